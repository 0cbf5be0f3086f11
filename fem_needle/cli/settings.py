"""Settings of the command line that change a scene: `--set path=value` and the options beside it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fem_needle.errors import SceneError
from fem_needle.scene.settings import overriding, refuse_idle
from fem_needle.scene.units import to_si

if TYPE_CHECKING:
    from fem_needle.scene import Scene


def changed(
    scene: Scene, assignments: Sequence[str], options: Mapping[str, Any], first: Mapping[str, Any] | None = None
) -> Scene:
    """Return a scene with the settings of the command line.

    Parameters
    ----------
    scene
        As loaded.
    assignments
        ``path=value`` each; a value as in a scene file, without quotes where it is a text.
    options
        Path and text (or value) of options; None where not given. They win over assignments; a mesh replaces elements.
    first
        Path and value of changes that come before the assignments; None removes what is there.

    Raises
    ------
    SceneError
        If an assignment has no path or value, or the changed scene is impossible.
    """
    values = dict(first or {}) | dict(_assignment(text) for text in assignments)
    given = {path: value_of(text) if isinstance(text, str) else text for path, text in options.items() if text is not None}
    values |= overriding(given)
    result = scene.with_values(values) if values else scene
    refuse_idle(result.model.kind, given)
    return result


def value_of(text: str) -> Any:
    """Return a number, list or table where the text is one in TOML, else the text itself."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    return parsed["value"] if len(parsed) == 1 else text


def number(option: str, text: str, unit: str) -> float:
    """Return a number in SI, or with a unit.

    Raises
    ------
    SceneError
        If it is none.
    """
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return to_si(text, unit)
    except ValueError as error:
        raise SceneError(f"{option}: {error} (got {text!r}; allowed a number of {unit}, or one with a unit)") from None


def _assignment(text: str) -> tuple[str, Any]:
    path, equals, value = text.partition("=")
    if not (path.strip() and equals and value.strip()):
        raise SceneError(f"--set: got {text!r}; allowed path=value, for example --set needle.length=150mm")
    return path.strip(), value_of(value)
