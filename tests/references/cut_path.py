"""The rest line that a tip cuts, remembered over the depth; its load on the needle's functions.

The load of the springs' rest line is m int k r Psi dy. While the tip cuts, y = z(t') and r = tip(t'), so that over each step
it is an integral in time, sum_j h b_j v_j k tip_j Psi(z_j), and inside a step with the rows of the collocation in place of b:
implicit and linear in the tips of the step. Steps between two landings make a group; its path is then kept as a polynomial in y.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev, legendre

POINTS = 16


@dataclass(frozen=True)
class Stretch:
    """Path between two depths in one layer: Chebyshev coefficients over it."""

    start: float
    end: float
    series: np.ndarray
    modulus: float

    def load(self, end, nodes, weights):
        """Places and k r times weights of the path up to a depth."""
        last = min(self.end, end)
        y = self.start + (last - self.start) * nodes
        value = chebyshev.chebval(2.0 * (y - self.start) / (self.end - self.start) - 1.0, self.series)
        return y, self.modulus * value * weights * (last - self.start)


class CutMemory:
    """Path of the tip, and the group of steps that cuts at present."""

    def __init__(self, loading, degree):
        self.loading, self.stretches, self.deepest = loading, [], float(loading.law.depth(0.0))
        nodes, weights = np.polynomial.legendre.leggauss(degree + POINTS)
        self.nodes, self.weights = (nodes + 1.0) / 2.0, weights / 2.0

    def begin(self, motor, time, depth, speed, start):
        """Take up a group of steps: instants of all its stages."""
        self.motor, self.depth, self.speed, self.start = motor, depth, speed, float(start)
        self.factor = self.loading.factor.value(time)
        middle = depth[depth.size // 2]
        self.cutting = bool(speed[0] > 0.0 and middle > self.deepest - 1e-12)
        self.modulus = float(self.loading.layer_modulus(middle))
        self.past = self.factor[:, None] * self._old(depth)
        self.fresh = np.zeros((0, 3))  # y, tip, h b v

    def _old(self, depth):
        """Load of all former stretches at depths, shape (nt, own)."""
        total = np.zeros((depth.size, self.motor.own.size))
        whole = [piece for piece in self.stretches if piece.end <= depth.min() + 1e-12]
        if whole:
            parts = zip(*(stretch.load(np.inf, self.nodes, self.weights) for stretch in whole), strict=True)
            total += self._rows(*self._compressed(*(np.concatenate(part) for part in parts)), depth)
        for piece in self.stretches:
            if piece.end > depth.min() + 1e-12:
                for i in np.flatnonzero(depth > piece.start):
                    y, load = piece.load(depth[i], self.nodes, self.weights)
                    total[i] += self._rows(y, load, depth[i : i + 1])[0]
        return total

    def _compressed(self, places, loads):
        """Few places and loads that give the same integrals: on a piece all functions are polynomials of its degree."""
        found = []
        for piece in self.motor.needle.pieces:
            start, end = piece.ends(places.max(), self.motor.needle.length)
            inside = (places >= start) & ((places < end) | (piece.end is None))
            if np.count_nonzero(inside) <= piece.index.size:
                found.append((places[inside], loads[inside]))
                continue
            nodes, weights = np.polynomial.legendre.leggauss(piece.index.size)
            degree = piece.index.size - 1
            moments = legendre.legvander(2.0 * (places[inside] - start) / (end - start) - 1.0, degree).T @ loads[inside]
            back = legendre.legvander(nodes, degree) * (np.arange(degree + 1) + 0.5) * weights[:, None]
            found.append((start + (end - start) * (nodes + 1.0) / 2.0, back @ moments))
        return (np.concatenate(part) for part in zip(*found, strict=True))

    def _rows(self, y, load, depth):
        rows = self.motor.needle.at(np.broadcast_to(y, (depth.size, y.size)), depth)
        return np.einsum("g,tgn->tn", load, rows)[:, self.motor.own]

    def loads(self, three):
        """Load of the path that is older than a step, at its stages."""
        total = self.past[three]
        if self.cutting and len(self.fresh):
            y, tip, weight = self.fresh.T
            total = total + self.factor[three, None] * self._rows(y, self.modulus * tip * weight, self.depth[three])
        return total

    def coupling(self, method, three, h):
        """Load at stage i for a tip of 1 at stage j, as a matrix of which only the tip's column is filled."""
        if not self.cutting:
            return None
        count, z, v = self.motor.own.size, self.depth[three], self.speed[three]
        rows = self.motor.needle.at(np.broadcast_to(z, (3, 3)), z)[:, :, self.motor.own]
        result = np.zeros((3, 3, count, count))
        result[..., self.motor.tip] = rows * (h * method.stages * v * self.modulus * self.factor[three, None])[..., None]
        return result

    def extend(self, method, three, h, tips):
        """Keep the tips of a step."""
        if self.cutting:
            new = np.stack([self.depth[three], tips, h * method.weights * self.speed[three]], axis=1)
            self.fresh = np.concatenate([self.fresh, new])

    def close(self, end):
        """Turn the group into a stretch of the path."""
        if self.cutting and end > self.start:
            place = 2.0 * (self.fresh[:, 0] - self.start) / (end - self.start) - 1.0
            degree = min(POINTS, place.size - 1)
            self.stretches.append(Stretch(self.start, end, chebyshev.chebfit(place, self.fresh[:, 1], degree), self.modulus))
            self.deepest = end
