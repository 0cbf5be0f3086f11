"""Where the tip's answer to a lateral force at the skin changes its sign: exact, elements, modes, over the stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray
from scipy.optimize import brentq

from fem_needle import FiniteElementNeedle
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.statics import solve_static
from reduced_model.validation.cases import CORRECTED, FIVE, HUB_REACH, MODULI, SKIN, TUBE, TWO, exact_tip, foundation, resting
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from reduced_model.validation.section import Section, blocks, kilo, percent, picture, prose, table

Array = NDArray[np.float64]

ELEMENTS = 16
TABLE_MODULI = (*MODULI, 1e5)
GRID = np.linspace(0.004, HUB_REACH, 49)
SHADE = "#e4e4e4"
ACCURACY = 1e-8  # m
PICTURE = "validation_signs.png"
PICTURE_MODULI = np.geomspace(1e3, 1e5, 25)
LABELS = ("exact", f"{ELEMENTS} elements", TWO.label, CORRECTED.label, FIVE.label)
SHOWN = LABELS[:4]


@dataclass(frozen=True)
class SignChanges:
    """Depths [m] at which the gain of the tip by a lateral force at the skin passes through zero, by model."""

    modulus: float
    depths: dict[str, tuple[float, ...]]


def sign_changes(modulus: float, labels: tuple[str, ...] = LABELS) -> SignChanges:
    """Return the sign changes of models in a tissue [N/m^2]."""
    scene = resting(TUBE, "hub", foundation(modulus), (SKIN,))
    return SignChanges(modulus, {label: _zeros(_tip(scene, label)) for label in labels})


def section() -> Section:
    """Return the section."""
    found = [sign_changes(modulus) for modulus in TABLE_MODULI]
    rows = [[kilo(one.modulus), *(_told(one.depths[label]) for label in LABELS)] for one in found]
    text = blocks(
        prose(
            f"""The tube of section 2, clamped at the hub, straight rest line, a lateral force at the skin. Depths [mm] at which
            the tip's static answer changes its sign, from {1e3 * GRID[0]:g} to {1e3 * HUB_REACH:g} mm: at first the tip goes
            with the force, beyond the first depth against it. A controller whose gain has a fixed sign is positive feedback
            there."""
        ),
        table(["k [kN/m^2]", *LABELS], rows),
        picture(PICTURE, "Depths at which the lateral gain changes its sign over the foundation modulus"),
    )
    return Section("5 The sign of the lateral gain", text, _conclusions(found), {PICTURE: _picture})


def _tip(scene: Scene, label: str) -> Callable[[float], float]:
    if label == "exact":
        return lambda depth: exact_tip(scene, depth)
    plant: Plant
    if label == LABELS[1]:
        plant = FiniteElementNeedle(scene, elements=ELEMENTS)
    else:
        plant = next(choice for choice in (TWO, CORRECTED, FIVE) if choice.label == label).plant(scene)
    return lambda depth: solve_static(plant, depth=depth).tip_deflection


def _zeros(tip: Callable[[float], float]) -> tuple[float, ...]:
    values = [tip(depth) for depth in GRID.tolist()]
    pairs = zip(pairwise(GRID.tolist()), pairwise(values), strict=True)
    return tuple(float(brentq(tip, *ends, xtol=ACCURACY)) for ends, (left, right) in pairs if left * right < 0.0)


def _told(depths: tuple[float, ...]) -> str:
    return ", ".join(f"{1e3 * depth:.1f}" for depth in depths) or "none"


def _conclusions(found: list[SignChanges]) -> tuple[str, ...]:
    there = [one for one in found if one.depths["exact"] and one.depths[TWO.label]]

    def miss(one: SignChanges, label: str) -> float:
        return abs(one.depths[label][0] - one.depths["exact"][0])

    worst = max(there, key=lambda one: miss(one, TWO.label))
    relative = max(miss(one, TWO.label) / one.depths["exact"][0] for one in there)
    text = f"""The first depth at which the tip turns against a lateral force at the skin: two modes miss it by up to
        {1e3 * miss(worst, TWO.label):.0f} mm (at {kilo(worst.modulus)} kN/m^2), {percent(relative)} % of the depth at most; with
        static corrections by {1e3 * max(miss(one, CORRECTED.label) for one in there):.1f} mm."""
    return (prose(text),)


def _picture() -> bytes:
    found = [sign_changes(modulus, SHOWN) for modulus in PICTURE_MODULI.tolist()]
    curves = [Curve(label, *_branches(found, label), MARKERS[label]) for label in SHOWN]

    def style(axes: Axes) -> None:
        axes.set_xscale("log")
        axes.set_ylim(0.0, 1e3 * HUB_REACH)
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        _shade(axes, found)

    panel = Panel("depths of the sign changes; shaded: the tip moves against the force", "k [kN/m²]", tuple(curves))
    return curve_picture("depth z [mm]", [panel], style)


MARKERS = {"exact": "", LABELS[1]: "+", TWO.label: "", CORRECTED.label: "x"}


def _branches(found: list[SignChanges], label: str) -> tuple[Array, Array]:
    """Return moduli [kN/m^2] and depths [mm] of the first sign change, then of the second, with a gap between."""
    moduli, depths = [], []
    for branch in (0, 1):
        there = [one for one in found if len(one.depths[label]) > branch]
        moduli += [1e-3 * one.modulus for one in there] + [np.nan]
        depths += [1e3 * one.depths[label][branch] for one in there] + [np.nan]
    return np.array(moduli), np.array(depths)


def _shade(axes: Axes, found: list[SignChanges]) -> None:
    """Shade where the exact gain is negative: between the first and the second sign change."""
    there = [one for one in found if one.depths["exact"]]
    first = [1e3 * one.depths["exact"][0] for one in there]
    second = [1e3 * (*one.depths["exact"], HUB_REACH)[1] for one in there]
    axes.fill_between([1e-3 * one.modulus for one in there], first, second, color=SHADE, zorder=0)
