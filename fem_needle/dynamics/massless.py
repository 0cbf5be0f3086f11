"""A plant whose inertia is left out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.plant import Operators, Plant

Array = NDArray[np.float64]


class Massless:
    """A plant without inertia; everything else is the plant's own."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices with M = S = R = 0."""
        operators = self._plant.operators(depth, time)
        return replace(operators, mass=np.zeros_like(operators.mass), convection=None, centrifugal=None)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return 0."""
        return 0.0


def massless(plant: Plant) -> Plant:
    """Return a plant without inertia."""
    found: Any = Massless(plant)
    return found
