"""The kernel as a loop calls it: a single stretch of steps at a time, without anything that only a whole run needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation
from fem_needle.dynamics import names as at
from fem_needle.dynamics.engine import RECORD_PARTS, REST, SAMPLE_COLUMNS, Engine
from fem_needle.dynamics.push import Push
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples

Array = NDArray[np.float64]


class LoopEngine(Engine):
    """A needle whose calls share one interval and one row.

    Attributes
    ----------
    row
        The record of the last output (`Model.record_ends`), `fem_needle.dynamics.names`.
    """

    def __init__(self, plant: Plant, kind: str, method: Collocation | None = None) -> None:
        super().__init__(plant, kind, method)
        self._rows, self._interval = np.zeros((1, self.model.record_ends[-1])), np.zeros((1, 4))
        self.row: Array = self._rows[0]
        self._is_ready, self._counting = False, self.limits
        last = at.END, -1
        self._tip_row, self._tip_first = self._work[at.POINT_ROWS][last], self._work[at.POINT_FIRST][at.END]
        self._tip_flexible, self._width = self._work[at.FLEXIBLE][last], self._work[at.POINT_ROWS].shape[2]
        self._coordinates = self.live.lateral[0, 0]
        self._none: Samples | None = None

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m] at the end of the last step."""
        first = self._tip_first[-1]
        bent = self._tip_row.dot(self._coordinates[first : first + self._width])
        return float(bent + self._tip_flexible.dot(self.live.held))

    def go(self, start: float, end: float, steps: float, is_output: bool) -> int:
        """Take equal steps from one time [s] to another, the end as a `row` if asked; returns how it ended (`names`)."""
        if not self._is_ready:
            self._work.put(at.INTERVALS, self._interval)
            self._work.put(at.RECORDS, self._rows)
            self._is_ready = True
        if self.cuts:
            self.live.reserve(int(steps))
        self._interval[0] = start, end, steps, is_output
        self.cursor[:] = 0
        self._counting[at.COUNTED] = 1.0
        status = self._run(self._work.table)
        if self._answers is not None:
            self._answers.callback.check()
            self._set_clamp_reactions(self._rows[: self.cursor[2]])
        return int(status)

    def advance(self, intervals: Array, *, counted: bool, from_start: bool = False) -> tuple[int, Samples]:
        """Go through intervals with arrays of their own, as any run does."""
        self._is_ready = False
        return super().advance(intervals, counted=counted, from_start=from_start)

    def settle(self, length: float) -> None:
        """Take the needle as it is at t = 0 as what was there before; ``length``: of the first step [s].

        Of equilibria that is the first `row`.
        """
        if self.kind == REST:
            n, p = self.model.size, self.model.points
            self.live.lateral[0, 0], self.live.held[:] = self.row[at.RECORD : at.RECORD + n], self.row[at.RECORD + n :][:p]
            self.live.axial[at.PACE] = self.row[at.R_SPEED]
        else:
            self.live.axial[at.LAST_LENGTH] = length
            self.pass_kink(counted=False)

    def keep(self, samples: Samples) -> None:
        """Let the last of some samples be the `row`."""
        row = self.row
        for name, column in SAMPLE_COLUMNS.items():
            row[column] = getattr(samples, name)[-1]
        row[at.R_PIECES] = max(0, int(samples.path_points[-1]) - 2)
        row[at.RECORD :] = np.concatenate([getattr(samples, name)[-1] for name in RECORD_PARTS])

    def samples(self, rows: Array) -> Samples:
        """Return rows of a record as samples, with the path as it is now."""
        return super()._samples(rows)

    def _samples(self, record: Array) -> Samples:
        if len(record):
            return super()._samples(record)
        if self._none is None:  # most calls of a push ask for none
            self._none = super()._samples(record)
        return self._none


class LoopPush(Push):
    """A push that begins when it is told, and that can be put back."""

    def settle(self, length: float) -> None:
        """Take the needle as it is at t = 0 as what was there before; ``length``: of the first step [s]."""
        self.needle.live.axial[at.LAST_LENGTH] = length
        self._set_limits(self.direction, None, events=False)
        self.needle.pass_kink(counted=False)
        self.counted = True
