"""The shapes of a line mesh, as a beam needs them."""

from __future__ import annotations

from functools import cached_property
from math import factorial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.elements.integrals import IntervalIntegrals, interval_integrals
from fem_needle.elements.mesh import LineMesh
from fem_needle.piecewise import PiecewisePolynomials
from fem_needle.shapes import Kind

Array = NDArray[np.float64]


class ElementShapes(LineMesh):
    """Piecewise polynomials with continuous slope on a line mesh (`fem_needle.shapes.Shapes`)."""

    quadrature_points: ClassVar[int] = 4  # exact for a cubic piece of a path times a quartic shape

    @property
    def breaks(self) -> Array:
        """The nodes."""
        return self.nodes

    def interval_integrals(self, kind: Kind, power: int = 0) -> IntervalIntegrals:
        """Return the integrals of a product of shapes."""
        return interval_integrals(self, kind, power)

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of deflection + angle x."""
        coordinates, stride = np.zeros(self.size), self.reference.stride
        coordinates[::stride] = deflection + angle * self.nodes
        coordinates[1::stride][: self.elements + 1] = angle
        return coordinates

    def polynomials(self) -> PiecewisePolynomials:
        """Return the shapes of every element as polynomials."""
        return self._polynomials

    @cached_property
    def _polynomials(self) -> PiecewisePolynomials:
        orders = range(self.degree + 1)
        unit = np.stack([self.reference.unit_shapes(0.0, order) / factorial(order) for order in orders], axis=-1)
        return PiecewisePolynomials(self.nodes, self.scales[:, :, None] * unit, self.stride)
