"""What the program is meant to reach, each with its measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from fem_needle.benchmark.goal_measurements import (
    HIT_RATE,
    Measured,
    batch_efficiency,
    cost_of_tolerance,
    error_of_loop,
    hit_rate,
    order_of_loop,
    stability_of_two_modes,
    time_of_command,
    time_per_step,
    time_per_step_of_two_modes,
)
from fem_needle.benchmark.methods import OWN
from fem_needle.benchmark.result import GoalRow, Row
from fem_needle.errors import NeedleError

MICROSECONDS = 1e6
LARGEST_TIP = 3.0  # of the true one: a vibration that grows is far above, one that a sudden load leaves is up to 2
ORDER = 3.9  # of the two-stage collocation: 4


@dataclass(frozen=True)
class TimeToError:
    """Time [s] in which the program should have a tip error (1) in a case."""

    case: str
    error: float
    time: float


TIMES_TO_ERROR = (
    TimeToError("S", 1e-3, 10e-6),
    TimeToError("D", 1e-3, 0.3e-3),
    TimeToError("M", 1e-3, 0.1e-3),
    TimeToError("M2", 1e-3, 3e-3),
    TimeToError("S", 1e-6, 20e-6),
    TimeToError("D", 1e-6, 1e-3),
    TimeToError("M", 1e-6, 10e-3),
    TimeToError("M2", 1e-6, 100e-3),
)


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


def fastest_to(goal: TimeToError, rows: Iterable[Row]) -> Measured:
    """Return the shortest median time of the program's own methods with the error [us], and by what.

    Raises
    ------
    NeedleError
        If none reaches it.
    """
    own = [row for row in rows if row.case == goal.case and row.kind == OWN and row.median is not None]
    found = [row for row in own if row.error is not None and row.error <= goal.error]
    if not found:
        raise NeedleError(f"no setting of {goal.case} reached {goal.error:.0e}" if own else f"{goal.case} was not run")
    best = min(found, key=lambda row: row.median or 0.0)
    return Measured(MICROSECONDS * (best.median or 0.0), f"{best.method}, {best.setting.label}: {best.error:.1e}")


def _times_to_error() -> Iterator[Goal]:
    for goal in TIMES_TO_ERROR:
        text = f"{goal.case} to an error of {goal.error:.0e}"
        yield Goal("2", text, MICROSECONDS * goal.time, "us", lambda rows, goal=goal: fastest_to(goal, rows))  # type: ignore[misc]


def _loop() -> Iterator[Goal]:
    for case, error in (("M", 1e-5), ("M2", 1e-3)):
        yield Goal("1", f"{case}, 40 elements: a step", 40.0, "us", lambda rows, case=case: time_per_step(case))  # type: ignore[misc]
        yield Goal("1", f"{case}, 40 elements, 0.5 ms: error", error, "1", lambda rows, case=case: error_of_loop(case))  # type: ignore[misc]
    yield Goal("1", "M, 40 elements: naive scikit-fem / this", 50, "x", _speed_up, at_least=True)
    order = "M2, boundary moving through elements: order in time (4)"
    yield Goal("1", order, ORDER, "1", lambda rows: order_of_loop(), at_least=True)


def _speed_up(rows: Sequence[Row]) -> Measured:
    """Return the time of a step of the naive program on 40 elements over the program's own.

    Raises
    ------
    NeedleError
        If the naive program was not run.
    """
    naive = [row for row in rows if row.case == "M" and row.method.startswith("scikit-fem") and row.setting.elements == 40]
    if not naive or naive[0].per_step is None:
        raise NeedleError("scikit-fem with 40 elements was not run on M")
    own = time_per_step("M").value
    return Measured(MICROSECONDS * naive[0].per_step / own, f"{MICROSECONDS * naive[0].per_step:.4g} us / {own:.3g} us")


def all_goals(scenes: int) -> tuple[Goal, ...]:
    """Return all goals; the hit rate of the tolerance is measured on a number of random scenes."""
    return (
        *_loop(),
        *_times_to_error(),
        Goal("3", f"tolerance kept in {scenes} random scenes", HIT_RATE, "%", lambda rows: hit_rate(scenes), at_least=True),
        Goal("3", "tolerance: cost / cheapest fixed setting", 2.0, "x", cost_of_tolerance),
        Goal("4", "two modes, steps of 1 to 100 ms: tip / true tip", LARGEST_TIP, "x", lambda rows: stability_of_two_modes()),
        Goal("4", "two modes: a step", 6.0, "us", lambda rows: time_per_step_of_two_modes()),
        Goal("5", "process `run thesis`", 1.0, "s", lambda rows: time_of_command("run", "thesis")),
        Goal("5", "process `run thesis --no-vtk`", 0.7, "s", lambda rows: time_of_command("run", "thesis", "--no-vtk")),
        Goal("5", "process `--help`", 0.2, "s", lambda rows: time_of_command("--help")),
        Goal("6", "batch on two cores: efficiency", 90.0, "%", lambda rows: batch_efficiency(), at_least=True),
    )


def goal_rows(rows: Sequence[Row], scenes: int, tell: Callable[[str], None] = lambda message: None) -> tuple[GoalRow, ...]:
    """Measure every goal."""
    found = []
    for goal in all_goals(scenes):
        tell(f"goal {goal.number}: {goal.text}")
        found.append(goal.row(rows))
    return tuple(found)
