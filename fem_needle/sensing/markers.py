"""A grid of markers in the tissue beside the needle, as a camera sees them."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Sensor
from fem_needle.sensing.truth import Truth

Array = NDArray[np.float64]

ROWS = 3  # on each side of the axis
ROUNDING = 1e-9  # of a spacing: a marker at the needle's length counts


@dataclass(frozen=True, eq=False)
class MarkerGrid:
    """Markers at depths (i + 1/2) spacing down to the needle's length, beside the axis at +-(j + 1/2) spacing, j = 0, 1, 2.

    Attributes
    ----------
    depths
        y of the markers [m], rising; shape (n,).
    places
        Lateral places of the rows in undeformed tissue [m], rising; shape (6, 1).
    shares
        exp(-abs(place) / decay_length) of each row; shape (6, 1).
    length
        Of the needle [m].
    """

    depths: Array
    places: Array
    shares: Array
    length: float

    @classmethod
    def of(cls, sensor: Sensor, length: float) -> MarkerGrid:
        """Return the grid of a sensor of kind ``"tissue-deformation"`` beside a needle of a length [m]."""
        spacing = sensor.marker_spacing
        depths: Array = (np.arange(floor(length / spacing + 0.5 + ROUNDING), dtype=np.float64) + 0.5) * spacing
        places: Array = (np.arange(-ROWS, ROWS, dtype=np.float64) + 0.5)[:, None] * spacing
        return cls(depths, places, np.exp(-np.abs(places) / (sensor.decay_length or np.inf)), length)

    def seen(self, truth: Truth) -> Array:
        """Return the lateral places of the markers [m]: place + w(y) exp(-abs(place) / decay_length); shape (6, n).

        w is 0 at markers that the tip has not reached.
        """
        depth = truth.depth
        reached = int(np.searchsorted(self.depths, depth))
        needle = np.zeros(len(self.depths))
        if reached:
            needle[:reached] = truth.deflection(self.length - depth + self.depths[:reached])
        return self.places + needle * self.shares
