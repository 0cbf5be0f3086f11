"""What sensors ask of a needle."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Truth(Protocol):
    """A needle at one instant, exactly; each value may cost something, so a sensor asks only for what it reads."""

    @property
    def time(self) -> float:
        """[s]."""
        ...

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        ...

    @property
    def speed(self) -> float:
        """Of the insertion [m/s]."""
        ...

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m]."""
        ...

    @property
    def hub_force(self) -> float:
        """Lateral force of the clamp on the needle [N]."""
        ...

    @property
    def hub_moment(self) -> float:
        """Moment of the clamp on the needle [N m]."""
        ...

    @property
    def push_force(self) -> float:
        """Axial force that the insertion needs [N], positive going in."""
        ...

    def deflection(self, arc_length: Array) -> Array:
        """Return w [m] at stations from the hub, 0, to the tip, l; shape of ``arc_length``."""
        ...
