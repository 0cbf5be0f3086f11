"""Exact static solution of any scene with a straight rest line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError
from fem_needle.exact.matching import BeamProblem, BeamSolution, solve_beam
from fem_needle.limits import stations_on
from fem_needle.scene import Guide, Scene, TipLoad
from fem_needle.scene.time_functions import as_function


@dataclass(frozen=True)
class PiecewiseStatics:
    """Exact equilibrium of a needle: EI w'''' + k(y, t) w = p(y, t), piece by piece.

    Clamped at the hub (`hub`) or at the tissue surface (`entry`), free at the tip: w'' = 0, EI w''' = -F.
    Made by `exact_static`. Lengths are in m, forces in N; the forces are those on the needle.

    Parameters
    ----------
    scene
        What was solved.
    depth
        Inserted length z [m].
    time
        Time of the loads and of the stiffness factor [s].
    tip_force
        Total lateral force at the tip, bevel law included [N].
    lateral_force
        Sum of the lateral forces outside the tissue [N].
    guide_forces
        Force of each guide on the needle [N], in the order of the scene.
    solution
        State of the beam over y; None where nothing of an `entry` needle is inserted.

    Notes
    -----
    Matching conditions after Hetenyi, Beams on Elastic Foundation (1946), chapter III.
    """

    scene: Scene
    depth: float
    time: float
    tip_force: float
    lateral_force: float
    guide_forces: tuple[float, ...]
    solution: BeamSolution | None

    @property
    def tip_deflection(self) -> float:
        """Deflection of the tip [m]."""
        return float(self.deflection(self.scene.needle.length))

    @property
    def tip_slope(self) -> float:
        """Slope at the tip [rad]."""
        return float(self.slope(self.scene.needle.length))

    def deflection(self, arc_length: ArrayLike) -> NDArray[np.float64]:
        """Deflection w [m] at stations from the hub, 0, to the tip, l [m]; shape of the input.

        Under `entry` zero outside the tissue.
        """
        return self._derivative(arc_length, 0)

    def slope(self, arc_length: ArrayLike) -> NDArray[np.float64]:
        """Slope w' [rad] at stations [m]; shape of the input."""
        return self._derivative(arc_length, 1)

    def bending_moment(self, arc_length: ArrayLike) -> NDArray[np.float64]:
        """Bending moment EI w'' [N m] at stations [m]; shape of the input."""
        return self.scene.needle.bending_stiffness * self._derivative(arc_length, 2)

    def shear_force(self, arc_length: ArrayLike) -> NDArray[np.float64]:
        """Shear force EI w''' [N] at stations [m]; from the right where it jumps; shape of the input."""
        return self.scene.needle.bending_stiffness * self._derivative(arc_length, 3)

    @property
    def tissue_force(self) -> float:
        """Total lateral force of the tissue on the needle, -int k w dy and that of a tip spring [N]."""
        if self.solution is None:
            return 0.0
        return self.solution.foundation_force - tip_stiffness(self.scene, self.time) * self.tip_deflection

    @property
    def hub_force(self) -> float:
        """Force of the clamp (hub, or surface under `entry`) on the needle, EI w''' there [N]."""
        if self.solution is None:
            return -self.tip_force
        return float(self.scene.needle.bending_stiffness * self.solution.states[0, 3])

    @property
    def hub_moment(self) -> float:
        """Moment of the clamp on the needle, -EI w'' there [N m]; positive turns towards positive slope."""
        if self.solution is None:
            return 0.0
        return float(-self.scene.needle.bending_stiffness * self.solution.states[0, 2])

    def _derivative(self, arc_length: ArrayLike, order: int) -> NDArray[np.float64]:
        station = stations_on(arc_length, self.scene.needle.length)
        y = np.ravel(station) - (self.scene.needle.length - self.depth)
        if self.solution is None:
            return np.zeros(station.shape)
        values = np.where(y < self.solution.steps.start[0] - 1e-15, 0.0, self.solution.state(y)[:, order])
        return values.reshape(station.shape)


def exact_static(scene: Scene, depth: float, time: float = 0.0) -> PiecewiseStatics:
    """Exact static solution of a scene at a depth and a time, to round-off.

    Parameters
    ----------
    scene
        Any fixed support, layers, guides and loads; straight rest line.
    depth
        Inserted length z [m], 0 to the length of the needle.
    time
        At which loads, hub and stiffness factor are taken [s].

    Returns
    -------
    PiecewiseStatics
        Deflection, section forces and reactions.

    Raises
    ------
    SceneError
        If the depth is not on the needle, the hub has passed a guide or a lateral force, or is free to turn.
    """
    if scene.support.kind == "entry" and depth == 0.0:
        return PiecewiseStatics(scene, depth, time, tip_force(scene, depth, time), 0.0, (), None)
    problem = beam_problem(scene, depth, time)
    solution = solve_beam(problem)
    forces = _lateral_forces(scene, time)
    at_tip = tip_force(scene, depth, time)
    given = [*forces, (depth, at_tip)]
    guides = tuple(
        solution.shear_jump(guide.position) - sum(force for y, force in given if y == guide.position)
        for guide in scene.support.guides
    )
    total = sum(force for _, force in forces)
    return PiecewiseStatics(scene, depth, time, at_tip, total, guides, solution)


