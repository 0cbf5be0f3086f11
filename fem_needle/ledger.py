"""The energy ledger: energies of a state, works of a step, and the axial force A.

Lateral: change of kinetic + bending + tissue energy = load_work + hub_work + tissue_work - tissue_dissipation + boundary_energy,
with boundary_energy = -integral A v dt and A = dL/dz - d(dT/dv)/dt + drag, taken from the discrete Lagrangian. Every term is
evaluated on its own; nothing is a remainder. Derivation: docs/theory.md, section "Energy".
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.collocation import Collocation
from fem_needle.path import CutPath
from fem_needle.plant import Plant, RestTerms
from fem_needle.stages import Stage, StageSolution, internal_force

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Works:
    """Works since the start [J]."""

    load_work: float = 0.0
    hub_work: float = 0.0
    tissue_work: float = 0.0
    tissue_dissipation: float = 0.0
    boundary_energy: float = 0.0
    friction_dissipation: float = 0.0
    cutting_work: float = 0.0
    push_work: float = 0.0
    arrest_loss: float = 0.0

    def __add__(self, other: Works) -> Works:
        """Add term by term."""
        return Works(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    @property
    def lateral(self) -> float:
        """What the lateral energies have gained by them [J]."""
        gained = self.load_work + self.hub_work + self.tissue_work + self.boundary_energy
        return gained - self.tissue_dissipation


@dataclass(frozen=True)
class Energies:
    """Lateral energies [J]; ``tissue`` includes the guides' springs, ``guide`` says how much of it they hold."""

    kinetic: float
    bending: float
    tissue: float
    guide: float

    @property
    def total(self) -> float:
        """Their sum [J]."""
        return self.kinetic + self.bending + self.tissue


def form(band: Array | None, left: Array, right: Array) -> float:
    """Return left . A right, 0 for an absent matrix."""
    return 0.0 if band is None else float(left @ banded.multiply(band, right))


def energies(stage: Stage, solution: StageSolution, *, inertia: bool) -> Energies:
    """Return the energies of a state; without inertia none is kinetic."""
    operators, speed = stage.operators, stage.instant.speed
    coordinates, velocities = solution.coordinates, solution.velocities
    kinetic = 0.5 * form(operators.mass, velocities, velocities) if inertia else 0.0
    if speed and inertia:
        kinetic += speed * form(operators.convection, velocities, coordinates)
        kinetic += 0.5 * speed**2 * form(operators.centrifugal, coordinates, coordinates)
    return Energies(kinetic, *potential_energies(stage, coordinates, solution.forces))


def potential_energies(stage: Stage, coordinates: Array, forces: Array) -> tuple[float, float, float]:
    """Return bending energy, tissue energy (guides' springs included) and the guides' part [J]."""
    operators, points = stage.operators, stage.points
    kinks = float(forces @ points.flexibility @ forces)
    if operators.beam is None:
        bending = form(operators.bending, coordinates, coordinates) + kinks
    else:
        bending = float(operators.beam.bending_forms(coordinates[:, None])[0]) + kinks
    reactions = forces[: points.guides]
    guide = 0.5 * float(reactions @ (points.guide_compliance * reactions))
    tissue = 0.5 * form(operators.tissue, coordinates, coordinates)
    if stage.rest is not None:
        tissue += stage.factor * rest_energy(stage.rest, coordinates)
    return 0.5 * bending, tissue + guide, guide


def rest_energy(rest: RestTerms, coordinates: Array) -> float:
    """Return c - q.H, what a cut path adds to 1/2 q.G q [J]."""
    return rest.constant - float(coordinates @ rest.load)


def axial_momentum(stage: Stage, coordinates: Array, velocities: Array) -> float:
    """Return dT/dv = q'.S q + v q.R q [N s]."""
    operators = stage.operators
    centrifugal = stage.instant.speed * form(operators.centrifugal, coordinates, coordinates)
    return form(operators.convection, velocities, coordinates) + centrifugal


def configuration_force(plant: Plant, stage: Stage, solution: StageSolution, *, inertia: bool = True) -> float:
    """Return dL/dz and the tissue's drag along z [N]: the axial force A without -d(dT/dv)/dt."""
    return energy_force(plant, stage, solution, inertia=inertia) + contact_force(stage, solution)


def energy_force(plant: Plant, stage: Stage, solution: StageSolution, *, inertia: bool = True) -> float:
    """Return d(T - U)/dz [N], the part of the axial force that is quadratic in the needle's own state."""
    coordinates, instant = solution.coordinates, stage.instant
    moved = plant.stiffness_rate_product(coordinates, instant.depth, instant.time)
    force = -0.5 * float(coordinates @ moved)
    if stage.rest is not None:
        force += stage.factor * (float(coordinates @ stage.rest.load_rate) - stage.rest.constant_rate)
    if inertia:
        force += plant.kinetic_rate(solution.velocities, coordinates, instant.depth, instant.speed)
    return force


def contact_force(stage: Stage, solution: StageSolution) -> float:
    """Return what points and viscous tissue add to the axial force [N]."""
    coordinates, forces, points = solution.coordinates, solution.forces, stage.points
    force = float(forces @ (points.row_rates @ coordinates) + 0.5 * forces @ points.flexibility_rate @ forces)
    force -= form(stage.operators.drag, solution.velocities, coordinates)
    return force - stage.instant.speed * form(stage.operators.slip, coordinates, coordinates)


