"""The cheapest finite elements whose tip is as right as a model's, and what the model costs beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from fem_needle.comparison.at_rest import RestStates, StaticLoad, relative_difference, rest_states
from fem_needle.comparison.runs import TimedRun, model_run, run_errors
from fem_needle.finite_element_model import ELEMENT_CHOICES
from fem_needle.models import build_plant
from fem_needle.plant import Plant
from fem_needle.scene import Scene

Answer = TypeVar("Answer", TimedRun, RestStates)

REPETITIONS = 3  # of both, in turn: the shortest time of each counts


@dataclass(frozen=True)
class EqualElements:
    """Finite elements beside a model.

    Attributes
    ----------
    elements
        The fewest of 1, 2, 3, 4, 6, 8, ... whose tip error is not larger than the model's.
    tip_error
        Their largest tip error, measured as the model's (1).
    solve_time, model_time
        What they take and what the model takes, the shortest of three times each [s].
    """

    elements: int
    tip_error: float
    solve_time: float
    model_time: float

    @property
    def factor(self) -> float:
        """Time of the model by that of the elements (1): above 1 the elements are cheaper."""
        return self.model_time / self.solve_time


def equal_in_run(scene: Scene, model: Plant, error: float, truth: TimedRun) -> EqualElements | None:
    """Return the elements whose run is as right as a model's; None where no coarser ones than the reference are."""

    def run(plant: Plant) -> TimedRun:
        return model_run(plant, truth.run)

    def tip_error(found: TimedRun) -> float:
        return float("inf") if found.failure else run_errors(found, truth).largest_tip

    return _equal(scene, model, error, run, tip_error)


def equal_at_rest(scene: Scene, model: Plant, error: float, truth: RestStates, load: StaticLoad) -> EqualElements | None:
    """Return the elements whose equilibria are as right as a model's; None where no coarser ones than the reference are."""

    def rest(plant: Plant) -> RestStates:
        loaded = plant if not load.probe_force else build_plant(load.applied(plant.scene))
        return rest_states(loaded, truth.depths, load.time)

    def tip_error(found: RestStates) -> float:
        return float(np.max(np.abs(relative_difference(found.tips, truth.tips))))

    return _equal(scene, model, error, rest, tip_error)


def _equal(
    scene: Scene, model: Plant, error: float, answer: Callable[[Plant], Answer], tip_error: Callable[[Answer], float]
) -> EqualElements | None:
    """Look for the elements and time both in turn."""
    finest = scene.numerics.elements
    if not isinstance(finest, int) or scene.model.kind != "fem" or not np.isfinite(error):
        return None
    for count in (count for count in ELEMENT_CHOICES if count < finest):
        plant = build_plant(scene.with_value("numerics.elements", count))
        missed = tip_error(answer(plant))
        if missed <= error:
            times = [(answer(plant).solve_time, answer(model).solve_time) for _ in range(REPETITIONS)]
            return EqualElements(count, missed, min(time for time, _ in times), min(time for _, time in times))
    return None
