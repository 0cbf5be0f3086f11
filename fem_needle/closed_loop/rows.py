"""Rows of a run that grow, in blocks that a copy shares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIRST, MOST = 16, 1024  # rows of a block


class Finished(NamedTuple):
    """Rows that nobody changes any more, and those before them."""

    before: Finished | None
    rows: Array


class RowsState(NamedTuple):
    """The rows of a run up to an instant, and how many they are."""

    finished: Finished | None
    total: int


class Rows:
    """Rows of a run.

    Parameters
    ----------
    width
        Numbers in a row.

    Attributes
    ----------
    width
        As given.
    """

    def __init__(self, width: int) -> None:
        self.width = width
        self._finished: Finished | None = None
        self._block, self._used = np.zeros((0, width)), 0
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self) -> Array:
        """Return the next row, to be filled."""
        if self._used == len(self._block):
            self._finish()
            self._block = np.empty((min(max(FIRST, self._count), MOST), self.width))
        self._used, self._count = self._used + 1, self._count + 1
        row: Array = self._block[self._used - 1]
        return row

    def array(self) -> Array:
        """Return all rows (rows, width)."""
        found, part = [self._block[: self._used]], self._finished
        while part is not None:
            found.append(part.rows)
            part = part.before
        return np.concatenate(found[::-1])

    def state(self) -> RowsState:
        """Return the rows as they are; who goes on writes behind them."""
        self._finish()
        return RowsState(self._finished, self._count)

    def restore(self, state: RowsState) -> None:
        """Go back to a state; what follows goes into a block of its own."""
        self._finished, self._count = state
        self._block, self._used = self._block[:0], 0

    def _finish(self) -> None:
        if self._used:
            self._finished = Finished(self._finished, self._block[: self._used])
            self._block, self._used = self._block[self._used :], 0


def flat(state: RowsState, width: int) -> RowsState:
    """Return a state in one block."""
    rows = Rows(width)
    rows.restore(state)
    return RowsState(Finished(None, rows.array()), state.total) if state.total else state