def dissipation(stage: Stage, solution: StageSolution) -> float:
    """Return the power lost in the tissue's viscosity [W]."""
    operators, speed = stage.operators, stage.instant.speed
    power = form(operators.damping, solution.velocities, solution.velocities)
    if speed:
        power += 2 * speed * form(operators.drag, solution.velocities, solution.coordinates)
        power += speed**2 * form(operators.slip, solution.coordinates, solution.coordinates)
    return power


@dataclass(frozen=True, eq=False)
class StepEnd:
    """One end of a step: the plant there, the state on it, and the path cut so far (None: straight rest line)."""

    stage: Stage
    solution: StageSolution
    path: CutPath | None = None


@dataclass(frozen=True, eq=False)
class StepParts:
    """What the works of one smooth step are computed from.

    Attributes
    ----------
    plant, method, length
        Model, nodes and weights, duration [s].
    ends
        State just after the start and just before the end.
    stages, solutions
        Plant and state at the nodes.
    """

    plant: Plant
    method: Collocation
    length: float
    ends: tuple[StepEnd, StepEnd]
    stages: tuple[Stage, ...]
    solutions: tuple[StageSolution, ...]


def step_works(parts: StepParts, *, inertia: bool) -> Works:
    """Return the works of one smooth step; a row of equal steps also needs the `row_correction` of its first and last one.

    Products with a rate are integrated by parts, so that only known rates (of loads, speed and hub) are needed:
    integral F d(deflection) = [F deflection] - integral dF/dt deflection dt.
    """
    works = _end_products(parts, inertia=inertia)
    for weight, stage, solution in zip(parts.method.weights * parts.length, parts.stages, parts.solutions, strict=True):
        works = works + _node_works(weight, stage, solution, inertia=inertia)
    if any(stage.instant.speed or stage.instant.acceleration for stage in parts.stages):
        works = works + Works(boundary_energy=_moving_work(parts, inertia=inertia))
    return works


def _end_products(parts: StepParts, *, inertia: bool) -> Works:
    """Return the products at the ends: [F deflection], [v dT/dv], [hub velocity momentum]."""
    load = hub = boundary = 0.0
    for end, sign in zip(parts.ends, (-1.0, 1.0), strict=True):
        solution, stage = end.solution, end.stage
        guides = stage.points.guides
        reached = stage.points.deflections(solution.coordinates, solution.forces)[guides:]
        load += sign * float(solution.forces[guides:] @ reached)
        if inertia and stage.instant.speed:
            boundary += sign * stage.instant.speed * axial_momentum(stage, solution.coordinates, solution.velocities)
        if inertia and np.any(stage.case.clamp_rates):
            hub += sign * float(stage.case.clamp_rates @ solution.momentum[:2])
    return Works(load_work=load, hub_work=hub, boundary_energy=boundary)


def _node_works(weight: float, stage: Stage, solution: StageSolution, *, inertia: bool) -> Works:
    """Return a node's share of the integrals that the method's own quadrature gives exactly as it moves the needle."""
    load = swelling = 0.0
    if np.any(stage.case.force_rates):
        guides = stage.points.guides
        load = -float(stage.case.force_rates @ stage.points.deflections(solution.coordinates, solution.forces)[guides:])
    if stage.operators.tissue_rate is not None:
        swelling = 0.5 * form(stage.operators.tissue_rate, solution.coordinates, solution.coordinates)
    if stage.rest is not None and stage.factor_rate:
        swelling += stage.factor_rate * rest_energy(stage.rest, solution.coordinates)
    return Works(
        load_work=weight * load,
        hub_work=weight * _hub_power(stage, solution, inertia=inertia),
        tissue_work=weight * swelling,
        tissue_dissipation=weight * dissipation(stage, solution) if stage.operators.damping is not None else 0.0,
        boundary_energy=-weight * stage.instant.speed * contact_force(stage, solution) if stage.instant.speed else 0.0,
    )


def _moving_work(parts: StepParts, *, inertia: bool) -> float:
    """Return -integral (v d(T - U)/dz + dv/dt dT/dv) dt [J].

    With inertia by the trapezoidal rule on the ends of the steps, corrected at the ends of a row of equal steps (Euler and
    Maclaurin, order 4): at the ends vibrations too fast for the step keep their whole amplitude, at the nodes they do not, and
    the energy that they gain or lose as the needle moves would be missed. Without inertia by the method's own quadrature.
    """
    if inertia:
        start, end = (_moving_power(parts.plant, state.stage, state.solution, inertia=True) for state in parts.ends)
        return 0.5 * parts.length * (start + end)
    powers = [_moving_power(parts.plant, *node, inertia=False) for node in zip(parts.stages, parts.solutions, strict=True)]
    return parts.length * float(parts.method.weights @ np.array(powers))


def _moving_power(plant: Plant, stage: Stage, solution: StageSolution, *, inertia: bool) -> float:
    power = -stage.instant.speed * energy_force(plant, stage, solution, inertia=inertia)
    if inertia and stage.instant.acceleration:
        power -= stage.instant.acceleration * axial_momentum(stage, solution.coordinates, solution.velocities)
    return power


def _hub_power(stage: Stage, solution: StageSolution, *, inertia: bool) -> float:
    """Return the power of the clamp's reaction without the part that is integrated by parts [W]."""
    case, power = stage.case, 0.0
    if np.any(case.clamp_rates):
        resisting = internal_force(stage, solution.coordinates, solution.velocities)
        resisting = resisting + stage.points.rows.T @ solution.forces
        power -= float(case.clamp_rates @ resisting[:2])
    if inertia and np.any(case.clamp_accelerations):
        power -= float(case.clamp_accelerations @ solution.momentum[:2])
    return power
