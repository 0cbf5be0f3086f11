"""Galerkin projection of a finite-element needle onto a few columns: a reduced model of any basis, a plant like any other.

With q = V(z) a the velocity of the elements is q' = V a' + v V_z a, and every operator follows by insertion (docs/theory.md):

    M_a = V'MV,   S_a = V'(M V_z + S V),   R_a = V_z'M V_z + V_z'S V + (V_z'S V)' + V'R V,   K_a = V'KV,   G_a = V'GV

Here ' of a matrix is its transpose and V_z = dV/dz.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle import FiniteElementNeedle, banded
from fem_needle.beam_needle import PolynomialNeedle
from fem_needle.path import CutPath
from fem_needle.piecewise import PiecewisePolynomials
from fem_needle.plant import Operators, Points, RestTerms
from fem_needle.row_blocks import row_blocks
from reduced_model.bases import Basis
from reduced_model.needle import INDEPENDENT_MODES, STABLE_SPECTRAL_RADIUS, resolved_directions

Array = NDArray[np.float64]


class ProjectedNeedle(PolynomialNeedle):
    """A needle on the columns of a basis, projected from finite elements.

    Parameters
    ----------
    needle
        The finite elements.
    basis
        Columns beside the clamp's own motion.

    Notes
    -----
    Coordinates are the clamp's deflection [m] and slope, and the amplitudes of the columns. What points bend inside an element
    (the flexibility of the finite elements) is left out: the shapes are the columns and nothing else.
    """

    axial_force_acts = True

    def __init__(self, needle: FiniteElementNeedle, basis: Basis) -> None:
        self.needle = needle
        self.basis = basis
        self.scene = needle.scene
        self.size = 2 + basis.count
        self.prescribed = needle.prescribed
        self.smallest_depth = needle.smallest_depth
        self.deflection_at_one = self.straight(1.0, 0.0)
        parallel = basis.moves and basis.count > INDEPENDENT_MODES
        guided = any(guide.stiffness == "rigid" for guide in needle.scene.support.guides)
        self.largest_spectral_radius = STABLE_SPECTRAL_RADIUS if parallel or guided else 1.0
        self.is_polynomial, self.shapes = not basis.moves, self
        self.frame, self.foundation, self.turns = needle.frame, needle.foundation, needle.turns
        self.warnings = needle.warnings
        self._rigid = np.column_stack([needle.straight(1.0, 0.0), needle.straight(0.0, 1.0)])

    def reconstruct(self, coordinates: Array, depth: float) -> Array:
        """Return the finite-element coordinates V a at a depth [m]."""
        return np.asarray(self._columns(depth) @ coordinates, dtype=float)

    def _reconstructed(self, coordinates: Array, depths: Array) -> Array:
        """Return the same of many states: (T, 2 + count) and (T,) to (T, n)."""
        clamp, amplitudes = coordinates[:, :2] @ self._rigid.T, coordinates[:, 2:]
        if not self.basis.moves:
            return np.asarray(clamp + amplitudes @ self.basis.columns(0.0).T, dtype=float)
        return clamp + np.einsum("tnc,tc->tn", self.basis.columns(depths), amplitudes)

    def operators(self, depth: float, time: float) -> Operators:
        """Return the projected matrices."""
        full, columns = self.needle.operators(depth, time), self._columns(depth)
        moved = self._columns(depth, 1) if self.basis.moves else None
        bending, mass = _projected(columns, full.bending), _projected(columns, full.mass)
        subspace = None
        if self.basis.moves and self.basis.count > INDEPENDENT_MODES:
            subspace = resolved_directions(bending[2:, 2:], mass[2:, 2:])
        convection, centrifugal = _moving((full.mass, full.convection, full.centrifugal), columns, moved)
        drag, slip = _moving((full.damping, full.drag, full.slip), columns, moved)
        return Operators(
            mass=banded.from_dense(mass),
            bending=banded.from_dense(bending),
            tissue=banded.from_dense(_projected(columns, full.tissue)),
            convection=convection,
            centrifugal=centrifugal,
            damping=None if full.damping is None else banded.from_dense(_projected(columns, full.damping)),
            drag=drag,
            slip=slip,
            tissue_rate=None if full.tissue_rate is None else banded.from_dense(_projected(columns, full.tissue_rate)),
            clamped=self.prescribed,
            subspace=subspace,
        )

    def points(self, depth: float) -> Points:
        """Return rows of guides, lateral loads and tip."""
        points, columns = self.needle.points(depth), self._columns(depth)
        rates = points.row_rates @ columns
        if self.basis.moves:
            rates = rates + points.rows @ self._columns(depth, 1)
        none = np.zeros_like(points.flexibility)
        return Points(points.rows @ columns, rates, none, none, points.guides, points.guide_compliance)

    def clamp_reactions(self, residual: Array, depth: float) -> tuple[float, float]:
        """Return force [N] and moment [N m] of the clamp."""
        return self.needle.clamp_reactions(residual, depth)

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of a straight needle."""
        coordinates = np.zeros(self.size)
        coordinates[:2] = deflection, angle
        return coordinates

    def stiffness_rate_product(self, coordinates: Array, depth: float, time: float) -> Array:
        """Return d(K + m G)/dz a."""
        columns = self._columns(depth)
        state = columns @ coordinates
        result = columns.T @ self.needle.stiffness_rate_product(state, depth, time)
        if self.basis.moves:
            stiffness, moved = self.needle.operators(depth, time).stiffness, self._columns(depth, 1)
            result = result + moved.T @ banded.multiply(stiffness, state)
            result = result + columns.T @ banded.multiply(stiffness, moved @ coordinates)
        return np.asarray(result, dtype=float)

    def rest_terms(self, path: CutPath, depth: float, lower: float, upper: float) -> RestTerms:
        """Return what the cut path adds to the tissue's energy."""
        full, columns = self.needle.rest_terms(path, depth, lower, upper), self._columns(depth)
        rate = columns.T @ full.load_rate
        if self.basis.moves:
            rate = rate + self._columns(depth, 1).T @ full.load
        return RestTerms(columns.T @ full.load, rate, full.constant, full.constant_rate)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N]: that of the elements, and what the columns' own motion adds."""
        columns, moved = self._columns(depth), self._columns(depth, 1)
        state, drift = columns @ coordinates, moved @ coordinates
        rates = columns @ velocities + speed * drift
        rate = self.needle.kinetic_rate(rates, state, depth, speed)
        if not self.basis.moves:
            return rate
        full = self.needle.operators(depth, 0.0)
        momentum, force = banded.multiply(full.mass, rates), np.zeros_like(state)
        if full.convection is not None and full.centrifugal is not None:
            momentum = momentum + speed * banded.multiply(full.convection, state)
            force = speed * banded.multiply_transposed(full.convection, rates)
            force = force + speed**2 * banded.multiply(full.centrifugal, state)
        change = moved @ velocities + speed * (self._columns(depth, 2) @ coordinates)
        return rate + float(momentum @ change + force @ drift)

    def deflection(
        self, coordinates: Array, forces: Array, depth: float | Array, arc_length: Array, derivative: int = 0
    ) -> Array:
        """Return w [m] or a derivative of it by arc length at stations from the hub (0) to the tip (l), of one state or many."""
        if np.ndim(depth):
            return self._deflections(coordinates, forces, np.asarray(depth, dtype=float), arc_length, derivative)
        if depth < self.smallest_depth:
            return np.zeros(np.shape(arc_length))
        state = self.reconstruct(coordinates, float(depth))
        return self.needle.deflection(state, np.zeros_like(forces), depth, arc_length, derivative)

    def _deflections(self, coordinates: Array, forces: Array, depths: Array, arc_length: Array, derivative: int) -> Array:
        """Return the same of many states: (T, 2 + count) and (T,) to (T, stations)."""
        result = np.zeros((len(depths), np.size(arc_length)))
        for block in row_blocks(len(depths), self.needle.size * self.size):
            bent = block.start + np.flatnonzero(depths[block] >= self.smallest_depth)
            state = self._reconstructed(coordinates[bent], depths[bent])
            result[bent] = self.needle.deflection(state, np.zeros_like(forces[bent]), depths[bent], arc_length, derivative)
        return result

    def describe(self) -> dict[str, int | float | str]:
        """Return kind, number of columns and of elements."""
        return {"model": "projected", "modes": self.basis.count, "elements": self.needle.mesh.elements}

    def polynomials(self) -> PiecewisePolynomials | None:
        """Return 1, x and the columns as polynomials on the elements; None where the columns move with the depth."""
        return None if self.basis.moves else self._polynomials

    @cached_property
    def _polynomials(self) -> PiecewisePolynomials:
        elements = self.needle.mesh.polynomials()
        pieces, count, _ = elements.coefficients.shape
        columns = self._columns(self.scene.needle.length)
        local = columns[elements.stride * np.arange(pieces)[:, None] + np.arange(count)]
        coefficients = np.einsum("pik,pij->pjk", elements.coefficients, local)
        coefficients[:, :2] = 0.0  # exactly what they are, without rounding
        coefficients[:, 0, 0] = 1.0
        coefficients[:, 1, 0], coefficients[:, 1, 1] = elements.nodes[:-1], self.needle.mesh.lengths
        return PiecewisePolynomials(elements.nodes, coefficients, 0)

    def _columns(self, depth: float, derivative: int = 0) -> Array:
        rigid = self._rigid if derivative == 0 else np.zeros_like(self._rigid)
        return np.hstack([rigid, self.basis.columns(depth, derivative)])


