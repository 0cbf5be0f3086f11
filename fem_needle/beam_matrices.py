"""The beam's own matrices on shapes that keep their range: the whole needle, or the inserted part stretched to 0..1.

All integrals are constants; with the stretch h of the frame (1, or the depth z),

    M = h M_1,   K = K_1 / h^3,   S = S_1,   R = R_1 / h.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.frames import Depth, Frame
from fem_needle.loads import turns_with_needle
from fem_needle.scene import Scene
from fem_needle.shapes import Shapes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BeamMatrices:
    """M, K, S, R of the beam alone at one depth, band storage; S and R are None where nothing is convected."""

    mass: Array
    bending: Array
    convection: Array | None
    centrifugal: Array | None


class Beam(Protocol):
    """The beam without tissue."""

    def matrices(self, depth: float) -> BeamMatrices:
        """Return the matrices at a depth [m]."""

    def bending_rate_product(self, coordinates: Array, depth: float) -> Array | None:
        """Return dK/dz q, None where K does not change."""

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N] at fixed coordinates, velocities and speed."""


@dataclass(frozen=True, eq=False)
class ScaledBeam:
    """A beam whose matrices are constants times powers of the frame's stretch."""

    frame: Frame
    unit: BeamMatrices

    def matrices(self, depth: float) -> BeamMatrices:
        """Return the matrices at a depth [m]."""
        stretch, unit = self.frame.stretch(depth), self.unit
        if stretch == 1.0 and not self.frame.stretch_rate:
            return unit
        return BeamMatrices(
            unit.mass * stretch,
            unit.bending * _bending_scale(stretch),
            unit.convection,
            None if unit.centrifugal is None else unit.centrifugal / stretch,
        )

    def bending_rate_product(self, coordinates: Array, depth: float) -> Array | None:
        """Return -3 K q / h dh/dz."""
        if not self.frame.stretch_rate:
            return None
        return banded.multiply(self.unit.bending, coordinates) * (-3 * self.frame.stretch_rate / self.frame.stretch(depth) ** 4)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N]: M grows with the depth and R falls with it under ``entry``; 0 under ``hub``."""
        if self.unit.centrifugal is None:
            return 0.0
        growing = 0.5 * velocities @ banded.multiply(self.unit.mass, velocities)
        falling = 0.5 * (speed / depth) ** 2 * (coordinates @ banded.multiply(self.unit.centrifugal, coordinates))
        return float(growing - falling)


def _bending_scale(stretch: Depth) -> Depth:
    """Return 1 / h^3, to the last digit the same for one depth and for many: what both loops round alike they agree on."""
    return 1.0 / (stretch * stretch * stretch)


def whole_needle(shapes: Shapes, frame: Frame, scene: Scene) -> ScaledBeam:
    """Return the beam from hub to tip; a hub that turns adds its inertia."""
    needle = scene.needle
    mass = shapes.interval_integrals("mass").band * needle.mass_per_length
    bending = shapes.interval_integrals("bending").band * needle.bending_stiffness
    if turns_with_needle(scene):
        mass[banded.half_bandwidth(mass), 1] += scene.support.hub_rotational_inertia or 0.0
    return ScaledBeam(frame, BeamMatrices(mass, bending, None, None))


def stretched_part(shapes: Shapes, from_tip: Shapes, frame: Frame, scene: Scene) -> ScaledBeam:
    """Return the inserted part on 0..1, with S = integral psi chi and R = integral chi chi for the scene's kinematics.

    chi = -xi psi' (fixed-frame) or (1 - xi) psi' (material): -x psi' with x counted from the surface or from the tip;
    ``from_tip`` are the same shapes on -1..0.
    """
    needle = scene.needle
    mass = shapes.interval_integrals("mass").band * needle.mass_per_length
    bending = shapes.interval_integrals("bending").band * needle.bending_stiffness
    counted = shapes if scene.model.kinematics == "fixed-frame" else from_tip
    convection = counted.interval_integrals("drag", 1).band * -needle.mass_per_length
    centrifugal = counted.interval_integrals("slip", 1).band * needle.mass_per_length
    return ScaledBeam(frame, BeamMatrices(mass, bending, convection, centrifugal))
