"""The path that a needle cuts when it goes in slowly: what tissue rests on where a linear model freezes it.

At every depth the needle is in equilibrium with the path so far, and the path goes on from its tip, K q = N.P + H(r), r(z) =
w(tip). Steps of Radau IIA (two nodes): on each the path is a parabola through its start and the tips at the nodes, which depend
on it linearly, so that two unknowns are solved for.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import collocation
from fem_needle.loads import load_case
from fem_needle.path import CutPath, straight_path
from fem_needle.plant import Operators, Plant, Points
from fem_needle.scene import Scene, as_function
from fem_needle.segments import interfaces
from fem_needle.statics import no_load_case, static_state

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
    path = straight_path(min(first_depth(scene), depth))
    if path.deepest < plant.smallest_depth:
        path = straight_path(min(plant.smallest_depth, depth))
    for start, end in pairwise(_marks(scene, path.deepest, depth)):
        path = _with_piece(plant, path, start, end, time)
    return path


def first_depth(scene: Scene) -> float:
    """Return the depth [m] at which a scene's insertion begins."""
    return scene.insertion.first_depth if scene.insertion.kind == "force" else scene.insertion.depth_range(scene.duration)[0]


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
    middle, nodes = 0.5 * (start + end), collocation(0.0).nodes
    begin = _tip(plant, _Place(plant, start, middle, time), path)
    positions = [start, *(start + nodes * (end - start))[:-1].tolist(), end]
    places = [_Place(plant, position, middle, time) for position in positions[1:]]
    base = np.full(len(places), begin)
    known = np.array([_tip(plant, place, path.extended(positions, [begin, *base])) for place in places])
    answers = np.zeros((len(places), len(places)))
    for node, unit in enumerate(np.eye(len(places))):
        bent = replace(straight_path(start), edges=np.array([start])).extended(positions, [0.0, *unit])
        answers[:, node] = [_tip(plant, place, bent, loaded=False) for place in places]
    tips = base + np.linalg.solve(np.eye(len(places)) - answers, known - base)
    return path.extended(positions, [begin, *tips.tolist()])


class _Place:
    """Matrices and loads at a depth, the layer at the tip that of another depth in the same one."""

    def __init__(self, plant: Plant, depth: float, inside: float, time: float) -> None:
        self.depth, self.time = depth, time
        self.operators: Operators = plant.operators(depth, time)
        self.points: Points = plant.points(depth)
        self.case = load_case(plant.scene, inside, time)
        self.factor = float(as_function(plant.scene.tissue.stiffness_factor).value(time))


def _tip(plant: Plant, place: _Place, path: CutPath, *, loaded: bool = True) -> float:
    """Return the tip's deflection [m] on a path; without the loads and the hub's own place what the path alone does."""
    case = place.case if loaded else no_load_case(place.case)
    rest = place.factor * plant.rest_terms(path, place.depth, -np.inf, np.inf).load
    state = static_state(plant, place.operators, place.points, case, depth=place.depth, time=place.time, rest_load=rest)
    return float(place.points.deflections(*state)[-1])
