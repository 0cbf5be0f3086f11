"""The needle by polynomials on pieces whose ends follow guides, forces, skin, layer borders and the tip.

Between its breaks every solution is smooth, so that the error falls exponentially with the degree, where polynomials over the
whole needle (`hub`, `entry`) leave powers. A break is at a fixed y and slides along the needle, or at hub or tip and goes with
it. A point of a piece of length L is xi in 0..1, the functions are N(xi) T: four cubics (deflection and slope at both ends, T = L
for slopes) and bubbles. At a fixed material point and at a fixed y, per unit of depth,

    dPsi/dz = [N' (-a - xi L') + L' N J] T / L,    a the rate of the piece's start in s or in y, J = 1 for slopes,

with which kinetic energy and viscous power are the quadratic forms of the theory page: T = 1/2 rho A int (Psi q' + v Psi_z q)^2.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import comb

import numpy as np

SLOPES = (1, 3)
SHORT, SHORT_DEGREE = 0.02, 8  # m, and the degree of pieces that are shorter


def local_functions(x, count):
    """Hermite cubics and ``count`` - 4 bubbles x^2 (1 - x)^2 C_j(2 x - 1): values, two derivatives, shape (3, ..., count)."""
    x = np.asarray(x)
    one = np.ones_like(x)
    cubics = [
        [1.0 - 3.0 * x**2 + 2.0 * x**3, -6.0 * x + 6.0 * x**2, -6.0 + 12.0 * x],
        [x - 2.0 * x**2 + x**3, 1.0 - 4.0 * x + 3.0 * x**2, -4.0 + 6.0 * x],
        [3.0 * x**2 - 2.0 * x**3, 6.0 * x - 6.0 * x**2, 6.0 - 12.0 * x],
        [x**3 - x**2, 3.0 * x**2 - 2.0 * x, 6.0 * x - 2.0],
    ]
    bubble = x**2 * (1.0 - x) ** 2, 2.0 * x - 6.0 * x**2 + 4.0 * x**3, 2.0 - 12.0 * x + 12.0 * x**2
    series = [[one, 0.0 * x, 0.0 * x], [9.0 * (2.0 * x - 1.0), 18.0 * one, 0.0 * x]]
    for n in range(2, count - 4):  # Gegenbauer's C^(9/2), orthogonal with the square of the bubble as weight
        lead, behind, t = (2.0 * n + 7.0) / n, (n + 7.0) / n, 2.0 * x - 1.0
        (a, da, dda), (b, db, ddb) = series[-1], series[-2]
        first, second = lead * (t * da + 2.0 * a) - behind * db, lead * (t * dda + 4.0 * da) - behind * ddb
        series.append([lead * t * a - behind * b, first, second])
    for number, (c, dc, ddc) in enumerate(series[: count - 4]):
        scale = comb(number + 8, 8) ** -0.5
        first = bubble[1] * c + bubble[0] * dc
        second = bubble[2] * c + 2.0 * bubble[1] * dc + bubble[0] * ddc
        cubics.append([scale * bubble[0] * c, scale * first, scale * second])
    return np.moveaxis(np.array(cubics), 0, -1)


@dataclass(frozen=True)
class Piece:
    """Part of the needle between two breaks.

    ``start`` and ``end`` are y [m], None for the hub and the tip; ``index`` has the places of its functions.
    """

    start: float | None
    end: float | None
    index: np.ndarray

    @property
    def stretches(self):
        """dL/dz."""
        return float(self.end is None) - float(self.start is None)

    @property
    def moves(self):
        """Rate of the start in s per depth; in y it is one more."""
        return -1.0 if self.start is not None else 0.0

    def ends(self, depth, length):
        """y of both ends, shapes of the depth."""
        start = depth - length if self.start is None else self.start + 0.0 * depth
        return start, depth if self.end is None else self.end + 0.0 * depth

    def rates(self, x, values, first, *, material):
        """L times the rate by depth of the functions at material points or at places, before T."""
        turned = np.zeros(values.shape[-1])
        turned[list(SLOPES)] = self.stretches
        start = self.moves if material else self.moves + 1.0
        return first * (-start - x * self.stretches)[..., None] + values * turned


@dataclass
class Operators:
    """M, S, R, K + m G, C, D, E of the theory page, shapes (nt, n, n)."""

    mass: np.ndarray
    transport: np.ndarray
    convective: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    sliding: np.ndarray
    dragging: np.ndarray


class PiecewiseNeedle:
    """Functions and operators of a scene; breaks rise in y between hub or skin and tip."""

    def __init__(self, scene, breaks, degree):
        self.scene, self.length = scene, scene.needle.length
        first = None if scene.support.kind == "hub" else 0.0
        marks = [first, *(y for y in sorted(breaks) if first is None or y > 0.0), None]
        self.breaks, self.pieces, self.size = marks[1:-1], [], 2 * len(marks)
        for number, (start, end) in enumerate(pairwise(marks)):
            short = end is not None and end - (-self.length if start is None else start) < SHORT
            bubbles = (min(degree, SHORT_DEGREE) if short else degree) - 3
            index = np.concatenate([2 * number + np.arange(4), self.size + np.arange(bubbles)])
            self.pieces.append(Piece(start, end, index))
            self.size += bubbles
        self.tip = 2 * len(marks) - 2
        rigid = [self.node(guide.position) for guide in scene.support.guides if guide.stiffness == "rigid"]
        self.own = np.setdiff1d(np.arange(self.size), [0, 1, *rigid])
        nodes, weights = np.polynomial.legendre.leggauss(degree + 3)
        self.nodes, self.weights = (nodes + 1.0) / 2.0, weights / 2.0

    def node(self, y):
        """Coordinate of the deflection at a break."""
        return 2 + 2 * self.breaks.index(y)

    def at(self, y, depth, *, rate=False):
        """Functions at places y (nt, g) at depths (nt,), shape (nt, g, n); with ``rate`` their dPsi/dz at material points."""
        y, depth = np.asarray(y), np.asarray(depth)
        total = np.zeros((*y.shape, self.size))
        for piece in self.pieces:
            start, end = piece.ends(depth[:, None], self.length)
            inside = (y >= start) | (piece is self.pieces[0])
            inside &= (y < end) | (piece.end is None)
            if not inside.any():
                continue
            span = np.broadcast_to(end - start, y.shape)[inside]
            x = ((y - start) / (end - start))[inside]
            values, first, _ = local_functions(x, piece.index.size)
            if rate:
                values = piece.rates(x, values, first, material=True) / span[:, None]
            values[:, list(SLOPES)] *= span[:, None]
            rows = np.zeros((x.size, self.size))
            rows[:, piece.index] = values
            total[inside] = rows
        return total

    def operators(self, depth, factor):
        """All operators at depths (nt,), which may be complex, and stiffness factors (nt,)."""
        shape = (7, depth.size, self.size, self.size)
        total = np.zeros(shape, dtype=depth.dtype)
        for piece in self.pieces:
            held = piece.start is not None and piece.end is not None
            there = depth[:1] if held else depth
            start, end = piece.ends(there, self.length)
            self._beam(total, piece, end - start)
            for layer in self.scene.tissue.layers:
                self._layer(total, piece, layer, (start, end), factor)
        for guide in self.scene.support.guides:
            if guide.stiffness != "rigid":
                total[3, :, self.node(guide.position), self.node(guide.position)] += guide.stiffness
        return Operators(*total)

    def _beam(self, total, piece, span):
        values, first, second = local_functions(self.nodes, piece.index.size)
        moved = piece.rates(self.nodes, values, first, material=True)
        inertia, stiffness = self.scene.needle.mass_per_length, self.scene.needle.bending_stiffness
        pairs = [(values, values, inertia * span), (values, moved, inertia + 0.0 * span), (moved, moved, inertia / span)]
        pairs.append((second, second, stiffness / span**3))
        for number, (left, right, scale) in enumerate(pairs):
            self._add(total[number], piece, span, scale[:, None, None] * ((left * self.weights[:, None]).T @ right))

    def _layer(self, total, piece, layer, ends, factor):
        start, end = ends
        span = end - start
        lower, upper = (_clipped((y - start) / span) for y in (layer.start, min(layer.far_side, 10.0 * self.length)))
        if np.all(lower.real >= upper.real):
            return
        part = (upper - lower)[:, None]
        x = lower[:, None] + part * self.nodes
        if np.all(x == x[0]):
            x, part = x[:1], part[:1]
        values, first, _ = local_functions(x, piece.index.size)
        weight = (part * self.weights)[..., None]
        whole = (values * weight).swapaxes(1, 2) @ values
        scale = span[:, None, None]
        self._add(total[3], piece, span, factor[:, None, None] * layer.foundation_modulus * scale * whole)
        if layer.damping:
            moved = piece.rates(x, values, first, material=False)
            self._add(total[4], piece, span, layer.damping * scale * whole)
            self._add(total[5], piece, span, layer.damping * ((values * weight).swapaxes(1, 2) @ moved))
            self._add(total[6], piece, span, layer.damping / scale * ((moved * weight).swapaxes(1, 2) @ moved))

    def _add(self, total, piece, span, matrix):
        """Add a piece's matrix before T to the whole."""
        scale = np.ones((span.size, piece.index.size), dtype=span.dtype)
        scale[:, list(SLOPES)] = span[:, None]
        total[:, piece.index[:, None], piece.index] += scale[:, :, None] * scale[:, None, :] * matrix


def _clipped(x):
    return np.where(x.real <= 0.0, 0.0, np.where(x.real >= 1.0, 1.0, x))
