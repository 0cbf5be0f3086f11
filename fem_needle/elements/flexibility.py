"""A beam carried from element to element by its flexibility: the static solver that keeps its digits on fine meshes.

The stiffness of an element, 12 EI / h^3, subtracts deflections that agree in all but their last digits: forces, and with them the
tip, lose a factor of (l / h)^3 and more. Here what an element transmits stays an unknown beside the nodes' deflections,

    rotation      angle_2 - angle_1             = h / EI M + h^2 / (2 EI) V
    deflection    w_2 - w_1 - h angle_1         = h^2 / (2 EI) M + h^3 / (3 EI) V
    balance       what elements and tissue exert on a node = its load

with M and V the moment [N m] and shear force [N] at the element's second node. Nothing is divided by h, so that an error of one
rounding per element stays one of the answer. The bubble bends no element's ends and keeps its own stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.elements.mesh import LineMesh
from fem_needle.elements.reference import BUBBLE_ENERGY
from fem_needle.gauss import gauss_rule

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CURVATURE_POINTS = 3  # exact for the square of a quartic's curvature
_HALF_BANDWIDTH = 6  # deflection of one node to the slope of the next


@dataclass(frozen=True, eq=False)
class FlexibleMesh:
    """The equations of a beam of any stiffness in terms of what its elements transmit.

    Attributes
    ----------
    mesh
        The mesh.
    """

    mesh: LineMesh

    def stiffened(self, bending_stiffness: float) -> FlexibleBeam:
        """Return the beam with a bending stiffness, EI over the cube of the length of the mesh's unit."""
        return FlexibleBeam(self, bending_stiffness)

    @cached_property
    def length(self) -> float:
        """Length of the mesh, the unit in which the equations are scaled."""
        return float(self.mesh.nodes[-1] - self.mesh.nodes[0])

    @cached_property
    def places(self) -> Integers:
        """Where the coordinates stand among the unknowns: deflection, slope, V, M (and bubble) of each element."""
        stride = self.mesh.stride
        nodal = np.arange(self.mesh.elements + 1)[:, None] * (stride + 2)
        inner = np.arange(4, stride + 2)
        return np.concatenate([(nodal + np.array([0, 1, *inner]))[:-1].ravel(), nodal[-1] + np.arange(2)])

    @cached_property
    def scales(self) -> Array:
        """Coordinates over unknowns: 1 for deflections, 1 / length for slopes, and for bubbles what makes their stiffness one."""
        result = np.ones(self.mesh.size)
        result[1 :: self.mesh.stride] = 1.0 / self.length
        if self.mesh.degree == 4:
            result[2 :: self.mesh.stride] = (self.mesh.lengths / self.length) ** 1.5
        return result

    @cached_property
    def equations(self) -> Array:
        """The scaled equations without tissue, band storage."""
        count, block = self.mesh.elements, self.mesh.stride + 2
        size = self.mesh.lengths / self.length
        band = banded.zeros(block * count + 2, _HALF_BANDWIDTH)
        ones = np.ones(count)
        # Each pair of unknowns once: what the row's equation takes of it, the column's takes too.
        couplings = [
            (0, 2, -ones), (1, 2, -size), (1, 3, -ones), (block, 2, ones), (block + 1, 3, ones),
            (2, 3, -(size**2) / 2),
        ]  # fmt: skip
        for row, column, values in couplings:
            _put(band, row, column, block, values)
            _put(band, column, row, block, values)
        _put(band, 2, 2, block, -(size**3) / 3)
        _put(band, 3, 3, block, -size)
        if self.mesh.degree == 4:
            _put(band, 4, 4, block, BUBBLE_ENERGY * ones)
        return band

    def with_tissue(self, tissue: Array, unit: float) -> Array:
        """Return the scaled equations with a tissue matrix, in a unit of stiffness [N/m]."""
        band, middle = self.equations.copy(order="F"), banded.half_bandwidth(tissue)
        size = self.mesh.size
        for offset in range(-middle, middle + 1):
            columns = np.arange(max(0, -offset), size - max(0, offset))
            rows = columns + offset
            values = tissue[middle + offset, columns] * self.scales[rows] * self.scales[columns]
            at, column = self.places[rows] - self.places[columns], self.places[columns]
            used = values != 0.0  # outside an element's block tissue is zero, and the band has no place for it
            band[(_HALF_BANDWIDTH + at)[used], column[used]] += values[used] / unit
        return band


@dataclass(frozen=True, eq=False)
class FlexibleBeam:
    """A beam on a mesh (`fem_needle.plant.FlexibleBeam`).

    Attributes
    ----------
    equations
        Those of its mesh.
    bending_stiffness
        EI, over the cube of the length of the mesh's unit.
    """

    equations: FlexibleMesh
    bending_stiffness: float

    @property
    def unit(self) -> float:
        """The stiffness in which the equations are scaled, EI / length^3 [N/m]."""
        return self.bending_stiffness / self.equations.length**3

    def factorize(self, tissue: Array, clamped: int) -> FlexibleFactorization:
        """Factor bending plus a tissue matrix (band storage), the first ``clamped`` coordinates held."""
        return FlexibleFactorization(self, tissue, clamped)

    def bending_forms(self, columns: Array) -> Array:
        """Return EI integral w''^2 (m,) of the functions with coordinates (size, m).

        From curvatures, which lose n^2 roundings on n elements where q.K q loses n^4.
        """
        mesh, (points, weights) = self.equations.mesh, gauss_rule(CURVATURE_POINTS)
        rows = mesh.stride * np.arange(mesh.elements)[:, None] + np.arange(mesh.reference.count)
        bent = np.matmul(mesh.reference.unit_shapes(points, 2).T, columns[rows] * mesh.scales[:, :, None])
        shares = self.bending_stiffness / mesh.lengths[:, None] ** 3 * weights
        return np.asarray(np.einsum("eg,egm->m", shares, bent**2), dtype=float)


class FlexibleFactorization:
    """LU factors of the equations with partial pivoting (LAPACK ``dgbtrf``).

    Raises
    ------
    SingularMatrixError
        If a pivot is zero or the matrix is not finite.
    """

    def __init__(self, beam: FlexibleBeam, tissue: Array, clamped: int) -> None:
        self._beam = beam
        self._clamped = clamped
        self._equations = beam.equations.with_tissue(tissue, beam.unit)
        self._factorization = banded.Factorization(banded.trailing(self._equations, clamped))

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side ``(n,)`` or several ``(n, m)``."""
        return self.solve_supported(right)[0]

    def solve_supported(self, right: Array) -> tuple[Array, Array]:
        """Solve, and return also what the held coordinates' equations take ``(clamped,)`` or ``(clamped, m)``."""
        beam, held, unit = self._beam.equations, self._clamped, self._beam.unit
        single = right.ndim == 1
        columns = right[:, None] if single else right
        scaled = np.zeros((self._equations.shape[1], columns.shape[1]))
        scaled[beam.places[held:]] = columns * beam.scales[held:, None] / unit
        found = np.zeros_like(scaled)
        found[held:] = self._factorization.solve(scaled[held:])
        answers = found[beam.places] * beam.scales[:, None]
        reached = banded.leading_rows(self._equations, held)
        support = reached @ found[: reached.shape[1]] * (unit / beam.scales[:held, None])
        return (answers[held:, 0], support[:, 0]) if single else (answers[held:], support)


def _put(band: Array, row: int, column: int, block: int, values: Array) -> None:
    """Write one entry of every element's block."""
    stop = column + block * (len(values) - 1) + 1
    band[_HALF_BANDWIDTH + row - column, column:stop:block] = values
