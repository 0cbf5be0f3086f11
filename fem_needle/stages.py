"""One time step: the two coupled stages of a collocation method on a plant whose matrices move.

In momentum form, with P = M q' + v S q,

    P' = v S^T q' + v^2 R q - (K + m G) q - C q' - v D q + N.forces

no derivative of the matrices and none of the speed appears, and P is what stays continuous at a jump of speed. The unknowns are
the increments of the free coordinates up to the stages; guides add their forces as multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.loads import LoadCase
from fem_needle.motion import Instant
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Plant, Points, RestTerms
from fem_needle.scene import as_function

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stage:
    """Everything of a plant at one instant.

    Attributes
    ----------
    instant
        The insertion's motion.
    operators, points, case
        Matrices, points and loads.
    rest
        What the cut path adds; None for a straight rest line.
    factor, factor_rate
        The tissue's stiffness factor, by which ``rest`` is to be multiplied, and its rate.
    """

    instant: Instant
    operators: Operators
    points: Points
    case: LoadCase
    rest: RestTerms | None = None
    factor: float = 1.0
    factor_rate: float = 0.0


@dataclass(frozen=True, eq=False)
class StageSolution:
    """Coordinates, velocities, momenta and point forces at one stage."""

    coordinates: Array
    velocities: Array
    momentum: Array
    forces: Array


def evaluate_stage(
    plant: Plant, instant: Instant, case: LoadCase, earlier: Stage | None = None, path: CutPath | None = None
) -> Stage:
    """Return the plant's matrices at an instant; those of an earlier stage serve again where nothing moved."""
    instant = replace(instant, depth=max(instant.depth, plant.smallest_depth))
    if earlier is not None and earlier.instant.depth == instant.depth and isinstance(plant.scene.tissue.stiffness_factor, float):
        stage = Stage(instant, earlier.operators, earlier.points, case)
    else:
        stage = Stage(instant, plant.operators(instant.depth, instant.time), plant.points(instant.depth), case)
    return stage if path is None else with_path(plant, stage, path)


def with_path(plant: Plant, stage: Stage, path: CutPath) -> Stage:
    """Return the stage with the tissue's springs resting on a path."""
    swelling = as_function(plant.scene.tissue.stiffness_factor)
    time, depth = stage.instant.time, stage.instant.depth
    rest = plant.rest_terms(path, depth, -inf, inf)
    return replace(stage, rest=rest, factor=swelling.value(time), factor_rate=swelling.derivative(time))


def momentum(stage: Stage, coordinates: Array, velocities: Array) -> Array:
    """Return P = M q' + v S q."""
    result = banded.multiply(stage.operators.mass, velocities)
    if stage.operators.convection is not None and stage.instant.speed:
        result += stage.instant.speed * banded.multiply(stage.operators.convection, coordinates)
    return result


def internal_force(stage: Stage, coordinates: Array, velocities: Array) -> Array:
    """Return v S^T q' + v^2 R q - (K + m G) q - C q' - v D q, the rate of P without the point forces."""
    operators, speed = stage.operators, stage.instant.speed
    result = -banded.multiply(operators.stiffness, coordinates)
    if operators.positional_error is not None:
        result -= banded.multiply(operators.positional_error, coordinates)
    if operators.velocity_error is not None:
        result -= banded.multiply(operators.velocity_error, velocities)
    if stage.rest is not None:
        result += stage.factor * stage.rest.load
    if operators.damping is not None:
        result -= banded.multiply(operators.damping, velocities)
    if speed and operators.drag is not None:
        result -= speed * banded.multiply(operators.drag, coordinates)
    if speed and operators.convection is not None and operators.centrifugal is not None:
        result += speed * banded.multiply_transposed(operators.convection, velocities)
        result += speed**2 * banded.multiply(operators.centrifugal, coordinates)
    return result


def trivial_solution(plant: Plant, stage: Stage) -> StageSolution:
    """Return the state of a straight needle at rest: its tip force is carried by the support."""
    zero = np.zeros(plant.size)
    return StageSolution(zero, zero, zero, np.concatenate([np.zeros(stage.points.guides), stage.case.forces]))
