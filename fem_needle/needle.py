"""The finite-element needle: a beam on a foundation, a plant.

    T = 1/2 rho A integral (Dw/Dt)^2,   U = 1/2 EI integral w''^2 + 1/2 m(t) sum_i k_i integral_layer_i w^2 - work of the points

on quartic (or cubic) elements with continuous slope. Derivation: docs/theory.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle import banded
from fem_needle.elements.integrals import interval_integrals
from fem_needle.elements.kink import kink, kink_compliance, kink_shift_rate
from fem_needle.elements.mesh import LineMesh, uniform_mesh
from fem_needle.errors import SceneError
from fem_needle.foundation import Foundation
from fem_needle.frames import Frame, MaterialFrame, StretchedFrame
from fem_needle.loads import turns_with_needle
from fem_needle.mesh_file import MAXIMUM_ELEMENTS, mesh_positions, needle_nodes
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Points, RestTerms
from fem_needle.scene import Guide, LateralLoad, Scene, as_function

Array = NDArray[np.float64]

DEFAULT_ELEMENTS = 40
SMALLEST_DEPTH_FRACTION = 1e-6  # of the length: below it the inserted part of an `entry` needle is dropped


class FiniteElementNeedle:
    """A scene's needle on finite elements.

    Parameters
    ----------
    scene
        What is modelled.
    elements
        Equal elements over the part that bends: hub to tip under ``hub``, surface to tip under ``entry``; default: the scene's
        ``numerics.mesh``, else 40.
    degree
        Polynomial degree 3 (Hermite) or 4 (Hermite and a bubble); default: the scene's ``numerics.degree``.
    mesh
        In place of elements: a mesh file, or the positions of the nodes from the hub, 0, to the tip, l [m]. Under ``entry`` they
        are scaled to the inserted part.

    Raises
    ------
    SceneError
        If ``elements`` or ``degree`` is out of range, or ``mesh`` is no mesh of this needle.

    Notes
    -----
    Coordinates are deflection [m] and slope at each node and the bubble's amplitude [m] in each element; under ``entry`` slopes
    are by depth fraction. The first two are the clamped end's and are prescribed.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        elements: int | None = None,
        degree: int | None = None,
        mesh: str | Path | ArrayLike | None = None,
    ) -> None:
        degree = scene.numerics.degree if degree is None else degree
        if degree not in {3, 4}:
            raise SceneError(f"degree: got {degree}; allowed 3 or 4")
        self.scene = scene
        self.is_entry = scene.support.kind == "entry"
        length = scene.needle.length
        self.mesh = _line_mesh(scene, elements, degree, mesh)
        self.frame: Frame = StretchedFrame() if self.is_entry else MaterialFrame(length)
        self.foundation = Foundation(scene.tissue.layers, self.mesh, self.frame, scene.tissue.tip_stiffness or 0.0)
        self.size = self.mesh.size
        self.turns = turns_with_needle(scene)
        self.prescribed = 1 if self.turns else 2
        self.smallest_depth = SMALLEST_DEPTH_FRACTION * length if self.is_entry else 0.0
        self.deflection_at_one = np.zeros(self.size)
        self.deflection_at_one[:: self.mesh.reference.stride] = 1.0
        self._stiffness_factor = as_function(scene.tissue.stiffness_factor)
        self._beam = _beam_operators(self.mesh, scene)
        self._point_list = _points_of(scene)

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices at a depth [m] and time [s]."""
        beam = self._beam
        stretch = self.frame.stretch(depth)
        damping, drag, slip = self.foundation.damping(depth)
        tissue, factor_rate = self.foundation.stiffness(depth), self._stiffness_factor.derivative(time)
        return Operators(
            mass=beam.mass * stretch,
            bending=beam.bending / stretch**3,
            tissue=tissue * self._stiffness_factor.value(time),
            convection=beam.convection,
            centrifugal=None if beam.centrifugal is None else beam.centrifugal / stretch,
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
        coordinates = deflection * self.deflection_at_one
        stride = self.mesh.reference.stride
        coordinates[::stride] += angle * self.mesh.nodes
        coordinates[1::stride][: self.mesh.elements + 1] = angle
        return coordinates

    def stiffness_rate_product(self, coordinates: Array, depth: float, time: float) -> Array:
        """Return d(K + m G)/dz q."""
        factor = self._stiffness_factor.value(time)
        result = factor * self.foundation.stiffness_rate_product(coordinates, depth)
        if self.frame.stretch_rate:
            result += banded.multiply(self._beam.bending, coordinates) * (-3 / depth**4)
        return result

    def rest_terms(self, path: CutPath, depth: float, lower: float, upper: float) -> RestTerms:
        """Return what the cut path at lower <= y < upper adds to the tissue's energy, for a stiffness factor of 1."""
        return self.foundation.rest_terms(path, depth, lower, upper)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return dT/dz [N]: M grows with the depth and R falls with it under ``entry``; 0 under ``hub``."""
        beam = self._beam
        if beam.centrifugal is None:
            return 0.0
        growing = 0.5 * velocities @ banded.multiply(beam.mass, velocities)
        falling = 0.5 * (speed / depth) ** 2 * (coordinates @ banded.multiply(beam.centrifugal, coordinates))
        return float(growing - falling)

    def points(self, depth: float) -> Points:
        """Return rows and flexibilities of guides, lateral loads and tip."""
        positions = [point.position for point in self._point_list]
        count = len(positions) + self.turns + 1
        rows, rates = np.zeros((count, self.size)), np.zeros((count, self.size))
        flexibility, flexibility_rate = np.zeros((count, count)), np.zeros((count, count))
        places = [self.mesh.locate(self.frame.position(y, depth)) for y in positions]
        for index, y in enumerate(positions):
            s = self.frame.position(y, depth)
            rows[index] = self.mesh.row(s)
            rates[index] = self.frame.position_rate(y, depth) * self.mesh.row(s, 1)
        rows[-1, -2] = 1.0
        if self.turns:
            rows[-2, 1] = 1.0
        for first, (element, place) in enumerate(places):
            for second, (other, other_place) in enumerate(places):
                if element == other:
                    scale, degree = self._kink_scale(element), self.mesh.degree
                    flexibility[first, second] = scale * kink_compliance(place, other_place, degree)
                    moved = -kink_shift_rate(place, other_place, degree) / self.mesh.lengths[element]
                    flexibility_rate[first, second] = scale * moved
        guides = self.scene.support.guides
        return Points(rows, rates, flexibility, flexibility_rate, len(guides), _compliances(guides))

    def deflection(
        self, coordinates: Array, forces: Array, depth: float, arc_length: Array, derivative: int = 0
    ) -> Array:
        """Return w [m] or a derivative of it by arc length at stations from the hub (0) to the tip (l)."""
        stations = np.asarray(arc_length, dtype=float)
        if not self.is_entry:
            return self.mesh.evaluate(coordinates, stations, derivative) + self._kinks(
                forces, depth, stations, derivative
            )
        result = np.zeros(stations.shape)
        inside = stations > self.scene.needle.length - depth
        if depth > 0:
            fraction = 1 + (stations[inside] - self.scene.needle.length) / depth
            result[inside] = self.mesh.evaluate(coordinates, fraction, derivative) / depth**derivative
        return result

    def describe(self) -> dict[str, int | float | str]:
        """Return kind, number of elements and degree."""
        return {"model": "fem", "elements": self.mesh.elements, "degree": self.mesh.degree}

    def _kink_scale(self, element: int) -> float:
        return float(self.mesh.lengths[element]) ** 3 / self.scene.needle.bending_stiffness

    def _kinks(self, forces: Array, depth: float, stations: Array, derivative: int) -> Array:
        result = np.zeros(stations.shape)
        for point, force in zip(self._point_list, forces, strict=False):
            element, place = self.mesh.locate(self.frame.position(point.position, depth))
            start, length = self.mesh.nodes[element], self.mesh.lengths[element]
            near = (stations >= start) & (stations <= start + length)
            shape = kink((stations[near] - start) / length, place, self.mesh.degree, derivative)
            result[near] += force * self._kink_scale(element) / length**derivative * shape
        return result


@dataclass(frozen=True, eq=False)
class _Beam:
    """The constant parts of the beam's matrices."""

    mass: Array
    bending: Array
    convection: Array | None
    centrifugal: Array | None


