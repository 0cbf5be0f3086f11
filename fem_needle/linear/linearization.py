"""Linearize a needle about an equilibrium at a depth: exact derivatives, named states, inputs and outputs.

Derivation, and what each input and state is: docs/analysis.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.linear.depth_rates import numerical_rate
from fem_needle.linear.guided_motion import Coordinates, Guided, guided, independent_coordinates
from fem_needle.linear.model import LinearModel, SecondOrder, Signal
from fem_needle.linear.slow_cut import slow_cut
from fem_needle.linear.small_motion import OperatingPoint, SmallMotion, operating_point, small_motion
from fem_needle.loads import turns_with_needle
from fem_needle.path import CutPath
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.threads import one_thread

Array = NDArray[np.float64]
Axial = Literal["free", "held"]


@one_thread
def linearize(
    plant: Plant,
    *,
    depth: float,
    time: float = 0.0,
    speed: float = 0.0,
    axial: Axial = "free",
    path: CutPath | None = None,
) -> LinearModel:
    """Return the linear model of a needle about its equilibrium at a depth.

    Parameters
    ----------
    plant
        Any model of a needle.
    depth
        z [m], above 0, at most where the hub meets skin, guide or lateral load; the shallower side at an interface.
    time
        Instant [s] whose loads, hub and stiffness factor act, frozen.
    speed
        v [m/s] of the operating point; q' is then v dq/dz of the equilibria.
    axial
        "free": depth and speed are states, driven by the push; of the friction only what is proportional to speed (and, at a
        speed, what grows with depth) is in the model, so at rest it is that of a needle that slides, without the
        threshold that would hold it. "held": the depth is what it is, as under friction that sticks or an insertion that
        is prescribed.
    path
        Of a scene whose tissue rests on the cut path: the path, frozen, as a run's ``samples.path_at(row)`` gives it; default:
        what a slow insertion cuts under the loads of ``time``.

    Returns
    -------
    LinearModel
        Inputs: push, each lateral load, the torque of a free hub, the tip force, the hub's motion. Outputs: deflection and
        angle of the tip, the depth and the angle of a free hub.

    Raises
    ------
    SceneError
        If depth or ``axial`` is out of range, a path is given where tissue rests on a straight line, or a needle moves in
        rigid guides.
    ComputationError
        If there is no equilibrium.
    """
    _check(plant, depth, speed, axial, path)
    moves = axial == "free"
    frozen = slow_cut(plant, depth, time) if path is None else path.up_to(depth)
    point = operating_point(plant, depth=depth, time=time, speed=speed, path=frozen)
    motion = small_motion(plant, point, moves=moves)
    guides = guided(motion, plant.prescribed)
    motion = _with_springs(motion, guides)
    given = plant.prescribed if plant.scene.support.kind == "hub" else 0
    chosen = independent_coordinates(guides.constraints, plant.prescribed, moves=moves, subspace=motion.subspace)
    loads = _inputs(plant, motion, guides, moves=moves)
    parts = _second_order(motion, replace(chosen, given=chosen.given[:, :given]), loads)
    rows = _outputs(plant, point, motion, moves=moves)
    outputs = _output_matrices(rows, guides, chosen.free, chosen.given[:, :given], parts, moves=moves)
    names = _Names(plant.scene, chosen.free.shape[1] - moves, moves, given)
    return _model(names, point, replace(parts, rows=outputs[0], direct=outputs[1]), tuple(rows.names))


def lateral_inputs(plant: Plant) -> tuple[Signal, ...]:
    """Return the inputs of a needle at a held depth: lateral loads, torque of a free hub, tip force, the hub's motion."""
    given = plant.prescribed if plant.scene.support.kind == "hub" else 0
    return _Names(plant.scene, 0, False, given).inputs


def with_lateral_force(scene: Scene, position: float) -> Scene:
    """Return the scene with a lateral load of 0 N at y = ``position`` [m], so that it becomes an input.

    Raises
    ------
    SceneError
        If the scene cannot have one there.
    """
    if any(load.position == position for load in scene.lateral_loads):
        return scene
    data = scene.to_dict()
    loads = [*data.get("loads", []), {"kind": "lateral", "position": position, "force": 0.0}]
    return Scene.from_dict(data | {"loads": loads})


