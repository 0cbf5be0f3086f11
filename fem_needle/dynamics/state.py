"""The state of a needle under way: a few plain arrays, to be copied, compared and put back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.dynamics import names as at
from fem_needle.dynamics.work import Work

Array = NDArray[np.float64]

PLANES = 1  # lateral planes; the arrays have an axis for them
TWIST = 2  # angle [rad] and angular momentum [N m s] about the axis: room for a needle that twists
FIRST_PIECES = 16


@dataclass(frozen=True, eq=False)
class State:
    """Everything that a needle has to remember.

    Attributes
    ----------
    values
        Coordinates and momenta (planes, 2, n), insertion and clock (AXIAL,), works (LEDGER,), forces at points (p,), twist (2,):
        one after the other.
    path
        Edges [m], cubics, moments and squares of the path that the tip has cut, one after the other; empty without one.
    pieces
        How many pieces the path has.
    """

    values: Array
    path: tuple[Array, ...]
    pieces: int


class LiveState:
    """The state that the kernel works on, in arrays of its own."""

    def __init__(self, work: Work, size: int, points: int, orders: int) -> None:
        self._work = work
        sizes = (PLANES * 2 * size, at.AXIAL, at.LEDGER, points, TWIST)
        self.values = np.zeros(sum(sizes))
        parts = np.split(self.values, np.cumsum(sizes)[:-1])
        self.lateral = parts[0].reshape(PLANES, 2, size)
        self.axial, self.ledger, self.held, self.twist = parts[1:]
        for name, array in zip((at.LATERAL, at.AXIAL_STATE, at.LEDGER_STATE, at.HELD), (self.lateral, *parts[1:4]), strict=True):
            work.put(name, array)
        self.count = np.zeros(1, dtype=np.int64)
        work.put(at.PATH_COUNT, self.count)
        self._orders = orders
        self._put_path(np.zeros(2), np.zeros((1, 4)), np.zeros((2, orders)), np.zeros(2))

    def _put_path(self, edges: Array, cubics: Array, moments: Array, squares: Array) -> None:
        self.path = (edges, cubics, moments, squares)
        names = (at.PATH_EDGES, at.PATH_CUBICS, at.PATH_MOMENTS, at.PATH_SQUARES)
        for name, array in zip(names, self.path, strict=True):
            self._work.put(name, array)

    @property
    def pieces(self) -> int:
        """How many pieces the path has."""
        return int(self.count[0])

    def reserve(self, pieces: int) -> None:
        """Have room for so many more pieces of the path."""
        wanted, present = self.pieces + pieces, len(self.path[1])
        if wanted > present:
            room = max(FIRST_PIECES, wanted, 2 * present)
            shapes = ((room + 1,), (room, 4), (2 * room, self._orders), (room + 1,))
            grown = []
            for array, shape in zip(self.path, shapes, strict=True):
                larger = np.zeros(shape)
                larger[: len(array)] = array
                grown.append(larger)
            self._put_path(*grown)

    def copied(self) -> State:
        """Return a copy."""
        count = self.pieces
        if not count:
            return State(self.values.copy(), (self.path[0][:1].copy(),), 0)
        lengths = (count + 1, count, 2 * count, count + 1)
        return State(
            self.values.copy(), tuple(array[:length].copy() for array, length in zip(self.path, lengths, strict=True)), count
        )

    def restore(self, state: State) -> None:
        """Go back to a copy."""
        self.values[:] = state.values
        self.count[0] = 0
        self.reserve(state.pieces)
        self.count[0] = state.pieces
        for array, kept in zip(self.path, state.path, strict=False):
            array[: len(kept)] = kept

    def path_points(self) -> tuple[Array, Array, Array]:
        """Return y [m] and r [m] at the jump (both sides) and at the pieces' ends, and the pieces' powers; all may be empty."""
        count = self.pieces
        if not count:
            return np.zeros(0), np.zeros(0), np.zeros((0, 4))
        edges, cubics = self.path[0][: count + 1], self.path[1][:count]
        spans = np.diff(edges)[:, None] ** np.arange(4)
        y = np.concatenate([edges[:1], edges])
        return y, np.concatenate([[0.0, cubics[0, 0]], np.sum(cubics * spans, axis=1)]), cubics.copy()
