"""Motion and loads at the nodes and ends of many steps at once: what `fem_needle.steppers` asks step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation
from fem_needle.loads import LoadCase, load_cases
from fem_needle.motion import DepthLaw
from fem_needle.plant import Plant
from fem_needle.scene import as_function
from fem_needle.segments import all_one_sided
from fem_needle.stages import Stage

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Instants:
    """The start of the first step, and nodes and end of each (T = (nodes + 1) steps + 1).

    Attributes
    ----------
    times, depths, speeds, accelerations
        (T,); the depth is the plant's own, not less than its smallest.
    loads
        With a row for each.
    factor, factor_rate
        The tissue's stiffness factor and its rate [1/s] (T,).
    """

    times: Array
    depths: Array
    speeds: Array
    accelerations: Array
    loads: LoadCase
    factor: Array
    factor_rate: Array

    def first(self, count: int) -> Instants:
        """Return the first instants alone."""
        return Instants(
            self.times[:count],
            self.depths[:count],
            self.speeds[:count],
            self.accelerations[:count],
            LoadCase(*(getattr(self.loads, name)[:count] for name in _LOAD_NAMES)),
            self.factor[:count],
            self.factor_rate[:count],
        )


def instants_of(plant: Plant, law: DepthLaw, method: Collocation, times: Array, start: Stage) -> Instants:
    """Return the instants of the steps between rising times [s] (steps + 1,), the start as a stage gives it."""
    begins, ends = times[:-1, None], times[1:, None]
    nodes = np.where(method.nodes == 1.0, ends, begins + method.nodes * (ends - begins))
    where = np.concatenate([nodes, ends], axis=1).ravel()
    before = np.tile(np.append(method.nodes == 1.0, True), len(begins))  # at the end of a step: its left side
    stride = len(method.nodes) + 1
    middles = np.repeat(law.depths(0.5 * (begins + ends).ravel()), stride)
    rated = np.where(before, np.nextafter(where, -np.inf), where)
    depths = law.depths(where)
    depths = np.where(before, all_one_sided(plant.scene.tissue.layers, depths, middles), depths)
    known = np.minimum(where, np.repeat(np.nextafter(ends, begins).ravel(), stride))
    loads = load_cases(plant.scene, middles, known)
    swelling = as_function(plant.scene.tissue.stiffness_factor)
    # A node at the end belongs to its step, the end itself to what follows.
    swollen = np.where(np.tile(np.arange(stride) < stride - 1, len(begins)), known, where)
    case = start.case
    return Instants(
        np.append(start.instant.time, where),
        np.append(start.instant.depth, np.maximum(depths, plant.smallest_depth)),
        np.append(start.instant.speed, law.speeds(rated)),
        np.append(start.instant.acceleration, law.accelerations(rated)),
        LoadCase(*(np.concatenate([getattr(case, name)[None], getattr(loads, name)]) for name in _LOAD_NAMES)),
        np.append(swelling.value(start.instant.time), swelling.value(swollen)),
        np.append(swelling.derivative(start.instant.time), swelling.derivative(swollen)),
    )


_LOAD_NAMES: Sequence[str] = ("forces", "force_rates", "clamp", "clamp_rates", "clamp_accelerations")