def _line_mesh(scene: Scene, elements: int | None, degree: int, mesh: str | Path | ArrayLike | None) -> LineMesh:
    """Return the mesh: over the arc length [m] under ``hub``, over the depth fraction under ``entry``."""
    length = scene.needle.length
    span = 1.0 if scene.support.kind == "entry" else length
    if elements is not None and mesh is not None:
        raise SceneError(f"mesh: has its own elements (got elements = {elements}; allowed one of the two)")
    if mesh is not None:
        positions = mesh_positions(mesh)
    elif elements is None and scene.numerics.mesh is not None:
        positions = np.array(scene.numerics.mesh)
    else:
        count = DEFAULT_ELEMENTS if elements is None else elements
        if not 1 <= count <= MAXIMUM_ELEMENTS:
            raise SceneError(f"elements: got {count}; allowed 1 to {MAXIMUM_ELEMENTS}")
        return uniform_mesh(span, count, degree)
    return LineMesh(needle_nodes(positions, length, span), degree)


def _beam_operators(mesh: LineMesh, scene: Scene) -> _Beam:
    """Assemble M, K and, under ``entry``, S = integral psi chi and R = integral chi chi for the scene's kinematics."""
    needle = scene.needle
    mass = interval_integrals(mesh, "mass").band * needle.mass_per_length
    bending = interval_integrals(mesh, "bending").band * needle.bending_stiffness
    if scene.support.kind == "hub":
        if turns_with_needle(scene):
            mass[banded.half_bandwidth(mass), 1] += scene.support.hub_rotational_inertia or 0.0
        return _Beam(mass, bending, None, None)
    # chi = -xi psi' (fixed-frame) or (1 - xi) psi' (material): -x psi' with x counted from the surface or from the tip
    origin = 0.0 if scene.model.kinematics == "fixed-frame" else 1.0
    shifted = LineMesh(mesh.nodes - origin, mesh.degree)
    convection = interval_integrals(shifted, "drag", 1).band * -needle.mass_per_length
    centrifugal = interval_integrals(shifted, "slip", 1).band * needle.mass_per_length
    return _Beam(mass, bending, convection, centrifugal)


def _points_of(scene: Scene) -> tuple[Guide | LateralLoad, ...]:
    lateral = tuple(load for load in scene.loads if isinstance(load, LateralLoad))
    return (*scene.support.guides, *lateral)


def _compliances(guides: tuple[Guide, ...]) -> Array:
    return np.array([0.0 if guide.stiffness == "rigid" else 1.0 / guide.stiffness for guide in guides])
