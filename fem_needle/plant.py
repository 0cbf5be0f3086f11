"""The protocol that every model of a needle meets: integrators, statics and studies know no mesh.

A plant is a linear system whose matrices move with the depth z(t). With coordinates q and v = dz/dt,

    kinetic energy    T = 1/2 q'.M q' + v q'.S q + 1/2 v^2 q.R q
    potential         U = 1/2 q.(K + m G) q - P.(N q) - 1/2 P.B P
    dissipation       c = q'.C q' + 2 v q'.D q + v^2 q.E q                (power lost in the tissue)

where P are the forces at points (guides, lateral loads, tip), N the rows that give the deflection there and B the flexibility of
the kink that the model's shapes miss inside an element. M, S, R, K, G, C, D, E, N, B depend on z; m(t) is the stiffness factor.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.path import CutPath
from fem_needle.scene import Scene

Array = NDArray[np.float64]

SMALLEST_COMPLIANCE = 1e-9  # of the needle's own: a guide's kink below it is taken as at a node


class StiffnessFactorization(Protocol):
    """Factors of the stiffness matrix of the coordinates that are not clamped."""

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side ``(n,)`` or several ``(n, m)``."""

    def solve_supported(self, right: Array) -> tuple[Array, Array]:
        """Solve, and return also what the clamped coordinates' equations take, ``(clamped,)`` or ``(clamped, m)``."""


class FlexibleBeam(Protocol):
    """The bending of a mesh in terms of what its elements transmit."""

    def factorize(self, tissue: Array, clamped: int) -> StiffnessFactorization:
        """Factor bending plus a tissue matrix (band storage), the first ``clamped`` coordinates held."""

    def bending_forms(self, columns: Array) -> Array:
        """Return q.K q (m,) of the bending alone for columns of coordinates (size, m)."""


@dataclass(frozen=True, eq=False)
class SupportedFactorization:
    """Factors of the free coordinates' matrix and the clamped coordinates' rows, in dense storage, of the whole one."""

    factors: banded.Factorization | banded.RestrictedFactorization
    clamped_rows: Array

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side ``(n,)`` or several ``(n, m)``."""
        return self.factors.solve(right)

    def solve_supported(self, right: Array) -> tuple[Array, Array]:
        """Solve, and return also what the clamped coordinates' equations take."""
        free, clamped = self.solve(right), len(self.clamped_rows)
        reached = self.clamped_rows[:, clamped:]
        return free, reached @ free[: reached.shape[1]]


@dataclass(frozen=True, eq=False)
class Operators:
    """The matrices of a plant at one depth and time, in band storage; None where a term is absent.

    Attributes
    ----------
    mass, convection, centrifugal
        M [kg], S [kg/m], R [kg/m^2] (times the coordinates' own units).
    bending, tissue
        K and m(t) G.
    damping, drag, slip
        C, D, E.
    tissue_rate
        dm/dt G, of a tissue that swells.
    clamped
        How many leading coordinates are the clamp's.
    subspace
        Directions (size - clamped, rank) of the free coordinates to which every solution is restricted, of a plant whose
        shapes are nearly dependent at this depth; None: all.
    positional_error, velocity_error
        X and Y: forces -X q - Y q' of a model with mistakes in it, which come from no energy and stand in no ledger.
    beam
        The bending K once more, in a form that keeps its digits on fine meshes; None of a model without elements.
    """

    mass: Array
    bending: Array
    tissue: Array
    convection: Array | None = None
    centrifugal: Array | None = None
    damping: Array | None = None
    drag: Array | None = None
    slip: Array | None = None
    tissue_rate: Array | None = None
    clamped: int = 0
    subspace: Array | None = None
    positional_error: Array | None = None
    velocity_error: Array | None = None
    beam: FlexibleBeam | None = None

    @cached_property
    def stiffness(self) -> Array:
        """Bending and tissue together."""
        return self.bending + self.tissue

    @cached_property
    def mass_factorization(self) -> banded.Factorization | banded.RestrictedFactorization:
        """Factors of the mass matrix of the coordinates that are not clamped."""
        return banded.factorize(banded.trailing(self.mass, self.clamped), self.subspace)

    @cached_property
    def stiffness_factorization(self) -> StiffnessFactorization:
        """Factors of the stiffness matrix of the coordinates that are not clamped."""
        if self.beam is not None:
            return self.beam.factorize(self.tissue, self.clamped)
        factors = banded.factorize(banded.trailing(self.stiffness, self.clamped), self.subspace)
        return SupportedFactorization(factors, banded.leading_rows(self.stiffness, self.clamped))


