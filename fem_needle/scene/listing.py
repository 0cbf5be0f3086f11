"""Every number of a scene with its path, value and unit."""

from __future__ import annotations

from collections.abc import Iterator
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


def entries(part: Part, prefix: str = "") -> Iterator[Entry]:
    """Yield all values of a part that are not missing, derived ones included."""
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        path = prefix + name
        quantity = next((item for item in field.metadata if isinstance(item, Quantity)), None)
        if quantity is not None or isinstance(value, str):
            if value is not None:
                yield Entry(path, value, quantity)
        elif isinstance(value, Part):
            yield from entries(value, f"{path}.")
        elif isinstance(value, tuple):
            for index, item in enumerate(value):
                yield from entries(item, f"{path}.{index}.")
