"""A leg of a run, all its steps in arrays: states at the nodes and ends, energies, works, reactions (`fem_needle.ledger`).

Instant 0 is the start; with s nodes to a step, step i has them at (s + 1) i + 1, ..., and its end at (s + 1) (i + 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation
from fem_needle.legs.course import Instants
from fem_needle.legs.matrices import LegMatrices
from fem_needle.tables import (
    BENDING,
    CENTRIFUGAL,
    CONVECTION,
    DAMPING,
    DRAG,
    MASS,
    SLIP,
    TISSUE,
    PointTable,
    Rates,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Leg:
    """States over a leg, ``T = stride steps + 1`` instants.

    Attributes
    ----------
    matrices, rates, points, instants
        The plant and its course.
    method, inertia
        The collocation method; whether the needle has inertia.
    lengths
        Of the steps [s] (steps,).
    coordinates, velocities, forces
        (T, n) twice, (T, p); without inertia velocities are zero at the ends.
    """

    matrices: LegMatrices
    rates: Rates
    points: PointTable
    instants: Instants
    method: Collocation
    inertia: bool
    lengths: Array
    coordinates: Array
    velocities: Array
    forces: Array

    @property
    def stride(self) -> int:
        """Instants of a step: its nodes and its end."""
        return len(self.method.nodes) + 1

    @property
    def nodes(self) -> Indices:
        """Instants of the nodes (steps, s)."""
        return self.stride * np.arange(len(self.lengths))[:, None] + np.arange(1, self.stride)

    @property
    def ends(self) -> Indices:
        """Instants of the start and of every end (steps + 1,)."""
        return self.stride * np.arange(len(self.lengths) + 1)

    @cached_property
    def moves(self) -> bool:
        """Whether the needle moves at any instant."""
        return bool(np.any(self.instants.speeds) or np.any(self.instants.accelerations))

    def form(self, kind: int, at: Indices, left: Array, right: Array) -> Array:
        """Return left . A right of states (T, n) at some instants."""
        return self.matrices.form(kind, at, left[at], right[at])

    def momenta(self, at: Indices) -> Array:
        """Return M q' + v S q (instants, n)."""
        return momenta_of(self.matrices, self.instants, at, self.coordinates[at], self.velocities[at])

    def guide_means(self, done: Indices) -> Array:
        """Return what is shown of the guides' forces after so many steps: with inertia a rigid one's mean over the last step."""
        points, guides = self.points, self.points.guides
        forces = self.forces[self.stride * done, :guides]
        if not self.inertia:
            return forces
        nodes = self.forces[self.nodes[np.maximum(done - 1, 0)], :guides]
        means = np.einsum("s,tsg->tg", self.method.weights, nodes)
        return np.where(points.guide_compliance > 0.0, forces, means)

    def axial_momenta(self, at: Indices) -> Array:
        """Return dT/dv = q'.S q + v q.R q [N s]."""
        if not (self.inertia and self.matrices.has(CONVECTION)):
            return np.zeros(len(at))
        moved = self.form(CONVECTION, at, self.velocities, self.coordinates)
        return moved + self.instants.speeds[at] * self.form(CENTRIFUGAL, at, self.coordinates, self.coordinates)

    def energy_forces(self, at: Indices) -> Array:
        """Return d(T - U)/dz [N] at fixed coordinates."""
        rates, swelling, rise = self.rates, self.instants.factor[at], np.zeros(len(at))
        if np.any(rates.bending_share):
            rise += rates.bending_share[at] * self.form(BENDING, at, self.coordinates, self.coordinates)
        if np.any(rates.tissue_share):
            rise += rates.tissue_share[at] * swelling * self.form(TISSUE, at, self.coordinates, self.coordinates)
        reached = gathered(rates.first[at], rates.rows[at], self.coordinates[at])
        rise += np.sum(rates.scale[at] * reached**2 * np.where(rates.is_tissue, swelling[:, None], 1.0), axis=1)
        return -0.5 * rise + (self._kinetic_forces(at) if self.inertia else 0.0)

    def _kinetic_forces(self, at: Indices) -> Array:
        """Return dT/dz [N]."""
        rates, speeds, force = self.rates, self.instants.speeds[at], np.zeros(len(at))
        if np.any(rates.mass_share):
            force += 0.5 * rates.mass_share[at] * self.form(MASS, at, self.velocities, self.velocities)
        if np.any(rates.centrifugal_share):
            moved = self.form(CENTRIFUGAL, at, self.coordinates, self.coordinates)
            force += 0.5 * speeds**2 * rates.centrifugal_share[at] * moved
        if rates.tip_mass:
            reached = np.einsum("ti,ti->t", rates.tip_row[at], self.velocities[at])
            reached += speeds * np.einsum("ti,ti->t", rates.tip_slope[at], self.coordinates[at])
            force += 0.5 * rates.tip_mass * reached**2
        return force

    def contact_forces(self, at: Indices) -> Array:
        """Return what points and viscous tissue add to the axial force [N]."""
        points, forces = self.points, self.forces[at]
        moved = gathered(points.first[at], points.row_rates[at], self.coordinates[at])
        moved += 0.5 * np.einsum("tij,tj->ti", points.flexibility_rate[at], forces)
        total = np.einsum("ti,ti->t", forces, moved)
        total -= self.form(DRAG, at, self.velocities, self.coordinates)
        return np.asarray(total - self.instants.speeds[at] * self.form(SLIP, at, self.coordinates, self.coordinates))

    def deflections(self, at: Indices) -> Array:
        """Return N q + B P at the points [m] (instants, p)."""
        points = self.points
        reached = gathered(points.first[at], points.rows[at], self.coordinates[at])
        return np.asarray(reached + np.einsum("tij,tj->ti", points.flexibility[at], self.forces[at]))

    def dissipation(self, at: Indices) -> Array:
        """Return the power lost in the tissue's viscosity [W]."""
        speeds = self.instants.speeds[at]
        power = self.form(DAMPING, at, self.velocities, self.velocities)
        power += 2 * speeds * self.form(DRAG, at, self.velocities, self.coordinates)
        return power + speeds**2 * self.form(SLIP, at, self.coordinates, self.coordinates)

    def internal_forces(self, at: Indices, velocities: Array) -> Array:
        """Return v S^T q' + v^2 R q - (K + m G) q - C q' - v D q with given velocities (instants, n)."""
        matrices, coordinates = self.matrices, self.coordinates[at]
        speeds = self.instants.speeds[at][:, None]
        result = speeds * matrices.product(CONVECTION, at, velocities, transposed=True)
        result += speeds**2 * matrices.product(CENTRIFUGAL, at, coordinates)
        result -= matrices.product(BENDING, at, coordinates)
        return result - self.tissue_forces(at, velocities)

    def tissue_forces(self, at: Indices, velocities: Array) -> Array:
        """Return m G q + C q' + v D q (instants, n)."""
        matrices, coordinates = self.matrices, self.coordinates[at]
        result = self.instants.factor[at][:, None] * matrices.product(TISSUE, at, coordinates)
        result += matrices.product(DAMPING, at, velocities)
        return result + self.instants.speeds[at][:, None] * matrices.product(DRAG, at, coordinates)

    def point_forces(self, at: Indices) -> Array:
        """Return N^T P (instants, n)."""
        points = self.points
        return scattered(points.first[at], points.rows[at], self.forces[at], self.coordinates.shape[1])


