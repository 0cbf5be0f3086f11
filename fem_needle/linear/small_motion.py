"""Small motions of depth and coordinates about an operating point: mass, damping and stiffness, exactly differentiated.

With xi = (z, q), the equations of lateral and axial motion of docs/theory.md, differentiated once:

    mass xi'' + damping xi' + stiffness xi = forces.

Derivation: docs/analysis.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial, banded
from fem_needle.linear.depth_rates import kinetic_matrix_rates, numerical_rate
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Plant, Points
from fem_needle.statics import depth_derivative, rest_of, solve_static

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """Where the equations are linearized.

    Attributes
    ----------
    depth, speed, time
        z [m], v [m/s], and the time [s] whose loads, hub and stiffness factor act, frozen.
    coordinates, velocities, accelerations
        q of the equilibrium, q' = v dq/dz, and the q'' that the equations give there; zeros at rest (but for a model with
        mistakes in it, which does not rest where its energy is least).
    point_forces
        At guides, lateral loads and tip [N].
    tip_deflection
        [m].
    path
        What the tissue rests on, frozen; None: a straight line.
    push_force
        That keeps the speed [N]; at rest without friction, which may take any value up to its threshold.
    """

    depth: float
    speed: float
    time: float
    coordinates: Array
    velocities: Array
    accelerations: Array
    point_forces: Array
    tip_deflection: float
    push_force: float = 0.0
    path: CutPath | None = None


@dataclass(frozen=True, eq=False)
class SmallMotion:
    """Linear equations of xi = (z, q), clamped coordinates included, guides not yet.

    Attributes
    ----------
    mass, damping, stiffness
        Shape (1 + size, 1 + size).
    rows
        How the deflections at the points change with xi, (points, 1 + size): N, before it dN/dz q + dB/dz P.
    points
        The points at the operating depth.
    subspace
        Directions (free coordinates, rank) to which the plant restricts solutions; None: all.
    """

    mass: Array
    damping: Array
    stiffness: Array
    rows: Array
    points: Points
    subspace: Array | None = None


@dataclass(frozen=True, eq=False)
class _Dense:
    """The matrices of a plant at one depth, dense; zeros where a term is absent. The last two are a model's mistakes X and Y."""

    mass: Array
    convection: Array
    centrifugal: Array
    stiffness: Array
    damping: Array
    drag: Array
    slip: Array
    positional_error: Array
    velocity_error: Array