def reach(scene: Scene) -> float:
    """Return the largest depth [m] at which the hub has met neither guide nor lateral load."""
    loads = [load.position for load in scene.lateral_loads]
    return scene.needle.length + min([0.0, *loads, *(guide.position for guide in scene.support.guides)])


def _check(plant: Plant, depth: float, speed: float, axial: str, path: CutPath | None) -> None:
    mistakes = []
    least, length = plant.smallest_depth, reach(plant.scene)
    if not (0.0 < depth <= length and depth >= least):
        mistakes.append(f"depth: out of range (got {depth:g} m; allowed above {least:g} to {length:g} m)")
    if not np.isfinite(speed):
        mistakes.append(f"speed: is not finite (got {speed:g} m/s; allowed any finite number)")
    if axial not in {"free", "held"}:
        mistakes.append(f"axial: is not a choice (got {axial!r}; allowed 'free', 'held')")
    if speed and any(guide.stiffness == "rigid" for guide in plant.scene.support.guides):
        mistakes.append(f"speed: a needle moves in rigid guides (got {speed:g} m/s; allowed 0, or guides with a stiffness)")
    if path is not None and plant.scene.tissue.rest_line != "cut-path":
        mistakes.append("path: the tissue rests on a straight line (got a path; allowed with tissue.rest_line = 'cut-path')")
    if mistakes:
        raise SceneError(mistakes)


def _with_springs(motion: SmallMotion, guides: Guided) -> SmallMotion:
    stiffness = motion.stiffness - motion.rows[: motion.points.guides].T @ guides.reactions
    return replace(motion, stiffness=stiffness)


def _inputs(plant: Plant, motion: SmallMotion, guides: Guided, *, moves: bool) -> Array:
    """Return the generalized forces of push (where the depth moves) and of each load, shape (1 + size, inputs)."""
    count = motion.points.guides
    loads = motion.rows[count:].T + motion.rows[:count].T @ guides.reactions_to_forces
    if not plant.axial_force_acts:
        loads[0] = 0.0
    push = np.zeros((len(loads), 1))
    push[0] = 1.0
    return np.hstack([push, loads]) if moves else loads


def _second_order(motion: SmallMotion, coordinates: Coordinates, loads: Array) -> SecondOrder:
    """Project on the independent coordinates; the motion of the hub becomes a force with its rates."""
    free, given = coordinates.free, coordinates.given
    mass, damping, stiffness = (free.T @ matrix for matrix in (motion.mass, motion.damping, motion.stiffness))
    none = np.zeros((free.shape[1], loads.shape[1]))
    forces = (
        np.hstack([free.T @ loads, -stiffness @ given]),
        np.hstack([none, -damping @ given]),
        np.hstack([none, -mass @ given]),
    )
    empty = np.zeros((0, free.shape[1]))
    return SecondOrder(mass @ free, damping @ free, stiffness @ free, forces, empty, np.zeros((0, forces[0].shape[1])))


@dataclass(frozen=True, eq=False)
class _OutputRows:
    """Outputs as functions of xi, (outputs, 1 + size), and of the point forces, (outputs, points)."""

    names: list[Signal]
    motion: Array
    forces: Array


def _outputs(plant: Plant, point: OperatingPoint, motion: SmallMotion, *, moves: bool) -> _OutputRows:
    length = plant.scene.needle.length
    names = [Signal("tip_deflection", "m"), Signal("tip_angle", "rad")]
    tip = motion.rows[-1], motion.points.flexibility[-1]
    pairs = [tip, _angle_rows(plant, point, length, moves=moves)]
    if moves:
        names.append(Signal("depth", "m"))
        pairs.append((np.eye(1, plant.size + 1)[0], np.zeros(len(motion.points.rows))))
    if turns_with_needle(plant.scene):
        names.append(Signal("hub_angle", "rad"))
        pairs.append(_angle_rows(plant, point, 0.0, moves=moves))
    return _OutputRows(names, np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs]))


