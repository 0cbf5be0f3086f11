"""Where a model may be trusted: the depths, and the characteristic numbers, at which its tip is within an error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.exact.krylov import characteristic_number
from fem_needle.scene import Scene, as_function
from fem_needle.segments import interfaces, tip_layer

Array = NDArray[np.float64]

ACCURACY = 1e-4  # m: of the ends of a range
ZERO_ACCURACY = 1e-7  # m: of the zeros of a difference or of the reference

Tips = Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class Interval:
    """Depths at which a model's tip is within the error, the tip in one layer.

    Attributes
    ----------
    start, end
        Depths [m].
    layer
        Name or number of the layer that holds the tip; empty outside all.
    number_start, number_end
        (k / 4 EI)^(1/4) z (1) at both, with the modulus k of that layer.
    """

    start: float
    end: float
    layer: str
    number_start: float
    number_end: float


def intervals_within(tips: Tips, depths: Array, within: float) -> tuple[tuple[float, float], ...]:
    """Return the intervals of depth in which the tip's relative error is at most ``within``, ends to 0.1 mm by bisection.

    Parameters
    ----------
    tips
        Reference's and model's tip [m] at a depth [m].
    depths
        Grid on which the intervals are looked for, rising. Between its points every zero of the difference (which is within)
        and of the reference's tip (which is not) is found, so that no interval is lost there.
    within
        Largest |w - w_ref| / |w_ref| (1).
    """

    def holds(depth: float) -> bool:
        reference, model = tips(depth)
        return abs(model - reference) <= within * abs(reference)

    knots = sorted(_knots(tips, holds, depths))
    found: list[tuple[float, float]] = []
    start = knots[0][0] if knots[0][1] else None
    for (left, inside), (right, stays) in pairwise(knots):
        if inside and not stays:
            found.append((left if start is None else start, _last_holding(holds, left, right, ACCURACY)))
            start = None
        elif stays and not inside:
            start = _last_holding(holds, right, left, ACCURACY)
    return (*found, (start, knots[-1][0])) if start is not None else tuple(found)


def wave_number_at_tip(scene: Scene, depth: float, time: float) -> float:
    """Return (k / 4 EI)^(1/4) [1/m] with the modulus of the layer that holds the tip, swelling included; 0 outside the layers."""
    index = tip_layer(scene.tissue.layers, depth)
    if index is None:
        return 0.0
    modulus = as_function(scene.tissue.stiffness_factor).value(time) * scene.tissue.layers[index].foundation_modulus
    return float(characteristic_number(modulus / scene.needle.bending_stiffness))


def described(scene: Scene, time: float, ranges: tuple[tuple[float, float], ...]) -> tuple[Interval, ...]:
    """Return intervals with their characteristic numbers, cut where the tip enters another layer."""
    layers, found = scene.tissue.layers, []
    for start, end in ranges:
        edges = [start, *(y for y in interfaces(layers) if start < y < end), end]
        for left, right in pairwise(edges):
            middle = 0.5 * (left + right)
            index, wave_number = tip_layer(layers, middle), wave_number_at_tip(scene, middle, time)
            name = "" if index is None else layers[index].name or str(index)
            found.append(Interval(left, right, name, wave_number * left, wave_number * right))
    return tuple(found)


def _knots(tips: Tips, holds: Callable[[float], bool], depths: Array) -> Iterator[tuple[float, bool]]:
    """Yield the grid and the zeros between its points, with whether the error is small enough there."""
    places = depths.tolist()
    answers = [tips(depth) for depth in places]
    yield from ((depth, holds(depth)) for depth in places)
    for (left, right), (first, second) in zip(pairwise(places), pairwise(answers), strict=True):
        if first[0] * second[0] < 0.0:
            yield _zero(lambda depth: tips(depth)[0], left, right), False
        if (first[1] - first[0]) * (second[1] - second[0]) < 0.0:
            yield _zero(lambda depth: tips(depth)[1] - tips(depth)[0], left, right), True


def _zero(function: Callable[[float], float], left: float, right: float) -> float:
    positive = function(left) > 0.0
    return _last_holding(lambda depth: (function(depth) > 0.0) == positive, left, right, ZERO_ACCURACY)


def _last_holding(holds: Callable[[float], bool], inside: float, outside: float, accuracy: float) -> float:
    """Return a depth that holds with one that does not within ``accuracy`` [m] beyond it, between two that differ."""
    while abs(outside - inside) > accuracy:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside
