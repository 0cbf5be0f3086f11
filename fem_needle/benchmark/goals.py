"""What the program is meant to reach, each with its measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from fem_needle.benchmark.goal_measurements import (
    HIT_RATE,
    Measured,
    cost_of_tolerance,
    error_of_loop,
    hit_rate,
    order_of_loop,
    runs_per_second,
    stability_of_two_modes,
    time_of_command,
    time_per_step,
    whole_answer,
)
from fem_needle.benchmark.result import GoalRow, Row
from fem_needle.errors import NeedleError

LARGEST_TIP = 3.0  # of the true one: a vibration that grows is far above, one that a sudden load leaves is up to 2
ORDER = 3.9  # of the two-stage collocation: 4
NAIVE_STEP = 2.5e-3  # s, about: by it goals appear in the picture
TOLERANCE = 1e-3  # of the shipped scenes

CUT = {"tissue.rest_line": "cut-path"}
# What users wait for, in steps of the naive program: name, scene, changes, goal.
WAITS: tuple[tuple[str, str, dict[str, Any], float], ...] = (
    ("S", "bench-s", {}, 1.0),
    ("D", "bench-d", {}, 2.5),
    ("M", "bench-m", {}, 2.5),
    ("M2", "bench-m2", {}, 7.5),
    ("brachytherapy", "brachytherapy", {}, 15.0),
    ("brachytherapy on a cut path", "brachytherapy", CUT, 100.0),
    ("three layers", "three-layers", {}, 25.0),
    ("three layers on a cut path", "three-layers", CUT, 100.0),
    ("thesis-open-loop", "thesis-open-loop", {}, 50.0),
    ("liver-push", "liver-push", {}, 50.0),
)
MOVING: dict[str, Any] = {"numerics.analysis": "dynamic", "numerics.time_step": 1e-3}
SWINGING: dict[str, Any] = {"numerics.analysis": "dynamic", "numerics.time_step": 5e-4}
RESTING: dict[str, Any] = {"numerics.analysis": "static", "numerics.time_step": 1e-3}
FEW = {"model.kind": "assumed-modes"}
# Computing time of a step [us]: name, scene, changes, goal.
STEPS: tuple[tuple[str, str, dict[str, Any], float], ...] = (
    ("hub, 6 elements", "brachytherapy", MOVING | {"numerics.elements": 6}, 7.0),
    ("hub, 40 elements", "brachytherapy", MOVING | {"numerics.elements": 40}, 20.0),
    ("entry (M2), 6 elements", "bench-m2", SWINGING | {"numerics.elements": 6}, 12.0),
    ("entry (M2), 40 elements", "bench-m2", SWINGING | {"numerics.elements": 40}, 40.0),
    ("equilibrium, hub, 6 elements", "brachytherapy", RESTING | {"numerics.elements": 6}, 4.0),
    ("equilibrium, hub, 40 elements", "brachytherapy", RESTING | {"numerics.elements": 40}, 10.0),
    ("push, 8 elements", "liver-push", {"numerics.time_step": 1e-3, "numerics.elements": 8}, 20.0),
    ("cut path, 12 elements", "brachytherapy", MOVING | CUT | {"numerics.elements": 12, "run.duration": 2.0}, 60.0),
    ("hub, 2 modes", "brachytherapy", MOVING | FEW | {"model.modes": 2}, 6.0),
    ("hub, 8 modes", "brachytherapy", MOVING | FEW | {"model.modes": 8}, 22.0),
)


@dataclass(frozen=True)
class TimeToError:
    """Time [s] in which the program should have a tip error (1) in a case."""

    case: str
    error: float
    time: float


TIMES_TO_ERROR = tuple(TimeToError(name, TOLERANCE, goal * NAIVE_STEP) for name, _, _, goal in WAITS[:5])


@dataclass(frozen=True)
class Goal:
    """A goal and how it is measured.

    Attributes
    ----------
    number, text, value, unit
        As shown.
    measure
        From the rows of the benchmark; raises `NeedleError` where it cannot be measured.
    at_least
        Whether more is better.
    """

    number: str
    text: str
    value: float
    unit: str
    measure: Callable[[Sequence[Row]], Measured]
    at_least: bool = False

    def row(self, rows: Sequence[Row]) -> GoalRow:
        """Return what was measured, or why it was not."""
        try:
            found = self.measure(rows)
        except NeedleError as error:
            return GoalRow(self.number, self.text, self.value, None, self.unit, None, str(error))
        met = found.value >= self.value if self.at_least else found.value <= self.value
        return GoalRow(self.number, self.text, self.value, found.value, self.unit, bool(met), found.note)


def _waits() -> Iterator[Goal]:
    for name, scene, changes, goal in WAITS:
        measure = partial(whole_answer, scene, changes)
        yield Goal("1", f"{name}: the whole answer to 1e-3", goal, "naive steps", lambda rows, measure=measure: measure())  # type: ignore[misc]


def _steps() -> Iterator[Goal]:
    for name, scene, changes, goal in STEPS:
        measure = partial(time_per_step, scene, changes)
        yield Goal("2", f"{name}: a step", goal, "us", lambda rows, measure=measure: measure())  # type: ignore[misc]
    yield Goal("2", "M2, 40 elements, 0.5 ms: error", TOLERANCE, "1", lambda rows: error_of_loop("M2"))
    order = "M2, boundary moving through elements: order in time (4)"
    yield Goal("2", order, ORDER, "1", lambda rows: order_of_loop(), at_least=True)


def all_goals(scenes: int) -> tuple[Goal, ...]:
    """Return all goals; the hit rate of the tolerance is measured on a number of random scenes."""
    return (
        *_waits(),
        *_steps(),
        Goal("3", f"tolerance kept in {scenes} random scenes", HIT_RATE, "%", lambda rows: hit_rate(scenes), at_least=True),
        Goal("3", "tolerance: cost / cheapest fixed setting", 3.0, "x", cost_of_tolerance),
        Goal("4", "two modes, steps of 1 to 100 ms: tip / true tip", LARGEST_TIP, "x", lambda rows: stability_of_two_modes()),
        Goal("5", "process `run thesis`", 0.8, "s", lambda rows: time_of_command("run", "thesis")),
        Goal("5", "process `--help`", 0.2, "s", lambda rows: time_of_command("--help")),
        Goal("6", "hub runs of 1600 steps a second, one thread", 90.0, "1/s", lambda rows: runs_per_second(1), at_least=True),
        Goal("6", "hub runs of 1600 steps a second, two threads", 140.0, "1/s", lambda rows: runs_per_second(2), at_least=True),
    )


def goal_rows(rows: Sequence[Row], scenes: int, tell: Callable[[str], None] = lambda message: None) -> tuple[GoalRow, ...]:
    """Measure every goal."""
    found = []
    for goal in all_goals(scenes):
        tell(f"goal {goal.number}: {goal.text}")
        found.append(goal.row(rows))
    return tuple(found)
