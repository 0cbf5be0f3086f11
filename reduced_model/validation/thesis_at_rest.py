"""The needle of the thesis at rest: the tip's error of few modes over the depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.statics import solve_static
from reduced_model.validation.cases import (
    CORRECTED,
    CORRECTED_INSERTED,
    FIVE,
    FIVE_INSERTED,
    HUB_REACH,
    LENGTH,
    THESIS,
    THESIS_MODULUS,
    THESIS_SPRING,
    THREE,
    THREE_INSERTED,
    TWO,
    TWO_INSERTED,
    Choice,
    exact_tip,
    foundation,
    resting,
    tip_spring,
)
from reduced_model.validation.pictures import Curve, Panel, error_picture
from reduced_model.validation.section import Section, blocks, millimeters, percent, picture, prose, table

Array = NDArray[np.float64]

ENTRY = (TWO, THREE, FIVE, TWO_INSERTED, THREE_INSERTED, FIVE_INSERTED, CORRECTED, CORRECTED_INSERTED)
HUB = (TWO, THREE, FIVE, CORRECTED)
DEPTHS = (0.02, 0.05, 0.1, 0.15, 0.18, LENGTH)
HUB_DEPTHS = (*DEPTHS[:-1], HUB_REACH)
TISSUES = {"foundation": foundation(THESIS_MODULUS), "tip spring": tip_spring(THESIS_SPRING)}
PICTURE = "validation_thesis_needle.png"
CURVE_POINTS = 90


@dataclass(frozen=True, eq=False)
class TipErrors:
    """Errors w / w_exact - 1 of the tip at rest under a tip force.

    Attributes
    ----------
    support, tissue
        Of the needle.
    depths
        z [m], shape (n,).
    choices
        The models.
    errors
        (1), shape (n, models).
    """

    support: str
    tissue: str
    depths: tuple[float, ...]
    choices: tuple[Choice, ...]
    errors: Array

    def of(self, choice: Choice, depth: float) -> float:
        """Return one error (1)."""
        return float(self.errors[self.depths.index(depth), self.choices.index(choice)])


def tip_errors(support: str, tissue: str, choices: tuple[Choice, ...], depths: tuple[float, ...]) -> TipErrors:
    """Return the errors of models at depths [m]."""
    scene = resting(THESIS, support, TISSUES[tissue])
    exact = np.array([exact_tip(scene, depth) for depth in depths])
    plants = [choice.plant(scene) for choice in choices]
    tips = np.array([[solve_static(plant, depth=depth).tip_deflection for plant in plants] for depth in depths])
    return TipErrors(support, tissue, depths, choices, tips / exact[:, None] - 1.0)


def section() -> Section:
    """Return the section."""
    found = [
        tip_errors(support, tissue, choices, depths)
        for support, choices, depths in (("entry", ENTRY, DEPTHS), ("hub", HUB, HUB_DEPTHS))
        for tissue in TISSUES
    ]
    text = blocks(
        prose(
            f"""EI = {THESIS.bending_stiffness} N m^2, rho A = {THESIS.mass_per_length} kg/m, 200 mm; the tissue is a foundation
            of 520 N/m^2 or one spring of 520 N/m at the tip, a force acts at the tip. Error of the tip's deflection in percent,
            against the exact solution. Modes are those of the full length unless a column says otherwise; corrections are the
            static responses to the loads, as shapes beside the modes."""
        ),
        *(_table(one) for one in found),
        picture(PICTURE, "Error of the tip at rest over the depth, entry and hub, foundation"),
    )
    return Section("1 The thesis' needle at rest", text, _conclusions(found), {PICTURE: _picture})


def _table(found: TipErrors) -> str:
    title = f"**`{found.support}`, {found.tissue}**"
    rows = [
        [millimeters(depth), *(percent(error) for error in errors)]
        for depth, errors in zip(found.depths, found.errors.tolist(), strict=True)
    ]
    return title + "\n\n" + table(["z [mm]", *(choice.label for choice in found.choices)], rows)


def _conclusions(found: list[TipErrors]) -> tuple[str, ...]:
    entry, hub = (next(one for one in found if one.support == kind) for kind in ("entry", "hub"))
    text = f"""The thesis' needle in its own tissue, clamped at the skin: two modes miss the tip at rest by
        {percent(abs(entry.of(TWO, 0.1)))} % at 100 mm and {percent(abs(entry.of(TWO, LENGTH)))} % at 200 mm. Clamped at the hub
        it is {percent(abs(hub.of(TWO, 0.1)))} % at 100 mm; static corrections leave {percent(abs(hub.of(CORRECTED, 0.1)))} %."""
    return (prose(text),)


def _picture() -> bytes:
    panels = []
    for support, choices, end in (("entry", (TWO, THREE, FIVE, TWO_INSERTED), LENGTH), ("hub", HUB, HUB_REACH)):
        depths = tuple(np.linspace(0.005, end, CURVE_POINTS).tolist())
        found = tip_errors(support, "foundation", choices, depths)
        curves = [
            Curve(choice.label, 1e3 * np.array(depths), np.abs(found.errors[:, index])) for index, choice in enumerate(choices)
        ]
        panels.append(Panel(f"clamped at the {'skin' if support == 'entry' else 'hub'}", "depth z [mm]", tuple(curves)))
    return error_picture("|tip error| at rest [%]", panels)
