"""What is true of a needle at an instant, computed when a sensor asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.engine import Engine
from fem_needle.plant import Plant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """The needle now.

    Attributes
    ----------
    plant
        The model.
    engine
        The needle under way.
    """

    plant: Plant
    engine: Engine

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.engine.time

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self.engine.depth

    @property
    def speed(self) -> float:
        """Insertion speed [m/s]."""
        return self.engine.speed

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m]."""
        return self.engine.tip_deflection

    def deflection(self, arc_length: Array) -> Array:
        """Return the deflection [m] at stations from the hub, 0, to the tip, l."""
        solution = self.engine.end.solution
        return self.plant.deflection(solution.coordinates, solution.forces, self.depth, arc_length)

    @property
    def hub_force(self) -> float:
        """Lateral force of the clamp on the needle [N]."""
        return self.engine.sample().hub_force

    @property
    def hub_moment(self) -> float:
        """Moment of the clamp on the needle [N m]."""
        return self.engine.sample().hub_moment

    @property
    def push_force(self) -> float:
        """Axial force that the insertion needs [N]."""
        return self.engine.sample().push_force
