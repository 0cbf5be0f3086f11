"""A held needle without damping under constant loads: eigenvectors once, then cosines, exact at any time.

    q(t) = q_e + sum_i Phi_i (a_i cos omega_i t + b_i sin omega_i t),   K Phi_i = omega_i^2 M Phi_i,   Phi' M Phi = 1

about the equilibrium q_e under the loads; a and b follow from the state at the start of the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.free_response import frozen_matrices, vibrations
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd
from fem_needle.loads import is_steady, load_case, turns_with_needle
from fem_needle.motion import depth_law, wanted_radius
from fem_needle.plant import Plant
from fem_needle.sample_arrays import NO_PATH, SINCE_START, Samples
from fem_needle.scene import Scene
from fem_needle.stages import StageSolution, evaluate_stage
from fem_needle.statics import Statics

Array = NDArray[np.float64]


def needs_no_steps(scene: Scene) -> bool:
    """Return whether eigenvectors and cosines give a dynamic run: a held, undamped, clamped needle under constant loads."""
    return scene.insertion.kind == "hold" and is_steady(scene) and is_free_to_swing(scene)


def is_free_to_swing(scene: Scene) -> bool:
    """Return whether a needle that is held swings without damping, memory, guides or a hub that gives way, exactly (radius 1)."""
    tissue = scene.tissue
    is_free = tissue.rest_line == "straight" and not any(layer.damping > 0 for layer in tissue.layers)
    is_clamped = not scene.support.guides and not turns_with_needle(scene)
    return is_free and is_clamped and wanted_radius(scene) == 1.0 and scene.model.variant != "as-printed"


@dataclass(frozen=True, eq=False)
class Vibration:
    """The motion of a plant about its equilibrium.

    Attributes
    ----------
    plant
        The model.
    origin
        State at the start of the run.
    """

    plant: Plant
    origin: StepEnd

    @cached_property
    def _rest(self) -> Array:
        stage = self.origin.stage
        depth, time = stage.instant.depth, stage.instant.time
        return Statics(self.plant, depth, time, stage.operators, stage.points).state(stage.case)[0]

    @cached_property
    def _modes(self) -> tuple[Array, Array, Array, Array]:
        """Natural frequencies [rad/s], shapes of the free coordinates, amplitudes of cosines and sines."""
        instant, clamped = self.origin.stage.instant, self.plant.prescribed
        mass, _, stiffness, basis = frozen_matrices(self.plant, instant.depth, instant.time)
        vectors = vibrations(mass, stiffness)[1]
        shapes = basis.T @ vectors
        squares = _quotients(stiffness, mass, vectors, self._bending(shapes))
        weighed = banded.trailing(self.origin.stage.operators.mass, clamped)
        solution = self.origin.solution
        away = solution.coordinates - self._rest
        frequencies = np.sqrt(squares)
        cosines = shapes.T @ banded.multiply(weighed, away[clamped:])
        speeds = shapes.T @ banded.multiply(weighed, solution.velocities[clamped:])
        return frequencies, shapes, cosines, speeds / frequencies

    def _bending(self, shapes: Array) -> tuple[Array, Array] | None:
        """Return q.K q of shapes and the rest of the stiffness, where bending is known better than by a matrix."""
        operators, clamped = self.origin.stage.operators, self.plant.prescribed
        if operators.beam is None:
            return None
        columns = np.vstack([np.zeros((clamped, shapes.shape[1])), shapes])
        return operators.beam.bending_forms(columns), banded.to_dense(banded.trailing(operators.tissue, clamped))

    def over(self, times: Array) -> tuple[Array, Array, Array]:
        """Return coordinates, velocities and accelerations at many times [s] (T, n)."""
        frequencies, shapes, cosines, sines = self._modes
        phases = np.outer(times - self.origin.stage.instant.time, frequencies)
        cosine, sine = np.cos(phases), np.sin(phases)
        coordinates = np.tile(self._rest, (len(times), 1))
        velocities, accelerations = np.zeros_like(coordinates), np.zeros_like(coordinates)
        clamped, away = self.plant.prescribed, cosines * cosine + sines * sine
        coordinates[:, clamped:] += away @ shapes.T
        velocities[:, clamped:] = (frequencies * (sines * cosine - cosines * sine)) @ shapes.T
        accelerations[:, clamped:] = -(frequencies**2 * away) @ shapes.T
        return coordinates, velocities, accelerations

    def tips(self, times: Array) -> Array:
        """Return the tip deflections [m] at times [s]."""
        frequencies, shapes, cosines, sines = self._modes
        row, phases = self.origin.stage.points.rows[-1], np.outer(times - self.origin.stage.instant.time, frequencies)
        tips = row[self.plant.prescribed :] @ shapes
        moved: Array = row @ self._rest + np.cos(phases) @ (cosines * tips) + np.sin(phases) @ (sines * tips)
        return moved


def _quotients(stiffness: Array, mass: Array, vectors: Array, bending: tuple[Array, Array] | None) -> Array:
    """Return x'K x / x'M x of every vector x, in extended precision: the error of a vector enters squared.

    The entries of K, and its factors in an eigenvalue solver, lose eps n^4 on n elements, which a phase of many turns shows:
    ``bending`` has what curvatures say, and the tissue's matrix.
    """
    wide = vectors.astype(np.longdouble)
    elastic = _energies(stiffness, wide) if bending is None else bending[0] + _energies(bending[1], wide)
    return np.asarray(elastic / _energies(mass, wide), dtype=float)


def _energies(matrix: Array, vectors: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Return x'A x of the columns x, diagonal by diagonal."""
    size, found = len(matrix), np.zeros(vectors.shape[1], dtype=np.longdouble)
    for offset in range(1 - size, size):
        diagonal = np.diagonal(matrix, offset)
        if np.any(diagonal):
            rows = slice(max(0, -offset), size - max(0, offset))
            columns = slice(max(0, offset), size - max(0, -offset))
            found += np.sum(diagonal.astype(np.longdouble)[:, None] * vectors[rows] * vectors[columns], axis=0)
    return found


