"""The state at t = 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem_needle.ledger import StepEnd
from fem_needle.loads import LoadCase, load_case
from fem_needle.motion import DepthLaw
from fem_needle.path import straight_path
from fem_needle.plant import Plant
from fem_needle.stages import Stage, StageSolution, evaluate_stage, momentum, trivial_solution, with_path
from fem_needle.statics import Statics

Array = NDArray[np.float64]


def initial_state(plant: Plant, law: DepthLaw) -> StepEnd:
    """Return the state at t = 0: shape and momentum as the scene's ``[initial]`` says.

    ``equilibrium``: static shape; its rate is v(0) dq/dz of the static shapes at frozen loads. ``straight`` and
    ``tip-displaced``: at rest (no momentum).
    """
    scene = plant.scene
    case = load_case(scene, law.depth(0.0), 0.0)
    path = straight_path(law.depth(0.0)) if scene.tissue.rest_line == "cut-path" else None
    stage = evaluate_stage(plant, law.after(0.0), case, path=path)
    solution = _initial_solution(plant, law, stage)
    if path is not None:  # in front of the jump at the initial depth the path begins at the tip
        path = path.seen_from(stage.instant.depth, float(stage.points.rows[-1] @ solution.coordinates))
        stage = with_path(plant, stage, path)
    return StepEnd(stage, solution, path)


def _initial_solution(plant: Plant, law: DepthLaw, stage: Stage) -> StageSolution:
    scene, case = plant.scene, stage.case
    if law.depth(0.0) < plant.smallest_depth:
        return trivial_solution(plant, stage)
    if scene.initial.shape == "equilibrium":
        return _moving_equilibrium(plant, law, stage)
    zero, guides = np.zeros(plant.size), stage.points.guides
    if scene.initial.shape == "straight":
        coordinates, reactions = plant.straight(*case.clamp), np.zeros(guides)
    else:
        coordinates, reactions = _tip_displaced(plant, stage, float(scene.initial.tip_deflection or 0.0))
    return StageSolution(coordinates, zero, zero, np.concatenate([reactions, case.forces]))


def _moving_equilibrium(plant: Plant, law: DepthLaw, stage: Stage) -> StageSolution:
    statics = _statics(plant, stage)
    rest = statics.equilibrium(stage.case)
    velocities = np.zeros(plant.size)
    if stage.instant.speed:
        velocities = stage.instant.speed * statics.derivative(rest)[0]
    start = momentum(stage, rest.coordinates, velocities)
    return StageSolution(rest.coordinates, velocities, start, rest.point_forces)


def _statics(plant: Plant, stage: Stage) -> Statics:
    return Statics(plant, stage.instant.depth, stage.instant.time, stage.operators, stage.points)


def _tip_displaced(plant: Plant, stage: Stage, tip_deflection: float) -> tuple[Array, Array]:
    """Return the clamp's own static shape plus that of a tip force, scaled to the wanted tip, and the guides' forces in it."""
    forces = np.zeros_like(stage.case.forces)
    still, statics = np.zeros(2), _statics(plant, stage)

    def shape(case: LoadCase) -> tuple[Array, Array]:
        coordinates, found = statics.state(case)
        return coordinates, found[: stage.points.guides]

    clamped, held = shape(replace(stage.case, forces=forces))
    forces[-1] = 1.0
    pushed, reactions = shape(replace(stage.case, forces=forces, clamp=still))
    tip = stage.points.rows[-1]
    share = (tip_deflection - float(tip @ clamped)) / float(tip @ pushed)
    return clamped + share * pushed, held + share * reactions
