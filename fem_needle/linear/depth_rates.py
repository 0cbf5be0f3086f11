"""Rates by depth that the protocol of a plant does not name: by differences of what it names exactly."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, log2

import numpy as np
from numpy.typing import NDArray

from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.segments import ROUNDINGS, interfaces

Array = NDArray[np.float64]

RELATIVE_STEP = 3e-4  # of the depth
POINTS = 4  # beside the depth itself, on one side
ROUNDING = 1e-14  # of a value, which an evaluation may miss; a rate that is no more than this is none
FINE = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0  # order 4
COARSE = np.array([-11.0, 18.0, -9.0, 2.0, 0.0]) / 6.0  # order 3


def numerical_rate(function: Callable[[float], Array | float], depth: float, scene: Scene) -> Array:
    """Return df/dz by one-sided differences of order 4, on the side where they agree better with those of order 3.

    A node of a mesh that the skin passes makes a third derivative jump; on one of the two sides there is none. No difference
    reaches over an interface of the tissue. At an interface the rate is the one from the shallower side, as everywhere else.

    Parameters
    ----------
    function
        Of the depth [m]; a number or an array.
    depth
        z [m], above 0.
    scene
        Whose layers and length bound the differences.
    """
    low, high = smooth_range(scene, depth)
    sides = [_one_sided(function, depth, room) for room in (low - depth, high - depth) if room != 0.0]
    return min(sides, key=lambda side: side[1])[0]


def smooth_range(scene: Scene, depth: float) -> tuple[float, float]:
    """Return the depths [m] around ``depth`` between which no interface lies; at an interface the depth is the upper one."""
    slack = ROUNDINGS * depth
    levels = [level for level in interfaces(scene.tissue.layers) if level > 0.0]
    low = max([0.0, *(level for level in levels if level < depth - slack)])
    above = [level for level in [*levels, scene.needle.length] if level >= depth - slack]
    high = min(above, default=depth)
    return low, depth if high <= depth + slack else high


def _one_sided(function: Callable[[float], Array | float], depth: float, room: float) -> tuple[Array, float]:
    """Return the rate and how far the lower order is from it."""
    size = min(RELATIVE_STEP * depth, abs(room) / (POINTS + 1))
    step = float(np.copysign(2.0 ** floor(log2(size)), room))
    values = np.stack([np.asarray(function(depth + number * step)) for number in range(POINTS + 1)])
    rate = np.tensordot(FINE, values, axes=1) / step
    noise = ROUNDING * np.max(np.abs(values), axis=0) / abs(step)
    rate = np.where(np.abs(rate) > noise, rate, 0.0)
    return rate, float(np.max(np.abs(rate - np.tensordot(COARSE, values, axes=1) / step), initial=0.0))


def kinetic_matrix_rates(plant: Plant, depth: float) -> tuple[Array, Array, Array]:
    """Return dM/dz, dS/dz and dR/dz, dense, exactly: `kinetic_rate` is a quadratic form in q', v and q.

    With dT/dz = 1/2 q'.M_z q' + v q'.S_z q + 1/2 v^2 q.R_z q the values at unit vectors and at their sums give every entry.
    """
    zero, units = np.zeros(plant.size), np.eye(plant.size)

    def mass(vector: Array) -> float:
        return plant.kinetic_rate(vector, zero, depth, 0.0)

    def centrifugal(vector: Array) -> float:
        return plant.kinetic_rate(zero, vector, depth, 1.0)

    mass_rate, centrifugal_rate = _polar(mass, units), _polar(centrifugal, units)
    mixed = np.array([[plant.kinetic_rate(left, right, depth, 1.0) for right in units] for left in units])
    own = 0.5 * np.diag(mass_rate)[:, None] + 0.5 * np.diag(centrifugal_rate)[None, :]
    return mass_rate, mixed - own, centrifugal_rate


def _polar(form: Callable[[Array], float], units: Array) -> Array:
    """Return the symmetric matrix A of form(x) = 1/2 x.A x."""
    own = np.array([form(unit) for unit in units])
    result = np.diag(2.0 * own)
    for first in range(len(units)):
        for second in range(first):
            value = form(units[first] + units[second]) - own[first] - own[second]
            result[first, second] = result[second, first] = value
    return result
