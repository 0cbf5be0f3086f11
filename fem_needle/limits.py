"""What is refused before anything is computed: runs that no machine finishes or holds, places that are not on the needle."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError

MOST_STEPS = 1_000_000_000
MOST_SAMPLES = 1_000_000
MOST_BYTES = 4_000_000_000  # of all samples together
MOST_READINGS = 1_000_000  # of a sensor or a controller
MOST_REPETITIONS = 100_000

BESIDE = 1e-9  # of the length: what rounding may put a station beside the needle

_BYTES_OF_SAMPLE = 2000  # besides coordinates and stations
_COPIES = (2, 3)  # of the coordinates and of the deflections at the stations, while a run is collected


def stations_on(arc_length: ArrayLike, length: float) -> NDArray[np.float64]:
    """Return stations from the hub, 0, to the tip [m], each of which is on the needle.

    Raises
    ------
    SceneError
        With the first that is not; where it would be in mm, this is said.
    """
    stations = np.asarray(arc_length, dtype=float)
    outside = ~((stations >= -BESIDE * length) & (stations <= (1.0 + BESIDE) * length))
    if np.any(outside):
        first = float(stations[outside].flat[0])
        hint = f"; {first:g} mm would be {1e-3 * first:g}" if length < first <= 1e3 * length else ""
        raise SceneError(f"arc_length: not on the needle (got {first:g} m; allowed 0, the hub, to {length:g} m, the tip{hint})")
    return np.clip(stations, 0.0, length)


def check_steps(duration: float, time_step: float) -> None:
    """Refuse a run [s] of too many steps [s].

    Raises
    ------
    SceneError
        With both, and the number of steps.
    """
    _check("numerics.time_step", "steps", duration, time_step, MOST_STEPS)


def check_samples(duration: float, output_step: float, unknowns: int = 0, stations: int = 0) -> None:
    """Refuse a run [s] of too many samples, or of samples that are too large together.

    Raises
    ------
    SceneError
        With the number of samples, or the memory that they need.
    """
    samples = _check("numerics.output_step", "samples", duration, output_step, MOST_SAMPLES)
    size = samples * (_BYTES_OF_SAMPLE + 8 * (_COPIES[0] * unknowns + _COPIES[1] * stations))
    if size > MOST_BYTES:
        raise SceneError(
            f"numerics.output_step: needs {size / 1e9:.3g} GB for {samples:.6g} samples of {unknowns} unknowns and {stations} "
            f"output_points (allowed up to {MOST_BYTES / 1e9:g} GB)"
        )


def check_readings(duration: float, period: float, key: str) -> None:
    """Refuse a sensor or a controller that is asked too often in a run [s].

    Raises
    ------
    SceneError
        With the number of readings.
    """
    _check(key, "readings", duration, period, MOST_READINGS)


def check_swings(duration: float, period: float) -> None:
    """Refuse a sinusoid that swings too often in a run [s] for a step to be chosen.

    Raises
    ------
    SceneError
        With the number of swings.
    """
    _check("frequency: a period", "swings", duration, period, MOST_SAMPLES)


def _check(key: str, what: str, duration: float, period: float, most: int) -> float:
    count = duration / period if period > 0.0 else float("inf")
    if not isfinite(count) or count > most:
        raise SceneError(f"{key}: makes {count:.6g} {what} (got {period:g} s over {duration:g} s; allowed up to {most} {what})")
    return count + 1.0
