"""Sets of functions on a line, joined to the shapes of a needle (`fem_needle.shapes.Shapes`): full matrices by Gauss's rule."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise
from math import ceil, pi
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.gauss import gauss_rule
from fem_needle.piecewise import PiecewisePolynomials, fitted_polynomials
from fem_needle.shapes import Kind
from reduced_model.modes import ClampedFreeModes

Array = NDArray[np.float64]

GAUSS_POINTS = 16
KEPT = 16  # values at recent places
_ORDERS = {"mass": (0, 0), "drag": (0, 1), "slip": (1, 1), "bending": (2, 2)}  # derivatives of the two factors
WAVES_PER_PANEL = 1.0  # of the shortest mode: its square is integrated to rounding by 16 points


class FunctionSet(Protocol):
    """Functions on a line."""

    @property
    def count(self) -> int:
        """How many."""

    @property
    def breaks(self) -> Array:
        """Places between which 16 Gauss points integrate any product of the functions to rounding."""

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return the functions, or a derivative, at places (n,); shape (count, n)."""


@dataclass(frozen=True, eq=False)
class RigidSet:
    """The functions 1 and x: the clamp's own motion."""

    count: ClassVar[int] = 2
    breaks: ClassVar[Array] = np.zeros(0)

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return 1 and x, or a derivative."""
        if derivative > 1:
            return np.zeros((2, len(positions)))
        one = np.ones(len(positions))
        return np.stack([one, positions] if derivative == 0 else [0.0 * one, one])


@dataclass(frozen=True, eq=False)
class ModeSet:
    """Clamped-free modes of a length."""

    length: float
    count: int

    @cached_property
    def modes(self) -> ClampedFreeModes:
        """The modes."""
        return ClampedFreeModes(self.length, self.count)

    @property
    def breaks(self) -> Array:
        """Equal panels, a wave of the last mode each."""
        panels = ceil(float(self.modes.roots[-1]) / (2 * pi * WAVES_PER_PANEL))
        return np.linspace(0.0, self.length, panels + 1)

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return the modes, or a derivative."""
        return self.modes.values(positions, derivative)


@dataclass(frozen=True, eq=False)
class LineShapes:
    """Sets of functions on 0..span, one after the other.

    Attributes
    ----------
    span
        The line's end: a length [m], or 1.
    sets
        The sets; a `RigidSet` first where there is a clamp.
    offset
        Place of the line's start as the power x^p of an integral counts it; the functions themselves do not move.
    row, gauss_values
        Values (size,) at a place, and (size, 16) at the Gauss points between two places, or a derivative; the last ones are kept.
    """

    span: float
    sets: tuple[FunctionSet, ...]
    offset: float = 0.0
    breaks: Array = field(init=False)
    quadrature_points: ClassVar[int] = GAUSS_POINTS
    row: Callable[..., Array] = field(init=False, repr=False)
    gauss_values: Callable[[float, float, int], Array] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        # Several matrices of one depth need the same values.
        object.__setattr__(self, "row", lru_cache(KEPT)(self._row))
        object.__setattr__(self, "gauss_values", lru_cache(KEPT)(self._gauss_values))
        breaks = np.unique(np.concatenate([[0.0, self.span], *(part.breaks for part in self.sets)]))
        object.__setattr__(self, "breaks", _without_slivers(breaks[(breaks >= 0) & (breaks <= self.span)]))

    def __reduce__(self) -> tuple[type[LineShapes], tuple[float, tuple[FunctionSet, ...], float]]:
        """Return how they are made again: values that are kept stay behind."""
        return LineShapes, (self.span, self.sets, self.offset)

    @property
    def size(self) -> int:
        """Number of functions."""
        return sum(part.count for part in self.sets)

    @property
    def half_bandwidth(self) -> int:
        """Half-bandwidth of a full matrix."""
        return self.size - 1

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return all functions (size, n), or a derivative, at places (n,)."""
        places = np.asarray(positions, dtype=float)
        return np.concatenate([part.values(places, derivative) for part in self.sets])

    def _row(self, position: float, derivative: int = 0) -> Array:
        """Return the values (size,), or a derivative, at one place."""
        return _unwritable(self.values(np.array([position]), derivative)[:, 0])

    def _gauss_values(self, start: float, end: float, derivative: int) -> Array:
        """Return all functions (size, points), or a derivative, at the Gauss points between two places."""
        points, _ = gauss_rule(GAUSS_POINTS)
        return _unwritable(self.values(start + (end - start) * points, derivative))

    @property
    def stride(self) -> int:
        """No elements: the number of functions."""
        return self.size

    def rows(self, positions: Array, derivative: int = 0) -> tuple[NDArray[np.int64], Array]:
        """Return rows at many places: first coordinates (T,), all 0, and values (T, size)."""
        return np.zeros(len(positions), dtype=np.int64), np.ascontiguousarray(self.values(positions, derivative).T)

    def weighted_sum(self, positions: Array, weights: Array, derivative: int = 0) -> Array:
        """Return the sum over places of weight times function (size,)."""
        return self.values(positions, derivative) @ weights

    def evaluate(self, coordinates: Array, positions: Array, derivative: int = 0) -> Array:
        """Return values (..., places) of functions with coordinates (..., size), or of a derivative."""
        return np.asarray(coordinates @ self.values(positions, derivative), dtype=float)

    def interval_integrals(self, kind: Kind, power: int = 0) -> GaussIntegrals:
        """Return the integrals of a product of functions."""
        return GaussIntegrals(self, kind, power)

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of deflection + angle x."""
        coordinates = np.zeros(self.size)
        coordinates[:2] = deflection, angle
        return coordinates

    def polynomials(self) -> PiecewisePolynomials:
        """Return the functions as polynomials on pieces, right to about 1e-13."""
        return self._polynomials

    @cached_property
    def _polynomials(self) -> PiecewisePolynomials:
        return fitted_polynomials(self.values, self.breaks)


