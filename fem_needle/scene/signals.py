"""What sensors read and controllers command: names, units, and the units of gains and limits that follow from them."""

from __future__ import annotations

from collections import Counter
from typing import Literal

SensorKind = Literal["tip-imaging", "tissue-deformation", "base-force", "base-moment", "needle-shape", "encoder"]
InputName = Literal["push_force", "speed", "lateral_force", "hub_deflection", "hub_angle", "hub_torque", "tip_direction"]

# Name of each reading of a kind of sensor, with unit and meaning.
READINGS: dict[str, dict[str, tuple[str, str]]] = {
    "tip-imaging": {
        "tip_deflection": ("m", "lateral place of the tip in the image"),
        "needle_angle": ("rad", "angle of the line from the entry point to the tip in the image"),
    },
    "tissue-deformation": {
        "tissue_deformation": ("m", "mean distance that the markers moved between two frames"),
        "tissue_displacement": ("m", "mean lateral displacement of the markers between two frames, with its sign"),
    },
    "base-force": {"hub_force": ("N", "lateral force at the base"), "push_force": ("N", "axial force at the base")},
    "base-moment": {"hub_moment": ("N m", "moment at the base")},
    "needle-shape": {"needle_shape": ("m", "deflection at stations from hub to tip")},
    "encoder": {"depth": ("m", "inserted length")},
}
# The mean of tip deflection and tissue displacement, which the thesis feeds back.
IMAGE_ERROR = "image_error"
INPUT_UNITS: dict[str, str] = {
    "push_force": "N",
    "speed": "m/s",
    "lateral_force": "N",
    "hub_deflection": "m",
    "hub_angle": "rad",
    "hub_torque": "N m",
    "tip_direction": "1",
}
# Gains of a controller: powers of the unit of the input, of the unit of the output, and of the second.
_GAIN_POWERS: dict[str, tuple[int, int, int]] = {
    "proportional": (1, -1, 0),
    "integral": (1, -1, -1),
    "derivative": (1, -1, 1),
    "smallest_error": (0, 1, 0),
    "smallest_change": (0, 1, 0),
    "largest_error": (0, 1, 0),
    "largest_command": (1, 0, 0),
    "increment": (1, 0, 0),
}


def output_units() -> dict[str, str]:
    """Return every number that a controller may bring to a target, with its unit."""
    found = {name: unit for readings in READINGS.values() for name, (unit, _) in readings.items() if name != "needle_shape"}
    return found | {IMAGE_ERROR: "m"}


def gain_units(input_name: str, output: str) -> dict[str, str]:
    """Return the units of the gains of a controller that depend on its input and output; an unknown one is a plain number."""
    given, read = INPUT_UNITS.get(input_name, "1"), output_units().get(output, "1")
    return {gain: _product((given, u), (read, y), ("s", s)) for gain, (u, y, s) in _GAIN_POWERS.items()}


def limit_units(input_name: str) -> dict[str, str]:
    """Return the units of the limits of an input."""
    unit = INPUT_UNITS.get(input_name, "1")
    return {"minimum": unit, "maximum": unit, "rate": _product((unit, 1), ("s", -1))}


def effort_unit(input_name: str) -> str:
    """Return the unit of the integral of an input over time."""
    return _product((INPUT_UNITS.get(input_name, "1"), 1), ("s", 1))


def _product(*factors: tuple[str, int]) -> str:
    """Return the unit that is a product of powers of units: of ("N", 1) and ("m/s", -1), ``N s/m``."""
    powers: Counter[str] = Counter()
    for unit, power in factors:
        above, _, below = unit.partition("/")
        for symbols, sign in ((above, power), (below, -power)):
            for symbol in symbols.split():
                powers[symbol] += sign if symbol != "1" else 0
    above, below = (
        " ".join(symbol if power == 1 else f"{symbol}^{power}" for symbol, power in side if power > 0)
        for side in (powers.items(), ((symbol, -power) for symbol, power in powers.items()))
    )
    return f"{above or 1}/{below}" if below else above or "1"
