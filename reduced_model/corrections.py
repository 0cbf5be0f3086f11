"""Static corrections: static responses to loads and hub motion, as shapes beside the modes.

A response is what the scene's loads could ask for, one by one: a unit force at each lateral load and at the tip, a unit torque, a
unit deflection and angle of a hub that moves. Under ``hub``, and in the inserted length, the response changes with the depth, so
a few depths of the run are taken, from finite elements. In the full length under ``entry`` two functions hold every static shape
at every depth (`clamped_solutions`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle import FiniteElementNeedle
from fem_needle.beam_needle import points_of
from fem_needle.exact.krylov import characteristic_number
from fem_needle.gauss import gauss_rule
from fem_needle.loads import LoadCase, load_case
from fem_needle.plant import Plant
from fem_needle.scene import Constant, Scene, as_function
from fem_needle.statics import statics_at
from reduced_model.clamped_solutions import ClampedSolutions
from reduced_model.shapes import GAUSS_POINTS, FunctionSet, ModeSet

Array = NDArray[np.float64]

REFERENCE_ELEMENTS = 64
DEPTHS = 4  # of a run in which the needle moves
LARGEST_NUMBER = 14.0  # (k/4EI)^(1/4) l up to which the clamped solutions are exact
PUSH_INSTANTS = 101  # at which the sense of a push is looked at
NEAR_HUB = 1e-3  # of the depth at which the hub meets a guide or a finger: no response is taken deeper
SHALLOW = 0.05  # of the length: no response is taken shallower
INDEPENDENCE = 1e-9  # of a shape's bending energy: what must be new in it


@dataclass(frozen=True, eq=False)
class Response:
    """A static response of the reference needle, as a function on the line of the shapes.

    Attributes
    ----------
    plant, depth
        The reference and its depth [m].
    coordinates, forces
        State and point forces.
    stretch
        Metres per unit of place: 1, or the depth on the inserted length.
    """

    plant: FiniteElementNeedle
    depth: float
    coordinates: Array
    forces: Array
    stretch: float
    count: ClassVar[int] = 1

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return the deflection, or a derivative by place, at places (n,); shape (1, n)."""
        start = self.plant.scene.needle.length - self.depth if self.plant.is_entry else 0.0
        stations = start + positions * self.stretch
        found = self.plant.deflection(self.coordinates, self.forces, self.depth, stations, derivative)
        return (found * self.stretch**derivative)[None]

    @property
    def breaks(self) -> Array:
        """Nodes and point forces."""
        length = self.plant.scene.needle.length
        points = [length - self.depth + y for y in self.plant.point_positions]
        return np.sort(np.concatenate([self.plant.mesh.nodes, points]))


@dataclass(frozen=True, eq=False)
class CorrectionSet:
    """Responses without what the modes, and one another, hold of them: orthonormal in bending over the whole line.

    Attributes
    ----------
    modes
        The modes.
    responses
        The responses.
    span
        The line's end.
    combinations
        Rows: corrections by modes and responses.
    """

    modes: ModeSet
    responses: tuple[FunctionSet, ...]
    span: float
    combinations: Array

    @property
    def count(self) -> int:
        """Number of corrections."""
        return len(self.combinations)

    @property
    def breaks(self) -> Array:
        """Those of the responses."""
        return np.unique(np.concatenate([response.breaks for response in self.responses]))

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return the corrections, or a derivative."""
        return np.asarray(self.combinations @ _stacked(self.modes, self.responses, positions, derivative), dtype=float)


def correction_sets(scene: Scene, modes: ModeSet, span: float) -> list[FunctionSet]:
    """Return the corrections of a scene, none where they add nothing to the modes."""
    responses = tuple(_responses(scene, span))
    if not responses:
        return []
    combinations = _independent(modes, responses, span)
    return [CorrectionSet(modes, responses, span, combinations)] if len(combinations) else []


def correction_warnings(scene: Scene) -> tuple[str, ...]:
    """Return where rounding spoils the corrections: the clamped solutions of very stiff tissue grow as exp((k/4EI)^(1/4) l)."""
    model = scene.model
    if not model.static_corrections or scene.support.kind == "hub" or model.basis != "full-length":
        return ()
    moduli = [layer.foundation_modulus for layer in scene.tissue.layers]
    number = float(characteristic_number(max(moduli, default=0.0) / scene.needle.bending_stiffness)) * scene.needle.length
    if number <= LARGEST_NUMBER:
        return ()
    return (
        f"(k/4EI)^(1/4) l = {number:.3g} > {LARGEST_NUMBER:g}: static corrections of the full length lose their digits; "
        "take basis 'inserted-length' or model 'fem'",
    )


def _responses(scene: Scene, span: float) -> Iterator[FunctionSet]:
    factor = as_function(scene.tissue.stiffness_factor)
    if scene.support.kind == "entry" and span == scene.needle.length:
        yield from (ClampedSolutions(scene, factor.value(time)) for time in _times(scene))
        return
    plant = FiniteElementNeedle(_still(scene), elements=REFERENCE_ELEMENTS, degree=4)
    for time in _times(scene):
        for depth in _depths(scene):
            yield from _unit_responses(plant, depth, time, depth if plant.is_entry else 1.0)


def _still(scene: Scene) -> Scene:
    """Return the scene as finite elements take it: the responses do not depend on the kinematics or the variant."""
    kinematics = {"model.variant": None, "model.kinematics": None}
    return scene.with_values({"model.kind": "fem", "numerics.mesh": None} | kinematics)


def _times(scene: Scene) -> list[float]:
    if isinstance(as_function(scene.tissue.stiffness_factor), Constant):
        return [0.0]
    return np.linspace(0.0, scene.duration, 3).tolist()


def _depths(scene: Scene) -> list[float]:
    """Return one depth of a needle that hardly moves, else the points of Chebyshev and Lobatto of the run's depths."""
    length, points = scene.needle.length, points_of(scene)
    reach = length
    if points:  # deeper than this the hub meets one of them
        reach = (1 - NEAR_HUB) * (length + min(point.position for point in points))
    lowest, highest = (min(max(depth, SHALLOW * length), reach) for depth in _depth_range(scene))
    if highest - lowest < SHALLOW * length:
        return [highest]
    middle, half = 0.5 * (highest + lowest), 0.5 * (highest - lowest)
    angles = np.pi * np.arange(DEPTHS) / (DEPTHS - 1)
    return (middle - half * np.cos(angles)).tolist()


