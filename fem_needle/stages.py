"""One time step: the two coupled stages of a collocation method on a plant whose matrices move.

In momentum form, with P = M q' + v S q,

    P' = v S^T q' + v^2 R q - (K + m G) q - C q' - v D q + N.forces

no derivative of the matrices and none of the speed appears, and P is what stays continuous at a jump of speed. The unknowns are
the increments of the free coordinates up to the stages; guides add their forces as multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.collocation import Collocation
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
    if (
        earlier is not None
        and earlier.instant.depth == instant.depth
        and isinstance(plant.scene.tissue.stiffness_factor, float)
    ):
        stage = Stage(instant, earlier.operators, earlier.points, case)
    else:
        stage = Stage(instant, plant.operators(instant.depth, instant.time), plant.points(instant.depth), case)
    return stage if path is None else with_path(plant, stage, path)


def with_path(plant: Plant, stage: Stage, path: CutPath, history: PathHistory | None = None) -> Stage:
    """Return the stage with the tissue's springs resting on a path; what lies behind a step's start comes from its history."""
    swelling = as_function(plant.scene.tissue.stiffness_factor)
    time, depth = stage.instant.time, stage.instant.depth
    if history is None:
        rest = plant.rest_terms(path, depth, -inf, inf)
    else:
        rest = history.at(plant, depth) + plant.rest_terms(path, depth, history.path.deepest, inf)
    return replace(stage, rest=rest, factor=swelling.value(time), factor_rate=swelling.derivative(time))


@dataclass(frozen=True, eq=False)
class PathHistory:
    """The path behind a step's start, integrated once for each depth of the step while the iteration goes on."""

    path: CutPath
    _known: dict[float, RestTerms] = field(default_factory=dict)

    def at(self, plant: Plant, depth: float) -> RestTerms:
        """Return the terms at a depth [m]."""
        if depth not in self._known:
            self._known[depth] = plant.rest_terms(self.path, depth, -inf, self.path.deepest)
        return self._known[depth]


def momentum(stage: Stage, coordinates: Array, velocities: Array) -> Array:
    """Return P = M q' + v S q."""
    result = banded.multiply(stage.operators.mass, velocities)
    if stage.operators.convection is not None and stage.instant.speed:
        result += stage.instant.speed * banded.multiply(stage.operators.convection, coordinates)
    return result


def velocities_of(plant: Plant, stage: Stage, coordinates: Array, start_momentum: Array) -> Array:
    """Return q' from P = M q' + v S q and the clamp's own velocity."""
    clamped = plant.prescribed
    velocities = np.zeros_like(coordinates)
    velocities[:clamped] = stage.case.clamp_rates[:clamped]
    right = (start_momentum - momentum(stage, coordinates, velocities))[clamped:]
    velocities[clamped:] = stage.operators.mass_factorization.solve(right)
    return velocities


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


@dataclass(frozen=True, eq=False)
class StepSystem:
    """The factored matrix of a step."""

    factorization: banded.Factorization | banded.RestrictedFactorization
    guide_columns: Array
    guide_answers: Array


def step_matrix(stages: tuple[Stage, Stage], method: Collocation, step: float, clamped: int) -> Array:
    """Return the matrix of both stages' free coordinates, interleaved, in band storage."""
    inverse = method.inverse / step
    size = stages[0].operators.mass.shape[1] - clamped
    middle = banded.half_bandwidth(stages[0].operators.mass)
    result = banded.zeros(2 * size, 2 * middle + 1)
    for row in range(2):
        for column in range(2):
            block = sum(inverse[row, j] * inverse[j, column] * stages[j].operators.mass for j in range(2))
            block = _add_first_order(block, stages, row, column, inverse[row, column])
            if row == column:
                block = block + stages[row].operators.stiffness
            offset = 1 + row - column
            result[offset : offset + 4 * middle + 1 : 2, column::2] = banded.trailing(block, clamped)
    return result


def _add_first_order(block: Array, stages: tuple[Stage, Stage], row: int, column: int, slope: float) -> Array:
    """Add v S, -v S^T, C, Y and, on the diagonal, v D - v^2 R + X."""
    operators, speed = stages[row].operators, stages[row].instant.speed
    if operators.damping is not None:
        block = block + slope * operators.damping
    if operators.velocity_error is not None:
        block = block + slope * operators.velocity_error
    if row == column and operators.positional_error is not None:
        block = block + operators.positional_error
    other, other_speed = stages[column].operators.convection, stages[column].instant.speed
    if operators.convection is not None and other is not None and (speed or other_speed):
        block = block + slope * (other_speed * other - speed * banded.transpose(operators.convection))
    if row == column and speed:
        if operators.drag is not None:
            block = block + speed * operators.drag
        if operators.centrifugal is not None:
            block = block - speed**2 * operators.centrifugal
    return block


