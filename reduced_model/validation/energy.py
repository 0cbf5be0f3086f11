"""Energy of a pushed needle without friction: what the three variants gain or lose."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fem_needle import SuspiciousValueWarning, load_scene, simulate
from fem_needle.scene import Scene
from fem_needle.trajectory import Trajectory
from reduced_model.needle import AssumedModeNeedle
from reduced_model.validation.cases import THESIS_SPRING
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from reduced_model.validation.section import Section, blocks, millimeters, percent, picture, prose, table

Array = NDArray[np.float64]

FOUNDATION, SPRING = "foundation", "tip spring"
THESIS_START, DEEP_START = 0.02, 0.08  # m
STEP = 1e-5  # s
OUTPUT_STEP = 1e-4  # s
ROUNDING = 1e-8  # of the lateral energy: below it digits differ between machines
PICTURE = "validation_energy.png"


@dataclass(frozen=True)
class Push:
    """A push of 3 N without friction: variant, tissue, initial depth [m], time step [s]."""

    variant: str
    tissue: str
    start: float
    step: float = STEP


PRINTED = Push("as-printed", SPRING, THESIS_START)
CORRECTED = Push("corrected", SPRING, THESIS_START)
CONSERVATIVE = Push("conservative", SPRING, THESIS_START)
SMOOTH = Push("conservative", FOUNDATION, THESIS_START)
COARSE = Push("conservative", FOUNDATION, THESIS_START, 2 * STEP)
DEEP = Push("conservative", FOUNDATION, DEEP_START)
CASES = (
    PRINTED,
    CORRECTED,
    CONSERVATIVE,
    Push("corrected", FOUNDATION, THESIS_START),
    COARSE,
    SMOOTH,
    DEEP,
)


def push_scene(push: Push) -> Scene:
    """Return the thesis' open loop without friction: the tip displaced by 0.5 mm, pushed to 180 mm."""
    values: dict[str, Any] = {"friction": None, "insertion.initial_depth": push.start}
    values |= {"model.kind": "assumed-modes", "model.variant": push.variant}
    if push.tissue == SPRING:
        values |= {"tissue.kind": "tip-spring", "tissue.layers": None, "tissue.tip_stiffness": THESIS_SPRING}
    return load_scene("thesis-open-loop").with_values(values)


@cache
def pushed(push: Push) -> Trajectory:
    """Return the run of a push."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SuspiciousValueWarning)  # that the printed equations are wrong is what is shown
        return simulate(AssumedModeNeedle(push_scene(push)), time_step=push.step, output_step=OUTPUT_STEP)


def drift(run: Trajectory) -> Array:
    """Return kinetic + bending + tissue + axial kinetic energy - push work - load work, less its start.

    Parameters
    ----------
    run
        Without friction and damping, so that the sum should stay what it was.

    Returns
    -------
    numpy.ndarray
        Over time, by the largest lateral energy (1), shape (nt,).
    """
    lateral = run.kinetic_energy + run.bending_energy + run.tissue_energy
    needle = run.scene.needle
    axial = 0.5 * needle.mass_per_length * needle.length * run.speed**2
    total = lateral + axial - run.push_work - run.load_work
    return np.asarray((total - total[0]) / np.max(lateral), dtype=float)


def largest_drift(push: Push) -> float:
    """Return the largest |drift| of a push (1)."""
    return float(np.max(np.abs(drift(pushed(push)))))


def section() -> Section:
    """Return the section."""
    rows = [_row(push) for push in CASES]
    header = ["variant", "tissue", "from [mm]", "step [us]", "drift", "largest tip [mm]"]
    header += ["tip at 180 mm [mm]", "speed at 180 mm [m/s]"]
    text = blocks(
        prose(
            f"""The thesis' open loop without friction: 3 N push the needle to 180 mm, its tip displaced by 0.5 mm; the first
            two variants are `fixed-frame`, the last `material`. Kinetic + bending + tissue + axial kinetic energy - work of the
            push - work of the loads must stay. Its largest change by the largest lateral energy: `corrected` lacks the axial
            force of the bent needle, `as-printed` has more mistakes ([erratum](erratum.md)), `conservative` changes by the
            error of the time steps alone: half the step divides it by {largest_drift(COARSE) / largest_drift(SMOOTH):.0f}."""
        ),
        table(header, rows),
        picture(PICTURE, "Drift of the energy over the depth for the three variants"),
    )
    return Section("6 Energy", text, _conclusions(), {PICTURE: _picture})


def _row(push: Push) -> list[str]:
    run = pushed(push)
    tip = 1e3 * run.tip_deflection
    figures = [_told(largest_drift(push)), f"{np.max(np.abs(tip)):.2f}", f"{tip[-1]:.2f}", f"{run.speed[-1]:.2f}"]
    return [f"`{push.variant}`", push.tissue, millimeters(push.start), f"{1e6 * push.step:g}", *figures]


def _told(change: float) -> str:
    return f"{change:.2g}" if change >= ROUNDING else f"< {ROUNDING:g}"


def _conclusions() -> tuple[str, ...]:
    text = f"""Energy of a push without friction: with a spring at the tip, from 20 mm, `conservative` keeps it to
        {_told(largest_drift(CONSERVATIVE))} of the lateral energy, `corrected` changes it by
        {percent(largest_drift(CORRECTED))} % and `as-printed` by {percent(largest_drift(PRINTED))} %; `conservative` in a
        foundation from 80 mm, where steps of {1e6 * STEP:g} us resolve every vibration, keeps it to
        {_told(largest_drift(DEEP))}."""
    return (prose(text),)


def _picture() -> bytes:
    curves = [
        Curve(push.variant, 1e3 * pushed(push).depth, drift(pushed(push))) for push in (PRINTED, CORRECTED, CONSERVATIVE)
    ]

    def style(axes: Axes) -> None:
        axes.set_xlim(1e3 * THESIS_START, None)

    panel = Panel("pushed with 3 N without friction, spring at the tip", "depth z [mm]", tuple(curves))
    return curve_picture("change of energy / largest lateral energy", [panel], style)
