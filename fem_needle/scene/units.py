"""Units: a small table of symbols, and the dimension of every unit string.

A unit is written as products of symbols with integer powers and at most one
division: ``N s/m^2`` is newton second per square meter.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import pi

from fem_needle.scene.unit_advice import unknown_unit

# Exponents of kilogram, meter, second and radian. The angle is kept as a
# dimension of its own, so that "2 deg" cannot pass for a plain number.
Dimension = tuple[int, int, int, int]

_NAMED: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, (0, 1, 0, 0)),
    "g": (1e-3, (1, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "Pa": (1.0, (1, -1, -2, 0)),
    "J": (1.0, (1, 2, -2, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "rad": (1.0, (0, 0, 0, 1)),
}
_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9}
_SYMBOLS: dict[str, tuple[float, Dimension]] = {
    prefix + symbol: (factor * size, dimension)
    for prefix, factor in _PREFIXES.items()
    for symbol, (size, dimension) in _NAMED.items()
} | {
    "cm": (1e-2, (0, 1, 0, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "deg": (pi / 180.0, (0, 0, 0, 1)),
    "in": (0.0254, (0, 1, 0, 0)),
    "gf": (9.80665e-3, (1, 1, -2, 0)),
    "kgf": (9.80665, (1, 1, -2, 0)),
}
_WHOLE = 1e-12  # of a size: how near its inverse is to a whole number that divides exactly

# Units of tables and pictures that are not those with millimeters in place of meters.
_DISPLAYED = {"Pa": "GPa", "rad": "deg", "N/m^2": "kN/m^2", "N s/m^2": "N s/m^2", "kg/m": "g/m", "kg/m^3": "g/cm^3"}

_NAMES: dict[Dimension, str] = {
    (0, 0, 0, 0): "plain number",
    (0, 1, 0, 0): "length",
    (0, 2, 0, 0): "area",
    (0, 4, 0, 0): "second moment of area",
    (1, 0, 0, 0): "mass",
    (1, -1, 0, 0): "mass per length",
    (1, -3, 0, 0): "density",
    (0, 0, 1, 0): "time",
    (0, 0, -1, 0): "frequency",
    (0, 1, -1, 0): "speed",
    (0, 1, -2, 0): "acceleration",
    (1, 1, -2, 0): "force",
    (1, 0, -2, 0): "force per length",
    (1, -1, -2, 0): "pressure or force per area",
    (1, 3, -2, 0): "bending stiffness",
    (1, 2, -2, 0): "moment or energy",
    (1, 0, -1, 0): "force per speed",
    (1, -1, -1, 0): "force per speed and length",
    (1, 1, -3, 0): "force per time",
    (1, 2, -3, 0): "moment per time or power",
    (0, 0, 0, 1): "angle",
    (0, 0, -1, 1): "angle per time",
}

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_FACTOR = re.compile(r"([A-Za-zµμ]+)(?:\^(-?[1-9]))?")


@dataclass(frozen=True)
class Unit:
    """A unit: its size in SI and its dimension."""

    size: float
    dimension: Dimension

    def to_si(self, number: float) -> float:
        """Return ``number`` of this unit in SI.

        Fractions such as mm (1/1000) and mm/min (1/60000) divide by a whole number, which rounds once where a product would
        round twice: "127 mm" is 0.127 and "300 mm/min" 0.005 to the last bit.
        """
        return number * self.size if self.divisor is None else number / self.divisor

    @cached_property
    def divisor(self) -> float | None:
        """The whole number whose inverse the size is, None where it is none."""
        inverse = 1.0 / self.size
        whole = float(round(inverse))
        return whole if whole > 1.0 and abs(inverse - whole) <= _WHOLE * whole else None


def dimension_name(dimension: Dimension) -> str:
    """Return the name of a dimension, e.g. ``speed``."""
    exponents = zip(("kg", "m", "s", "rad"), dimension, strict=True)
    return _NAMES.get(dimension) or " ".join(f"{symbol}^{power}" for symbol, power in exponents if power)


@lru_cache(maxsize=256)
def parse_unit(text: str) -> Unit:
    """Return the unit that ``text`` writes; ``"1"`` and ``""`` mean no unit.

    Raises
    ------
    ValueError
        If a symbol is unknown or the text is not a unit.
    """
    cleaned = text.strip()
    for superscript, power in (("²", "^2"), ("³", "^3"), ("⁴", "^4"), ("·", " "), ("*", " ")):
        cleaned = cleaned.replace(superscript, power)
    if cleaned in ("", "1"):
        return Unit(1.0, (0, 0, 0, 0))
    parts = cleaned.split("/")
    if len(parts) > 2:
        raise ValueError(f"the unit {text!r} has more than one division")
    size, dimension = _product(parts[0], text)
    if len(parts) == 2:
        below, below_dimension = _product(parts[1], text)
        size /= below
        dimension = _added(dimension, below_dimension, -1)
    return Unit(_tidy(size), dimension)


def _product(part: str, text: str) -> tuple[float, Dimension]:
    size, dimension = 1.0, (0, 0, 0, 0)
    symbols = part.split()
    if not symbols:
        raise ValueError(f"{text!r} is not a unit")
    for written in symbols:
        if written == "1":
            continue
        match = _FACTOR.fullmatch(written)
        if match is None or match[1] not in _SYMBOLS:
            raise ValueError(unknown_unit(text, written if match is None else match[1], _SYMBOLS))
        power = int(match[2] or 1)
        size *= _SYMBOLS[match[1]][0] ** power
        dimension = _added(dimension, _SYMBOLS[match[1]][1], power)
    return size, dimension


def _added(left: Dimension, right: Dimension, power: int) -> Dimension:
    mass, length, time, angle = (a + power * b for a, b in zip(left, right, strict=True))
    return mass, length, time, angle


def _tidy(size: float) -> float:
    """Return the nearest decimal of 15 digits: powers of ten lose their last bit in products."""
    return float(f"{size:.15g}") if size != _SYMBOLS["deg"][0] else size


def split_quantity(text: str) -> tuple[float, str]:
    """Split ``"127 mm"`` into number and unit text.

    Raises
    ------
    ValueError
        If the text does not begin with a number.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise ValueError("is not a number with a unit")
    return float(match[1]), match[2]


def to_si(text: str, unit: str) -> float:
    """Return the SI value of a text such as ``"127 mm"`` where ``unit`` is expected.

    Parameters
    ----------
    text
        Number and unit.
    unit
        The SI unit of the wanted quantity; its dimension is compared.

    Raises
    ------
    ValueError
        If the text is no number, has no or an unknown unit, or another dimension.
    """
    number, written = split_quantity(text)
    expected = parse_unit(unit)
    if expected.dimension == (0, 0, 0, 0):
        raise ValueError("is a plain number and takes no text or unit")
    if not written:
        raise ValueError("a text needs a unit")
    found = parse_unit(written)
    if found.dimension != expected.dimension:
        wanted, given = dimension_name(expected.dimension), dimension_name(found.dimension)
        raise ValueError(f"expected {wanted} in {unit}, not {given}")
    return found.to_si(number)


def display_unit(unit: str) -> str:
    """Return the unit for tables and pictures: millimeter, newton, second, degree, and for moduli what people type."""
    return _DISPLAYED.get(unit) or re.sub(r"\bm\b", "mm", unit)
