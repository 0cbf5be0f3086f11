"""The works of all steps of a leg, and what is shown at its outputs (equations: `fem_needle.ledger`, `fem_needle.samples`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.legs.states import Leg
from fem_needle.tables import BENDING, CENTRIFUGAL, CONVECTION, DAMPING, MASS, TISSUE

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LegWorks:
    """Works since the start of a leg [J], at its start and after every step (steps + 1,)."""

    load_work: Array
    hub_work: Array
    tissue_work: Array
    tissue_dissipation: Array
    boundary_energy: Array


def leg_works(leg: Leg, starts_row: NDArray[np.bool_]) -> LegWorks:
    """Return the works after every step.

    ``starts_row`` (steps + 1,): whether a step begins a row of equal steps; the last entry is not used. What ends the last row is
    left to whoever goes on from there.
    """
    boundary = _boundary_steps(leg)
    if leg.inertia and leg.moves:
        first = np.flatnonzero(starts_row[:-1])
        boundary[first] += row_corrections(leg, first, at_start=True)
        boundary[first[first > 0]] += row_corrections(leg, first[first > 0] - 1, at_start=False)
    return LegWorks(
        _since_start(_load_steps(leg)),
        _since_start(_hub_steps(leg)),
        _since_start(_swelling_steps(leg)),
        _since_start(_node_sums(leg, leg.dissipation) if leg.matrices.has(DAMPING) else np.zeros(len(leg.lengths))),
        _since_start(boundary),
    )


def _since_start(steps: Array) -> Array:
    return np.append(0.0, np.cumsum(steps))


def _node_sums(leg: Leg, power: Callable[[Indices], Array]) -> Array:
    """Return the integral of a power over every step by the method's own quadrature."""
    values = power(leg.nodes.ravel()).reshape(leg.nodes.shape)
    return np.asarray(leg.lengths * (values @ leg.method.weights))


def _load_steps(leg: Leg) -> Array:
    """Return [F deflection] - integral dF/dt deflection dt of the loads."""
    guides, loads = leg.points.guides, leg.instants.loads
    products = np.sum((leg.forces[leg.ends] * leg.deflections(leg.ends))[:, guides:], axis=1)
    steps = np.diff(products)
    if np.any(loads.force_rates):
        steps -= _node_sums(leg, lambda at: np.sum(loads.force_rates[at] * leg.deflections(at)[:, guides:], axis=1))
    return steps


def _hub_steps(leg: Leg) -> Array:
    """Return the work of the clamp: [rate momentum] - integral (rate force + acceleration momentum) dt."""
    loads, steps = leg.instants.loads, np.zeros(len(leg.lengths))
    if np.any(loads.clamp_rates) and leg.inertia:
        steps += np.diff(np.sum(loads.clamp_rates[leg.ends] * leg.momenta(leg.ends)[:, :2], axis=1))
    if np.any(loads.clamp_rates):

        def resisted(at: Indices) -> Array:
            force = leg.internal_forces(at, leg.velocities[at]) + leg.point_forces(at)
            return np.asarray(np.sum(loads.clamp_rates[at] * force[:, :2], axis=1))

        steps -= _node_sums(leg, resisted)
    if leg.inertia and np.any(loads.clamp_accelerations):
        steps -= _node_sums(leg, lambda at: np.sum(loads.clamp_accelerations[at] * leg.momenta(at)[:, :2], axis=1))
    return steps


def _swelling_steps(leg: Leg) -> Array:
    """Return the integral of 1/2 dm/dt q.G q dt."""
    rates = leg.instants.factor_rate
    if not np.any(rates):
        return np.zeros(len(leg.lengths))
    return _node_sums(leg, lambda at: 0.5 * rates[at] * leg.form(TISSUE, at, leg.coordinates, leg.coordinates))


def _boundary_steps(leg: Leg) -> Array:
    """Return what the needle's lateral energy gains because the boundary moves, without what rows of equal steps need."""
    if not leg.moves:
        return np.zeros(len(leg.lengths))
    speeds = leg.instants.speeds
    steps = -_node_sums(leg, lambda at: speeds[at] * leg.contact_forces(at))
    if not leg.inertia:
        return steps + _node_sums(leg, lambda at: moving_powers(leg, at))
    powers = moving_powers(leg, leg.ends)
    steps += 0.5 * leg.lengths * (powers[1:] + powers[:-1])
    return steps + np.diff(speeds[leg.ends] * leg.axial_momenta(leg.ends))


