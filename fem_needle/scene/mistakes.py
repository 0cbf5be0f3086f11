"""The mistakes of a scene as lines of text: path, message, value, allowed range."""

from __future__ import annotations

from difflib import get_close_matches
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import ValidationError

from fem_needle.errors import SceneError
from fem_needle.scene.part import Part, shown
from fem_needle.scene.plain_data import LISTS
from fem_needle.scene.time_functions import Table
from fem_needle.scene.time_quantity import SINUSOID_KEYS, TABLE_KEYS

Location = tuple[int | str, ...]

MOST_MISTAKES = 100  # that are told

# By the type of pydantic's error; what is not here already speaks for itself.
_NOT_A_TABLE = "is not a table of keys (got {value})"
_TEMPLATES = {
    "missing": "is required",
    "literal_error": "is not a choice (got {value}; allowed {expected})",
    "union_tag_not_found": "needs a kind (allowed 'tip' or 'lateral')",
    "union_tag_invalid": "kind is not a choice (got '{tag}'; allowed {expected_tags})",
    "model_type": _NOT_A_TABLE,
    "model_attributes_type": _NOT_A_TABLE,
    "dict_type": _NOT_A_TABLE,
    "too_long": "has too many entries (got {actual_length}; allowed up to {max_length})",
    "tuple_type": "is not a list (got {value})",
    "string_type": "is not a text (got {value})",
}


def mistake_lines(error: ValidationError, root: type[Part]) -> tuple[str, ...]:
    """Return one line for each mistake of a validation of ``root``."""
    lines = []
    details = error.errors(include_url=False)
    for detail in details[:MOST_MISTAKES]:
        location = tuple(detail["loc"])
        path = ".".join(str(key) for key in without_tags(location)) or "scene"
        lines.append(f"{path}: {_message(dict(detail), location, root)}")
    more = [f"scene: and {len(details) - MOST_MISTAKES} more mistakes"] if len(details) > MOST_MISTAKES else []
    return tuple(dict.fromkeys(lines + more))


def without_tags(location: Location) -> Location:
    """Return a location without the tag that follows the number of a load."""
    if len(location) > 2 and location[0] == "loads" and location[2] in ("tip", "lateral"):
        return location[:2] + location[3:]
    return location


def _message(detail: dict[str, Any], location: Location, root: type[Part]) -> str:
    if detail["type"] == "extra_forbidden":
        return nearest_text(str(location[-1]), known_keys(root, location[:-1]))
    template = _TEMPLATES.get(detail["type"])
    if template is None:
        return str(detail["msg"])
    return template.format(value=shown(detail["input"]), **detail.get("ctx", {}))


def nearest_text(key: str, known: tuple[str, ...]) -> str:
    """Return the message for an unknown key, with the nearest known one."""
    close = get_close_matches(key, known, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known) or 'none'}"
    return f"unknown key; {hint}"


def known_keys(root: type[Part], location: Location) -> tuple[str, ...]:
    """Return the keys that a scene file may have at a location."""
    parts: list[Any] = [root]
    for key in location:
        if isinstance(key, int):
            continue
        tagged = [part for part in parts if _tag(part) == key]
        found = [part.model_fields[key].annotation for part in parts if key in part.model_fields]
        parts = tagged or [part for annotation in found for part in _parts_of(annotation)]
    if Table in parts:
        return TABLE_KEYS + SINUSOID_KEYS
    return tuple(dict.fromkeys(field for part in parts for field in part.model_fields))


def check_path(root: type[Part], path: str) -> None:
    """Compare each key of a dotted path with the known ones.

    Raises
    ------
    SceneError
        At the first unknown key, with the nearest known one.
    """
    location: Location = ()
    for key in path.split("."):
        if location and location[-1] in LISTS:
            location = (*location, 0)  # any entry: which one there is, only the data know
            continue
        known = known_keys(root, location)
        if known and key not in known:
            raise SceneError(f"{path}: {nearest_text(key, known)}")
        location = (*location, key)


def _tag(part: type[Part]) -> Any:
    kind = part.model_fields.get("kind")
    return kind.default if kind else None


def _parts_of(annotation: Any) -> list[type[Part]]:
    """Return the classes of scene parts inside an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return [annotation]
    inner = get_args(annotation) if get_origin(annotation) in (Union, UnionType, tuple) else ()
    return [part for item in inner for part in _parts_of(_bare(item))]


def _bare(annotation: Any) -> Any:
    """Return an annotation without its metadata."""
    return annotation.__origin__ if hasattr(annotation, "__metadata__") else annotation


Part.mistake_lines = staticmethod(mistake_lines)
