"""Exact integrals of products of shapes over any interval of a mesh: whole elements and the parts of cut ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.elements.mesh import LineMesh
from fem_needle.gauss import gauss_rule
from fem_needle.shapes import Kind

Array = NDArray[np.float64]

# psi_i psi_j, psi_i x psi_j' and x^2 psi_i' psi_j' have degree 10 at most: six points are exact, also on a part of an element.
_POINTS = 6


@dataclass(frozen=True, eq=False)
class IntervalIntegrals:
    """Integrals of one product of shapes, ready to be added over intervals of the mesh.

    ``mass``: psi_i psi_j; ``drag``: x^p psi_i psi_j'; ``slip``: x^(2 p) psi_i' psi_j'; ``bending``: psi_i'' psi_j''; p is 0 or 1.

    Attributes
    ----------
    mesh
        The mesh.
    kind
        Which product.
    power
        p, 0 or 1.
    local
        Element matrices (elements, m, m).
    band
        Their sum over the whole mesh, band storage.
    """

    mesh: LineMesh
    kind: Kind
    power: int
    local: Array
    band: Array

    def add(self, start: float, end: float, factor: float, target: Array) -> None:
        """Add ``factor`` times the integral from ``start`` to ``end`` to a band matrix, in place.

        Elements inside the interval are added whole; an element that an end cuts contributes exactly its part.
        """
        nodes, last = self.mesh.nodes, self.mesh.elements
        first_whole = int(np.searchsorted(nodes, start, side="left"))
        end_whole = int(np.searchsorted(nodes, end, side="right")) - 1
        if end_whole < first_whole:  # within one element
            self._add_part(end_whole, start, end, factor, target)
            return
        if end_whole > first_whole:
            self._add_whole(first_whole, end_whole, factor, target)
        if first_whole > 0 and nodes[first_whole] > start:
            self._add_part(first_whole - 1, start, nodes[first_whole], factor, target)
        if end_whole < last and end > nodes[end_whole]:
            self._add_part(end_whole, nodes[end_whole], end, factor, target)

    def _add_whole(self, first: int, end: int, factor: float, target: Array) -> None:
        stride, count = self.mesh.reference.stride, self.mesh.reference.count
        inner = slice(stride * first + 2, stride * end)
        target[:, inner] += factor * self.band[:, inner]
        # The coordinates of the two end nodes also belong to elements outside: take the one element's part.
        for element, columns in ((first, range(2)), (end - 1, range(count - 2, count))):
            for column in columns:
                top = count - 1 - column
                target[top : top + count, stride * element + column] += factor * self.local[element, :, column]

    def _add_part(self, element: int, start: float, end: float, factor: float, target: Array) -> None:
        length, node = self.mesh.lengths[element], self.mesh.nodes[element]
        points, weights = gauss_rule(_POINTS)
        position = start + (end - start) * points
        place = np.minimum(np.maximum((position - node) / length, 0.0), 1.0)
        shapes = self._factors(element, place, position)
        local = (shapes[0] * (weights * (end - start) * factor)) @ shapes[1].T
        banded.add_local(target, self.mesh.reference.stride * element, local)

    def _factors(self, element: int | NDArray[np.int64], place: Array, position: Array) -> tuple[Array, Array]:
        shapes = self.mesh.shapes_in
        if self.kind == "mass":
            values = shapes(element, place)
            return values, values
        if self.kind == "bending":
            curvatures = shapes(element, place, 2)
            return curvatures, curvatures
        slopes = shapes(element, place, 1)
        if self.power:
            slopes = slopes * position**self.power
        return (shapes(element, place) if self.kind == "drag" else slopes), slopes


def interval_integrals(mesh: LineMesh, kind: Kind, power: int = 0) -> IntervalIntegrals:
    """Scale the reference matrices to the mesh and assemble them."""
    local = _element_matrices(mesh, kind, power)
    return IntervalIntegrals(mesh, kind, power, local, banded.from_elements(local, mesh.reference.stride))


def _element_matrices(mesh: LineMesh, kind: Kind, power: int) -> Array:
    reference, lengths = mesh.reference, mesh.lengths[:, None, None]
    scale = mesh.scales
    scales = scale[:, :, None] * scale[:, None, :]
    if kind == "mass":
        return reference.mass * scales * lengths
    if kind == "bending":
        return reference.bending * scales / lengths**3
    starts = mesh.nodes[:-1, None, None]
    if kind == "drag":  # x = start + length * place
        moments = reference.drag[0] if power == 0 else starts * reference.drag[0] + lengths * reference.drag[1]
        return moments * scales
    moments = reference.slip[0] * np.ones_like(starts)
    if power == 1:
        moments = (
            starts**2 * reference.slip[0]
            + 2 * starts * lengths * reference.slip[1]
            + lengths**2 * reference.slip[2]
        )
    return moments * scales / lengths