def scattered(first: Indices, rows: Array, forces: Array, size: int) -> Array:
    """Return the sum of force times row (T, size) of forces (T, p) at points."""
    result, everywhere = np.zeros((len(forces), size)), np.arange(len(forces))[:, None, None]
    columns = first[:, :, None] + np.arange(rows.shape[2])
    np.add.at(result, (everywhere, columns), rows * forces[:, :, None])
    return result


def gathered(first: Indices, rows: Array, vectors: Array) -> Array:
    """Return row . x of rows (T, p, m) that begin at the coordinates ``first`` (T, p), for vectors (T, n)."""
    columns = first[:, :, None] + np.arange(rows.shape[2])
    return np.asarray(np.einsum("tpm,tpm->tp", rows, vectors[np.arange(len(vectors))[:, None, None], columns]))


def woven(start: Array, stages: Array, ends: Array) -> Array:
    """Return values at all instants from those at the start (n,), the stages (steps, s, n) and the ends (steps, n)."""
    steps = np.concatenate([stages, ends[:, None]], axis=1)
    return np.concatenate([start[None], steps.reshape(-1, len(start))])


def momenta_of(matrices: LegMatrices, instants: Instants, at: Indices, coordinates: Array, velocities: Array) -> Array:
    """Return M q' + v S q at some instants (instants, n)."""
    moved = instants.speeds[at][:, None] * matrices.product(CONVECTION, at, coordinates)
    return matrices.product(MASS, at, velocities) + moved


def point_forces_of(
    points: PointTable, instants: Instants, method: Collocation, coordinates: Array, guide_forces: Array, start: Array
) -> Array:
    """Return the forces at all points (T, p) from the guides' at the nodes (steps, 2, guides) and at the start (p,).

    At the end of a step N q + B P + compliance R = 0 for all guides together, except those that hardly give way: the mean over
    the step, about which the values at the nodes alternate.
    """
    guides, stride = points.guides, len(method.nodes) + 1
    ends = stride * np.arange(1, len(guide_forces) + 1)
    forces = np.zeros((len(coordinates), points.rows.shape[1]))
    forces[:, guides:] = instants.loads.forces
    forces[0] = start
    if not guides:
        return forces
    forces[1:].reshape(-1, stride, forces.shape[1])[:, :-1, :guides] = guide_forces
    compliance = points.flexibility[ends, :guides, :guides] + np.diag(points.guide_compliance)
    gaps = -gathered(points.first[ends, :guides], points.rows[ends, :guides], coordinates[ends])
    gaps -= np.einsum("tgl,tl->tg", points.flexibility[ends, :guides, guides:], forces[ends, guides:])
    soft = np.einsum("tgg->tg", compliance) > points.softest
    rows = np.where(soft[:, :, None], compliance, np.eye(guides))
    right = np.where(soft, gaps, np.einsum("s,tsg->tg", method.weights, guide_forces))
    forces[ends, :guides] = np.linalg.solve(rows, right[:, :, None])[:, :, 0]
    return forces
