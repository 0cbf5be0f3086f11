"""Equilibria at places of a run, one after the other in one call of the kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import drive_of
from fem_needle.dynamics.engine import REST, Engine
from fem_needle.dynamics.model import is_known
from fem_needle.plant import Plant
from fem_needle.sample_arrays import tips_of
from fem_needle.statics import solve_static

Array = NDArray[np.float64]

BEFORE = 1e-12  # of the last time: how long it rests before it is looked at


def tips_at_rest(plant: Plant, places: Sequence[tuple[float, float]]) -> Array:
    """Return the static tip deflections [m] at places of rising times (time [s], depth [m]).

    Raises
    ------
    ComputationError
        If an equilibrium has no solution.
    """
    times = np.array([time for time, _ in places])
    before = BEFORE * max(1.0, float(times[-1]))
    if not is_known(plant) or np.any(np.diff(times) <= 4.0 * before):
        return _one_by_one(plant, places)
    engine = Engine(plant, REST)
    engine.drive(drive_of(plant.scene).replaced({at.DEPTH_SIGNAL: _resting_rows(places, before)}))
    engine.land()
    ones = np.ones(len(times))
    _, samples = engine.advance(np.stack([times - before, times, ones, ones], axis=1), counted=False)
    if len(samples) < len(times) or not np.all(np.isfinite(samples.coordinates)):  # which says why
        return _one_by_one(plant, places)
    return tips_of(plant, samples)


def _one_by_one(plant: Plant, places: Sequence[tuple[float, float]]) -> Array:
    return np.array([solve_static(plant, depth=depth, time=time).tip_deflection for time, depth in places])


def _resting_rows(places: Sequence[tuple[float, float]], before: float) -> Array:
    """Return the rows of a depth that stays at each place until just before the next one."""
    rows = np.zeros((len(places), at.ROW))
    rows[:, at.ROW_START] = [time - 2.0 * before for time, _ in places]
    rows[:, at.ROW_VALUE] = [depth for _, depth in places]
    return rows