def project(needle: FiniteElementNeedle, basis: Basis) -> ProjectedNeedle:
    """Return the Galerkin projection of a finite-element needle onto a basis.

    Parameters
    ----------
    needle
        The finite elements.
    basis
        `mode_basis`, `natural_mode_basis`, `snapshot_basis`, or a `FixedBasis` of one's own columns.
    """
    return ProjectedNeedle(needle, basis)


def _projected(left: Array, band: Array, right: Array | None = None) -> Array:
    """Return left' A right, with the same columns on both sides by default."""
    columns = left if right is None else right
    return np.asarray(left.T @ np.column_stack([banded.multiply(band, column) for column in columns.T]), dtype=float)


def _moving(
    form: tuple[Array | None, Array | None, Array | None], columns: Array, moved: Array | None
) -> tuple[Array | None, Array | None]:
    """Return B_a and C_a, band storage, of a form 1/2 q'.A q' + v q'.B q + 1/2 v^2 q.C q: of M, S, R or of C, D, E.

    B_a = V'(A V_z + B V) and C_a = V_z'A V_z + V_z'B V + (V_z'B V)' + V'C V; None where nothing moves.
    """
    still, mixed, moving = form
    if still is None or (moved is None and mixed is None):
        return None, None
    first, second = np.zeros((2, columns.shape[1], columns.shape[1]))
    if mixed is not None and moving is not None:
        first, second = _projected(columns, mixed), _projected(columns, moving)
    if moved is not None:
        first, second = first + _projected(columns, still, moved), second + _projected(moved, still)
        if mixed is not None:
            crossed = _projected(moved, mixed, columns)
            second = second + crossed + crossed.T
    return banded.from_dense(first), banded.from_dense(second)
