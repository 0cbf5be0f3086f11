"""The kinds of sensors: what each reads of a needle, with noise and rounding, at one instant."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Sensor
from fem_needle.sensing.markers import MarkerGrid
from fem_needle.sensing.noise import Noise
from fem_needle.sensing.quantization import rounded, rounded_array
from fem_needle.sensing.truth import Truth

Array = NDArray[np.float64]
Readings = dict[str, float | Array]
Reader = Callable[[Truth], Readings]


class Instrument(Protocol):
    """What reads for a sensor.

    Attributes
    ----------
    memory
        What it keeps from one reading to the next, never changed in place.
    """

    memory: Array | None

    def __call__(self, truth: Truth) -> Readings:
        """Return one reading."""


class Gauge:
    """An instrument that keeps nothing."""

    def __init__(self, read: Reader) -> None:
        self._read = read
        self.memory: Array | None = None

    def __call__(self, truth: Truth) -> Readings:
        """Return one reading."""
        return self._read(truth)


class DeformationCamera:
    """Reads how far markers moved since the frame before: mean absolute value, and mean with sign.

    Attributes
    ----------
    memory
        The last frame [m], shape (6, n).
    """

    def __init__(self, sensor: Sensor, length: float, noise: Noise) -> None:
        self._grid, self._pixel, self._noise = MarkerGrid.of(sensor, length), sensor.pixel_size, noise
        self.memory: Array | None = None

    def __call__(self, truth: Truth) -> Readings:
        """Return one reading."""
        places = self._grid.seen(truth)
        frame = rounded_array(places + self._noise.field(places.shape), self._pixel)
        moved = frame - (frame if self.memory is None else self.memory)
        self.memory = frame
        if not moved.size:
            return {"tissue_deformation": 0.0, "tissue_displacement": 0.0}
        return {"tissue_deformation": float(np.abs(moved).mean()), "tissue_displacement": float(moved.mean())}


def instrument_of(sensor: Sensor, length: float, noise: Noise) -> Instrument:
    """Return what reads for a sensor beside a needle of a length [m]; each call is one reading.

    An instrument of kind ``"tissue-deformation"`` remembers its last frame, all keep their place in the noise: they serve one
    run.
    """
    if sensor.kind == "tissue-deformation":
        return DeformationCamera(sensor, length, noise)
    makers: dict[str, Callable[[Sensor, float, Noise], Reader]] = {
        "tip-imaging": _tip_imaging,
        "base-force": _base_force,
        "base-moment": _base_moment,
        "needle-shape": _needle_shape,
        "encoder": _encoder,
    }
    return Gauge(makers[sensor.kind](sensor, length, noise))


def _tip_imaging(sensor: Sensor, length: float, noise: Noise) -> Reader:
    """Read the tip's place in an image, and the angle of the line from the entry point to it; 0 at depth 0 in the image."""
    draw, pixel = noise.number, sensor.pixel_size

    def read(truth: Truth) -> Readings:
        place = rounded(truth.tip_deflection + draw(), pixel)
        depth = rounded(truth.depth, pixel)
        return {"tip_deflection": place, "needle_angle": atan2(place, depth) if depth > 0.0 else 0.0}

    return read


def _base_force(sensor: Sensor, length: float, noise: Noise) -> Reader:
    """Read the lateral and the axial force at the base, each with its own noise."""
    draw, step = noise.number, sensor.resolution
    return lambda truth: {
        "hub_force": rounded(truth.hub_force + draw(), step),
        "push_force": rounded(truth.push_force + draw(), step),
    }


def _base_moment(sensor: Sensor, length: float, noise: Noise) -> Reader:
    draw, step = noise.number, sensor.resolution
    return lambda truth: {"hub_moment": rounded(truth.hub_moment + draw(), step)}


def _encoder(sensor: Sensor, length: float, noise: Noise) -> Reader:
    draw, step = noise.number, sensor.resolution
    return lambda truth: {"depth": rounded(truth.depth + draw(), step)}


def _needle_shape(sensor: Sensor, length: float, noise: Noise) -> Reader:
    """Read the deflection at stations from hub to tip, each with its own noise."""
    stations, pixel = np.linspace(0.0, length, sensor.stations), sensor.pixel_size
    return lambda truth: {
        "needle_shape": rounded_array(truth.deflection(stations) + noise.field(stations.shape), pixel),
    }
