"""Table IV of the thesis repeated: ten insertions to 100 mm at each speed and by hand, without and with the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle import load_scene, steer
from fem_needle.scene import Scene
from reduced_model.thesis_data import REPETITIONS, TABLE_IV, InsertionTest
from reduced_model.validation.section import Section, blocks, prose, table

Array = NDArray[np.float64]

# Beside the thesis' own rows: markers that see more of the needle, gains that follow the model, and the printed program.
WIDER = 0.04  # m: another decay length of the tissue's displacement, twice that of the scene
OTHERS = (
    (f"incremental, decay length {1e3 * WIDER:g} mm", {"controller.kind": "incremental", "sensors.1.decay_length": WIDER}),
    ("proportional, model gain", {"controller.kind": "proportional", "controller.schedule": "model-gain"}),
    ("incremental, model gain", {"controller.kind": "incremental", "controller.schedule": "model-gain"}),
    ("proportional, as printed", {"controller.kind": "proportional", "controller.variant": "as-printed"}),
)
OUTPUT_STEP = 1.0  # s: only the end counts here


@dataclass(frozen=True, eq=False)
class Insertions:
    """Position errors at the target of ten insertions [m], with their sign (10,)."""

    errors: Array

    @property
    def mean(self) -> float:
        """Mean of the magnitudes [m]."""
        return float(np.mean(np.abs(self.errors)))

    @property
    def deviation(self) -> float:
        """Standard deviation of the magnitudes [m]."""
        return float(np.std(np.abs(self.errors), ddof=1))


@dataclass(frozen=True, eq=False)
class Row:
    """Insertions of one kind without and with the robot.

    Attributes
    ----------
    name
        Speed and controller.
    uncontrolled, controlled
        The errors.
    printed
        The thesis' row; None where it has none.
    """

    name: str
    uncontrolled: Insertions
    controlled: Insertions
    printed: InsertionTest | None = None

    @property
    def improvement(self) -> float:
        """How much smaller the mean error is with the robot (1)."""
        return 1.0 - self.controlled.mean / self.uncontrolled.mean

    @property
    def p_value(self) -> float:
        """Of Student's one-sided t-test of equal means against a larger one without the robot."""
        found = scipy.stats.ttest_ind(
            np.abs(self.uncontrolled.errors), np.abs(self.controlled.errors), alternative="greater"
        )
        return float(found.pvalue)


def scene_of(speed: float) -> Scene:
    """Return the scene of a speed [mm/s], 0: by hand."""
    if speed == 0.0:
        return load_scene("steering-manual").with_value("numerics.output_step", OUTPUT_STEP)
    return load_scene("steering").with_values({"insertion.speed": 1e-3 * speed, "numerics.output_step": OUTPUT_STEP})


def insertions(scene: Scene, repetitions: int = REPETITIONS) -> Insertions:
    """Return the errors of the repetitions of a scene."""
    runs = (steer(scene, repetition=number) for number in range(1, repetitions + 1))
    return Insertions(np.array([run.summary["target_error"] for run in runs]))


@cache
def uncontrolled(speed: float) -> Insertions:
    """Return the insertions without the robot."""
    return insertions(scene_of(speed).with_value("controller", {"kind": "none"}))


@cache
def rows() -> tuple[Row, ...]:
    """Return the thesis' rows, then the others at 10 mm/s."""
    found = []
    for printed in TABLE_IV:
        scene = scene_of(printed.speed).with_value("controller.kind", printed.controller)
        name = f"{_speed_text(printed.speed)}, {printed.controller}"
        found.append(Row(name, uncontrolled(printed.speed), insertions(scene), printed))
    for name, changes in OTHERS:
        found.append(Row(f"{_speed_text(10.0)}, {name}", uncontrolled(10.0), insertions(scene_of(10.0).with_values(changes))))
    return tuple(found)


def _speed_text(speed: float) -> str:
    return "by hand" if speed == 0.0 else f"{speed:g} mm/s"


def pixel_size() -> float:
    """Return the pixel of the scenes' camera [m]."""
    return next(sensor.pixel_size for sensor in scene_of(10.0).sensors if sensor.kind == "tip-imaging")


def _cells(row: Row) -> Sequence[str]:
    pixel, printed = pixel_size(), row.printed

    def pixels(found: Insertions) -> str:
        return f"{found.mean / pixel:.1f} +- {found.deviation / pixel:.1f}"

    ours = [pixels(row.uncontrolled), pixels(row.controlled), f"{100 * row.improvement:.0f}", f"{row.p_value:.1g}"]
    if printed is None:
        return [row.name, *ours, "-", "-", "-", "-"]
    theirs = [f"{printed.uncontrolled:g}", f"{printed.controlled:g}", f"{printed.improvement:g}", f"{printed.probability:g}"]
    return [row.name, *ours, *theirs]


def findings(found: Sequence[Row]) -> tuple[str, ...]:
    """Return what agrees with the thesis and what does not, from the numbers."""
    return (_by_speed(found), _without(found), _proportional(found), _by_hand(found), _decay(found))


