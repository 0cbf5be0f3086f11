"""A line mesh and the functions on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem_needle.elements.reference import ReferenceElement, reference_element

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LineMesh:
    """Nodes on a line and the coordinates that live on them.

    Attributes
    ----------
    nodes
        Rising positions, shape (elements + 1,): arc length [m] under hub support, depth fraction 0..1 under entry support.
    degree
        Polynomial degree of an element, 3 or 4.
    reference, lengths, scales
        Derived: the reference element, the elements' lengths and their factors from unit shapes to shapes.
    """

    nodes: Array
    degree: int = 4
    reference: ReferenceElement = field(init=False)
    lengths: Array = field(init=False)
    scales: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reference", reference_element(self.degree))
        object.__setattr__(self, "lengths", np.diff(self.nodes))
        object.__setattr__(self, "scales", self.reference.slope_scale(self.lengths).T.copy())

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.nodes) - 1

    @property
    def size(self) -> int:
        """Number of coordinates, those of the clamped end included."""
        return self.reference.stride * self.elements + 2

    @property
    def half_bandwidth(self) -> int:
        """Half-bandwidth of every matrix on the mesh."""
        return self.reference.count - 1

    def locate(self, position: float) -> tuple[int, float]:
        """Return the element that holds a position and the place 0..1 within it; ends are clipped."""
        element = int(np.searchsorted(self.nodes, position, side="right")) - 1
        element = min(max(element, 0), self.elements - 1)
        place = (position - self.nodes[element]) / self.lengths[element]
        return element, min(max(float(place), 0.0), 1.0)

    def locate_all(self, positions: Array) -> tuple[NDArray[np.int64], Array]:
        """Return elements and places of many positions (T,)."""
        elements = np.clip(np.searchsorted(self.nodes, positions, side="right") - 1, 0, self.elements - 1)
        return elements, np.clip((positions - self.nodes[elements]) / self.lengths[elements], 0.0, 1.0)

    def row(self, position: float, derivative: int = 0) -> Array:
        """Return the row (size,) that maps coordinates to the value, or a derivative, at a position."""
        element, place = self.locate(position)
        row = np.zeros(self.size)
        first = self.reference.stride * element
        row[first : first + self.reference.count] = self.shapes_in(element, place, derivative)
        return row

    @property
    def stride(self) -> int:
        """Coordinates from one element's first to the next one's."""
        return self.reference.stride

    def rows(self, positions: Array, derivative: int = 0) -> tuple[NDArray[np.int64], Array]:
        """Return rows at many places: first coordinates (T,) and the values of one element's shapes (T, m)."""
        columns, shapes = self._shapes_at(positions, derivative)
        return np.ascontiguousarray(columns[0]), np.ascontiguousarray(shapes.T)

    def shapes_in(self, element: int | NDArray[np.int64], place: Array | float, derivative: int = 0) -> Array:
        """Return the shapes (count, ...) of one element, or of as many as places have rows, or a derivative, at places 0..1."""
        values = self.reference.unit_shapes(place, derivative)
        scale = self.scales[element].T / self.lengths[element] ** derivative
        return values * scale.reshape(scale.shape + (1,) * (values.ndim - scale.ndim))

    def weighted_sum(self, positions: Array, weights: Array, derivative: int = 0) -> Array:
        """Return the sum over positions of weight times shape, or derivative of it, for every coordinate (size,)."""
        columns, shapes = self._shapes_at(positions, derivative)
        return np.asarray(np.bincount(columns.ravel(), (shapes * weights).ravel(), minlength=self.size), dtype=float)

    def evaluate(self, coordinates: Array, positions: Array, derivative: int = 0) -> Array:
        """Return values (..., positions) of functions with coordinates (..., size), or of a derivative."""
        columns, shapes = self._shapes_at(positions, derivative)
        return np.einsum("...ij,ij->...j", coordinates[..., columns], shapes)

    def _shapes_at(self, positions: Array, derivative: int) -> tuple[NDArray[np.int64], Array]:
        """Return the coordinates (count, positions) that act at each position, and their shapes there."""
        where, place = self.locate_all(positions)
        shapes = self.shapes_in(where, place, derivative)
        columns = self.reference.stride * where + np.arange(self.reference.count)[:, None]
        return np.asarray(columns, dtype=np.int64), shapes
