"""Units in which tables and pictures of a loop show what is in SI."""

from __future__ import annotations

from fem_needle.scene.units import display_unit, parse_unit


def shown_unit(unit: str) -> tuple[float, str]:
    """Return size in SI and name of the unit in which a quantity is shown: mm, N, s, degrees."""
    shown = display_unit(unit).replace("rad", "deg")
    return parse_unit(shown).size / parse_unit(unit).size, shown