def operating_point(
    plant: Plant, *, depth: float, time: float, speed: float, path: CutPath | None = None
) -> OperatingPoint:
    """Return the equilibrium at a depth [m] under the loads of a time [s], passed with a speed [m/s], on a path.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    rest, is_wrong = solve_static(plant, depth=depth, time=time, path=path), _has_mistakes(plant, depth, time)
    zero = np.zeros(plant.size)
    point = OperatingPoint(
        depth, speed, time, rest.coordinates, zero, zero, rest.point_forces, rest.tip_deflection, 0.0, path
    )
    if speed:
        point = replace(point, velocities=speed * depth_derivative(plant, rest, path)[0])
    if speed or is_wrong:
        point = replace(point, accelerations=_accelerations(plant, point))
    return replace(point, push_force=_push_force(plant, point))


def small_motion(plant: Plant, point: OperatingPoint, *, moves: bool) -> SmallMotion:
    """Return the linear equations about an operating point.

    Parameters
    ----------
    plant
        Any model.
    point
        The operating point.
    moves
        Whether the depth is a coordinate; where it is not, its row and column are incomplete.
    """
    dense, points = _dense(plant, point.depth, point.time), plant.points(point.depth)
    known = points.row_rates @ point.coordinates + points.flexibility_rate @ point.point_forces
    motion = SmallMotion(
        *_at_rest(plant, point, dense, points),
        rows=np.column_stack([known, points.rows]),
        points=points,
        subspace=plant.operators(point.depth, point.time).subspace,
    )
    if point.speed or np.any(point.accelerations):
        motion = _with_speed(plant, point, dense, motion, moves=moves)
    if not plant.axial_force_acts:
        return _without_axial_force(plant, point, motion)
    if moves:
        motion.stiffness[0, 0] += float(numerical_rate(lambda z: _rate_of_energy(plant, point, z), point.depth, plant.scene))
    return motion


def _without_axial_force(plant: Plant, point: OperatingPoint, motion: SmallMotion) -> SmallMotion:
    """Return the motion of a model whose depth feels nothing of the bending: mass and friction alone in the axial row."""
    scene, friction = plant.scene, plant.scene.friction
    mass, damping, stiffness = (matrix.copy() for matrix in (motion.mass, motion.damping, motion.stiffness))
    for matrix in (mass, damping, stiffness):
        matrix[0] = 0.0
    mass[0, 0] = scene.needle.mass_per_length * scene.needle.length
    damping[0, 0] = axial.viscous_coefficient(scene, point.depth)
    stiffness[0, 0] = np.sign(point.speed) * friction.coulomb_per_length + point.speed * friction.viscous_per_length
    return replace(motion, mass=mass, damping=damping, stiffness=stiffness)


def _has_mistakes(plant: Plant, depth: float, time: float) -> bool:
    """Return whether the model has forces that come from no energy: its equilibria are none of its own equations."""
    operators = plant.operators(depth, time) if depth >= plant.smallest_depth else None
    return operators is not None and not (operators.positional_error is None and operators.velocity_error is None)


def _dense(plant: Plant, depth: float, time: float) -> _Dense:
    operators = plant.operators(depth, time)

    def full(band: Array | None) -> Array:
        return np.zeros((plant.size, plant.size)) if band is None else banded.to_dense(band)

    return _Dense(
        full(operators.mass),
        full(operators.convection),
        full(operators.centrifugal),
        full(operators.stiffness),
        full(operators.damping),
        full(operators.drag),
        full(operators.slip),
        full(operators.positional_error),
        full(operators.velocity_error),
    )


def _bordered(corner: float, row: Array, column: Array, block: Array) -> Array:
    return np.block([[np.array([[corner]]), row[None, :]], [column[:, None], block]])


def _at_rest(plant: Plant, point: OperatingPoint, dense: _Dense, points: Points) -> tuple[Array, Array, Array]:
    """Return mass, damping and stiffness of a needle at rest, but for the second derivative of the energy by depth."""
    scene, q = plant.scene, point.coordinates
    weight = scene.needle.mass_per_length * scene.needle.length
    carried, dragged = dense.convection @ q, dense.drag @ q
    pulled = plant.stiffness_rate_product(q, point.depth, point.time) - points.row_rates.T @ point.point_forces
    terms = rest_of(plant, point.path, point.depth, point.time)
    if terms is not None:
        pulled = pulled - terms.load_rate
    friction = axial.viscous_coefficient(scene, point.depth)
    return (
        _bordered(weight + float(q @ dense.centrifugal @ q), carried, carried, dense.mass),
        _bordered(friction + float(q @ dense.slip @ q), dragged, dragged, dense.damping + dense.velocity_error),
        _bordered(0.0, pulled, pulled, dense.stiffness + dense.positional_error),
    )


def _with_speed(
    plant: Plant, point: OperatingPoint, dense: _Dense, motion: SmallMotion, *, moves: bool
) -> SmallMotion:
    """Add what the speed, the velocities and the accelerations of the operating point contribute."""
    v, q, rate, twice = point.speed, point.coordinates, point.velocities, point.accelerations
    mass_rate, convection_rate, centrifugal_rate = kinetic_matrix_rates(plant, point.depth)
    gyroscopic = dense.convection - dense.convection.T
    damping, stiffness = motion.damping.copy(), motion.stiffness.copy()
    damping[1:, 1:] += v * (mass_rate + gyroscopic)
    damping[1:, 0] += (mass_rate + gyroscopic) @ rate + 2 * v * (convection_rate - dense.centrifugal) @ q
    damping[0, 1:] += (dense.convection + dense.convection.T - mass_rate) @ rate + 2 * v * dense.centrifugal @ q
    damping[0, 0] += float(2 * rate @ dense.centrifugal @ q + v * q @ centrifugal_rate @ q)
    stiffness[1:, 1:] += v**2 * (convection_rate - dense.centrifugal) + v * dense.drag
    if moves:
        moving = numerical_rate(lambda z: _moving_forces(plant, point, z), point.depth, plant.scene)
        stiffness[1:, 0] += mass_rate @ twice + moving
    stiffness[0, 1:] += dense.convection.T @ twice + 2 * v * dense.centrifugal @ rate + v**2 * centrifugal_rate @ q
    stiffness[0, 1:] += dense.drag.T @ rate + 2 * v * dense.slip @ q
    friction = plant.scene.friction
    stiffness[0, 0] += float(np.sign(v) * friction.coulomb_per_length + v * friction.viscous_per_length)
    return replace(motion, damping=damping, stiffness=stiffness)


def _moving_forces(plant: Plant, point: OperatingPoint, depth: float) -> Array:
    """Return v M_z q' + v (S - S^T) q' + v^2 (S_z - R) q + C q' + v D q + X q + Y q' at a depth, the state held."""
    v, q, rate = point.speed, point.coordinates, point.velocities
    dense = _dense(plant, depth, point.time)
    mass_rate, convection_rate, _ = kinetic_matrix_rates(plant, depth)
    carried = v * (mass_rate + dense.convection - dense.convection.T) + dense.damping + dense.velocity_error
    placed = v**2 * (convection_rate - dense.centrifugal) + v * dense.drag + dense.positional_error
    return carried @ rate + placed @ q


def _accelerations(plant: Plant, point: OperatingPoint) -> Array:
    """Return the q'' of the operating point at constant speed; the clamp rests."""
    operators, points, clamped = plant.operators(point.depth, point.time), plant.points(point.depth), plant.prescribed
    force = points.rows.T @ point.point_forces - banded.multiply(operators.stiffness, point.coordinates)
    terms = rest_of(plant, point.path, point.depth, point.time)
    if terms is not None:
        force += terms.load
    force -= _moving_forces(plant, point, point.depth)
    result = np.zeros(plant.size)
    result[clamped:] = operators.mass_factorization.solve(force[clamped:])
    return result


def _rate_of_energy(plant: Plant, point: OperatingPoint, depth: float) -> float:
    """Return what the axial equation has on its left beside inertia, friction and push, at a depth, the state held [N]."""
    q, forces, points = point.coordinates, point.point_forces, plant.points(depth)
    result = 0.5 * float(q @ plant.stiffness_rate_product(q, depth, point.time))
    result -= float(forces @ (points.row_rates @ q) + 0.5 * forces @ points.flexibility_rate @ forces)
    terms = rest_of(plant, point.path, depth, point.time)
    if terms is not None:
        result += terms.constant_rate - float(q @ terms.load_rate)
    if point.speed:
        result += _moving_energy_rate(plant, plant.operators(depth, point.time), point, depth)
    return result


def _moving_energy_rate(plant: Plant, operators: Operators, point: OperatingPoint, depth: float) -> float:
    """Return q''.S q + q'.S q' + v q'.S_z q + 2 v q'.R q + v^2 q.R_z q - dT/dz + q'.D q + v q.E q [N]."""
    v, q, rate, zero = point.speed, point.coordinates, point.velocities, np.zeros(plant.size)

    def product(band: Array | None, left: Array, right: Array) -> float:
        return 0.0 if band is None else float(left @ banded.multiply(band, right))

    # 1/2 v^2 q.R_z q - 1/2 q'.M_z q': the kinetic terms that are left of dT/dz
    result = plant.kinetic_rate(zero, q, depth, v) - plant.kinetic_rate(rate, zero, depth, 0.0)
    result += product(operators.convection, point.accelerations, q) + product(operators.convection, rate, rate)
    result += 2 * v * product(operators.centrifugal, rate, q)
    return result + product(operators.drag, rate, q) + v * product(operators.slip, q, q)


def _push_force(plant: Plant, point: OperatingPoint) -> float:
    """Return the push that keeps the speed [N]."""
    resisting = axial.friction_force(plant.scene, point.depth, point.speed)
    resisting += axial.cutting_force(plant.scene, point.depth, point.speed, point.depth)
    return resisting + (_rate_of_energy(plant, point, point.depth) if plant.axial_force_acts else 0.0)
