"""An 18 gauge tube at rest in soft and stiff tissue: up to which depth few modes may be trusted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fem_needle.comparison.at_rest import relative_difference
from fem_needle.comparison.ranges import Interval, described, intervals_within
from fem_needle.exact.krylov import characteristic_number
from fem_needle.scene import Scene
from fem_needle.statics import solve_static
from reduced_model.validation.cases import (
    CORRECTED,
    FIVE,
    HUB_REACH,
    MODULI,
    SHALLOW,
    SKIN,
    TIP,
    TUBE,
    TWO,
    Choice,
    exact_tip,
    foundation,
    resting,
)
from reduced_model.validation.pictures import Curve, Panel, error_picture
from reduced_model.validation.section import Section, blocks, kilo, percent, picture, prose, table

Array = NDArray[np.float64]

LOADS = {
    "`entry`, force at the tip": ("entry", TIP),
    "`hub`, force at the tip": ("hub", TIP),
    "`hub`, lateral force at the skin": ("hub", SKIN),
}
GRID = np.linspace(SHALLOW, HUB_REACH, 41)
WITHIN = (0.01, 0.05)
SCALED_STRIDE = 2  # of the grid, for the errors by the largest tip
ISLE = 0.002  # m: shorter ranges, where an error passes through zero, are not told
PICTURE = "validation_tube.png"
PICTURE_MODULI = (500.0, 5e3, 5e4)
CURVE_POINTS = 120


@dataclass(frozen=True)
class Range:
    """Where a model's tip is within an error.

    Attributes
    ----------
    load
        Support and load, a key of `LOADS`.
    modulus
        k [N/m^2].
    choice
        The model.
    within
        Error (1).
    intervals
        Of depth, with characteristic numbers.
    """

    load: str
    modulus: float
    choice: Choice
    within: float
    intervals: tuple[Interval, ...]

    @property
    def first_number(self) -> float:
        """Where the range that begins at the skin ends, (k / 4EI)^(1/4) z (1); 0 where it does not begin there."""
        first = self.intervals[0] if self.intervals else None
        return first.number_end if first is not None and first.start == SHALLOW else 0.0


def ranges(load: str, modulus: float, choice: Choice, errors: tuple[float, ...] = WITHIN) -> tuple[Range, ...]:
    """Return the ranges within each of the errors (1)."""
    scene = _scene(load, modulus)
    tips = cache(_tips(scene, choice))
    return tuple(
        Range(load, modulus, choice, within, described(scene, 0.0, intervals_within(tips, GRID, within))) for within in errors
    )


def scaled_error(load: str, modulus: float, choice: Choice) -> float:
    """Return the largest |w - w_exact| of the tip over the depth by the largest |w_exact| (1)."""
    tips = _tips(_scene(load, modulus), choice)
    exact, found = np.array([tips(depth) for depth in GRID[::SCALED_STRIDE].tolist()]).T
    return float(np.max(np.abs(found - exact)) / np.max(np.abs(exact)))


def section() -> Section:
    """Return the section."""
    two = {load: [ranges(load, modulus, TWO) for modulus in MODULI] for load in LOADS}
    five = {load: [ranges(load, modulus, FIVE, WITHIN[:1])[0] for modulus in MODULI] for load in LOADS}
    tables = [f"**{load}**\n\n" + _table(two[load], five[load]) for load in LOADS]
    text = blocks(
        prose(
            f"""EI = 0.01572 N m^2, 200 mm, 18 gauge, in 0.5 to 50 kN/m^2. Depths, and (k / 4EI)^(1/4) z, at which the tip at
            rest is within 1 % and 5 % of the exact one; z from {1e3 * SHALLOW:g} to {1e3 * HUB_REACH:g} mm; ranges shorter than
            {1e3 * ISLE:g} mm, where an error passes through zero, are left out. Under a lateral force the tip itself passes
            through zero (section 5), and there no relative error is small: the last two columns are the largest error over these
            depths in percent of the largest tip, of two modes alone and with static corrections."""
        ),
        *tables,
        picture(PICTURE, "Error of two modes at rest over the characteristic number, three loads, three tissues"),
    )
    return Section("2 An 18 gauge tube at rest", text, _conclusions(two), {PICTURE: _picture})


def _scene(load: str, modulus: float) -> Scene:
    support, force = LOADS[load]
    return resting(TUBE, support, foundation(modulus), (force,))


def _tips(scene: Scene, choice: Choice) -> Callable[[float], tuple[float, float]]:
    plant = choice.plant(scene)
    return lambda depth: (exact_tip(scene, depth), solve_static(plant, depth=depth).tip_deflection)


def _table(two: list[tuple[Range, ...]], five: list[Range]) -> str:
    number = "(k / 4EI)^(1/4) z"
    header = ["k [kN/m^2]", "2 modes, 1 %: z [mm]", number, "2 modes, 5 %: z [mm]", number, "5 modes, 1 %: z [mm]"]
    header += ["2 modes, by the largest tip", "2 and corrections"]
    rows = []
    for (strict, loose), more in zip(two, five, strict=True):
        cells = [_depths(strict), _numbers(strict), _depths(loose), _numbers(loose), _depths(more)]
        scaled = [percent(scaled_error(strict.load, strict.modulus, choice)) for choice in (TWO, CORRECTED)]
        rows.append([kilo(strict.modulus), *cells, *scaled])
    return table(header, rows)


def _long(found: Range) -> list[Interval]:
    return [one for one in found.intervals if one.end - one.start >= ISLE]


def _depths(found: Range) -> str:
    return ", ".join(f"{1e3 * one.start:.0f} to {1e3 * one.end:.0f}" for one in _long(found)) or "none"


def _numbers(found: Range) -> str:
    return ", ".join(f"{one.number_start:.1f} to {one.number_end:.1f}" for one in _long(found)) or "none"


def _conclusions(two: dict[str, list[tuple[Range, ...]]]) -> tuple[str, ...]:
    texts = []
    for load, found in two.items():
        ends = [(strict.first_number, loose.first_number) for strict, loose in found]
        (least, most), (lowest, highest) = ((min(column), max(column)) for column in zip(*ends, strict=True))
        text = f"""18 gauge tube at rest, {load}: two modes are within 1 % up to (k / 4EI)^(1/4) z = {least:.1f} to {most:.1f}
            and within 5 % up to {lowest:.1f} to {highest:.1f}, for all k from 0.5 to 50 kN/m^2."""
        texts.append(prose(text))
    return tuple(texts)


def _picture() -> bytes:
    panels = []
    for load, (support, force) in LOADS.items():
        curves = []
        for modulus in PICTURE_MODULI:
            depths = np.linspace(SHALLOW, HUB_REACH, CURVE_POINTS)
            tips = np.array([_tips(_scene(load, modulus), TWO)(depth) for depth in depths.tolist()])
            numbers = float(characteristic_number(modulus / TUBE.bending_stiffness)) * depths
            curves.append(Curve(f"{kilo(modulus)} kN/m²", numbers, relative_difference(tips[:, 1], tips[:, 0])))
        place = "tip" if force is TIP else "skin"
        clamp = "skin" if support == "entry" else "hub"
        panels.append(Panel(f"clamped at the {clamp}, force at the {place}", "(k / 4EI)$^{1/4}$ z", tuple(curves)))
    return error_picture("|tip error| of two modes at rest [%]", panels, WITHIN)
