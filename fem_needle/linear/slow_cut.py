"""The path that a needle cuts when it goes in slowly: what tissue rests on where a linear model freezes it.

At every depth the needle is in equilibrium with the path so far, and the path goes on from its tip, K q = N.P + H(r), r(z) =
w(tip). Steps of Radau IIA (two nodes): on each the path is a parabola through its start and the tips at the nodes, which depend
on it linearly, so that two unknowns are solved for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import collocation
from fem_needle.loads import LoadCase, load_case
from fem_needle.path import CutPath, straight_path
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.segments import interfaces
from fem_needle.statics import Statics, no_load_case, rest_of, statics_at

Array = NDArray[np.float64]

STEPS = 100  # over the length of the needle


def slow_cut(plant: Plant, depth: float, time: float = 0.0) -> CutPath | None:
    """Return the path that a slow insertion has cut at a depth; None where tissue rests on a straight line.

    Parameters
    ----------
    plant
        Any model; its scene says where the insertion begins. Tissue is straight before.
    depth
        z [m] of the tip.
    time
        Instant [s] whose loads, hub and stiffness factor act all the way.

    Raises
    ------
    ComputationError
        If there is no equilibrium on the way.
    """
    scene = plant.scene
    if scene.tissue.rest_line != "cut-path":
        return None
    path = straight_path(min(scene.insertion.first_depth, depth))
    if path.deepest < plant.smallest_depth:
        path = straight_path(min(plant.smallest_depth, depth))
    for start, end in pairwise(_marks(scene, path.deepest, depth)):
        path = _with_piece(plant, path, start, end, time)
    return path


def _marks(scene: Scene, start: float, end: float) -> list[float]:
    """Return depths [m] from the start to the end, all interfaces between among them."""
    levels = [start, *(level for level in interfaces(scene.tissue.layers) if start < level < end), end]
    marks = [start]
    for low, high in pairwise(levels):
        count = max(1, int(np.ceil(STEPS * (high - low) / scene.needle.length)))
        marks += np.linspace(low, high, count + 1)[1:].tolist()
    return marks if end > start else []


def _with_piece(plant: Plant, path: CutPath, start: float, end: float, time: float) -> CutPath:
    """Return the path with what the tip cuts between two depths in one layer."""
    case = load_case(plant.scene, 0.5 * (start + end), time)
    begin = statics_at(plant, start, time, path).tip(case)
    positions = [start, *(start + collocation(0.0).nodes * (end - start))[:-1].tolist(), end]
    straight = [statics_at(plant, place, time) for place in positions[1:]]
    count = len(straight)
    base = np.full(count, begin)
    known = _tips(straight, case, path.extended(positions, [begin, *base]))
    units = (straight_path(start).extended(positions, [0.0, *unit]) for unit in np.eye(count))
    answers = np.stack([_tips(straight, no_load_case(case), bent) for bent in units], axis=1)
    tips = base + np.linalg.solve(np.eye(count) - answers, known - base)
    return path.extended(positions, [begin, *tips.tolist()])


def _tips(places: Sequence[Statics], case: LoadCase, path: CutPath) -> Array:
    """Return the tip's deflections [m] at several depths on a path."""
    return np.array([replace(one, rest=rest_of(one.plant, path, one.depth, one.time)).tip(case) for one in places])