def _depth_range(scene: Scene) -> tuple[float, float]:
    """Return the depths between which the run may be [m]; a push draws out as far as it can."""
    if scene.insertion.kind != "force":
        return scene.insertion.depth_range(scene.duration)
    push = as_function(scene.insertion.push_force or 0.0)
    instants = np.linspace(0.0, scene.duration or 1.0, PUSH_INSTANTS).tolist()
    lowest = 0.0 if min(push.value(time) for time in instants) < 0.0 else scene.insertion.first_depth
    return lowest, scene.insertion.final_depth or scene.needle.length


def _unit_responses(plant: FiniteElementNeedle, depth: float, time: float, stretch: float) -> Iterator[FunctionSet]:
    statics = statics_at(plant, depth, time)
    for case in _unit_cases(plant, load_case(plant.scene, depth, time)):
        coordinates, forces = statics.state(case)
        clamp = coordinates[:2]  # a hub that turns has an angle of its own
        yield Response(plant, depth, coordinates - plant.straight(float(clamp[0]), float(clamp[1])), forces, stretch)


def _unit_cases(plant: Plant, case: LoadCase) -> Iterator[LoadCase]:
    """Yield load cases of one unit force or one unit of hub motion each."""
    zero, still = np.zeros_like(case.forces), np.zeros(2)
    for unit in np.eye(len(zero)):
        yield replace(case, forces=unit, clamp=still)
    support = plant.scene.support
    for moved, unit in zip((support.hub_deflection, support.hub_angle), np.eye(2), strict=True):
        if plant.scene.support.kind == "hub" and moved != 0.0:
            yield replace(case, forces=zero, clamp=unit)


def _stacked(modes: ModeSet, responses: tuple[FunctionSet, ...], positions: Array, derivative: int) -> Array:
    return np.vstack([modes.values(positions, derivative), *(part.values(positions, derivative) for part in responses)])


def _independent(modes: ModeSet, responses: tuple[FunctionSet, ...], span: float) -> Array:
    """Return the combinations by Gram and Schmidt in the bending energy over the whole line, twice for rounding's sake."""
    positions, weights = _quadrature(modes, responses, span)
    curvatures = _stacked(modes, responses, positions, 2) * np.sqrt(weights)
    count = len(curvatures)
    held = [np.eye(count)[i] / np.linalg.norm(curvatures[i]) for i in range(modes.count)]
    found: list[Array] = []
    for number in range(modes.count, count):
        row = np.eye(count)[number] / np.linalg.norm(curvatures[number])
        for _ in range(2):
            for other in (*held, *found):
                row = row - float((row @ curvatures) @ (other @ curvatures)) * other
        left = float(np.linalg.norm(row @ curvatures))
        if left**2 > INDEPENDENCE:
            found.append(row / left)
    return np.array(found).reshape(len(found), count)


def _quadrature(modes: ModeSet, responses: tuple[FunctionSet, ...], span: float) -> tuple[Array, Array]:
    breaks = np.unique(np.concatenate([modes.breaks, *(response.breaks for response in responses)]))
    breaks = breaks[(breaks >= 0) & (breaks <= span)]
    points, weights = gauss_rule(GAUSS_POINTS)
    sizes = np.diff(breaks)[:, None]
    return (breaks[:-1, None] + sizes * points).ravel(), (sizes * weights).ravel()