def _by_speed(found: Sequence[Row]) -> str:
    gains = [row.improvement for row in _constant_speeds(found)]
    falls = all(slow >= fast for slow, fast in pairwise(gains)) and gains[0] > gains[-1]
    percents = ", ".join(f"{100 * gain:.0f}" for gain in gains)
    return prose(f"""Less improvement at higher speed: {"agrees" if falls else "does not agree"} ({percents} % at 5, 10, 15 mm/s).
        Each image changes the force by one increment at most, and a faster insertion has fewer images.""")


def _without(found: Sequence[Row]) -> str:
    errors = [row.uncontrolled.mean for row in _constant_speeds(found)]
    spread = (max(errors) - min(errors)) / max(errors)
    return prose(f"""Smaller errors without the robot at higher speed (22, 12 to 15, 11 pixels): not in this model, where they
        differ by {100 * spread:.0f} %: its phantom is elastic, the bevel's force does not know the speed, and the same ten
        phantoms are used. A force at the tip or a tissue that depends on the speed would be needed.""")


def _proportional(found: Sequence[Row]) -> str:
    one = next(row for row in found if row.printed and row.printed.controller == "proportional")
    other = next(row for row in _constant_speeds(found) if row.printed and row.printed.speed == 10.0)
    verdict = "agrees" if one.improvement > other.improvement else "does not agree"
    return prose(f"""Proportional better than incremental control: {verdict} ({100 * one.improvement:.0f} against
        {100 * other.improvement:.0f} %). A proportional force leaves an error, and its gain is limited by the depth at which
        the tip follows the finger most; the thesis compares with another mean without the robot (15 and 12 pixels).""")


def _by_hand(found: Sequence[Row]) -> str:
    hand = next(row for row in found if row.printed and row.printed.speed == 0.0)
    helps = "agrees" if hand.improvement > 0.0 else "does not agree"
    return prose(f"""By hand the robot helps too: {helps} ({100 * hand.improvement:.0f} %; 23 % there). What the operator's hand
        does is our assumption.""")


def _decay(found: Sequence[Row]) -> str:
    wider = next(row for row in found if "decay length" in row.name).controlled.mean / pixel_size()
    other = next(row for row in _constant_speeds(found) if row.printed and row.printed.speed == 10.0)
    first, second = (1e3 * largest_deformation(length) for length in (0.02, WIDER))
    return prose(f"""How far the tissue's displacement reaches away from the needle is assumed. With a decay length of 20 mm the
        error is {other.controlled.mean / pixel_size():.2f} pixels, with {1e3 * WIDER:g} mm {wider:.2f}; the largest mean
        displacement of the markers between two frames that the camera saw was {first:.3f} and {second:.3f} mm, beside a pixel of
        {1e3 * pixel_size():g} mm: in this phantom the feedback is the tip's place, whatever is assumed of the tissue.""")


@cache
def largest_deformation(decay_length: float) -> float:
    """Return the largest reading of the tissue's deformation [m] in the incremental loop at 10 mm/s."""
    scene = scene_of(10.0).with_values({"sensors.1.decay_length": decay_length, "numerics.output_step": 0.15})
    return float(np.nanmax(steer(scene).signals["measurement_tissue_deformation"]))


def _constant_speeds(found: Sequence[Row]) -> list[Row]:
    return [row for row in found if row.printed and row.printed.controller == "incremental" and row.printed.speed > 0.0]


def impossible() -> tuple[str, ...]:
    """Return what in the printed table cannot be right, from its own numbers."""
    slow, fast = TABLE_IV[1], TABLE_IV[2]
    worse = next(row for row in TABLE_IV if row.controlled > row.uncontrolled)
    others = max(row.probability for row in TABLE_IV if row is not worse)
    return (
        prose(f"""The same insertion without the robot, {slow.speed:g} mm/s, has {slow.uncontrolled:g} pixels in one row and
            {fast.uncontrolled:g} in the other: two baselines, on which "proportional is better" rests."""),
        prose(f"""At {worse.speed:g} mm/s the mean with the robot is the larger one ({worse.controlled:g} against
            {worse.uncontrolled:g}): a one-sided test of a smaller mean then has p above 0.5, not {worse.probability:g}."""),
        prose(f"""p = {worse.probability:g} would reject equal means at 5 %, and is said to have failed to; by that standard
            {others:g} in another row, which is said to reject, is no different."""),
        "There is no scale in millimeters per pixel, and no value of the thresholds and of b: only ratios can be compared.",
    )


def section() -> Section:
    """Return the section."""
    found = rows()
    header = ["insertion", "robot off [pixels]", "on [pixels]", "better [%]", "p", "thesis: off", "on", "better [%]", "p"]
    about = prose(f"""The scenes `steering` and `steering-manual`: {REPETITIONS} repetitions with other moduli, entry angles and
        speeds, images every 150 ms with noise and pixels of {1e3 * pixel_size():g} mm (ours). Shown: mean and standard
        deviation of the errors' magnitudes at 100 mm; p: one-sided t-test of equal means. Gains follow from the model
        ([control](control.md)): the thesis prints none.""")
    lists = ["\n".join(f"- {sentence}" for sentence in sentences) for sentences in (findings(found), impossible())]
    text = blocks(
        about,
        table(header, [_cells(row) for row in found]),
        "What agrees and what does not:",
        lists[0],
        "What in the printed table cannot be right:",
        lists[1],
    )
    return Section("2 Table IV: insertions with a robot's finger", text, findings(found)[:1])