def factor_step(plant: Plant, stages: tuple[Stage, Stage], method: Collocation, step: float) -> StepSystem:
    """Factor the step's matrix and solve for the guides' columns."""
    clamped, guides = plant.prescribed, stages[0].points.guides
    subspace = stages[0].operators.subspace
    both = None if subspace is None else np.asarray(np.kron(subspace, np.eye(2)), dtype=float)
    factorization = banded.factorize(step_matrix(stages, method, step, clamped), both)
    columns = np.zeros((2 * (plant.size - clamped), 2 * guides))
    for number, stage in enumerate(stages):
        columns[number::2, number * guides : (number + 1) * guides] = stage.points.rows[:guides, clamped:].T
    answers = factorization.solve(columns) if guides else columns
    return StepSystem(factorization, columns, answers)


def solve_step(
    plant: Plant,
    stages: tuple[Stage, Stage],
    method: Collocation,
    step: float,
    system: StepSystem,
    coordinates: Array,
    start_momentum: Array,
) -> tuple[StageSolution, StageSolution]:
    """Solve the stage equations from coordinates q and momentum P at the start of the step.

    The unknowns are the increments of the free coordinates since then.
    """
    clamped = plant.prescribed
    bases = [_known_motion(stage, coordinates, clamped) for stage in stages]
    right = _right_side(stages, method, step, bases, start_momentum)
    answer = system.factorization.solve(np.stack([side[clamped:] for side in right], axis=1).ravel())
    guide_forces = _guide_forces(stages, system, bases, answer)
    answer = answer + system.guide_answers @ guide_forces.ravel()
    free = answer.reshape(-1, 2)
    solutions = []
    for number, (stage, (known, known_velocity)) in enumerate(zip(stages, bases, strict=True)):
        stage_coordinates, velocities = known.copy(), known_velocity.copy()
        stage_coordinates[clamped:] += free[:, number]
        velocities[clamped:] += free @ method.inverse[number] / step
        forces = np.concatenate([guide_forces[number], stage.case.forces])
        solutions.append(
            StageSolution(stage_coordinates, velocities, momentum(stage, stage_coordinates, velocities), forces)
        )
    return solutions[0], solutions[1]


def _known_motion(stage: Stage, coordinates: Array, clamped: int) -> tuple[Array, Array]:
    """Return coordinates and velocities with the unknowns at zero: the clamp moves, the rest stays where it was."""
    known, velocities = coordinates.copy(), np.zeros_like(coordinates)
    known[:clamped], velocities[:clamped] = stage.case.clamp[:clamped], stage.case.clamp_rates[:clamped]
    return known, velocities


def _right_side(
    stages: tuple[Stage, Stage],
    method: Collocation,
    step: float,
    bases: list[tuple[Array, Array]],
    start_momentum: Array,
) -> list[Array]:
    inverse = method.inverse / step
    changes = [momentum(stage, *base) - start_momentum for stage, base in zip(stages, bases, strict=True)]
    sides = []
    for number, (stage, base) in enumerate(zip(stages, bases, strict=True)):
        guides = stage.points.guides
        side = internal_force(stage, *base) + stage.points.rows[guides:].T @ stage.case.forces
        sides.append(side - inverse[number, 0] * changes[0] - inverse[number, 1] * changes[1])
    return sides


def _guide_forces(
    stages: tuple[Stage, Stage], system: StepSystem, bases: list[tuple[Array, Array]], answer: Array
) -> Array:
    """Return the guides' forces at both stages (2, guides): N q + B P + compliance R = 0 at each stage."""
    guides = stages[0].points.guides
    if not guides:
        return np.zeros((2, 0))
    compliance = system.guide_columns.T @ system.guide_answers
    gaps = system.guide_columns.T @ answer
    for number, stage in enumerate(stages):
        block, points = slice(number * guides, (number + 1) * guides), stage.points
        compliance[block, block] += points.flexibility[:guides, :guides] + np.diag(points.guide_compliance)
        gaps[block] += points.rows[:guides] @ bases[number][0]
        gaps[block] += points.flexibility[:guides, guides:] @ stage.case.forces
    return np.asarray(np.linalg.solve(compliance, -gaps), dtype=float).reshape(2, guides)
