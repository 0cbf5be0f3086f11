"""Runs of the prototypes of `one_matrix`: states at the outputs, and the time that the steps took."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks import one_matrix as one
from fem_needle.collocation import collocation
from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import drive_of
from fem_needle.dynamics.grid import TimeGrid
from fem_needle.dynamics.model import model_of
from fem_needle.dynamics.state import LiveState
from fem_needle.dynamics.work import Work
from fem_needle.initial import initial_state
from fem_needle.motion import depth_law
from fem_needle.needle import FiniteElementNeedle

Array = NDArray[np.float64]
WHICH = {"SDIRK": one.SDIRK, "RODAS": one.RODAS}  # others: collocation of the kernel


@dataclass(frozen=True, eq=False)
class Run:
    """Coordinates and momenta (outputs, 2, n), the number of steps, and the time that all steps took [s]."""

    states: Array
    steps: int
    seconds: float


class Prototype:
    """A method on a needle with inertia.

    Parameters
    ----------
    needle
        Finite elements, without a cut path and without a push.
    method
        "SDIRK", "RODAS", or the spectral radius of the collocation.
    """

    def __init__(self, needle: FiniteElementNeedle, method: str | float) -> None:
        self.method = WHICH.get(method, one.PAIR) if isinstance(method, str) else one.PAIR
        model = model_of(needle, inertia=True, viscous=True)
        pair = collocation(method if isinstance(method, float) else 1.0)
        self._work = work = Work(model, pair, 2 if self.method == one.PAIR else 1)
        table = np.zeros((one.FOUND + 1, work.table.shape[1]), dtype=np.int64)
        table[: len(work.table)] = work.table
        work.table = table
        work.drive(drive_of(needle.scene))
        self.live = LiveState(work, model.size, model.points, model.arrays[at.COEFFICIENTS].shape[2])
        work.put(one.STAGES, np.zeros((8, 2, model.size)))
        work.put(one.TRIED, np.zeros((2, model.size)))
        work.put(one.TABLEAU, one.tableau(self.method))
        work[at.CURSOR][0] = self.method
        start = initial_state(needle, depth_law(needle.scene)).solution
        self._begin = np.stack([start.coordinates, start.momentum])

    def run(self, grid: TimeGrid, begin: Array | None = None) -> Run:
        """Take the steps of a grid from the scene's initial state, or from another (2, n)."""
        outputs = set(grid.outputs)
        intervals = np.array([(start, end, count, end in outputs) for start, end, count in grid.intervals()], dtype=float)
        found = np.zeros((int(np.sum(intervals[:, 3])), 2, self.live.lateral.shape[2]))
        self._work.put(at.INTERVALS, intervals)
        self._work.put(one.FOUND, found)
        self.live.lateral[0] = self._begin if begin is None else begin
        self._work[at.KEY][:] = np.nan
        self._work[at.RATES][:] = 0.0
        began = clock.thread_time()
        one.take_steps(self._work.table)
        seconds = clock.thread_time() - began
        return Run(found, int(np.sum(intervals[:, 2])), seconds)

    @property
    def guide_forces(self) -> Array:
        """Forces [N] of the points at the last stage."""
        forces: Array = self._work[at.FORCES][0]
        return forces
