"""Scenes as plain data: dictionaries, lists, numbers, texts."""

from __future__ import annotations

from typing import Any

from fem_needle.errors import SceneError
from fem_needle.scene.needle import Needle
from fem_needle.scene.part import Part

# Keys of a scene file that hold lists.
LISTS = {"guides", "layers", "loads", "sensors"}


def plain(value: Any, *, complete: bool) -> Any:
    """Return a part, or a sequence of parts, as plain data.

    Parameters
    ----------
    value
        What to convert.
    complete
        With every default, except derived values and missing (None) ones.
    """
    if isinstance(value, Part):
        fields = type(value).model_fields
        return {
            fields[name].alias or name: plain(getattr(value, name), complete=complete)
            for name in fields
            if _kept(value, name, complete)
        }
    if isinstance(value, tuple):
        return [plain(item, complete=complete) for item in value]
    return value


def _kept(part: Part, name: str, complete: bool) -> bool:
    if getattr(part, name) is None:
        return False
    # Both ways at once would not load again, so a needle keeps to what was given.
    everything = complete and not isinstance(part, Needle)
    return everything or name in part.model_fields_set or name == "kind"


def with_entry(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Return plain data with another value at a path; None removes the key.

    Raises
    ------
    SceneError
        If the path leads through a number or to a list entry that is not there.
    """
    return _replaced(data, path.split("."), value, path)


def _replaced(data: Any, keys: list[str], value: Any, path: str) -> Any:
    if not keys:
        return value
    key, rest = keys[0], keys[1:]
    if isinstance(data, list):
        index = _index(data, key, path)
        return [*data[:index], _replaced(data[index], rest, value, path), *data[index + 1 :]]
    if not isinstance(data, dict):
        raise SceneError(f"{path}: there is nothing inside a single value (at '{key}')")
    if not rest and value is None:
        return {name: item for name, item in data.items() if name != key}
    missing: Any = [] if key in LISTS else {}
    return data | {key: _replaced(data.get(key, missing), rest, value, path)}


def _index(items: list[Any], key: str, path: str) -> int:
    """Return the index that a number or a name means."""
    names = [item.get("name") or "" if isinstance(item, dict) else "" for item in items]
    if key and key in names:
        return names.index(key)
    if key.isdecimal() and int(key) < len(items):
        return int(key)
    known = [name or str(index) for index, name in enumerate(names)]
    raise SceneError(f"{path}: no entry '{key}' (allowed {', '.join(known) or 'none: the list is empty'})")
