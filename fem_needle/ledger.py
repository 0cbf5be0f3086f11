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


def energies(stage: Stage, coordinates: Array, velocities: Array, forces: Array) -> Energies:
    """Return the energies of a state; pass zero velocities and speed for a static one."""
    operators, speed = stage.operators, stage.instant.speed
    kinetic = 0.5 * form(operators.mass, velocities, velocities)
    if speed:
        kinetic += speed * form(operators.convection, velocities, coordinates)
        kinetic += 0.5 * speed**2 * form(operators.centrifugal, coordinates, coordinates)
    return Energies(kinetic, *potential_energies(stage, coordinates, forces))


def potential_energies(stage: Stage, coordinates: Array, forces: Array) -> tuple[float, float, float]:
    """Return bending energy, tissue energy (guides' springs included) and the guides' part [J]."""
    operators, points = stage.operators, stage.points
    bending = form(operators.bending, coordinates, coordinates) + float(forces @ points.flexibility @ forces)
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
    coordinates, velocities, forces = solution.coordinates, solution.velocities, solution.forces
    operators, points, instant = stage.operators, stage.points, stage.instant
    force = -0.5 * float(
        coordinates @ plant.stiffness_rate_product(coordinates, instant.depth, instant.time)
    )
    if stage.rest is not None:
        force += stage.factor * (float(coordinates @ stage.rest.load_rate) - stage.rest.constant_rate)
    force += float(forces @ (points.row_rates @ coordinates) + 0.5 * forces @ points.flexibility_rate @ forces)
    if inertia:
        force += plant.kinetic_rate(velocities, coordinates, instant.depth, instant.speed)
    force -= form(operators.drag, velocities, coordinates)
    return force - instant.speed * form(operators.slip, coordinates, coordinates)


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


def step_works(
    plant: Plant,
    method: Collocation,
    step: float,
    ends: tuple[StepEnd, StepEnd],
    stages: tuple[Stage, ...],
    solutions: tuple[StageSolution, ...],
    *,
    inertia: bool = True,
) -> Works:
    """Return the works of one smooth step, by the method's own quadrature.

    Products with a rate are integrated by parts, so that only known rates (of loads, speed and hub) are needed:
    integral F d(deflection) = [F deflection] - integral dF/dt deflection dt.
    """
    guides = stages[0].points.guides
    load = hub = swelling = lost = boundary = 0.0
    for end, sign in zip(ends, (-1.0, 1.0), strict=True):
        solution, speed = end.solution, end.stage.instant.speed
        reached = end.stage.points.deflections(solution.coordinates, solution.forces)[guides:]
        load += sign * float(solution.forces[guides:] @ reached)
        if inertia and speed:
            boundary += sign * speed * axial_momentum(end.stage, solution.coordinates, solution.velocities)
        if inertia and np.any(end.stage.case.clamp_rates):
            hub += sign * float(end.stage.case.clamp_rates @ solution.momentum[:2])
    for weight, stage, solution in zip(method.weights * step, stages, solutions, strict=True):
        instant = stage.instant
        if np.any(stage.case.force_rates):
            reached = stage.points.deflections(solution.coordinates, solution.forces)[guides:]
            load -= weight * float(stage.case.force_rates @ reached)
        hub += weight * _hub_power(stage, solution, inertia=inertia)
        swelling += weight * 0.5 * form(stage.operators.tissue_rate, solution.coordinates, solution.coordinates)
        if stage.rest is not None and stage.factor_rate:
            swelling += weight * stage.factor_rate * rest_energy(stage.rest, solution.coordinates)
        if stage.operators.damping is not None:
            lost += weight * dissipation(stage, solution)
        if instant.speed:
            boundary -= weight * instant.speed * configuration_force(plant, stage, solution, inertia=inertia)
        if inertia and instant.acceleration:
            axial = axial_momentum(stage, solution.coordinates, solution.velocities)
            boundary -= weight * instant.acceleration * axial
    return Works(load, hub, swelling, lost, boundary)


def jump_works(before: StepEnd, after: StepEnd) -> Works:
    """Return the works at a jump of speed or of the hub's velocity: mean velocity times the jump of momentum."""
    left, right = before.solution, after.solution
    jump = axial_momentum(after.stage, right.coordinates, right.velocities) - axial_momentum(
        before.stage, left.coordinates, left.velocities
    )
    boundary = 0.5 * (before.stage.instant.speed + after.stage.instant.speed) * jump
    rates = 0.5 * (before.stage.case.clamp_rates + after.stage.case.clamp_rates)
    clamped = min(2, right.momentum.shape[0])
    hub = float(rates[:clamped] @ (right.momentum - left.momentum)[:clamped]) if np.any(rates) else 0.0
    return Works(hub_work=hub, boundary_energy=boundary)


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
