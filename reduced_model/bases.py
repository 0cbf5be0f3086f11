"""Bases for the Galerkin projection of finite elements: columns of coordinates, which may move with the depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh

from fem_needle import FiniteElementNeedle, Trajectory, banded
from fem_needle.elements.shapes import ElementShapes
from fem_needle.errors import SceneError
from fem_needle.gauss import gauss_rule
from reduced_model.modes import ClampedFreeModes

Array = NDArray[np.float64]

INTERPOLATION_POINTS = 8  # of the bubble's share of a smooth function


class Basis(Protocol):
    """Columns (plant size, count) of finite-element coordinates, zero at the clamp, and their derivatives by depth."""

    @property
    def count(self) -> int:
        """Number of columns."""

    @property
    def moves(self) -> bool:
        """Whether the columns change with the depth."""

    def columns(self, depth: float | Array, derivative: int = 0) -> Array:
        """Return the columns at a depth [m], or their first or second derivative by it; shape (plant size, count).

        Where they move, depths (T,) may be many: shape (T, plant size, count).
        """


@dataclass(frozen=True, eq=False)
class FixedBasis:
    """Columns that stay the same.

    Attributes
    ----------
    matrix
        Shape (plant size, count); rows of the clamp are zero.
    """

    matrix: Array
    moves: bool = False

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.matrix.shape[1]

    def columns(self, depth: float | Array, derivative: int = 0) -> Array:
        """Return the matrix, or zeros."""
        return self.matrix if derivative == 0 else np.zeros_like(self.matrix)


@dataclass(frozen=True, eq=False)
class GrownModes:
    """Clamped-free modes of the full length on the stretched elements of an ``entry`` needle: phi_i(z xi)."""

    shapes: ElementShapes
    modes: ClampedFreeModes
    moves: bool = True

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.modes.count

    def columns(self, depth: float | Array, derivative: int = 0) -> Array:
        """Return the interpolation of d^n/dz^n phi_i(z xi) = xi^n phi_i^(n)(z xi)."""
        depths = np.reshape(np.asarray(depth, dtype=float), (-1, 1))

        def modes(places: Array, order: int) -> Array:
            """Return the modes at places (T, n), shape (count, T, n)."""
            return self.modes.values(places.ravel(), order).reshape(-1, *places.shape)

        def power(xi: Array, lost: int) -> Array:
            """Return d^lost/dxi^lost of xi^derivative."""
            factor = np.prod(np.arange(derivative - lost + 1, derivative + 1)) if lost else 1.0
            return factor * xi ** (derivative - lost) if derivative >= lost else np.zeros_like(xi)

        def value(xi: Array, order: int) -> Array:
            found = power(xi, 0) * depths**order * modes(depths * xi, derivative + order)
            if order and derivative:
                found = found + order * power(xi, 1) * depths ** (order - 1) * modes(depths * xi, derivative + order - 1)
            if order == 2 and derivative == 2:
                found = found + power(xi, 2) * modes(depths * xi, derivative)
            return np.asarray(found, dtype=float).reshape(-1, len(xi))

        found = interpolated(self.shapes, value).reshape(self.shapes.size, self.count, -1)
        return np.moveaxis(found, 2, 0) if np.ndim(depth) else found[:, :, 0]


@dataclass(frozen=True, eq=False)
class LineModes:
    """Clamped-free modes of the line that the elements cover: the whole needle, or the inserted length."""

    shapes: ElementShapes
    modes: ClampedFreeModes
    moves: bool = False

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.modes.count

    @cached_property
    def _matrix(self) -> Array:
        return interpolated(self.shapes, self.modes.values)

    def columns(self, depth: float | Array, derivative: int = 0) -> Array:
        """Return the interpolation of phi_i, or zeros."""
        return self._matrix if derivative == 0 else np.zeros_like(self._matrix)


def mode_basis(needle: FiniteElementNeedle, modes: int, basis: str = "full-length") -> Basis:
    """Return the clamped-free modes that `AssumedModeNeedle` takes, on the elements of a needle.

    Parameters
    ----------
    needle
        The elements that the modes are put on.
    modes
        How many.
    basis
        Modes of the ``"full-length"`` or of the ``"inserted-length"``.
    """
    if basis not in {"full-length", "inserted-length"}:
        raise SceneError(f"basis: got {basis!r}; allowed 'full-length', 'inserted-length'")
    if needle.is_entry and basis == "full-length":
        return GrownModes(needle.mesh, ClampedFreeModes(needle.scene.needle.length, modes))
    return LineModes(needle.mesh, ClampedFreeModes(float(needle.mesh.nodes[-1]), modes))


def natural_mode_basis(needle: FiniteElementNeedle, modes: int, depth: float, time: float = 0.0) -> FixedBasis:
    """Return the lowest natural modes of the needle in its tissue, held at a depth [m], guides left out.

    Parameters
    ----------
    needle
        The elements that the modes are put on.
    modes
        How many.
    depth
        [m].
    time
        Of the stiffness factor [s].
    """
    operators, clamped = needle.operators(depth, time), needle.prescribed
    stiffness, mass = (
        banded.to_dense(banded.trailing(band, clamped)) for band in (operators.stiffness, operators.mass)
    )
    _, vectors = eigh(stiffness, mass, subset_by_index=[0, modes - 1])
    return FixedBasis(np.vstack([np.zeros((clamped, modes)), vectors]))


def snapshot_basis(needle: FiniteElementNeedle, run: Trajectory, modes: int, depth: float) -> FixedBasis:
    """Return the proper orthogonal modes of a run: they catch the most bending energy (at one depth) of its shapes.

    Parameters
    ----------
    needle
        The elements that the modes are put on.
    run
        A run of this needle.
    modes
        How many.
    depth
        Whose bending stiffness weighs the shapes [m].

    Raises
    ------
    SceneError
        If the run is of another plant, or has fewer independent shapes.
    """
    clamped = needle.prescribed
    if run.coordinates.shape[1] != needle.size:
        raise SceneError(f"run: has {run.coordinates.shape[1]} coordinates (allowed {needle.size}, those of the needle)")
    shapes = run.coordinates[:, clamped:]
    bending = banded.to_dense(banded.trailing(needle.operators(depth, 0.0).bending, clamped))
    factor = np.linalg.cholesky(bending)
    left, values, _ = np.linalg.svd(factor.T @ shapes.T, full_matrices=False)
    found = int(np.sum(values > 1e-12 * values[0]))
    if modes > found:
        raise SceneError(f"modes: the run has fewer independent shapes (got {modes}; allowed 1 to {found})")
    columns = cho_solve(cho_factor(bending), factor @ left[:, :modes])
    return FixedBasis(np.vstack([np.zeros((clamped, modes)), columns]))


def interpolated(shapes: ElementShapes, functions: Callable[[Array, int], Array]) -> Array:
    """Return the coordinates (size, count) of smooth functions: values and slopes at the nodes, bubbles by bending energy.

    Parameters
    ----------
    shapes
        The elements.
    functions
        Called with places (n,) and the order of a derivative, 0 to 2; returns (count, n).
    """
    nodes, lengths, stride = shapes.nodes, shapes.lengths, shapes.reference.stride
    values = functions(nodes, 0)
    result = np.zeros((shapes.size, len(values)))
    result[::stride], result[1::stride][: len(nodes)] = values.T, functions(nodes, 1).T
    if shapes.degree == 4:
        points, weights = gauss_rule(INTERPOLATION_POINTS)
        places = (nodes[:-1, None] + lengths[:, None] * points).ravel()
        curvatures = functions(places, 2).reshape(len(values), len(lengths), len(points))
        bubble = shapes.reference.unit_shapes(points, 2)[2]
        energy = float(weights @ bubble**2)
        result[2::stride] = ((curvatures * (weights * bubble)).sum(axis=2) * lengths**2 / energy).T
    return result
