"""The finite-element needle: a beam on a foundation, on quartic (or cubic) elements with continuous slope."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.beam_matrices import ScaledBeam, stretched_part, whole_needle
from fem_needle.beam_needle import BeamNeedle
from fem_needle.elements.flexibility import FlexibleMesh
from fem_needle.elements.kink import kink, kink_compliance, kink_shift_rate
from fem_needle.elements.shapes import ElementShapes
from fem_needle.errors import SceneError
from fem_needle.frames import Frame, MaterialFrame, StretchedFrame
from fem_needle.mesh_file import MAXIMUM_ELEMENTS, mesh_positions, needle_nodes
from fem_needle.plant import Operators
from fem_needle.row_blocks import row_blocks
from fem_needle.scene import Scene

Array = NDArray[np.float64]

DEFAULT_ELEMENTS = 40


class FiniteElementNeedle(BeamNeedle):
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
        self.mesh = _line_mesh(scene, elements, degree, mesh)
        is_entry = scene.support.kind == "entry"
        frame: Frame = StretchedFrame() if is_entry else MaterialFrame(scene.needle.length)
        super().__init__(scene, self.mesh, frame, _beam(self.mesh, frame, scene))
        self._flexible = FlexibleMesh(self.mesh)

    def deflection(
        self, coordinates: Array, forces: Array, depth: float | Array, arc_length: Array, derivative: int = 0
    ) -> Array:
        """Return w [m] or a derivative of it by arc length at stations from the hub (0) to the tip (l), of one state or many."""
        smooth = super().deflection(coordinates, forces, depth, arc_length, derivative)
        if self.is_entry:
            return smooth
        stations = np.asarray(arc_length, dtype=float)
        if np.ndim(depth):
            return smooth + self._many_kinks(forces, np.asarray(depth, dtype=float), stations, derivative)
        return smooth + self._kinks(forces, float(depth), stations, derivative)

    def describe(self) -> dict[str, int | float | str]:
        """Return kind, number of elements and degree."""
        return {"model": "fem", "elements": self.mesh.elements, "degree": self.mesh.degree}

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices at a depth [m] and time [s]."""
        bending_stiffness = self.scene.needle.bending_stiffness / self.frame.stretch(depth) ** 3
        return replace(super().operators(depth, time), beam=self._flexible.stiffened(bending_stiffness))

    def _flexibilities(self, depths: Array, count: int) -> tuple[Array, Array]:
        """Return B and dB/dz over depths: points in one element bend it beyond its own shapes."""
        flexibility, rate = np.zeros((len(depths), count, count)), np.zeros((len(depths), count, count))
        places = [self.mesh.locate_all(self.frame.places_of(point.position, depths)[0]) for point in self._point_list]
        degree = self.mesh.degree
        for first, (element, place) in enumerate(places):
            scale = np.asarray(self.mesh.lengths[element] ** 3 / self.scene.needle.bending_stiffness)
            for second, (other, other_place) in enumerate(places):
                same = scale * (element == other)
                flexibility[:, first, second] = same * kink_compliance(place, other_place, degree)
                moved = -kink_shift_rate(place, other_place, degree) / self.mesh.lengths[element]
                rate[:, first, second] = same * moved
        return flexibility, rate

    def _kinks(self, forces: Array, depth: float, stations: Array, derivative: int) -> Array:
        result = np.zeros(stations.shape)
        for point, force in zip(self._point_list, forces, strict=False):
            element, place = self.mesh.locate(self.frame.position(point.position, depth))
            start, length = self.mesh.nodes[element], self.mesh.lengths[element]
            near = (stations >= start) & (stations <= start + length)
            shape = kink((stations[near] - start) / length, place, self.mesh.degree, derivative)
            result[near] += force * self._kink_scale(element) / length**derivative * shape
        return result

    def _many_kinks(self, forces: Array, depths: Array, stations: Array, derivative: int) -> Array:
        """Return the same of many states: (T, p) and (T,) to (T, stations)."""
        result = np.zeros((len(depths), stations.size))
        for index, point in enumerate(self._point_list):
            element, place = self.mesh.locate_all(self.frame.places_of(point.position, depths)[0])
            start, length = self.mesh.nodes[element], self.mesh.lengths[element]
            scale = forces[:, index] * length**3 / self.scene.needle.bending_stiffness / length**derivative
            for block in row_blocks(len(depths), stations.size):
                first, last = start[block, None], start[block, None] + length[block, None]
                row, near = np.nonzero((stations >= first) & (stations <= last))
                row += block.start
                shape = kink((stations[near] - start[row]) / length[row], place[row], self.mesh.degree, derivative)
                result[row, near] += scale[row] * shape
        return result

    def _kink_scale(self, element: int) -> float:
        return float(self.mesh.lengths[element]) ** 3 / self.scene.needle.bending_stiffness


def _line_mesh(scene: Scene, elements: int | None, degree: int, mesh: str | Path | ArrayLike | None) -> ElementShapes:
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
        return ElementShapes(np.linspace(0.0, span, count + 1), degree)
    return ElementShapes(needle_nodes(positions, length, span), degree)


def _beam(shapes: ElementShapes, frame: Frame, scene: Scene) -> ScaledBeam:
    if scene.support.kind == "hub":
        return whole_needle(shapes, frame, scene)
    return stretched_part(shapes, ElementShapes(shapes.nodes - 1.0, shapes.degree), frame, scene)
