"""The path that the tip has cut: the rest line of the tissue's springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CutPath:
    """Rest line r(y): zero over the initial depth, then where the tip was when it passed y for the first time.

    Attributes
    ----------
    edges
        y of the pieces' ends [m], rising from the initial depth to the deepest point; shape (pieces + 1,).
    coefficients
        Powers of (y - edge) of each piece, shape (pieces, 4).
    front
        Deflection of a tip that stands at the deepest point or beyond [m]: what r will be just in front of it.
    """

    edges: Array
    coefficients: Array
    front: float = 0.0

    @property
    def deepest(self) -> float:
        """Deepest y that the tip has reached [m]."""
        return float(self.edges[-1])

    def value(self, y: Array) -> Array:
        """Return r [m] at positions y [m]; at the deepest point and beyond, the front."""
        if not len(self.coefficients):
            return np.where(y >= self.deepest, self.front, 0.0)
        piece = np.clip(np.searchsorted(self.edges, y, side="right") - 1, 0, len(self.coefficients) - 1)
        offset = np.minimum(y, self.deepest) - self.edges[piece]
        powers = self.coefficients[piece]
        cut = ((powers[..., 3] * offset + powers[..., 2]) * offset + powers[..., 1]) * offset + powers[..., 0]
        return np.where(y >= self.deepest, self.front, np.where(y >= self.edges[0], cut, 0.0))

    def integrals(self, y: Array) -> tuple[Array, Array]:
        """Return the integrals of r and of r y from the surface to positions y [m] on the path or before it."""
        if not len(self.coefficients):
            return np.zeros(y.shape), np.zeros(y.shape)
        places = np.clip(y, self.edges[0], self.deepest)
        once = scipy.interpolate.PPoly(self.coefficients.T[::-1], self.edges).antiderivative()
        total = once(places)
        return total, places * total - once.antiderivative()(places)

    def extended(self, positions: Sequence[float], deflections: Sequence[float]) -> CutPath:
        """Return the path with one more piece: the polynomial through the given points, up to the last of them.

        The first point is the tip at the present deepest position. Points that do not advance are left out.
        """
        start = positions[0]
        kept = [(y - start, w) for y, w in zip(positions, deflections, strict=True)]
        kept = [kept[0], *(now for before, now in pairwise(kept) if now[0] > before[0])]
        if len(kept) < 2:
            return replace(self, front=deflections[-1])
        offsets, values = np.array([y for y, _ in kept]), np.array([w for _, w in kept])
        span = offsets[-1]
        powers = np.linalg.solve(np.vander(offsets / span, len(kept), increasing=True), values)
        piece = np.zeros(4)
        piece[: len(kept)] = powers / span ** np.arange(len(kept))
        edges, pieces = np.append(self.edges, start + span), np.vstack([self.coefficients, piece])
        return CutPath(edges, pieces, deflections[-1])

    def points(self) -> tuple[Array, Array]:
        """Return y [m] and r [m] at the jump (both sides) and at the end of every piece; empty before anything is cut."""
        if not len(self.coefficients):
            return np.zeros(0), np.zeros(0)
        spans = np.diff(self.edges)[:, None] ** np.arange(4)
        ends = np.sum(self.coefficients * spans, axis=1)
        y = np.concatenate([self.edges[:1], self.edges])
        return y, np.concatenate([[0.0, self.coefficients[0, 0]], ends])

    def up_to(self, depth: float) -> CutPath:
        """Return the path as it was when the tip stood at a depth [m] on its way."""
        if depth >= self.deepest:
            return self
        count = int(np.searchsorted(self.edges, depth))
        if count == 0:
            return straight_path(depth)
        edges = np.append(self.edges[:count], depth)
        return CutPath(edges, self.coefficients[:count], float(self.value(np.array(depth))))

    def seen_from(self, depth: float, tip_deflection: float) -> CutPath:
        """Return the path with the front of a tip that stands at a depth inside the last piece or beyond."""
        return replace(self, front=tip_deflection) if depth >= self.deepest else self


def path_through(positions: Array, deflections: Array, coefficients: Array) -> CutPath:
    """Return the path of points as `CutPath.points` gives them; straight pieces between them where their powers are unknown."""
    if not len(positions):
        return CutPath(np.array([np.inf]), np.zeros((0, 4)))
    edges, values = positions[1:], deflections[1:]
    if len(coefficients) != len(edges) - 1:
        coefficients = np.zeros((len(edges) - 1, 4))
        coefficients[:, 0], coefficients[:, 1] = values[:-1], np.diff(values) / np.diff(edges)
    return CutPath(edges, coefficients, float(values[-1]))


def straight_path(depth: float) -> CutPath:
    """Return the path at the start: straight over the initial depth [m]."""
    return CutPath(np.array([depth]), np.zeros((0, 4)))
