"""What is known of a run at one output time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial, banded
from fem_needle.ledger import StepEnd, StepParts, Works, axial_momentum, configuration_force, energies
from fem_needle.plant import Plant
from fem_needle.sample_arrays import OVER_TIME, PATH, Samples
from fem_needle.stages import internal_force

Array = NDArray[np.float64]
Ending = TypeVar("Ending")

FEW = 4  # samples of a block: a loop that gives them one by one is watched as it goes
PATIENCE = 0.5  # s: a block waits no longer for another sample


@dataclass(frozen=True, eq=False)
class Sample:
    """State, forces and ledger at one output time; SI.

    The names are those of ``series.nc`` (docs/contract.md), with ``coordinates`` and ``point_forces`` besides.
    """

    time: float
    depth: float
    speed: float
    coordinates: Array
    velocities: Array
    accelerations: Array
    point_forces: Array
    guide_force: Array
    push_force: float
    friction_force: float
    cutting_force: float
    axial_force: float
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
    path_cubics: Array


def stacked(samples: Sequence[Sample]) -> Samples:
    """Return samples, at least one, in order of time, as rows of arrays."""
    over_time = {name: np.array([getattr(sample, name) for sample in samples]) for name in OVER_TIME if name != "path_points"}
    points, last = np.array([len(sample.path_position) for sample in samples]), samples[-1]
    return Samples(**over_time, **{name: getattr(last, name) for name in PATH}, path_points=points)


def sample_step(
    plant: Plant, step: StepParts, works: Works, deepest: float, depth: float, *, at_start: bool, inertia: bool
) -> Sample:
    """Return the sample at the end of a step, or at the start of the first one.

    Rates of momentum come from the step's own polynomial; its error is of second order in the step.
    """
    end = step.ends[0] if at_start else step.ends[1]
    instant, solution, scene = end.stage.instant, end.solution, plant.scene
    mass = scene.needle.mass_per_length * scene.needle.length
    friction = axial.friction_force(scene, depth, instant.speed)
    cutting = axial.cutting_force(scene, depth, instant.speed, deepest)
    axial_force = axial_force_at(plant, step, at_start=at_start, inertia=inertia)
    needed, tissue = _reactions(plant, step, end, at_start=at_start, inertia=inertia)
    hub_force, hub_moment = reactions_of_clamp(plant, needed, depth, solution.forces)
    path_position, path_deflection = (np.zeros(0), np.zeros(0)) if end.path is None else end.path.points()
    return Sample(
        time=instant.time,
        depth=depth,
        speed=instant.speed,
        coordinates=solution.coordinates,
        velocities=solution.velocities if inertia else _rate_of_coordinates(step, at_start=at_start),
        accelerations=_accelerations(step, at_start=at_start, inertia=inertia),
        point_forces=solution.forces,
        guide_force=_guide_forces(step, end, inertia=inertia),
        push_force=mass * instant.acceleration + friction + cutting - axial_force,
        friction_force=friction,
        cutting_force=cutting,
        axial_force=axial_force,
        tissue_force=tissue,
        hub_force=hub_force,
        hub_moment=hub_moment,
        axial_kinetic_energy=0.5 * mass * instant.speed**2,
        path_position=path_position,
        path_deflection=path_deflection,
        path_cubics=np.zeros((0, 4)) if end.path is None else end.path.coefficients,
        **_ledger_values(end, works, inertia=inertia),
    )


def axial_force_at(plant: Plant, step: StepParts, *, at_start: bool, inertia: bool) -> float:
    """Return the axial force A [N] at the end, or the start, of a step; 0 of a model whose push does not feel it."""
    if not plant.axial_force_acts:
        return 0.0
    end = step.ends[0] if at_start else step.ends[1]
    force = configuration_force(plant, end.stage, end.solution, inertia=inertia)
    return force - float(_rate(step, _axial_momenta(step), at_start=at_start)) if inertia else force


def _ledger_values(end: StepEnd, works: Works, *, inertia: bool) -> dict[str, float]:
    energy = energies(end.stage, end.solution, inertia=inertia)
    held = {f"{field.name}_energy": getattr(energy, field.name) for field in fields(energy)}
    return held | {field.name: float(getattr(works, field.name)) for field in fields(works)}


def _reactions(plant: Plant, step: StepParts, end: StepEnd, *, at_start: bool, inertia: bool) -> tuple[Array, float]:
    """Return what the coordinates' equations lack, which a clamp gives, and the tissue's total lateral force."""
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
    return np.asarray(needed), -float(plant.deflection_at_one @ tissue)


def reactions_of_clamp(plant: Plant, residual: Array, depth: float, point_forces: Array) -> tuple[float, float]:
    """Return force [N] and moment [N m] of the clamp; the surface carries the tip force of a needle that is hardly inserted."""
    if depth < plant.smallest_depth:
        return -float(point_forces[-1]), 0.0
    return plant.clamp_reactions(residual, depth)


def _guide_forces(step: StepParts, end: StepEnd, *, inertia: bool) -> Array:
    """Return the guides' forces; where no node is the end a rigid one's mean, about which its multiplier alternates."""
    points = end.stage.points
    forces = end.solution.forces[: points.guides]
    if not inertia or step.method.nodes[-1] == 1.0:
        return forces
    weighted = [w * s.forces[: points.guides] for w, s in zip(step.method.weights, step.solutions, strict=True)]
    return np.where(points.guide_compliance > 0.0, forces, np.sum(weighted, axis=0)) if points.guides else forces


def _axial_momenta(step: StepParts) -> list[float]:
    pairs = [(step.ends[0].stage, step.ends[0].solution), *zip(step.stages, step.solutions, strict=True)]
    return [axial_momentum(stage, solution.coordinates, solution.velocities) for stage, solution in pairs]


def _accelerations(step: StepParts, *, at_start: bool, inertia: bool) -> Array:
    states = [step.ends[0].solution, *step.solutions]
    if not inertia:
        return np.zeros_like(states[0].coordinates)
    return np.asarray(_rate(step, [state.velocities for state in states], at_start=at_start))


def _rate_of_coordinates(step: StepParts, *, at_start: bool) -> Array:
    states = [step.ends[0].solution, *step.solutions]
    return np.asarray(_rate(step, [state.coordinates for state in states], at_start=at_start))


def _rate(step: StepParts, values: list[Any], *, at_start: bool) -> Any:
    """Differentiate the polynomial through the values at the start and at the two nodes."""
    slopes = step.method.start_slope if at_start else step.method.end_slope
    return sum(slope * (value - values[0]) for slope, value in zip(slopes, values[1:], strict=True)) / step.length
