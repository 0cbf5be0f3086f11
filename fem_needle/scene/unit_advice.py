"""What is said of an unknown unit: the nearest known ones."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches

MOST_NEAR = 3
_WORDS = {
    "sec": "s", "second": "s", "millisecond": "ms", "minute": "min", "meter": "m", "metre": "m", "millimeter": "mm",
    "millimetre": "mm", "centimeter": "cm", "centimetre": "cm", "micrometer": "um", "micron": "um", "inch": "in", '"': "in",
    "newton": "N", "millinewton": "mN", "kilonewton": "kN", "pascal": "Pa", "kilopascal": "kPa", "megapascal": "MPa",
    "gigapascal": "GPa", "gram": "g", "kilogram": "kg", "joule": "J", "hertz": "Hz", "degree": "deg", "°": "deg",
    "radian": "rad", "gramforce": "gf", "pond": "gf", "kp": "kgf", "psi": "kPa", "bar": "kPa", "atm": "kPa", "mmhg": "kPa",
    "lb": "kg", "lbf": "N", "dyn": "N", "ft": "m", "rpm": "1/min", "h": "min", "hour": "min",
}  # fmt: skip
_GAUGES = ("g", "ga", "gauge")


def unknown_unit(text: str, symbol: str, known: Collection[str]) -> str:
    """Return the message for a unit ``text`` whose ``symbol`` is unknown.

    Parameters
    ----------
    text, symbol
        As written.
    known
        Every symbol with its prefixes.
    """
    if symbol.casefold() in _GAUGES:
        return f"unknown unit {text!r}: a gauge is known for an outer diameter alone; write mm"
    near = _near(symbol, known)
    if near:
        return f"unknown unit {text!r}; did you mean {' or '.join(repr(text.replace(symbol, one, 1)) for one in near)}?"
    return f"unknown unit {text!r} (at {symbol!r}); known: m, cm, in, g, s, min, N, gf, Pa, J, Hz, rad, deg, prefixes as in kPa"


def _near(symbol: str, known: Collection[str]) -> list[str]:
    """Return known symbols that another one may stand for: of another case, a word, or a slip."""
    folded = symbol.casefold()
    same = sorted(one for one in known if one.casefold() == folded)
    word = _WORDS.get(folded) or _WORDS.get(folded.removesuffix("es")) or _WORDS.get(folded.removesuffix("s"))
    if same or word:
        return same if same else [word or ""]
    return get_close_matches(symbol, sorted(known), n=MOST_NEAR, cutoff=0.7)