@dataclass(frozen=True, eq=False)
class GaussIntegrals:
    """Integrals of one product of functions over any interval: whole panels kept, parts of panels by Gauss's rule.

    Attributes
    ----------
    shapes, kind, power
        As in `fem_needle.shapes.IntervalIntegrals`.
    """

    shapes: LineShapes
    kind: Kind
    power: int = 0

    @cached_property
    def panels(self) -> Array:
        """Matrices of the panels between breaks (panels, size, size)."""
        breaks = self.shapes.breaks
        return np.stack([self._part(start, end) for start, end in pairwise(breaks.tolist())])

    @cached_property
    def band(self) -> Array:
        """The integrals over the whole line, band storage."""
        return banded.from_dense(self.panels.sum(axis=0))

    def add(self, start: float, end: float, factor: float, target: Array) -> None:
        """Add ``factor`` times the integral from ``start`` to ``end`` to a full band matrix, in place."""
        target += banded.from_dense(factor * self.between(start, end))

    def between(self, start: float, end: float) -> Array:
        """Return the integral (size, size) from ``start`` to ``end``."""
        breaks = self.shapes.breaks
        first, last = np.searchsorted(breaks, start, side="left"), np.searchsorted(breaks, end, side="right") - 1
        if last < first:
            return self._part(start, end)
        result = self.panels[first:last].sum(axis=0)
        if breaks[first] > start:
            result = result + self._part(start, float(breaks[first]))
        if end > breaks[last]:
            result = result + self._part(float(breaks[last]), end)
        return result

    @property
    def _exponent(self) -> int:
        return self.power * {"drag": 1, "slip": 2}.get(self.kind, 0)

    def _part(self, start: float, end: float) -> Array:
        points, weights = gauss_rule(GAUSS_POINTS)
        values = self.shapes.gauss_values
        left, right = (values(start, end, order) for order in _ORDERS[self.kind])
        weights = weights * (end - start)
        if self._exponent:
            weights = weights * (start + (end - start) * points + self.shapes.offset) ** self._exponent
        return np.asarray((left * weights) @ right.T, dtype=float)


def _unwritable(values: Array) -> Array:
    values.flags.writeable = False
    return values


def _without_slivers(breaks: Array) -> Array:
    """Return the breaks without those that rounding has doubled."""
    kept = np.concatenate([[True], np.diff(breaks) > 1e-12 * breaks[-1]])
    kept[-1] = True
    return breaks[kept]


def joined(span: float, sets: Sequence[FunctionSet]) -> LineShapes:
    """Return the clamp's motion and sets of functions as shapes on 0..span."""
    return LineShapes(span, (RigidSet(), *sets))
