"""What a beam needs of the functions that its deflection is made of: finite elements, modes, or anything else on a line.

w = sum_i psi_i(x) q_i, with x a place on the line of the shapes (`frames` says where y lies on it). Matrices are in band storage.
"""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle.piecewise import PiecewisePolynomials

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Kind = Literal["mass", "drag", "slip", "bending"]


class IntervalIntegrals(Protocol):
    """Integrals of one product of shapes over any interval.

    ``mass``: psi_i psi_j; ``drag``: x^p psi_i psi_j'; ``slip``: x^(2 p) psi_i' psi_j'; ``bending``: psi_i'' psi_j''; p is 0 or 1.
    """

    @property
    def band(self) -> Array:
        """The integrals over the whole line, band storage."""

    def add(self, start: float, end: float, factor: float, target: Array) -> None:
        """Add ``factor`` times the integral from ``start`` to ``end`` to a band matrix, in place."""


class Shapes(Protocol):
    """Functions on a line."""

    @property
    def size(self) -> int:
        """Number of coordinates, those of the clamped end included."""

    @property
    def half_bandwidth(self) -> int:
        """Half-bandwidth of every matrix of products of shapes."""

    @property
    def breaks(self) -> Array:
        """Rising places between which `quadrature_points` Gauss points integrate a shape times a cubic."""

    @property
    def quadrature_points(self) -> int:
        """Number of Gauss points on each piece between breaks."""

    @property
    def stride(self) -> int:
        """Coordinates from one element's first to the next one's; of shapes without elements, any number."""

    def row(self, position: float, derivative: int = 0) -> Array:
        """Return the row (size,) that maps coordinates to the value, or a derivative, at a place."""

    def rows(self, positions: Array, derivative: int = 0) -> tuple[Integers, Array]:
        """Return the same at many places (T,): first coordinates (T,) and what differs from zero from there on (T, m)."""

    def weighted_sum(self, positions: Array, weights: Array, derivative: int = 0) -> Array:
        """Return the sum over places of weight times shape, or derivative of it, for every coordinate (size,)."""

    def evaluate(self, coordinates: Array, positions: Array, derivative: int = 0) -> Array:
        """Return values (..., places) of functions with coordinates (..., size), or of a derivative."""

    def interval_integrals(self, kind: Kind, power: int = 0) -> IntervalIntegrals:
        """Return the integrals of a product of shapes."""

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of deflection + angle x."""

    def polynomials(self) -> PiecewisePolynomials:
        """Return the shapes as polynomials on pieces, always the same object."""


def values_at(shapes: Shapes, coordinates: Array, rows: Integers, places: Array, derivative: int = 0) -> Array:
    """Return values (k,) of functions with coordinates (T, size), or of a derivative, each of a row and at a place of its own."""
    first, values = shapes.rows(places, derivative)
    acting = coordinates[rows[:, None], first[:, None] + np.arange(values.shape[1])]
    return np.asarray(np.einsum("kj,kj->k", values, acting), dtype=float)