def tip_compliance(scene: Scene, depth: float, time: float = 0.0) -> float:
    """Tip deflection per tip force with no other load and the clamp at zero [m/N].

    Parameters
    ----------
    scene, depth, time
        As for `exact_static`; the depth above 0.

    Returns
    -------
    float
        The compliance of the tip.
    """
    problem = beam_problem(scene, depth, time)
    alone = np.zeros(problem.breaks.size)
    alone[-1] = 1.0
    solution = solve_beam(replace(problem, point_force=alone, clamp_deflection=0.0, clamp_slope=0.0))
    return float(solution.ends[-1, 0])


def beam_problem(scene: Scene, depth: float, time: float) -> BeamProblem:
    """Pieces, supports and loads of a scene at a depth [m] and a time [s], over y."""
    entry = scene.support.kind == "entry"
    _refuse_impossible(scene, depth)
    clamp = 0.0 if entry else depth - scene.needle.length
    springs = [(guide.position, _spring(guide)) for guide in scene.support.guides]
    forces = _lateral_forces(scene, time)
    borders = [y for layer in scene.tissue.layers for y in (layer.start, layer.far_side)]
    candidates = np.unique([*borders, *(y for y, _ in springs), *(y for y, _ in forces)])
    inner = candidates[(candidates > clamp) & (candidates < depth)]
    breaks = np.concatenate([[clamp], inner, [depth]])
    modulus = [foundation_modulus(scene, y, time) for y in (breaks[:-1] + breaks[1:]) / 2.0]
    point_force = np.array([sum(force for y, force in forces if y == at) for at in breaks], dtype=float)
    spring = np.array([sum(value for y, value in springs if y == at) for at in breaks], dtype=float)
    point_force[-1] += tip_force(scene, depth, time)
    spring[-1] += tip_stiffness(scene, time)
    return BeamProblem(
        bending_stiffness=scene.needle.bending_stiffness,
        breaks=breaks,
        foundation_modulus=np.array(modulus),
        point_force=point_force,
        point_stiffness=spring,
        clamp_deflection=0.0 if entry else as_function(scene.support.hub_deflection).value(time),
        clamp_slope=0.0 if entry else as_function(scene.support.hub_angle).value(time),
    )


def _spring(guide: Guide) -> float:
    """Stiffness of a guide [N/m], inf if it is rigid."""
    return math.inf if guide.stiffness == "rigid" else float(guide.stiffness)


def foundation_modulus(scene: Scene, y: float, time: float) -> float:
    """k(y, t) = k(y) m(t) [N/m^2]; the deeper layer at an interface, 0 outside."""
    factor = as_function(scene.tissue.stiffness_factor).value(time)
    return sum(layer.foundation_modulus for layer in scene.tissue.layers if layer.holds(y)) * factor


def tip_stiffness(scene: Scene, time: float) -> float:
    """Stiffness of the spring that travels with the tip [N/m], 0 without one."""
    return (scene.tissue.tip_stiffness or 0.0) * as_function(scene.tissue.stiffness_factor).value(time)


def tip_force(scene: Scene, depth: float, time: float) -> float:
    """Sum of the tip forces [N]: given ones, and bevel coefficient times k at the tip."""
    return sum(_tip_load_force(load, scene, depth, time) for load in scene.loads if isinstance(load, TipLoad))


def _tip_load_force(load: TipLoad, scene: Scene, depth: float, time: float) -> float:
    direction = as_function(load.direction).value(time)
    if load.force is not None:
        return as_function(load.force).value(time) * direction
    return (load.bevel_coefficient or 0.0) * foundation_modulus(scene, depth, time) * direction


def _lateral_forces(scene: Scene, time: float) -> list[tuple[float, float]]:
    """Position [m] and value [N] of the lateral forces."""
    return [(load.position, as_function(load.force).value(time)) for load in scene.lateral_loads]


def _refuse_impossible(scene: Scene, depth: float) -> None:
    if scene.support.kind == "hub" and scene.support.hub_rotation == "free":
        raise SceneError("support.hub_rotation: the exact solution clamps the hub (got 'free'; allowed 'fixed')")
    length = scene.needle.length
    smallest_open = scene.support.kind == "entry"
    if not (0.0 < depth <= length if smallest_open else 0.0 <= depth <= length):
        raise SceneError(f"depth: not on the needle (got {depth:g}; allowed 0 to {length:g} m)")
    held = [guide.position for guide in scene.support.guides]
    held += [load.position for load in scene.lateral_loads]
    for y in held:
        if not depth - length < y <= depth:
            where = f"a guide or lateral force at y = {y:g} m is not on the needle"
            limits = f"got {depth:g}; allowed {max(y, 0.0):g} to below {y + length:g} m"
            raise SceneError(f"depth: {where} ({limits})")
