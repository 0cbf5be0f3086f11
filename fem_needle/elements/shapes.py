"""The shapes of a line mesh, as a beam needs them."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.elements.integrals import IntervalIntegrals, interval_integrals
from fem_needle.elements.mesh import LineMesh
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