def _angle_rows(plant: Plant, point: OperatingPoint, station: float, *, moves: bool) -> tuple[Array, Array]:
    """Return how the slope at a station changes with xi and with the point forces."""
    place, forces = np.array([station]), np.zeros_like(point.point_forces)

    def slope(coordinates: Array, loads: Array, depth: float) -> float:
        return float(plant.deflection(coordinates, loads, depth, place, 1)[0])

    row = [slope(unit, forces, point.depth) for unit in np.eye(plant.size)]
    zero = np.zeros(plant.size)
    by_force = [slope(zero, unit, point.depth) for unit in np.eye(len(forces))]
    moved = 0.0
    if moves:
        moved = float(numerical_rate(lambda z: slope(point.coordinates, point.point_forces, z), point.depth, plant.scene))
    return np.array([moved, *row]), np.array(by_force)


def _output_matrices(
    rows: _OutputRows, guides: Guided, free: Array, given: Array, parts: SecondOrder, *, moves: bool
) -> tuple[Array, Array]:
    """Return rows and direct terms of the outputs; the guides' springs answer to motion and forces."""
    count = len(guides.reactions)
    by_motion = rows.motion + rows.forces[:, :count] @ guides.reactions
    by_force = rows.forces[:, count:] + rows.forces[:, :count] @ guides.reactions_to_forces
    direct = np.hstack([np.zeros((len(by_force), int(moves))), by_force, by_motion @ given])
    return by_motion @ free, direct[:, : parts.forces[0].shape[1]]


@dataclass(frozen=True)
class _Names:
    """Names of states and inputs of a scene."""

    scene: Scene
    coordinates: int
    moves: bool
    given: int

    @property
    def positions(self) -> tuple[Signal, ...]:
        depth = (Signal("depth", "m"),) if self.moves else ()
        return depth + tuple(Signal(f"coordinate_{number}", "own") for number in range(1, self.coordinates + 1))

    @property
    def inputs(self) -> tuple[Signal, ...]:
        count = len(self.scene.lateral_loads)
        lateral = ["lateral_force"] if count == 1 else [f"lateral_force_{number}" for number in range(1, count + 1)]
        names = [Signal("push", "N")] if self.moves else []
        names += [Signal(name, "N") for name in lateral]
        if turns_with_needle(self.scene):
            names.append(Signal("torque", "N m"))
        hub = (Signal("hub_deflection", "m"), Signal("hub_angle", "rad"))
        return (*names, Signal("tip_force", "N"), *hub[: self.given])


def _rates(positions: tuple[Signal, ...]) -> tuple[Signal, ...]:
    return tuple(
        Signal("speed" if one.name == "depth" else f"{one.name}_rate", f"{one.unit}/s") for one in positions
    )


def _model(names: _Names, point: OperatingPoint, parts: SecondOrder, outputs: tuple[Signal, ...]) -> LinearModel:
    positions, inputs = names.positions, names.inputs
    support = names.scene.support
    if support.kind == "entry" and support.hub_rotation == "free":
        parts = _with_base(parts, support.hub_rotational_inertia or 0.0)
        positions = (*positions, Signal("base_angle", "rad"))
        inputs, outputs = (*inputs, Signal("torque", "N m")), (*outputs, Signal("hub_angle", "rad"))
    matrices = parts.state_space()
    return LinearModel(*matrices, (*positions, *_rates(positions)), inputs, outputs, point, parts)


def _with_base(parts: SecondOrder, inertia: float) -> SecondOrder:
    """Add the base that turns alone under its torque, I theta'' = tau: the rotation of the thesis under ``entry``."""

    def grown(matrix: Array, corner: float) -> Array:
        rows, columns = matrix.shape
        result = np.zeros((rows + 1, columns + 1))
        result[:rows, :columns], result[-1, -1] = matrix, corner
        return result

    changed: dict[str, Any] = {"mass": inertia, "damping": 0.0, "stiffness": 0.0, "rows": 1.0, "direct": 0.0}
    forces = tuple(grown(force, float(number == 0)) for number, force in enumerate(parts.forces))
    return SecondOrder(forces=forces, **{name: grown(getattr(parts, name), value) for name, value in changed.items()})  # type: ignore[arg-type]
