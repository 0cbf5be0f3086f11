"""A held needle without damping under constant loads: eigenvectors once, then cosines, exact at any time.

    q(t) = q_e + sum_i Phi_i (a_i cos omega_i t + b_i sin omega_i t),   K Phi_i = omega_i^2 M Phi_i,   Phi' M Phi = 1

about the equilibrium q_e under the loads; a and b follow from the state at the start of the run.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.collocation import Collocation, collocation
from fem_needle.free_response import frozen_matrices, vibrations
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd
from fem_needle.loads import is_steady, turns_with_needle
from fem_needle.motion import Motion, depth_law
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.stages import StageSolution, momentum
from fem_needle.statics import static_state
from fem_needle.steppers import Step

Array = NDArray[np.float64]

RESOLVED = 1e-2  # of 1 / omega of the highest mode: a step in which every rate is resolved


def needs_no_steps(scene: Scene) -> bool:
    """Return whether eigenvectors and cosines give a dynamic run: a held, undamped, clamped needle under constant loads."""
    tissue = scene.tissue
    is_free = tissue.rest_line == "straight" and not any(layer.damping > 0 for layer in tissue.layers)
    is_held = scene.insertion.kind == "hold" and is_steady(scene)
    is_clamped = not scene.support.guides and not turns_with_needle(scene)
    return is_free and is_held and is_clamped and scene.numerics.spectral_radius == 1.0 and scene.model.variant != "as-printed"


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
        return static_state(self.plant, stage.operators, stage.points, stage.case, depth=depth, time=time)[0]

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

    @property
    def resolved_time(self) -> float:
        """A time [s] in which even the fastest vibration hardly moves."""
        return RESOLVED / float(self._modes[0][-1])

    def at(self, time: float) -> StepEnd:
        """Return the state at a time [s]."""
        frequencies, shapes, cosines, sines = self._modes
        clamped, phases = self.plant.prescribed, frequencies * (time - self.origin.stage.instant.time)
        coordinates, velocities = self._rest.copy(), np.zeros_like(self._rest)
        coordinates[clamped:] += shapes @ (cosines * np.cos(phases) + sines * np.sin(phases))
        velocities[clamped:] = shapes @ (frequencies * (sines * np.cos(phases) - cosines * np.sin(phases)))
        stage = replace(self.origin.stage, instant=replace(self.origin.stage.instant, time=time))
        forces = self.origin.solution.forces
        return StepEnd(stage, StageSolution(coordinates, velocities, momentum(stage, coordinates, velocities), forces))

    def over(self, times: Array) -> tuple[Array, Array]:
        """Return coordinates and velocities at many times [s] (T, n)."""
        frequencies, shapes, cosines, sines = self._modes
        phases = np.outer(times - self.origin.stage.instant.time, frequencies)
        cosine, sine = np.cos(phases), np.sin(phases)
        coordinates = np.tile(self._rest, (len(times), 1))
        velocities, clamped = np.zeros_like(coordinates), self.plant.prescribed
        coordinates[:, clamped:] += (cosines * cosine + sines * sine) @ shapes.T
        velocities[:, clamped:] = (frequencies * (sines * cosine - cosines * sine)) @ shapes.T
        return coordinates, velocities

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


def vibrating_tips(plant: Plant, times: Array) -> Array:
    """Return the tip deflections [m] at times [s] of a scene that `needs_no_steps`."""
    return Vibration(plant, initial_state(plant, depth_law(plant.scene))).tips(times)


@dataclass(frozen=True, eq=False)
class ModalStep(Step):
    """A step of any length; its rates are taken on a short one at its end or at its start."""

    vibration: Vibration = field(kw_only=True)

    def resolved(self, *, at_start: bool) -> Step:
        """Return the short step with the same start, or the same end."""
        edge = self.ends[0 if at_start else 1].stage.instant.time
        start = edge if at_start else edge - self.vibration.resolved_time
        return _between(self.vibration, self.method, self.vibration.at(start), start + self.vibration.resolved_time)


@dataclass(frozen=True, eq=False)
class ModalStepper:
    """Goes from one output to the next without steps between."""

    plant: Plant
    inertia: bool = True
    method: Collocation = field(default_factory=lambda: collocation(1.0))

    def start(self, law: Motion, time: float, until: float, before: StepEnd) -> StepEnd:
        """Return the state: nothing jumps while the needle is held."""
        return before

    def advance(self, law: Motion, start: StepEnd, until: float, last: Step | None) -> Step:
        """Return the step to a time."""
        known = last.vibration if isinstance(last, ModalStep) else None
        return _between(known or Vibration(self.plant, start), self.method, start, until)


def _between(vibration: Vibration, method: Collocation, start: StepEnd, until: float) -> ModalStep:
    time = start.stage.instant.time
    length = until - time
    nodes = [vibration.at(time + node * length) for node in method.nodes]
    return ModalStep(
        vibration.plant,
        method,
        length,
        (start, vibration.at(until)),
        tuple(node.stage for node in nodes),
        tuple(node.solution for node in nodes),
        vibration=vibration,
    )
