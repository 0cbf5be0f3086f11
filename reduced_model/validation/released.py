"""A needle let go from a static shape: errors of the lowest frequencies, and when the vibration is out of phase."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.free_response import natural_frequencies
from fem_needle.scene import Initial, Insertion, Needle, Run, Scene
from fem_needle.trajectory import Trajectory
from reduced_model.validation.cases import (
    CORRECTED,
    FIVE,
    HUB_REACH,
    LENGTH,
    THESIS,
    THESIS_MODULUS,
    THREE,
    TUBE,
    TWO,
    Choice,
    foundation,
    scene_of,
)
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from reduced_model.validation.section import Section, blocks, kilo, millimeters, percent, picture, prose, table

Array = NDArray[np.float64]

TUBE_NAME, THESIS_NAME = "18 gauge tube", "thesis"
NEEDLES = {THESIS_NAME: THESIS, TUBE_NAME: TUBE}
CASES = (
    *((THESIS_NAME, "entry", THESIS_MODULUS, depth) for depth in (0.05, 0.1, LENGTH)),
    *((TUBE_NAME, "entry", 5e4, depth) for depth in (0.05, 0.1, LENGTH)),
    *((TUBE_NAME, "hub", modulus, depth) for modulus in (5e3, 5e4) for depth in (0.05, 0.1, HUB_REACH)),
)
CHOICES = (TWO, THREE, FIVE, CORRECTED)
ELEMENTS = 24
EXACT = 1e-6  # of a frequency: smaller errors are those of the elements
QUARTER = 0.25  # of a swing: then one needle is at rest where the other passes its middle
RUN = (TUBE_NAME, "hub", 5e3, 0.1)
RUN_CHOICES = (TWO, FIVE, CORRECTED)
SWINGS = (1, 5, 20)
STEPS_A_SWING = 64
SHOWN_SHARE = 0.3  # of the run in the picture
PICTURE = "validation_released.png"
Case = tuple[str, str, float, float]


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Lowest natural frequencies at a held depth.

    Attributes
    ----------
    case
        Needle, support, foundation modulus [N/m^2], depth [m].
    true
        First and second of the elements [Hz].
    errors
        f / f_true - 1 of both (1), by model.
    """

    case: Case
    true: Array
    errors: dict[str, Array]

    @property
    def is_exact(self) -> bool:
        """Whether the first mode of the model is one of the needle."""
        return abs(float(self.errors[TWO.label][0])) < EXACT

    @property
    def swings_in_phase(self) -> float:
        """Swings until two modes are a quarter of a swing off in their first vibration."""
        return QUARTER / abs(float(self.errors[TWO.label][0]))

    @property
    def time_in_phase(self) -> float:
        """The same [s]."""
        return self.swings_in_phase / float(self.true[0])


def released_scene(case: Case) -> Scene:
    """Return the scene of a case: the tip displaced by 1 mm and let go."""
    name, support, modulus, depth = case
    needle: Needle = NEEDLES[name]
    held = Insertion(kind="hold", initial_depth=depth)
    initial = Initial(shape="tip-displaced", tip_deflection=1e-3)
    return scene_of(needle, support, foundation(modulus), held, (), initial=initial, run=Run(duration=1.0))


def frequencies(case: Case) -> Frequencies:
    """Return the frequencies of a case."""
    scene, depth = released_scene(case), case[-1]
    true = natural_frequencies(FiniteElementNeedle(scene, elements=ELEMENTS), depth)[:2]
    # Static corrections need a load to correct: the tip force that displaced the needle.
    found = {choice.label: natural_frequencies(choice.plant(_corrected(scene, choice)), depth)[:2] for choice in CHOICES}
    return Frequencies(case, true / (2 * pi), {label: values / true - 1.0 for label, values in found.items()})


def swing_errors() -> dict[str, tuple[float, ...]]:
    """Return by model the largest difference of the tip within some swings, by its start (1)."""
    true, runs = _runs()
    period = 1.0 / frequencies(RUN).true[0]
    scale = abs(float(true.tip_deflection[0]))

    def largest(run: Trajectory, swings: int) -> float:
        gap = np.abs(run.tip_deflection - true.tip_deflection)
        return float(np.max(gap[true.time <= swings * period]) / scale)

    return {label: tuple(largest(run, swings) for swings in SWINGS) for label, run in runs.items()}


