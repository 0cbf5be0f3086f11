"""Tips and shapes of equilibria as functions of a scene's parameters, with exact sensitivities.

An equilibrium obeys K(p) q = f(p) with guides N q + (B + compliance) R = 0, so that

    K dq/dp = df/dp - dK/dp q + N.dR/dp

with dK/dk_i = m F_i (one unit matrix for each layer) and dK/dEI = K_bending / EI: exact, and one solution with the factors that
the equilibrium has anyway.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.beam_needle import BeamNeedle
from fem_needle.errors import SceneError
from fem_needle.loads import LoadCase, load_case
from fem_needle.models import build_plant
from fem_needle.plant import Operators, Points
from fem_needle.scene import LateralLoad, Scene, TipLoad, as_function
from fem_needle.statics import Statics, known_coordinates, solve_guided

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Place:
    """What is measured at one instant at rest.

    Attributes
    ----------
    depth, time
        [m], [s].
    arc_length
        Stations of the deflection, from the hub, 0, to the tip, l [m].
    """

    depth: float
    time: float
    arc_length: Array


@dataclass(frozen=True, eq=False)
class _Change:
    """How an instant changes with a parameter; None: not at all.

    Attributes
    ----------
    tissue, bending
        dG/dp and dK/dp, band.
    forces, clamp
        df/dp of the loads, and of the hub's place.
    softness
        d(1/EI)/dp by 1/EI: of the kinks that a force makes inside an element.
    """

    tissue: Array | None = None
    bending: Array | None = None
    forces: Array | None = None
    clamp: Array | None = None
    softness: float = 0.0


Rule = Callable[["_Instant", BeamNeedle], _Change]


@dataclass(frozen=True, eq=False)
class _Instant:
    """An instant of a plant with the values that the parameters have."""

    place: Place
    operators: Operators
    points: Points
    case: LoadCase
    factor: float


def exact_rule(scene: Scene, path: str) -> Rule | None:
    """Return how a parameter enters equilibria, None where that is not known exactly."""
    path = numbered(scene, path)
    keys = path.split(".")
    if keys[:2] == ["tissue", "layers"] and keys[-1] == "foundation_modulus":
        return _modulus_rule(scene, int(keys[2]))
    if path in {"needle.bending_stiffness", "needle.youngs_modulus"}:
        value = float(getattr(scene.needle, keys[1]))
        if scene.support.guides:
            return None
        return lambda at, plant: _Change(bending=at.operators.bending / value, softness=-1.0 / value)
    if keys[0] == "loads" and keys[-1] in {"force", "bevel_coefficient"}:
        return _load_rule(scene, int(keys[1]), keys[-1])
    if path in {"support.hub_deflection", "support.hub_angle"} and scene.support.kind == "hub":
        unit = np.array([1.0, 0.0] if path.endswith("deflection") else [0.0, 1.0])
        return lambda at, plant: _Change(clamp=unit)
    return None


def _modulus_rule(scene: Scene, layer: int) -> Rule:
    held = scene.tissue.layers[layer]

    def change(at: _Instant, plant: BeamNeedle) -> _Change:
        forces = np.zeros_like(at.case.forces)
        # The bevel law: the force grows with the modulus of the layer that holds the tip.
        if held.holds(at.place.depth):
            bevels = [load for load in scene.loads if isinstance(load, TipLoad) and load.bevel_coefficient is not None]
            turned = [as_function(load.direction).value(at.place.time) for load in bevels]
            forces[-1] = at.factor * sum(
                (load.bevel_coefficient or 0.0) * cosine for load, cosine in zip(bevels, turned, strict=True)
            )
        return _Change(at.factor * plant.foundation.unit_stiffness(layer, at.place.depth), forces=forces)

    return change


def _load_rule(scene: Scene, number: int, key: str) -> Rule:
    load = scene.loads[number]
    laterals = [index for index, one in enumerate(scene.loads) if isinstance(one, LateralLoad)]

    def change(at: _Instant, plant: BeamNeedle) -> _Change:
        forces = np.zeros_like(at.case.forces)
        if isinstance(load, LateralLoad):
            forces[laterals.index(number)] = 1.0
            return _Change(forces=forces)
        cosine = as_function(load.direction).value(at.place.time)
        modulus = sum(layer.foundation_modulus for layer in scene.tissue.layers if layer.holds(at.place.depth))
        forces[-1] = cosine * (at.factor * modulus if key == "bevel_coefficient" else 1.0)
        return _Change(forces=forces)

    return change


def is_linear(scene: Scene, paths: Sequence[str]) -> bool:
    """Return whether stiffness and loads are linear in the parameters together: no bevel's modulus with its coefficient."""
    bevel = any(path.endswith("bevel_coefficient") for path in paths)
    return not (bevel and any(path.endswith("foundation_modulus") for path in paths))


