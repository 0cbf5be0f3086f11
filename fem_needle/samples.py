"""What is known of a run at one output time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial, banded
from fem_needle.ledger import StepEnd, Works, axial_momentum, configuration_force, energies
from fem_needle.plant import Plant
from fem_needle.stages import internal_force
from fem_needle.steppers import Step

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sample:
    """State, forces and ledger at one output time; SI.

    The names are those of ``series.nc`` (docs/contract.md), with ``coordinates`` and ``point_forces`` besides.
    """

    time: float
    depth: float
    speed: float
    coordinates: Array
    point_forces: Array
    guide_force: Array
    push_force: float
    friction_force: float
    tissue_force: float
    hub_force: float
    hub_moment: float
    kinetic_energy: float
    bending_energy: float
    tissue_energy: float
    guide_energy: float
    load_work: float
    hub_work: float
    tissue_work: float
    tissue_dissipation: float
    boundary_energy: float
    friction_dissipation: float
    cutting_work: float
    push_work: float
    arrest_loss: float
    axial_kinetic_energy: float
    path_position: Array
    path_deflection: Array

    @property
    def lateral_energy(self) -> float:
        """Kinetic, bending and tissue energy together [J]."""
        return self.kinetic_energy + self.bending_energy + self.tissue_energy


def sample_step(plant: Plant, step: Step, works: Works, deepest: float, depth: float, *, at_start: bool, inertia: bool) -> Sample:
    """Return the sample at the end of a step, or at the start of the first one.

    Rates of momentum come from the step's own polynomial; its error is of second order in the step.
    """
    end = step.ends[0] if at_start else step.ends[1]
    stage, solution = end.stage, end.solution
    speed, acceleration = stage.instant.speed, stage.instant.acceleration
    scene, energy = plant.scene, energies(stage, solution, inertia=inertia)
    mass = scene.needle.mass_per_length * scene.needle.length
    friction = axial.friction_force(scene, depth, speed)
    cutting = axial.cutting_force(scene, depth, speed, deepest)
    axial_force = configuration_force(plant, stage, solution, inertia=inertia)
    if inertia:
        axial_force -= _rate(step, _axial_momenta(step), at_start=at_start)
    (hub_force, hub_moment), tissue = _reactions(plant, step, end, at_start=at_start, inertia=inertia)
    no_path = (np.zeros(0), np.zeros(0))
    path_position, path_deflection = no_path if end.path is None else end.path.points()
    return Sample(
        time=stage.instant.time,
        depth=depth,
        speed=speed,
        coordinates=solution.coordinates,
        point_forces=solution.forces,
        guide_force=_guide_forces(step, end),
        push_force=mass * acceleration + friction + cutting - axial_force,
        friction_force=friction,
        tissue_force=tissue,
        hub_force=hub_force,
        hub_moment=hub_moment,
        kinetic_energy=energy.kinetic,
        bending_energy=energy.bending,
        tissue_energy=energy.tissue,
        guide_energy=energy.guide,
        load_work=works.load_work,
        hub_work=works.hub_work,
        tissue_work=works.tissue_work,
        tissue_dissipation=works.tissue_dissipation,
        boundary_energy=works.boundary_energy,
        friction_dissipation=works.friction_dissipation,
        cutting_work=works.cutting_work,
        push_work=works.push_work,
        arrest_loss=works.arrest_loss,
        axial_kinetic_energy=0.5 * mass * speed**2,
        path_position=path_position,
        path_deflection=path_deflection,
    )


def _reactions(
    plant: Plant, step: Step, end: StepEnd, *, at_start: bool, inertia: bool
) -> tuple[tuple[float, float], float]:
    """Return what the clamp exerts on the needle, (force, moment), and the tissue's total lateral force."""
    stage, solution = end.stage, end.solution
    velocities = solution.velocities
    if not inertia:
        velocities = _rate_of_coordinates(step, at_start=at_start)
    needed = -internal_force(stage, solution.coordinates, velocities) - stage.points.rows.T @ solution.forces
    if inertia:
        states = [step.ends[0].solution, *step.solutions]
        needed = needed + _rate(step, [state.momentum for state in states], at_start=at_start)
    tissue = banded.multiply(stage.operators.tissue, solution.coordinates)
    if stage.operators.damping is not None:
        tissue = tissue + banded.multiply(stage.operators.damping, velocities)
        if stage.operators.drag is not None and stage.instant.speed:
            tissue = tissue + stage.instant.speed * banded.multiply(stage.operators.drag, solution.coordinates)
    if stage.rest is not None:
        tissue = tissue - stage.factor * stage.rest.load
    clamp = plant.clamp_reactions(np.asarray(needed), stage.instant.depth)
    return clamp, -float(plant.deflection_at_one @ tissue)


def _guide_forces(step: Step, end: StepEnd) -> Array:
    """Return the guides' forces: a rigid one's as the mean over the step, about which an index-3 multiplier alternates."""
    points = end.stage.points
    forces = end.solution.forces[: points.guides]
    weighted = [w * s.forces[: points.guides] for w, s in zip(step.method.weights, step.solutions, strict=True)]
    return np.where(points.guide_compliance > 0.0, forces, np.sum(weighted, axis=0)) if points.guides else forces


def _axial_momenta(step: Step) -> list[float]:
    pairs = [(step.ends[0].stage, step.ends[0].solution), *zip(step.stages, step.solutions, strict=True)]
    return [axial_momentum(stage, solution.coordinates, solution.velocities) for stage, solution in pairs]


def _rate_of_coordinates(step: Step, *, at_start: bool) -> Array:
    states = [step.ends[0].solution, *step.solutions]
    return np.asarray(_rate(step, [state.coordinates for state in states], at_start=at_start))


def _rate(step: Step, values: list[Any], *, at_start: bool) -> Any:
    """Differentiate the polynomial through the values at the start and at the two nodes."""
    slopes = step.method.start_slope if at_start else step.method.end_slope
    return sum(slope * (value - values[0]) for slope, value in zip(slopes, values[1:], strict=True)) / step.length