def section() -> Section:
    """Return the section."""
    found = [frequencies(case) for case in CASES]
    header = ["needle", "support", "k [kN/m^2]", "z [mm]", "f1 [Hz]", *(f"f1, {choice.label}" for choice in CHOICES)]
    header += ["f2, 2 modes", "2 modes in phase: swings", "[ms]"]
    swings = swing_errors()
    name, support, modulus, depth = RUN
    run_rows = [[str(count), *(percent(one[row]) for one in swings.values())] for row, count in enumerate(SWINGS)]
    text = blocks(
        prose(
            """The tip is displaced (the static shape under a tip force) and let go, undamped. Errors of the first two natural
            frequencies in percent, against 24 elements, and the swings and the time after which two modes are a quarter of a
            swing off: from then on the phase is lost. Inserted over its whole length in one tissue the needle vibrates in the
            modes themselves."""
        ),
        table(header, [_row(one) for one in found]),
        prose(
            f"""In the run itself ({name}, `{support}`, {kilo(modulus)} kN/m^2, z = {millimeters(depth)} mm): largest difference
            of the tip within some swings, in percent of its start. Static corrections mend the frequencies
            under `entry`, and far less under `hub`."""
        ),
        table(["swings", *swings], run_rows),
        picture(PICTURE, "Tip of a released needle: elements, two modes, five modes"),
    )
    return Section("3 Let go", text, _conclusions(found), {PICTURE: _picture})


def _corrected(scene: Scene, choice: Choice) -> Scene:
    loads = [{"kind": "tip", "force": 0.0}] if choice.static_corrections else []
    return scene.with_value("loads", loads)


@cache
def _runs() -> tuple[Trajectory, dict[str, Trajectory]]:
    """Return the elements' run and those of the modes, over the most swings."""
    period = 1.0 / float(frequencies(RUN).true[0])
    scene = released_scene(RUN).with_value("run.duration", 1.02 * SWINGS[-1] * period)
    step = period / STEPS_A_SWING
    settings = {"time_step": step, "output_step": step, "analysis": "dynamic"}
    true = simulate(FiniteElementNeedle(scene, elements=ELEMENTS), **settings)
    return true, {choice.label: simulate(choice.plant(_corrected(scene, choice)), **settings) for choice in RUN_CHOICES}


def _row(found: Frequencies) -> list[str]:
    name, support, modulus, depth = found.case
    first = [percent(float(found.errors[choice.label][0])) for choice in CHOICES]
    place = [name, f"`{support}`", kilo(modulus), millimeters(depth), f"{found.true[0]:.0f}"]
    lost = ["all", ""] if found.is_exact else [f"{found.swings_in_phase:.0f}", f"{1e3 * found.time_in_phase:.0f}"]
    return [*place, *first, percent(float(found.errors[TWO.label][1])), *lost]


def _conclusions(found: list[Frequencies]) -> tuple[str, ...]:
    inexact = [one for one in found if not one.is_exact]
    best, worst = (choose(inexact, key=lambda one: one.swings_in_phase) for choose in (max, min))
    ends = " to ".join(
        f"""{one.swings_in_phase:.0f} ({one.case[0]}, `{one.case[1]}`, {kilo(one.case[2])} kN/m^2, {millimeters(one.case[3])}
        mm)""" for one in (worst, best)
    )
    return (prose(f"Let go: swings for which two modes keep the phase of the first vibration: {ends}."),)


def _picture() -> bytes:
    true, runs = _runs()
    named = {"elements": true, **{label: runs[label] for label in (TWO.label, FIVE.label)}}
    shown = true.time < SHOWN_SHARE * true.time[-1]
    curves = tuple(Curve(label, 1e3 * run.time[shown], 1e3 * run.tip_deflection[shown]) for label, run in named.items())
    name, support, modulus, depth = RUN
    title = f"{name}, {support}, {kilo(modulus)} kN/m², z = {millimeters(depth)} mm"
    return curve_picture("tip deflection [mm]", [Panel(title, "time [ms]", curves)])
