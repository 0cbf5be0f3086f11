"""How the tip of a model answers an input at rest, over the depth: tip = y0(z) + g(z) u."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from fem_needle.analysis.depth_gains import END, SHALLOWEST
from fem_needle.errors import ComputationError, SceneError
from fem_needle.linear.linearization import lateral_inputs, reach
from fem_needle.linear.slow_cut import slow_cut
from fem_needle.loads import LoadCase, load_case
from fem_needle.path import CutPath
from fem_needle.plant import Plant
from fem_needle.scene import Scene, TipLoad
from fem_needle.scene.cross_checks import input_obstacle
from fem_needle.segments import interfaces
from fem_needle.statics import statics_at

Array = NDArray[np.float64]

COARSEST, FINEST = 8, 512  # intervals of a piece between two interfaces
ACCURACY = 5e-5  # of the largest value: what a grid of twice the spacing may miss
SIGNLESS = 1e-4  # of the largest gain: a smaller one has no sign
# What the linear models call the inputs that move the tip at rest.
STATIC_INPUTS = {
    "lateral_force": "lateral_force",
    "hub_deflection": "hub_deflection",
    "hub_angle": "hub_angle",
    "hub_torque": "torque",
    "tip_direction": "tip_force",
}


@dataclass(frozen=True)
class DepthCurve:
    """A function of the depth, cubic between depths; constant before the first and beyond the last.

    Attributes
    ----------
    starts
        Where each cubic begins [m], rising.
    end
        Where the last one ends [m].
    coefficients
        Of each, the cubic one first, in powers of depth - start.
    """

    starts: tuple[float, ...]
    end: float
    coefficients: tuple[tuple[float, float, float, float], ...]

    def __call__(self, depth: float) -> float:
        """Return the value at a depth [m]; where two pieces meet, that of the deeper one."""
        inside = min(max(depth, self.starts[0]), self.end)
        index = bisect_right(self.starts, inside) - 1
        way = inside - self.starts[index]
        cubic, square, slope, value = self.coefficients[index]
        return ((cubic * way + square) * way + slope) * way + value


@dataclass(frozen=True)
class ModelResponse:
    """Static response of a model's tip to one input; loads, hub and stiffness factor of t = 0.

    Springs rest on the straight line, or on the path that a slow insertion cuts under these loads.

    Attributes
    ----------
    input
        Name of the input, as `controller.input`.
    gain
        g(z), output per SI unit of the input.
    rest
        y0(z): the output by everything else.
    first_depth, last_depth
        Range [m].
    largest_gain
        Largest |g| in the range.
    sign_changes
        Depths [m] at which g changes its sign, rising.
    """

    input: str
    gain: DepthCurve
    rest: DepthCurve
    first_depth: float
    last_depth: float
    largest_gain: float
    sign_changes: tuple[float, ...]

    def output(self, depth: float, value: float) -> float:
        """Return y0(z) + g(z) u at a depth [m], in one search: both curves have the same pieces."""
        gain = self.gain
        inside = min(max(depth, gain.starts[0]), gain.end)
        index = bisect_right(gain.starts, inside) - 1
        way = inside - gain.starts[index]
        (a, b, c, d), (p, q, r, s) = gain.coefficients[index], self.rest.coefficients[index]
        return (((p + a * value) * way + q + b * value) * way + r + c * value) * way + s + d * value


def depth_range(scene: Scene) -> tuple[float, float]:
    """Return the smallest and the largest depth [m] of a run; of a push without end 2 % before the hub meets something."""
    insertion, length = scene.insertion, scene.needle.length
    lowest, highest = insertion.depth_range(scene.duration)
    if insertion.kind == "force":
        end = insertion.final_depth
        highest = max(lowest, reach(scene) - END * length) if end is None else end
    if scene.support.kind == "entry":  # nothing inserted, nothing that could answer
        lowest = max(lowest, SHALLOWEST * length)
    return lowest, max(lowest, highest)


def model_response(plant: Plant, name: str, *, depths: tuple[float, float], share: float = 1.0) -> ModelResponse:
    """Return gain and rest of a model over a range of depths, by interpolation that is right to 1e-4 of the largest value.

    Parameters
    ----------
    plant
        The model; its scene has the input.
    name
        Input: ``"lateral_force"``, ``"hub_deflection"``, ``"hub_angle"``, ``"hub_torque"``, ``"tip_direction"``.
    depths
        First and last [m].
    share
        Output per deflection of the tip: 1, or 1/2 of an image error.

    Raises
    ------
    SceneError
        If the input has no static gain, the model's scene has no such input, or it does not move the tip.
    ComputationError
        If there is no equilibrium, or no grid is fine enough.

    Notes
    -----
    Statics are linear: one equilibrium for each unit load gives g and y0 at a depth. Between the interfaces that the tip
    passes both are smooth; at one their slopes jump, and themselves under the bevel law: each piece has its own spline.
    """
    index = _input_index(plant, name)
    path = slow_cut(plant, depths[1])
    pieces = [_piece(plant, index, name, part, path) for part in pairwise(_breaks(plant.scene, depths))]
    coarse = [_sampled(piece, np.linspace(piece.start, piece.end, COARSEST + 1)) for piece in pieces]
    largest = np.max([np.max(np.abs(values), axis=0) for values in coarse], axis=0)
    if largest[0] == 0.0:
        raise SceneError(f"controller.input: does not move the tip of the model at t = 0 (got {name!r}; allowed another input)")
    grids = [_refined(piece, values, largest) for piece, values in zip(pieces, coarse, strict=True)]
    gain, rest = (_curve(grids, column, share) for column in (0, 1))
    samples = np.concatenate([values[:, 0] for _, values in grids]) * share
    places = np.concatenate([places for places, _ in grids])
    top = float(np.max(np.abs(samples)))
    return ModelResponse(name, gain, rest, float(places[0]), float(places[-1]), top, _sign_changes(gain, places, samples, top))


@dataclass(frozen=True)
class _Piece:
    """Depths between two interfaces [m], and gain and rest there."""

    start: float
    end: float
    answer: Callable[[float], tuple[float, float]]


def _input_index(plant: Plant, name: str) -> int:
    if name not in STATIC_INPUTS:
        limits = f"got {name!r}; allowed {', '.join(STATIC_INPUTS)}, or all gains given and schedule = 'none'"
        raise SceneError(f"controller.input: has no static gain of the tip ({limits})")
    obstacle = input_obstacle(plant.scene, name)
    if obstacle:
        raise SceneError(f"controller.input: in the scene of the model '{name}' {obstacle}")
    return [signal.name for signal in lateral_inputs(plant)].index(STATIC_INPUTS[name])


def _breaks(scene: Scene, depths: tuple[float, float]) -> list[float]:
    first, last = depths
    return [first, *(level for level in interfaces(scene.tissue.layers) if first < level < last), last]


def _piece(plant: Plant, index: int, name: str, ends: tuple[float, float], path: CutPath | None) -> _Piece:
    """Return a piece; the layer at the tip, and so every load, is the same in all of it."""
    case = load_case(_unturned(plant.scene) if name == "tip_direction" else plant.scene, 0.5 * (ends[0] + ends[1]), 0.0)
    acting = np.concatenate([case.forces, case.clamp])
    unit = np.zeros_like(acting)
    unit[index] = acting[index] if name == "tip_direction" else 1.0
    acting[index] = 0.0
    cases = [_still(case, loads) for loads in (unit, acting)]

    def answer(depth: float) -> tuple[float, float]:
        resting = statics_at(plant, depth, 0.0, None if path is None else path.up_to(depth))
        return replace(resting, rest=None).tip(cases[0]), resting.tip(cases[1])

    return _Piece(*ends, answer)


def _still(case: LoadCase, loads: Array) -> LoadCase:
    """Return a case with other forces and another place of the hub, at rest."""
    forces, clamp = loads[: len(case.forces)], loads[len(case.forces) :]
    return LoadCase(forces, np.zeros_like(forces), clamp, np.zeros_like(clamp), np.zeros_like(clamp))


def _unturned(scene: Scene) -> Scene:
    """Return the scene with every tip load in the direction 1."""
    loads = [load.model_copy(update={"direction": 1.0}) if isinstance(load, TipLoad) else load for load in scene.loads]
    return scene.model_copy(update={"loads": tuple(loads)})


def _sampled(piece: _Piece, places: Array) -> Array:
    if piece.start == piece.end:  # a needle that is held
        return np.tile(piece.answer(piece.start), (len(places), 1))
    return np.array([piece.answer(float(place)) for place in places])


def _refined(piece: _Piece, values: Array, largest: Array) -> tuple[Array, Array]:
    """Return depths and values, on twice as many intervals until those between are where the spline expects them."""
    places = np.linspace(piece.start, piece.end, len(values))
    if piece.start == piece.end:
        return places, values
    while len(places) <= FINEST:
        between = 0.5 * (places[1:] + places[:-1])
        found = _sampled(piece, between)
        miss = np.max(np.abs(CubicSpline(places, values)(between) - found), axis=0)
        values = np.insert(values, np.arange(1, len(values)), found, axis=0)
        places = np.insert(places, np.arange(1, len(places)), between)
        if np.all(miss <= ACCURACY * largest):
            return places, values
    where = f"between {piece.start:g} and {piece.end:g} m"
    raise ComputationError(f"the static gain of the model is too rough over the depth {where}: use more elements or modes")


def _curve(grids: list[tuple[Array, Array]], column: int, share: float) -> DepthCurve:
    starts: list[float] = []
    rows: list[tuple[float, float, float, float]] = []
    for places, values in grids:
        if places[0] == places[-1]:
            starts.append(float(places[0]))
            rows.append((0.0, 0.0, 0.0, share * float(values[0, column])))
            continue
        starts += [float(place) for place in places[:-1]]
        rows += [tuple(row) for row in CubicSpline(places, share * values[:, column]).c.T.tolist()]
    return DepthCurve(tuple(starts), float(grids[-1][0][-1]), tuple(rows))


def _sign_changes(gain: DepthCurve, places: Array, samples: Array, largest: float) -> tuple[float, ...]:
    kept = np.flatnonzero(np.abs(samples) > SIGNLESS * largest)
    found = []
    for left, right in pairwise(kept):
        if samples[left] * samples[right] < 0.0:
            found.append(float(brentq(gain, float(places[left]), float(places[right]), xtol=1e-12)))
    return tuple(found)
