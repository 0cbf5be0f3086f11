"""Where a position along the insertion axis lies on the mesh, and how it moves as the needle goes in.

``hub``: the mesh is the needle itself, arc length s = y + (l - z). ``entry``: the mesh is stretched over the inserted part,
depth fraction xi = y / z (physics: docs/theory.md, sections "Hub" and "Entry").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Depth = TypeVar("Depth", float, Array)


class Frame(Protocol):
    """Map from y to the mesh."""

    def position(self, y: float, depth: float) -> float:
        """Return the place on the mesh of a point at y [m]."""

    def position_rate(self, y: float, depth: float) -> float:
        """Return d(position)/dz at a fixed y."""

    def positions(self, y: Array, depth: float) -> tuple[Array, Array]:
        """Return the places of points on the needle, the tip excluded, and their rates by depth."""

    def places_of(self, y: Array | float, depths: Array) -> tuple[Array, Array]:
        """Return the places of points at y [m], and their rates by depth, over many depths [m]: `position`, `position_rate`."""

    def stretch(self, depth: Depth) -> Depth | float:
        """Return dy / d(position)."""

    def axis_positions(self, places: Array, depth: float) -> Array:
        """Return y [m] of places on the shapes, the inverse of `positions`."""

    def places(self, arc_length: Array, length: float, depth: Depth) -> tuple[Array, Depth | float]:
        """Return the places of stations of the part that bends, and how many metres a unit of place is.

        Depths may be one for each station.
        """

    @property
    def stretch_rate(self) -> float:
        """Return d(stretch)/dz."""

    @property
    def power(self) -> int | None:
        """Return p in dw/dt = psi q' - v x^p psi' q / stretch: the needle slides (0) or stretches (1) past the tissue.

        None: the shapes rest with the tissue, dw/dt = psi q'.
        """


@dataclass(frozen=True)
class MaterialFrame:
    """Arc length of a needle of a given length [m]."""

    length: float
    stretch_rate: float = 0.0
    power: int | None = 0

    def position(self, y: float, depth: float) -> float:
        """Return s = y + (l - z) [m], kept on the needle."""
        return self.length if y >= depth else min(max(y + (self.length - depth), 0.0), self.length)

    def position_rate(self, y: float, depth: float) -> float:
        """Return -1, or 0 at the tip, which moves with the mesh."""
        return 0.0 if y >= depth else -1.0

    def places_of(self, y: Array | float, depths: Array) -> tuple[Array, Array]:
        """Return s and -1, or l and 0 at the tip."""
        at_tip = y >= depths
        places = np.clip(y + (self.length - depths), 0.0, self.length)
        return np.where(at_tip, self.length, places), np.where(at_tip, 0.0, -1.0)

    def positions(self, y: Array, depth: float) -> tuple[Array, Array]:
        """Return s and -1."""
        return y + (self.length - depth), np.full(y.shape, -1.0)

    def stretch(self, depth: Depth) -> Depth | float:
        """Return 1."""
        return 1.0

    def axis_positions(self, places: Array, depth: float) -> Array:
        """Return y = s - (l - z) [m]."""
        return depth - (self.length - places)

    def places(self, arc_length: Array, length: float, depth: Depth) -> tuple[Array, Depth | float]:
        """Return s and 1."""
        return arc_length, 1.0


@dataclass(frozen=True)
class StretchedFrame:
    """Fraction of the depth."""

    stretch_rate: float = 1.0
    power: int | None = 1

    def position(self, y: float, depth: float) -> float:
        """Return xi = y / z."""
        return 1.0 if y >= depth else max(y / depth, 0.0)

    def position_rate(self, y: float, depth: float) -> float:
        """Return -xi / z, or 0 at the tip."""
        return 0.0 if y >= depth else -y / depth**2

    def places_of(self, y: Array | float, depths: Array) -> tuple[Array, Array]:
        """Return xi and -xi / z, or 1 and 0 at the tip."""
        at_tip = y >= depths
        return np.where(at_tip, 1.0, np.maximum(y / depths, 0.0)), np.where(at_tip, 0.0, -y / depths**2)

    def positions(self, y: Array, depth: float) -> tuple[Array, Array]:
        """Return xi and -xi / z."""
        return y / depth, -y / depth**2

    def stretch(self, depth: Depth) -> Depth | float:
        """Return z [m]."""
        return depth

    def axis_positions(self, places: Array, depth: float) -> Array:
        """Return y = xi z [m], rounded as counted from the tip."""
        return depth - depth * (1.0 - places)

    def places(self, arc_length: Array, length: float, depth: Depth) -> tuple[Array, Depth | float]:
        """Return xi = 1 + (s - l) / z and z."""
        return 1 + (arc_length - length) / depth, depth
