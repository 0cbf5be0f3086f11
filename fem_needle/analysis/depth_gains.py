"""How far each input moves the tip at rest, and how fast the needle vibrates, over the depth; where a gain changes its sign."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from fem_needle.errors import ComputationError, SceneError
from fem_needle.linear.linearization import lateral_inputs, linearize, reach
from fem_needle.linear.modal_form import lateral_frequencies
from fem_needle.linear.model import Signal
from fem_needle.linear.slow_cut import slow_cut
from fem_needle.loads import LoadCase, load_case
from fem_needle.path import CutPath
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.statics import statics_at

Array = NDArray[np.float64]

SHALLOWEST = 0.01  # of the length: where curves begin
END = 0.02  # of the length: how far before the hub meets guide, load or skin they end
POINTS = 181
ZERO = 1e-9  # of the largest gain: a smaller one has no sign
ACCURACY = 1e-9  # of the length: of a depth at which a sign changes
FREQUENCIES = 3


@dataclass(frozen=True)
class SignChange:
    """A depth [m] at which the tip begins to answer an input the other way; the sign of the gain just beyond it."""

    input: str
    depth: float
    sign_beyond: int


@dataclass(frozen=True, eq=False)
class DepthGains:
    """Static gains of the tip and natural frequencies over the depth.

    Attributes
    ----------
    depths
        z [m], shape (n,).
    inputs
        Lateral inputs as in `linearize`, then ``depth``: how the tip's deflection changes as the needle goes in slowly.
    gains
        dw(tip) / d(input) at rest, shape (n, inputs).
    frequencies
        Lowest undamped natural frequencies at a held depth [rad/s], shape (n, 3); nan where there are fewer.
    sign_changes
        By input, then by depth.
    """

    depths: Array
    inputs: tuple[Signal, ...]
    gains: Array
    frequencies: Array
    sign_changes: tuple[SignChange, ...]


def depth_gains(
    plant: Plant, depths: ArrayLike | None = None, *, time: float = 0.0, path: CutPath | None = None
) -> DepthGains:
    """Return gains and frequencies over the depth, and where gains change sign.

    Parameters
    ----------
    plant
        Any model.
    depths
        [m], rising; default: 181 from 1 % of the length to 2 % before the hub meets skin, guide or lateral load.
    time
        Instant [s] whose loads (for ``depth``) and stiffness factor act.
    path
        That the tip has cut at the last depth; default: by a slow insertion, where tissue rests on the cut path.

    Raises
    ------
    SceneError
        If a depth is out of range.
    ComputationError
        If there is no equilibrium.

    Notes
    -----
    Signs are compared at the depths given; two changes between neighbors escape. Each change is then found by Brent's method.
    """
    places = _default_depths(plant.scene) if depths is None else np.atleast_1d(np.asarray(depths, dtype=float))
    least, length = plant.smallest_depth, reach(plant.scene)
    if np.any(places <= least) or np.any(places > length) or np.any(np.diff(places) <= 0.0):
        raise SceneError(f"depths: out of range (got {places.tolist()}; allowed rising, above {least:g} to {length:g} m)")
    inputs = (*lateral_inputs(plant), Signal("depth", "m"))
    path = slow_cut(plant, float(places[-1]), time) if path is None else path
    gains = np.array([tip_gains(plant, float(depth), time, path) for depth in places])
    frequencies = np.array([_frequencies(plant, float(depth), time, path) for depth in places])
    names = [(index, one.name) for index, one in enumerate(inputs)]
    changes = [change for one in names for change in _changes(plant, places, gains, one, time, path)]
    return DepthGains(places, inputs, gains, frequencies, tuple(changes))


def _default_depths(scene: Scene) -> Array:
    """Return depths that stay a little before the hub meets something: beside a guide a hub that is moved turns the needle."""
    least = SHALLOWEST * scene.needle.length
    rest = END * scene.needle.length if scene.support.kind == "hub" else 0.0
    return np.linspace(least, max(reach(scene) - rest, 2 * least), POINTS)


def _frequencies(plant: Plant, depth: float, time: float, path: CutPath | None) -> Array:
    """Return the lowest frequencies, nan where there are fewer or the model has none."""
    result = np.full(FREQUENCIES, np.nan)
    try:
        found = lateral_frequencies(linearize(plant, depth=depth, time=time, axial="held", path=path))[:FREQUENCIES]
    except ComputationError:
        return result
    result[: len(found)] = found
    return result


def tip_gains(plant: Plant, depth: float, time: float = 0.0, path: CutPath | None = None) -> Array:
    """Return dw(tip) / d(input) of the equilibria at a depth [m], shape (inputs,), in the order of `DepthGains`.

    One static solution for each input of 1, which is exact, for statics are linear; by depth, N dq/dz + dN/dz q at the tip.
    Tissue that rests on a cut path has it frozen for the inputs, cut on by depth: ``path``, default what a slow insertion cuts.

    Raises
    ------
    ComputationError
        If there is no equilibrium.
    """
    here = slow_cut(plant, depth, time) if path is None else path.up_to(depth)
    resting = statics_at(plant, depth, time, here)
    frozen, points = replace(resting, rest=None), resting.points  # what a load does, it does alone
    forces = len(points.rows) - points.guides
    given = plant.prescribed if plant.scene.support.kind == "hub" else 0
    gains = []
    for unit in np.eye(forces + given):
        clamp = np.zeros(2)
        clamp[:given] = unit[forces:]
        none = np.zeros_like
        case = LoadCase(unit[:forces], none(unit[:forces]), clamp, none(clamp), none(clamp))
        gains.append(frozen.tip(case))
    rest = resting.equilibrium(load_case(plant.scene, depth, time))
    moved, _ = resting.derivative(rest)
    return np.array([*gains, float(points.rows[-1] @ moved + points.row_rates[-1] @ rest.coordinates)])


def _changes(
    plant: Plant, depths: Array, gains: Array, one: tuple[int, str], time: float, path: CutPath | None
) -> list[SignChange]:
    index, name = one
    values = gains[:, index]
    floor = ZERO * float(np.max(np.abs(values), initial=0.0))
    kept = np.flatnonzero(np.abs(values) > floor)
    found = []

    def gain(depth: float) -> float:
        return float(tip_gains(plant, depth, time, path)[index])

    for left, right in pairwise(kept):
        if values[left] * values[right] < 0.0:
            depth = brentq(gain, depths[left], depths[right], xtol=ACCURACY * plant.scene.needle.length)
            found.append(SignChange(name, float(depth), int(np.sign(values[right]))))
    return found