@dataclass(frozen=True, eq=False)
class StaticProblem:
    """Equilibria at many places as functions of some parameters; everything that does not depend on them is built once.

    Attributes
    ----------
    plant
        The model with the values of the scene.
    instants, changes
        Of each place; how each instant changes with each parameter.
    start
        Values of the parameters in the scene (p,).
    """

    plant: BeamNeedle
    instants: tuple[_Instant, ...]
    changes: tuple[tuple[_Change, ...], ...]
    start: Array

    def answers(self, values: Array) -> tuple[Array, Array]:
        """Return deflections at all stations of all places [m] (n,), and their derivatives by the parameters (n, p)."""
        found = [self._answer(at, changes, values) for at, changes in zip(self.instants, self.changes, strict=True)]
        return np.concatenate([value for value, _ in found]), np.concatenate([slope for _, slope in found])

    def _answer(self, first: _Instant, changes: Sequence[_Change], values: Array) -> tuple[Array, Array]:
        at, place = _moved_instant(first, changes, values - self.start), first.place
        coordinates, forces = Statics(self.plant, place.depth, place.time, at.operators, at.points).state(at.case)
        slopes = [self._slope(at, change, coordinates, forces) for change in changes]
        return self._seen(at, coordinates, forces), np.stack(slopes, axis=1)

    def _seen(self, at: _Instant, coordinates: Array, forces: Array) -> Array:
        stations, place = at.place.arc_length, at.place
        if len(stations) == 1 and stations[0] == self.plant.scene.needle.length:
            return np.atleast_1d(at.points.rows[-1] @ coordinates + at.points.flexibility[-1] @ forces)
        return self.plant.deflection(coordinates, forces, place.depth, stations)

    def _slope(self, at: _Instant, change: _Change, coordinates: Array, forces: Array) -> Array:
        moved, moved_forces = _moved_state(at, self.plant, change, coordinates)
        slope = self._seen(at, moved, moved_forces)
        if change.softness:
            slope = slope + change.softness * self._seen(at, np.zeros_like(coordinates), forces)
        return slope


def static_problem(scene: Scene, places: Sequence[Place], paths: Sequence[str]) -> StaticProblem | None:
    """Return the equilibria of a scene as functions of parameters by path, None where they are not known exactly."""
    rules = [exact_rule(scene, path) for path in paths]
    known = [rule for rule in rules if rule is not None]
    plant = build_plant(scene)
    if len(known) < len(rules) or not isinstance(plant, BeamNeedle) or not is_linear(scene, paths):
        return None
    instants = tuple(_instant(scene, plant, place) for place in places)
    changes = tuple(tuple(rule(at, plant) for rule in known) for at in instants)
    return StaticProblem(plant, instants, changes, np.array([float(value_at(scene, path)) for path in paths]))


def value_at(scene: Scene, path: str) -> float:
    """Return the number at a path of a scene, SI.

    Raises
    ------
    SceneError
        If there is none, or it varies in time.
    """
    found: object = scene
    for key in numbered(scene, path).split("."):
        if isinstance(found, tuple):
            found = found[int(key)] if key.isdigit() and int(key) < len(found) else None
        else:
            found = getattr(found, key, None) if key in getattr(type(found), "model_fields", ()) else None
    if not isinstance(found, float):
        what = "nothing of this name" if found is None else f"a {type(found).__name__}"
        raise SceneError(f"{path}: is no number of the scene that could be fitted (got {what})")
    return found


def numbered(scene: Scene, path: str) -> str:
    """Return a path with the number of a layer in place of its name."""
    keys = path.split(".")
    names = [layer.name for layer in scene.tissue.layers]
    if keys[:2] == ["tissue", "layers"] and len(keys) > 2 and keys[2] in names:
        keys[2] = str(names.index(keys[2]))
    return ".".join(keys)


def _instant(scene: Scene, plant: BeamNeedle, place: Place) -> _Instant:
    case = load_case(scene, place.depth, place.time)
    factor = float(as_function(scene.tissue.stiffness_factor).value(place.time))
    return _Instant(place, plant.operators(place.depth, place.time), plant.points(place.depth), case, factor)


def _moved_instant(first: _Instant, changes: Sequence[_Change], steps: Array) -> _Instant:
    """Return an instant after the parameters have changed by some steps."""
    operators, case, points = first.operators, first.case, first.points
    tissue, bending, forces, clamp = operators.tissue, operators.bending, case.forces, case.clamp
    softness = 0.0
    for change, step in zip(changes, steps, strict=True):
        tissue = tissue if change.tissue is None else tissue + step * change.tissue
        bending = bending if change.bending is None else bending + step * change.bending
        forces = forces if change.forces is None else forces + step * change.forces
        clamp = clamp if change.clamp is None else clamp + step * change.clamp
        softness += step * change.softness
    if softness:  # B is proportional to 1 / EI = 1 / (EI_0 (1 + step / EI_0))
        points = replace(points, flexibility=points.flexibility / (1.0 - softness))
    flexible = operators.beam if bending is operators.bending else None
    return replace(
        first,
        operators=replace(operators, tissue=tissue, bending=bending, beam=flexible),
        case=replace(case, forces=forces, clamp=clamp),
        points=points,
    )


def _moved_state(at: _Instant, plant: BeamNeedle, change: _Change, coordinates: Array) -> tuple[Array, Array]:
    """Return dq/dp and the derivative of the point forces."""
    points, guides = at.points, at.points.guides
    forces = np.zeros_like(at.case.forces) if change.forces is None else change.forces
    still = np.zeros(2)
    clamp = still if change.clamp is None else change.clamp
    known = known_coordinates(plant, LoadCase(forces, forces, clamp, still, still))
    force = points.rows[guides:].T @ forces - banded.multiply(at.operators.tissue, known)
    for changed in (change.tissue, change.bending):
        if changed is not None:
            force = force - banded.multiply(changed, coordinates)
    gap = points.rows[:guides] @ known + points.flexibility[:guides, guides:] @ forces
    free, reactions = solve_guided(plant, at.operators, points, force, gap)
    return known + free, np.concatenate([reactions, forces])
