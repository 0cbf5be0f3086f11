"""The inserted part of an ``entry`` needle on functions of y that do not move: the beam grows along them.

    M = rho A integral psi psi,   K = EI integral psi'' psi'',   S = rho A integral psi psi',   R = rho A integral psi' psi'

over 0..z. S and R belong to the material derivative Dw/Dt = psi q' + v psi' q; the fixed frame has neither. Everything changes
with z only through the upper limit, so that dM/dz = rho A psi(z) psi(z) and so on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.beam_matrices import BeamMatrices
from fem_needle.frames import Depth
from fem_needle.scene import Scene
from reduced_model.shapes import GaussIntegrals, LineShapes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FixedFrame:
    """The place on the functions is y itself, for a needle of a given length [m]."""

    length: float
    stretch_rate: float = 0.0
    power: int | None = None

    def position(self, y: float, depth: float) -> float:
        """Return y [m], kept on the needle."""
        return min(max(y, 0.0), self.length)

    def position_rate(self, y: float, depth: float) -> float:
        """Return 0, or 1 at the tip, which moves along the functions."""
        return 1.0 if y >= depth else 0.0

    def places_of(self, y: Array | float, depths: Array) -> tuple[Array, Array]:
        """Return y and 0, or 1 at the tip."""
        return np.clip(y, 0.0, self.length) + 0.0 * depths, np.where(y >= depths, 1.0, 0.0)

    def positions(self, y: Array, depth: float) -> tuple[Array, Array]:
        """Return y and 0."""
        return y, np.zeros(y.shape)

    def axis_positions(self, places: Array, depth: float) -> Array:
        """Return y [m]."""
        return places

    def places(self, arc_length: Array, length: float, depth: Depth) -> tuple[Array, Depth | float]:
        """Return y = s - (l - z) [m] and 1."""
        return depth - (length - arc_length), 1.0

    def stretch(self, depth: Depth) -> Depth | float:
        """Return 1."""
        return 1.0


class GrowingBeam:
    """A beam from the surface to the tip at z on functions of y (`fem_needle.beam_matrices.Beam`)."""

    def __init__(self, shapes: LineShapes, scene: Scene) -> None:
        self._shapes = shapes
        self._mass_per_length = scene.needle.mass_per_length
        self._bending_stiffness = scene.needle.bending_stiffness
        self._is_convected = scene.model.kinematics == "material"
        self._mass, self._bending = GaussIntegrals(shapes, "mass"), GaussIntegrals(shapes, "bending")
        self._drag, self._slip = GaussIntegrals(shapes, "drag"), GaussIntegrals(shapes, "slip")

    def matrices(self, depth: float) -> BeamMatrices:
        """Return the matrices at a depth [m]."""

        def upto(integrals: GaussIntegrals, factor: float) -> Array:
            return banded.from_dense(factor * integrals.between(0.0, depth))

        mass = self._mass_per_length
        return BeamMatrices(
            upto(self._mass, mass),
            upto(self._bending, self._bending_stiffness),
            upto(self._drag, mass) if self._is_convected else None,
            upto(self._slip, mass) if self._is_convected else None,
        )

    def bending_rate_product(self, coordinates: Array, depth: float) -> Array:
        """Return dK/dz q = EI psi''(z) (psi''(z) . q)."""
        curvature = self._shapes.row(depth, 2)
        return self._bending_stiffness * float(curvature @ coordinates) * curvature

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz = 1/2 rho A (tip velocity)^2 [N], of the functions' own velocity under ``fixed-frame``."""
        velocity = float(self._shapes.row(depth) @ velocities)
        if self._is_convected:
            velocity += speed * float(self._shapes.row(depth, 1) @ coordinates)
        return 0.5 * self._mass_per_length * velocity**2