@dataclass(frozen=True, eq=False)
class RestTerms:
    """What a rest line r(y) adds to the tissue's energy: 1/2 sum k integral (w - r)^2 = 1/2 q.G q - q.H + c.

    Attributes
    ----------
    load, load_rate
        H = sum k integral r psi and dH/dz.
    constant, constant_rate
        c = 1/2 sum k integral r^2 [J] and dc/dz [N].
    """

    load: Array
    load_rate: Array
    constant: float
    constant_rate: float

    def __add__(self, other: RestTerms) -> RestTerms:
        """Add two parts of a rest line."""
        return RestTerms(
            self.load + other.load,
            self.load_rate + other.load_rate,
            self.constant + other.constant,
            self.constant_rate + other.constant_rate,
        )


def no_rest_terms(size: int) -> RestTerms:
    """Return the terms of no rest line at all."""
    return RestTerms(np.zeros(size), np.zeros(size), 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Points:
    """Where point forces act: guides first, then lateral loads, the tip last.

    Attributes
    ----------
    rows, row_rates
        N and dN/dz, shape (points, size).
    flexibility, flexibility_rate
        B and dB/dz, shape (points, points) [m/N] and [1/N].
    guides
        How many of the points are guides.
    guide_compliance
        1 / stiffness of each guide [m/N], 0 where it is rigid.
    """

    rows: Array
    row_rates: Array
    flexibility: Array
    flexibility_rate: Array
    guides: int
    guide_compliance: Array

    def deflections(self, coordinates: Array, forces: Array) -> Array:
        """Return the deflection at each point [m] under the forces (points,) [N]."""
        return self.rows @ coordinates + self.flexibility @ forces


class Plant(Protocol):
    """What integrators, statics and studies may ask of a model.

    Attributes
    ----------
    scene
        The scene that it models.
    size
        Number of coordinates.
    prescribed
        How many leading coordinates are prescribed: 2 of a clamped end, 1 of a hub that turns, 0 without a clamp.
    deflection_at_one
        Coordinates of the function 1: their product with a force vector is the total force.
    smallest_depth
        Below this depth [m] the plant has no inserted part and is straight; 0 where it always has one.
    axial_force_acts
        Whether a push feels the axial force A of the lateral state.
    largest_spectral_radius
        Of the integrator of a moving needle: below 1 where vibrations that a step does not resolve would grow.
    warnings
        What a user should know of the model before trusting it.
    is_polynomial
        Whether the polynomials of its shapes say all of it; else the kernel asks it for its matrices at every depth.
    """

    scene: Scene
    size: int
    prescribed: int
    deflection_at_one: Array
    smallest_depth: float
    axial_force_acts: bool
    largest_spectral_radius: float
    warnings: tuple[str, ...]
    is_polynomial: bool

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices."""

    def points(self, depth: float) -> Points:
        """Return where point forces act."""

    def clamp_reactions(self, residual: Array, depth: float) -> tuple[float, float]:
        """Return force [N] and moment [N m] of the clamp from what the coordinates' equations lack; zeros without a clamp."""

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of a straight needle, clamped with a deflection [m] and an angle [rad]."""

    def stiffness_rate_product(self, coordinates: Array, depth: float, time: float) -> Array:
        """Return d(K + m G)/dz q at a fixed time."""

    def rest_terms(self, path: CutPath, depth: float, lower: float, upper: float) -> RestTerms:
        """Return what the cut path at lower <= y < upper adds to the tissue's energy, for a stiffness factor of 1."""

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N] at fixed coordinates, velocities and speed."""

    def deflection(
        self, coordinates: Array, forces: Array, depth: float | Array, arc_length: Array, derivative: int = 0
    ) -> Array:
        """Return deflections [m], or derivatives by arc length, at stations of one state or of many.

        Parameters
        ----------
        coordinates
            Shape (n,), or (T, n) of T states.
        forces
            At the points [N], shape (p,) or (T, p).
        depth
            [m], a number or shape (T,).
        arc_length
            Stations from the hub, 0, to the tip, l [m], shape (stations,), the same for all states.
        derivative
            Its order, 0 to 3.

        Returns
        -------
        Array
            Shape (stations,) or (T, stations).
        """

    def describe(self) -> dict[str, int | float | str]:
        """Return what ``summary.json`` says of the model: kind, elements or modes."""