def moving_powers(leg: Leg, at: Indices) -> Array:
    """Return -(v d(T - U)/dz + dv/dt dT/dv) [W]."""
    powers = -leg.instants.speeds[at] * leg.energy_forces(at)
    if np.any(leg.instants.accelerations[at]):
        powers -= leg.instants.accelerations[at] * leg.axial_momenta(at)
    return powers


def row_corrections(leg: Leg, steps: Indices, *, at_start: bool) -> Array:
    """Return what the first or the last step of a row of equal steps adds to the trapezoidal rule of the boundary energy."""
    if not (leg.inertia and leg.moves):
        return np.zeros(len(steps))
    at = leg.stride * steps[:, None] + np.arange(leg.stride + 1)
    slopes = moving_powers(leg, at.ravel()).reshape(at.shape) @ leg.method.power_slopes[0 if at_start else 1]
    return leg.lengths[steps] / 12 * (slopes if at_start else -slopes)


@dataclass(frozen=True, eq=False)
class Figures:
    """Energies [J], axial force [N], what the clamp's equations lack, and the tissue's force [N] at some instants."""

    kinetic_energy: Array
    bending_energy: Array
    tissue_energy: Array
    guide_energy: Array
    axial_force: Array
    hub_residual: Array
    tissue_force: Array


def figures(leg: Leg, at: Indices, one: Array) -> Figures:
    """Return figures at the start (instant 0, by the first step's polynomial) or at ends of steps; one: the function 1 (n,)."""
    steps = np.maximum(at // leg.stride - 1, 0)
    slopes = np.where((at == 0)[:, None], leg.method.start_slope, leg.method.end_slope) / leg.lengths[steps][:, None]
    own = leg.velocities[at]
    velocities = own if leg.inertia else _slopes(leg.coordinates[_polynomial_instants(leg, steps)], slopes)
    needed = -leg.internal_forces(at, velocities) - leg.point_forces(at)
    axial = leg.energy_forces(at) + leg.contact_forces(at)
    if leg.inertia:
        needed += _slopes(leg.momenta(_polynomial_instants(leg, steps).ravel()).reshape(len(at), leg.stride, -1), slopes)
        values = leg.axial_momenta(_polynomial_instants(leg, steps).ravel()).reshape(len(at), -1)
        axial -= np.einsum("ts,ts->t", slopes, values[:, 1:] - values[:, :1])
    return Figures(*_energies(leg, at), axial, needed[:, :2], -leg.tissue_forces(at, velocities) @ one)


def _polynomial_instants(leg: Leg, steps: Indices) -> Indices:
    return leg.stride * steps[:, None] + np.arange(leg.stride)


def _slopes(found: Array, slopes: Array) -> Array:
    """Differentiate the polynomials through values at the start and at the two nodes of steps (instants, 3, n)."""
    return np.asarray(np.einsum("ts,tsn->tn", slopes, found[:, 1:] - found[:, :1]))


def _energies(leg: Leg, at: Indices) -> tuple[Array, Array, Array, Array]:
    """Return kinetic, bending, tissue and guide energies [J]."""
    speeds, points, forces = leg.instants.speeds[at], leg.points, leg.forces[at]
    kinetic = np.zeros(len(at))
    if leg.inertia:
        kinetic = 0.5 * leg.form(MASS, at, leg.velocities, leg.velocities)
        kinetic += speeds * leg.form(CONVECTION, at, leg.velocities, leg.coordinates)
        kinetic += 0.5 * speeds**2 * leg.form(CENTRIFUGAL, at, leg.coordinates, leg.coordinates)
    kinks = np.einsum("ti,tij,tj->t", forces, points.flexibility[at], forces)
    guide = 0.5 * np.sum(points.guide_compliance * forces[:, : points.guides] ** 2, axis=1)
    bending = 0.5 * (leg.form(BENDING, at, leg.coordinates, leg.coordinates) + kinks)
    tissue = 0.5 * leg.instants.factor[at] * leg.form(TISSUE, at, leg.coordinates, leg.coordinates) + guide
    return kinetic, bending, tissue, guide
