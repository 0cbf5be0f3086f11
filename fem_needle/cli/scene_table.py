"""The rows of the table that `check` shows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.text import Text

from fem_needle.scene import Scene, Sinusoid, Table
from fem_needle.scene.listing import entries
from fem_needle.scene.time_quantity import extremes
from fem_needle.scene.units import display_unit, parse_unit

Row = tuple[Text, Text, Text]
# Tables of a closed loop, shown where a scene has one.
_OF_A_LOOP = ("target", "controller", "actuators", "scatter")


def scene_rows(scene: Scene) -> Iterator[Row]:
    """Yield key, value in SI and value in mm, N, s for every value of a scene."""
    fields = type(scene).model_fields
    hidden = {name for name in _OF_A_LOOP if getattr(scene, name) == fields[name].default} | {"title"}  # the table's own title
    for path, value, quantity in entries(scene):
        if path.partition(".")[0] in hidden:
            continue
        unit = "1" if quantity is None else quantity.unit
        # Plain text: a title or a name may hold what looks like markup.
        yield Text(path), Text(_written(value, unit)), Text(_converted(value, unit))
    if scene.run.duration is None:
        text = f"{scene.duration:.6g} s"
        yield Text("run.duration"), Text(f"{text} (until the insertion ends)"), Text(text)


def _converted(value: Any, unit: str) -> str:
    return _written(value, display_unit(unit), unit)


def _written(value: Any, unit: str, stored_unit: str | None = None) -> str:
    """Return a value in ``unit``; it is stored in ``stored_unit``, by default the same."""
    if isinstance(value, str):
        return value
    suffix = "" if unit == "1" else f" {unit}"
    size = parse_unit(unit).size / parse_unit(stored_unit or unit).size
    if isinstance(value, tuple):
        return f"mesh of {len(value) - 1} elements"
    if isinstance(value, Table | Sinusoid):
        low, high = (extreme / size for extreme in extremes(value))
        kind = f"table of {len(value.time)} points" if isinstance(value, Table) else f"{value.frequency:.6g} Hz"
        return f"{low:.6g} to {high:.6g}{suffix} ({kind})"
    return f"{value / size:.6g}{suffix}"
