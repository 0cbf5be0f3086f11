"""A needle under way: the kernel with its state, from breakpoint to breakpoint; the loop that all runs go through.

Enters: a plant and an analysis. Leaves: samples as arrays, states. Open `loop.py` for the steps, `rest_loop.py` for equilibria.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation, gauss
from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import Drive, drive_of
from fem_needle.dynamics.given import Answers, given_model
from fem_needle.dynamics.loop import run_steps
from fem_needle.dynamics.model import is_known, model_of
from fem_needle.dynamics.rest_loop import run_rests
from fem_needle.dynamics.state import LiveState, State
from fem_needle.dynamics.work import Work
from fem_needle.errors import ComputationError
from fem_needle.ledger import StepEnd
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples

Array = NDArray[np.float64]

DYNAMIC, CREEP, REST = "dynamic", "creep", "rest"  # with inertia; without; through equilibria
NUMBERS_OF_A_CALL = 400_000  # coordinates times steps: a fraction of a second, in which an interrupt waits

SAMPLE_COLUMNS = {
    "time": at.R_TIME, "depth": at.R_DEPTH, "speed": at.R_SPEED, "push_force": at.R_PUSH, "friction_force": at.R_FRICTION,
    "cutting_force": at.R_CUTTING, "axial_force": at.R_AXIAL,
    "tissue_force": at.R_TISSUE, "hub_force": at.R_HUB, "hub_moment": at.R_MOMENT, "kinetic_energy": at.R_KINETIC,
    "bending_energy": at.R_BENDING, "tissue_energy": at.R_ELASTIC, "guide_energy": at.R_GUIDE,
    "axial_kinetic_energy": at.R_INSERTION, "load_work": at.R_WORKS + at.LOAD_WORK, "hub_work": at.R_WORKS + at.HUB_WORK,
    "tissue_work": at.R_WORKS + at.TISSUE_WORK, "tissue_dissipation": at.R_WORKS + at.DISSIPATION,
    "boundary_energy": at.R_WORKS + at.BOUNDARY, "friction_dissipation": at.R_WORKS + at.FRICTION_LOSS,
    "cutting_work": at.R_WORKS + at.CUTTING_WORK, "push_work": at.R_WORKS + at.PUSH_WORK,
    "arrest_loss": at.R_WORKS + at.ARREST_LOSS,
}  # fmt: skip
RECORD_PARTS = ("coordinates", "point_forces", "guide_force", "velocities", "accelerations")  # behind the numbers of a record


class Engine:
    """A needle and everything that it remembers.

    Parameters
    ----------
    plant
        A needle on shapes.
    kind
        "dynamic", "creep" (without inertia) or "rest" (through equilibria).
    method
        Collocation method of the steps; of equilibria the nodes of the works between.

    Attributes
    ----------
    live
        The state.
    """

    def __init__(self, plant: Plant, kind: str, method: Collocation | None = None) -> None:
        self.plant, self.kind = plant, kind
        self.method = gauss(3) if kind == REST or method is None else method
        inertia, viscous = kind == DYNAMIC, kind != REST
        if is_known(plant):
            self.model = model_of(plant, inertia=inertia, viscous=viscous)
        else:
            self.model = given_model(plant, inertia=inertia, viscous=viscous)
        if kind == REST:
            self.model.switches[at.CUTS] = 0
        self._work = Work(self.model, self.method, 1 if kind == REST else 2)
        self._work.drive(drive_of(plant.scene))
        orders = self.model.arrays[at.COEFFICIENTS].shape[2]
        self.live = LiveState(self._work, self.model.size, self.model.points, orders)
        self.cuts = bool(self.model.switches[at.CUTS])
        self._run = run_rests if kind == REST else run_steps
        self._answers = None if is_known(plant) else Answers(plant, self._work)

    def begin(self, start: StepEnd, depth: float) -> None:
        """Stand at t = 0 at a depth [m] with a state."""
        live, solution = self.live, start.solution
        live.lateral[0, 0], live.lateral[0, 1] = solution.coordinates, solution.momentum
        live.held[:] = solution.forces
        live.axial[at.WAY] = live.axial[at.DEEPEST] = live.path[0][0] = depth
        live.axial[at.LANDED] = at.KINK
        if start.path is not None:
            live.axial[at.FRONT] = start.path.front

    def drive(self, drive: Drive) -> None:
        """Let other signals act from now on."""
        self._work.drive(drive)

    def use(self, method: Collocation | None) -> None:
        """Take the steps that follow by another method; None keeps the one that is used."""
        if method is not None and method is not self.method:
            self.method = method
            self._work.use(method)

    def land(self) -> None:
        """Take what follows as the other side of a kink."""
        self.live.axial[at.LANDED] = at.KINK

    @property
    def limits(self) -> Array:
        """What limits a push (`names`)."""
        limits: Array = self._work[at.LIMITS]
        return limits

    def advance(self, intervals: Array, *, counted: bool, from_start: bool = False) -> tuple[int, Samples]:
        """Go through smooth intervals: start and end [s], steps, ENDS_AT_OUTPUT + BEGINS_AT_KINK (I, 4).

        Returns how it ended (`names`) and the samples of the outputs; ``from_start``: also one of the first instant.
        ``counted``: what a kink at the start does enters the works.
        """
        work, cursor = self._work, self._work[at.CURSOR]
        rows = int(np.count_nonzero(intervals[:, 3] % 2)) + from_start
        record = np.zeros((rows, self.model.record_ends[-1]))
        if self.cuts:
            self.live.reserve(int(np.sum(intervals[:, 2])))
        work.put(at.INTERVALS, intervals)
        work.put(at.RECORDS, record)
        cursor[:] = 0, 0, 0, int(from_start)
        self.limits[at.COUNTED] = float(counted)
        status = self._run(work.table)
        if self._answers is not None:
            self._answers.callback.check()
            self._set_clamp_reactions(record[: cursor[2]])
        return status, self._samples(record[: cursor[2]])

    def _set_clamp_reactions(self, record: Array) -> None:
        """Let a model that is asked say what its clamp takes."""
        for row in record:
            if row[at.R_DEPTH] >= self.plant.smallest_depth:
                residual = np.zeros(self.model.size)
                residual[:2] = row[at.R_HUB], row[at.R_MOMENT]
                row[at.R_HUB], row[at.R_MOMENT] = self.plant.clamp_reactions(residual, float(row[at.R_DEPTH]))

    def _samples(self, record: Array) -> Samples:
        parts = [np.ascontiguousarray(part) for part in np.split(record, self.model.record_ends[:-1], axis=1)[1:]]
        position, deflection, cubics = self.live.path_points()
        pieces = record[:, at.R_PIECES].astype(np.int64)
        values: dict[str, Any] = {name: np.ascontiguousarray(record[:, column]) for name, column in SAMPLE_COLUMNS.items()}
        return Samples(
            **values,
            **dict(zip(RECORD_PARTS, parts, strict=True)),
            path_position=position,
            path_deflection=deflection,
            path_cubics=cubics,
            path_points=np.where(pieces > 0, pieces + 2, 0),
        )

    @property
    def cursor(self) -> NDArray[np.int64]:
        """Where the last call stopped: interval, step in it."""
        cursor: NDArray[np.int64] = self._work[at.CURSOR]
        return cursor

    @property
    def axial_force_at_start(self) -> float:
        """A [N] in the first row of the last record."""
        return float(self._work[at.RECORDS][0, at.R_AXIAL])

    def pass_kink(self, *, counted: bool) -> None:
        """Let the kink that is ahead act now."""
        self.advance(np.zeros((0, 4)), counted=counted)

    def axial_of(self, state: State) -> Array:
        """Return the part of a state that is no coordinate (`names`)."""
        first = self.live.lateral.size
        return state.values[first : first + at.AXIAL]

    def state(self) -> State:
        """Return a copy of the state."""
        return self.live.copied()

    def restore(self, state: State) -> None:
        """Go back to a state."""
        self.live.restore(state)


def failed_step(time: float, depth: float, what: str) -> ComputationError:
    """Return the error of a step from a time [s] and depth [m] that failed."""
    return ComputationError(
        f"the step at time {time:g} s, depth {depth:g} m failed: {what}; use a smaller time_step, or fewer elements"
    )


def smooth_stretches(
    intervals: Iterator[tuple[float, float, int]], outputs: set[float], kinks: set[float], turns: set[float], size: int
) -> Generator[Array, None, None]:
    """Yield intervals as `Engine.advance` takes them, some at once.

    They are cut in front of the second kink (what the first one does is the start of the run), where another method begins
    (``turns``), and after so many steps.
    """
    most, found, steps, passed = max(1, NUMBERS_OF_A_CALL // size), list[tuple[float, float, float, float]](), 0, 0
    for start, end, count in intervals:
        is_kink = start in kinks
        passed += is_kink
        if found and (start in turns or steps + count > most or (is_kink and passed == 2)):
            yield np.array(found)
            found, steps = [], 0
        kind, done = float(at.BEGINS_AT_KINK * is_kink), 0
        while count - done > most:  # an interval of its own, in parts
            middle = start + (end - start) * ((done + most) / count)
            yield np.array([(start + (end - start) * (done / count), middle, most, kind)])
            done, kind = done + most, 0.0
        first = start + (end - start) * (done / count) if done else start
        found.append((first, end, count - done, kind + at.ENDS_AT_OUTPUT * (end in outputs)))
        steps += count - done
    if found:
        yield np.array(found)
