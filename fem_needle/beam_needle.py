"""A needle whose deflection is a sum of shapes: what all models of a beam in tissue share, a plant.

    T = 1/2 rho A integral (Dw/Dt)^2,   U = 1/2 EI integral w''^2 + 1/2 m(t) sum_i k_i integral_layer_i w^2 - work of the points

Derivation: docs/theory.md.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.beam_matrices import Beam
from fem_needle.foundation import Foundation
from fem_needle.frames import Frame
from fem_needle.loads import turns_with_needle
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Plant, Points, RestTerms
from fem_needle.row_blocks import row_blocks
from fem_needle.scene import Guide, LateralLoad, Scene, as_function
from fem_needle.shapes import Shapes, values_at

Array = NDArray[np.float64]

SMALLEST_DEPTH_FRACTION = 1e-6  # of the length: below it the inserted part of an `entry` needle is dropped


class PolynomialNeedle(Plant):
    """A plant whose shapes are polynomials that the compiled loop can integrate itself; a wrapper around one is none.

    Attributes
    ----------
    shapes, frame
        The functions w is made of, and where a position along the insertion axis lies on them.
    foundation
        Tells whether any tissue is viscous.
    turns
        Whether the hub's rotation is a coordinate.
    is_polynomial
        Whether the polynomials say all of it (`Plant.is_polynomial`).
    nearly_dependent
        Whether only some directions of the functions are told apart at a small depth.
    """

    shapes: Any
    frame: Frame
    foundation: Foundation
    turns: bool
    is_polynomial = True
    nearly_dependent = False


class BeamNeedle(PolynomialNeedle, ABC):
    """A beam on a foundation, a plant.

    Parameters
    ----------
    scene
        What is modelled.
    shapes
        The functions w is made of; the first two coordinates are the clamped end's (deflection and slope) and are prescribed.
    frame
        Where a position along the insertion axis lies on the shapes.
    beam
        The beam's own matrices.
    """

    axial_force_acts = True
    largest_spectral_radius = 1.0
    warnings: tuple[str, ...] = ()

    def __init__(self, scene: Scene, shapes: Shapes, frame: Frame, beam: Beam) -> None:
        self.scene = scene
        self.shapes = shapes
        self.frame = frame
        self.is_entry = scene.support.kind == "entry"
        self.foundation = Foundation(scene.tissue.layers, shapes, frame, scene.tissue.tip_stiffness or 0.0)
        self.size = shapes.size
        self.turns = turns_with_needle(scene)
        self.prescribed = 1 if self.turns else 2
        self.smallest_depth = SMALLEST_DEPTH_FRACTION * scene.needle.length if self.is_entry else 0.0
        self.deflection_at_one = shapes.straight(1.0, 0.0)
        self._beam = beam
        self._stiffness_factor = as_function(scene.tissue.stiffness_factor)
        self._point_list = points_of(scene)

    @property
    def point_positions(self) -> tuple[float, ...]:
        """Positions y [m] of guides and lateral loads."""
        return tuple(point.position for point in self._point_list)

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices at a depth [m] and time [s]."""
        beam = self._beam.matrices(depth)
        damping, drag, slip = self.foundation.damping(depth)
        tissue, factor_rate = self.foundation.stiffness(depth), self._stiffness_factor.derivative(time)
        return Operators(
            mass=beam.mass,
            bending=beam.bending,
            tissue=tissue * self._stiffness_factor.value(time),
            convection=beam.convection,
            centrifugal=beam.centrifugal,
            damping=damping,
            drag=drag,
            slip=slip,
            tissue_rate=tissue * factor_rate if factor_rate else None,
            clamped=self.prescribed,
        )

    def clamp_reactions(self, residual: Array, depth: float) -> tuple[float, float]:
        """Return force [N] and moment [N m] of the clamp; a slope by depth fraction is z times the angle."""
        if self.turns:  # nothing but the torque, a load, turns a free hub
            return float(residual[0]), 0.0
        return float(residual[0]), float(residual[1]) * self.frame.stretch(depth)

    def straight(self, deflection: float, angle: float) -> Array:
        """Return the coordinates of w = deflection + angle s (zero under ``entry``, whose clamp does not move)."""
        return self.shapes.straight(deflection, angle)

    def stiffness_rate_product(self, coordinates: Array, depth: float, time: float) -> Array:
        """Return d(K + m G)/dz q."""
        factor = self._stiffness_factor.value(time)
        result = factor * self.foundation.stiffness_rate_product(coordinates, depth)
        bending = self._beam.bending_rate_product(coordinates, depth)
        return result if bending is None else result + bending

    def rest_terms(self, path: CutPath, depth: float, lower: float, upper: float) -> RestTerms:
        """Return what the cut path at lower <= y < upper adds to the tissue's energy, for a stiffness factor of 1."""
        return self.foundation.rest_terms(path, depth, lower, upper)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N] at fixed coordinates, velocities and speed."""
        return self._beam.kinetic_rate(velocities, coordinates, depth, speed)

    def points(self, depth: float) -> Points:
        """Return rows and flexibilities of guides, lateral loads and tip."""
        positions = self.point_positions
        count = len(positions) + self.turns + 1
        rows, rates = np.zeros((count, self.size)), np.zeros((count, self.size))
        for index, y in [*enumerate(positions), (count - 1, depth)]:
            place, moved = self.frame.position(y, depth), self.frame.position_rate(y, depth)
            rows[index] = self.shapes.row(place)
            if moved:
                rates[index] = moved * self.shapes.row(place, 1)
        if self.turns:
            rows[-2, 1] = 1.0
        guides = self.scene.support.guides
        flexibility, rate = self._flexibilities(np.array([depth]), count)
        return Points(rows, rates, flexibility[0], rate[0], len(guides), _compliances(guides))

    def deflection(
        self, coordinates: Array, forces: Array, depth: float | Array, arc_length: Array, derivative: int = 0
    ) -> Array:
        """Return w [m] or a derivative of it by arc length at stations from the hub (0) to the tip (l), of one state or many."""
        stations = np.asarray(arc_length, dtype=float)
        if np.ndim(depth):
            return self._deflections(coordinates, np.asarray(depth, dtype=float), stations, derivative)
        if not self.is_entry:
            return self.shapes.evaluate(coordinates, stations, derivative)
        result = np.zeros(stations.shape)
        inside = stations > self.scene.needle.length - depth
        if depth > 0:
            places, stretch = self.frame.places(stations[inside], self.scene.needle.length, float(depth))
            result[inside] = self.shapes.evaluate(coordinates, places, derivative) / stretch**derivative
        return result

    def _deflections(self, coordinates: Array, depths: Array, stations: Array, derivative: int) -> Array:
        """Return the same of many states: (T, n) and (T,) to (T, stations)."""
        result = np.zeros((len(depths), stations.size))
        length, count = self.scene.needle.length, self.shapes.half_bandwidth + 1  # shapes at a place
        for block in row_blocks(len(depths), stations.size * count):
            if not self.is_entry:
                result[block] = self.shapes.evaluate(coordinates[block], stations, derivative)
                continue
            inserted = depths[block, None]
            row, station = np.nonzero((stations > length - inserted) & (inserted > 0))
            places, stretch = self.frame.places(stations[station], length, depths[block][row])
            values = values_at(self.shapes, coordinates[block], row, places, derivative)
            result[block][row, station] = values / stretch**derivative
        return result

    @abstractmethod
    def describe(self) -> dict[str, int | float | str]:
        """Return what ``summary.json`` says of the model."""

    def _flexibilities(self, depths: Array, count: int) -> tuple[Array, Array]:
        """Return B and dB/dz (T, count, count) over depths (T,): what the shapes miss of a point force, nothing by default."""
        return np.zeros((len(depths), count, count)), np.zeros((len(depths), count, count))


def points_of(scene: Scene) -> tuple[Guide | LateralLoad, ...]:
    """Return guides and lateral loads, the points in front of the tip."""
    return (*scene.support.guides, *scene.lateral_loads)


def _compliances(guides: tuple[Guide, ...]) -> Array:
    return np.array([0.0 if guide.stiffness == "rigid" else 1.0 / guide.stiffness for guide in guides])
