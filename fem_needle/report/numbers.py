"""Numbers in words and tables: mm, N, s, degrees, with four digits."""

from __future__ import annotations

import re
from math import isfinite, isnan
from typing import Any

from fem_needle.closed_loop.units import shown_unit
from fem_needle.scene import Sinusoid, Table
from fem_needle.scene.time_quantity import extremes

DIGITS = 4
PLAIN = (1e-3, 1e6)  # numbers between are written without a power of ten
MISSING = "none"
SPACE = "\u00a0"
KILO = 1e3
ROUNDING = 1e-15  # m
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_TIMES = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
_EXPONENT = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?e[-+]?\d+(?![\w.])")
_POWERS = {"^2": "²", "^3": "³", "^4": "⁴"}


def number(value: Any, digits: int = DIGITS) -> str:
    """Return a value as a text: numbers rounded, "none" for None and nan, yes and no."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or isinstance(value, str | int):
        return MISSING if value is None else str(value)
    if not isfinite(value):
        return MISSING if isnan(value) else ("infinite" if value > 0 else "minus infinite")
    if value == 0.0 or PLAIN[0] <= abs(value) < PLAIN[1]:
        return _plain(value, digits)
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa.replace('-', '−')}{SPACE}×{SPACE}10{str(int(power)).translate(_RAISED)}"


def _plain(value: float, digits: int) -> str:
    rounded = float(f"{value:.{digits}g}")
    text = f"{rounded:.{digits + 3}f}".rstrip("0").rstrip(".")
    return text.replace("-", "−") if text != "-0" else "0"


def unit_text(unit: str) -> str:
    """Return a unit with raised powers; "" of a plain number."""
    for power, raised in _POWERS.items():
        unit = unit.replace(power, raised)
    return "" if unit == "1" else unit


def with_unit(text: str, unit: str) -> str:
    """Return a number's text with its unit, not parted by a line's end."""
    return f"{text}{SPACE}{unit_text(unit)}" if unit_text(unit) and text != MISSING else text


def quantity(value: Any, unit: str, digits: int = DIGITS) -> str:
    """Return a value in SI as a text in mm, N, s, degrees."""
    if value is None or isinstance(value, str | bool):
        return number(value)
    size, shown = shown_unit(unit)
    return with_unit(number(value / size, digits), shown)


def millimeters(value: float | None) -> str:
    """Return a length [m] as a text in mm; one below what rounding leaves of a needle's is 0."""
    return quantity(0.0 if value is not None and abs(value) < ROUNDING else value, "m")


def duration(value: float | None) -> str:
    """Return a time [s] as a text in s, ms or µs."""
    if value is None or not isfinite(value):
        return MISSING
    size, unit = next(((size, unit) for size, unit in _TIMES if abs(value) >= size), (1.0, "s"))
    return with_unit(number(value / size), unit)


def tidy(text: str) -> str:
    """Return a sentence with powers of ten in place of numbers such as 2.8e-07."""
    return _EXPONENT.sub(lambda found: number(float(found[0])) if abs(float(found[0])) < PLAIN[0] else found[0], text)


def ratio(value: float | None) -> str:
    """Return a share with two digits: a percentage, a power of ten where it is small."""
    if value is None or not isfinite(value):
        return MISSING
    return with_unit(number(100.0 * value, 2), "%") if abs(value) >= 1e-3 else number(value, 2)


def varying(value: Any, unit: str) -> str:
    """Return a value that may vary in time as a text."""
    if isinstance(value, Sinusoid):
        size, shown = shown_unit(unit)
        swing = f"{number(value.mean / size)} ± {with_unit(number(value.amplitude / size), shown)}"
        return f"{swing} at {with_unit(number(value.frequency), 'Hz')}"
    if isinstance(value, Table):
        size, shown = shown_unit(unit)
        low, high = (number(extreme / size) for extreme in extremes(value))
        return f"{with_unit(f'{low} to {high}', shown)} over time ({len(value.time)} points)"
    return quantity(value, unit)


def instant(text: str) -> str:
    """Return a date and time of a file as it is read, such as 2026-11-22 21:14:33 UTC."""
    return text.replace("T", " ").replace("+00:00", " UTC")
