"""The kinds of sensors: what each reads of a needle, with noise and rounding, at one instant."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Sensor
from fem_needle.sensing.markers import MarkerGrid
from fem_needle.sensing.noise import Noise
from fem_needle.sensing.quantization import rounded, rounded_array
from fem_needle.sensing.truth import Truth

Array = NDArray[np.float64]
Readings = dict[str, float | Array]
Instrument = Callable[[Truth], Readings]


def instrument_of(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Return what reads for a sensor beside a needle of a length [m]; each call is one reading.

    An instrument of kind ``"tissue-deformation"`` remembers its last frame, all keep their place in the noise: they serve one
    run.
    """
    makers: dict[str, Callable[[Sensor, float, Noise], Instrument]] = {
        "tip-imaging": _tip_imaging,
        "tissue-deformation": _tissue_deformation,
        "base-force": _base_force,
        "base-moment": _base_moment,
        "needle-shape": _needle_shape,
        "encoder": _encoder,
    }
    return makers[sensor.kind](sensor, length, noise)


def _tip_imaging(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Read the tip's place in an image, and the angle of the line from the entry point to it; 0 at depth 0 in the image."""
    draw, pixel = noise.numbers.__next__, sensor.pixel_size

    def read(truth: Truth) -> Readings:
        place = rounded(truth.tip_deflection + draw(), pixel)
        depth = rounded(truth.depth, pixel)
        return {"tip_deflection": place, "needle_angle": atan2(place, depth) if depth > 0.0 else 0.0}

    return read


def _tissue_deformation(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Read how far markers moved since the frame before: mean absolute value, and mean with sign."""
    grid, pixel = MarkerGrid.of(sensor, length), sensor.pixel_size
    before: Array | None = None

    def read(truth: Truth) -> Readings:
        nonlocal before
        places = grid.seen(truth)
        frame = rounded_array(places + noise.field(places.shape), pixel)
        moved = frame - (frame if before is None else before)
        before = frame
        if not moved.size:
            return {"tissue_deformation": 0.0, "tissue_displacement": 0.0}
        return {"tissue_deformation": float(np.abs(moved).mean()), "tissue_displacement": float(moved.mean())}

    return read


def _base_force(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Read the lateral and the axial force at the base, each with its own noise."""
    draw, step = noise.numbers.__next__, sensor.resolution
    return lambda truth: {
        "hub_force": rounded(truth.hub_force + draw(), step),
        "push_force": rounded(truth.push_force + draw(), step),
    }


def _base_moment(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    draw, step = noise.numbers.__next__, sensor.resolution
    return lambda truth: {"hub_moment": rounded(truth.hub_moment + draw(), step)}


def _encoder(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    draw, step = noise.numbers.__next__, sensor.resolution
    return lambda truth: {"depth": rounded(truth.depth + draw(), step)}


def _needle_shape(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Read the deflection at stations from hub to tip, each with its own noise."""
    stations, pixel = np.linspace(0.0, length, sensor.stations), sensor.pixel_size
    return lambda truth: {
        "needle_shape": rounded_array(truth.deflection(stations) + noise.field(stations.shape), pixel),
    }
