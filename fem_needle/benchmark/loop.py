"""The program's own loop over time, as the benchmark times it: the one place that knows which call that is."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.methods import TooSlowError
from fem_needle.choices import choose
from fem_needle.errors import SuspiciousValueWarning
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples
from fem_needle.scene import Scene
from fem_needle.simulation import run_scene, simulate

Array = NDArray[np.float64]

LONGEST = 15.0  # s: a run of the program that takes longer is stopped


class Watch:
    """Stops a run at a time limit.

    Parameters
    ----------
    longest
        Limit [s].
    """

    def __init__(self, longest: float = LONGEST) -> None:
        self._limit, self._end = longest, clock.perf_counter() + longest

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Ignore what is going to be computed."""

    def progress(self, fraction: float) -> None:
        """Stop the run after the limit.

        Raises
        ------
        TooSlowError
            Then.
        """
        if clock.perf_counter() > self._end:
            raise TooSlowError(f"stopped after {self._limit:g} s")

    def samples(self, block: Samples) -> None:
        """Ignore samples."""


def whole_loop(plant: Plant) -> Callable[[], Array]:
    """Return a call that runs a plant through its scene with the scene's steps and returns the tips at its outputs [m]."""
    analysis = choose(plant.scene, lambda: plant).analysis
    return lambda: quietly(lambda: simulate(plant, analysis=analysis, observer=Watch()).tip_deflection)


def whole_run(scene: Scene) -> Callable[[], Array]:
    """Return a call that does all that `run_scene` does and returns the tips at the outputs [m]."""
    return lambda: quietly(lambda: run_scene(scene, observer=Watch()).tip_deflection)


def quietly(call: Callable[[], Array]) -> Array:
    """Return what a call returns without its warnings on few modes, which are known here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SuspiciousValueWarning)
        return call()