def under_way(plant: Plant, time: float, coordinates: Array, momentum: Array) -> Vibration:
    """Return the vibration of a needle that is held from a time [s] on, with what it brings along."""
    law = depth_law(plant.scene)
    case = load_case(plant.scene, law.depth(time), time)
    stage, clamped, velocities = evaluate_stage(plant, law.after(time), case), plant.prescribed, np.zeros(plant.size)
    mass = banded.to_dense(banded.trailing(stage.operators.mass, clamped))
    velocities[clamped:] = np.linalg.solve(mass, momentum[clamped:])
    return Vibration(plant, StepEnd(stage, StageSolution(coordinates.copy(), velocities, momentum.copy(), case.forces), None))


def vibrating_tips(plant: Plant, times: Array) -> Array:
    """Return the tip deflections [m] at times [s] of a scene that `needs_no_steps`."""
    return Vibration(plant, initial_state(plant, depth_law(plant.scene))).tips(times)


def vibration_samples(vibration: Vibration, times: Array) -> Samples:
    """Return everything that is shown of a vibrating needle at times [s]."""
    plant, stage, start = vibration.plant, vibration.origin.stage, vibration.origin.solution
    operators, points, count = stage.operators, stage.points, len(times)
    coordinates, velocities, accelerations = vibration.over(times)
    forces = np.tile(start.forces, (count, 1))
    bent, held = (_products(band, coordinates) for band in (operators.bending, operators.tissue))
    kinetic = 0.5 * np.sum(velocities * _products(operators.mass, velocities), axis=1)
    bending = np.sum(coordinates * bent, axis=1)
    if operators.beam is not None:
        bending = operators.beam.bending_forms(coordinates.T)
    kinks = float(start.forces @ points.flexibility @ start.forces)
    needed = _products(operators.mass, accelerations) + bent + held - points.rows.T @ start.forces
    axial_forces = _axial_forces(vibration, coordinates, velocities, accelerations)
    hub = _clamp(plant, needed, stage.instant.depth)
    moved = (coordinates - start.coordinates) @ points.rows.T
    none = np.zeros(count)
    return Samples(
        time=times.copy(),
        depth=np.full(count, stage.instant.depth),
        coordinates=coordinates,
        velocities=velocities,
        accelerations=accelerations,
        point_forces=forces,
        guide_force=np.zeros((count, 0)),
        push_force=-axial_forces,
        axial_force=axial_forces,
        tissue_force=-held @ plant.deflection_at_one,
        hub_force=hub[:, 0],
        hub_moment=hub[:, 1],
        kinetic_energy=kinetic,
        bending_energy=0.5 * (bending + kinks),
        tissue_energy=0.5 * np.sum(coordinates * held, axis=1),
        load_work=np.sum(forces * moved, axis=1),
        **NO_PATH,
        path_points=np.zeros(count, dtype=np.int64),
        **dict.fromkeys(_NEVER, none),
    )


_WORKS = (name for name in SINCE_START if name != "load_work")
_NEVER = ("speed", "friction_force", "cutting_force", "guide_energy", "axial_kinetic_energy", *_WORKS)


def _products(band: Array, vectors: Array) -> Array:
    """Return A x of vectors (T, n)."""
    return np.asarray(vectors @ banded.to_dense(band).T, dtype=float)


def _clamp(plant: Plant, needed: Array, depth: float) -> Array:
    """Return force and moment of the clamp (T, 2), linear in what the first coordinates lack."""
    units = np.zeros((2, needed.shape[1]))
    units[0, 0], units[1, 1] = 1.0, 1.0
    answers = np.array([plant.clamp_reactions(unit, depth) for unit in units])
    return needed[:, :2] @ answers


def _axial_forces(vibration: Vibration, coordinates: Array, velocities: Array, accelerations: Array) -> Array:
    """Return A = dL/dz - d/dt (q'.S q) of a held needle at every time [N] (T,)."""
    plant, stage, forces = vibration.plant, vibration.origin.stage, vibration.origin.solution.forces
    if not plant.axial_force_acts:
        return np.zeros(len(coordinates))
    depth, time, points = stage.instant.depth, stage.instant.time, stage.points
    stiffer = np.array([plant.stiffness_rate_product(unit, depth, time) for unit in np.eye(plant.size)])
    found = -0.5 * np.sum(coordinates * (coordinates @ stiffer), axis=1)
    found += [plant.kinetic_rate(rate, at, depth, 0.0) for rate, at in zip(velocities, coordinates, strict=True)]
    found += coordinates @ (points.row_rates.T @ forces) + 0.5 * forces @ points.flexibility_rate @ forces
    convection = stage.operators.convection
    if convection is not None:
        swept = _products(convection, coordinates)
        found -= np.sum(accelerations * swept, axis=1) + np.sum(velocities * _products(convection, velocities), axis=1)
    return np.asarray(found)
