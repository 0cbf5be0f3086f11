"""Every number of a scene with its path, value and unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

from fem_needle.scene.part import Part
from fem_needle.scene.quantity import Quantity


class Entry(NamedTuple):
    """One value of a scene.

    Attributes
    ----------
    path
        Dotted keys as in the scene file.
    value
        Number in SI, `Table`, `Sinusoid`, or a text.
    quantity
        Unit and allowed range; None for a text.
    """

    path: str
    value: Any
    quantity: Quantity | None


def entries(part: Part, prefix: str = "", units: Mapping[str, str | None] = MappingProxyType({})) -> Iterator[Entry]:
    """Yield all values of a part that are not missing and have a meaning, derived ones included.

    Parameters
    ----------
    part
        A scene or a part of one.
    prefix
        Path of the part, with a dot at its end.
    units
        Paths whose unit depends on another key, with that unit; None: without meaning.
    """
    units = {**units, **{prefix + key: unit for key, unit in part.own_units().items()}}
    for name, field in type(part).model_fields.items():
        value, path = getattr(part, name), prefix + name
        quantity = next((item for item in field.metadata if isinstance(item, Quantity)), None)
        if value is None or units.get(path, "") is None:
            continue
        if quantity is not None or isinstance(value, str):
            unit = units.get(path)
            yield Entry(path, value, replace(quantity, unit=unit) if quantity and unit else quantity)
        elif isinstance(value, Part):
            yield from entries(value, f"{path}.", units)
        elif isinstance(value, tuple):
            for index, item in enumerate(value):
                yield from entries(item, f"{path}.{index}.")
