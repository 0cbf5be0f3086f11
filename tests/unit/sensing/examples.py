"""A needle with known values, and rigs beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Sensor
from fem_needle.sensing import SensorRig
from tests.unit.scene.examples import hub_scene

Array = NDArray[np.float64]
LENGTH = 0.2


def straight(arc_length: Array) -> Array:
    return np.zeros_like(arc_length)


@dataclass
class Known:
    """What a sensor may ask; w is a function of the arc length."""

    time: float = 0.0
    depth: float = 0.0
    speed: float = 0.0
    tip_deflection: float = 0.0
    hub_force: float = 0.0
    hub_moment: float = 0.0
    push_force: float = 0.0
    shape: Callable[[Array], Array] = straight

    def deflection(self, arc_length: Array) -> Array:
        return self.shape(arc_length)


def rig_of(*sensors: Sensor, seed: int = 0, repetition: int = 0) -> SensorRig:
    """Sensors beside a needle of 0.2 m."""
    return SensorRig(hub_scene(sensors=sensors), seed, repetition)


def read_once(kind: str, truth: Known, **keys: Any) -> dict[str, Any]:
    """What one sensor reads at the first instant."""
    rig = rig_of(Sensor(kind=kind, **keys))
    rig.sample(truth)
    return dict(rig.known(truth.time))


def series(rig: SensorRig, name: str, count: int, truth: Known | None = None) -> Array:
    """The known value of a reading at each of the next instants at which something is due; nan before the first."""
    truth = Known() if truth is None else truth
    found = []
    for _ in range(count):
        truth.time = rig.next_time
        rig.sample(truth)
        found.append(rig.known(truth.time).get(name, np.nan))
    return np.array(found)
