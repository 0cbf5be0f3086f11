"""Bending moment and shear force along the needle, from equilibrium: what acts beyond a section is summed from the free tip on.

    Q(s) = sum over s_j >= s of F_j + integral from s to l of q,      M(s) = sum of F_j (s_j - s) + integral of q (sigma - s)
    q = -m(t) k (w - r) - c dw/dt at fixed y - rho A D^2w/Dt^2

M = EI w'' and dM/ds = EI w''' = -Q. Differentiating the deflection itself would cost the shapes two or three orders and leave a
moment at a free tip (docs/theory.md, "Section forces").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.beam_needle import PolynomialNeedle, points_of
from fem_needle.dynamics.model import is_known
from fem_needle.gauss import gauss_rule
from fem_needle.path import CutPath
from fem_needle.plant import Plant
from fem_needle.row_blocks import row_blocks
from fem_needle.sample_arrays import Samples
from fem_needle.scene import Scene, as_function
from fem_needle.segments import tip_values
from fem_needle.shapes import values_at

Array = NDArray[np.float64]

GAUSS_POINTS = 4  # on a piece without a node, an interface or a point: exact for what quartic shapes weigh


@dataclass(frozen=True, eq=False)
class SectionForces:
    """Moment and shear force at stations.

    Attributes
    ----------
    bending_moment
        EI w'' [N m], shape (T, n).
    shear_force
        EI w''' [N], minus the force along y that the part towards the tip exerts on the part towards the hub, shape (T, n): a tip
        force F gives -F at the tip. Where a point force acts, the value on its hub side.
    """

    bending_moment: Array
    shear_force: Array


def section_forces(plant: Plant, samples: Samples, arc_length: Array) -> SectionForces:
    """Return the section forces of samples at stations from the hub, 0, to the tip, l [m].

    Exact at free ends, guides and loads up to the error of the deflection; of a plant whose shapes are unknown they are EI times
    the derivatives of its deflection.
    """
    if not is_known(plant):
        state = samples.coordinates, samples.point_forces, samples.depth
        return differentiated(plant.scene, lambda derivative: plant.deflection(*state, arc_length, derivative))
    shape = (len(samples), arc_length.size)
    found, loads = SectionForces(np.zeros(shape), np.zeros(shape)), _LineLoads(plant)
    for rows in row_blocks(shape[0], GAUSS_POINTS * (shape[1] + len(plant.shapes.breaks))):
        block = loads.sections(samples.rows(rows), arc_length)
        found.bending_moment[rows], found.shear_force[rows] = block.bending_moment, block.shear_force
    return found


def differentiated(scene: Scene, deflection: Callable[[int], Array]) -> SectionForces:
    """Return EI times the second and third derivatives of a deflection, where nothing better is known."""
    return SectionForces(*(scene.needle.bending_stiffness * deflection(derivative) for derivative in (2, 3)))


class _LineLoads:
    """What acts along a needle."""

    def __init__(self, plant: PolynomialNeedle) -> None:
        scene = plant.scene
        self.plant, self.scene, self.length = plant, scene, scene.needle.length
        self.positions = np.array([point.position for point in points_of(scene)])
        ends = {end for layer in scene.tissue.layers for end in (layer.start, layer.far_side) if np.isfinite(end)}
        self.breaks = np.array(sorted({0.0, *ends, *self.positions.tolist()}))
        self.is_material = scene.model.kinematics == "material"
        self.is_viscous = any(layer.damping for layer in scene.tissue.layers)

    def sections(self, samples: Samples, arc_length: Array) -> SectionForces:
        """Return the section forces of some samples."""
        path = samples.path_at(-1)  # of earlier samples: the same, as far as they have come
        knots, order = self._knots(samples.depth[:, None], arc_length, path.edges[:1])
        widths = np.diff(knots, axis=1)
        points, weights = gauss_rule(GAUSS_POINTS)
        places = knots[:, :-1, None] + widths[..., None] * points
        load = self._line_load(samples, places) * weights * widths[..., None]
        from_tip = self.length - knots
        rest = self._rest_load(samples, path, knots)
        force = _beyond(np.sum(load, axis=2) + rest[0])
        moment = _beyond(np.sum(load * (self.length - places), axis=2) + rest[1])
        moment = from_tip * force - moment
        for place, acting in self._point_forces(samples):
            ahead = np.maximum(place, 0.0)[:, None]  # distance from the tip
            force += np.where(from_tip >= ahead, acting[:, None], 0.0)
            moment += acting[:, None] * np.maximum(from_tip - ahead, 0.0)
        ranks = np.argsort(order, axis=1)[:, : arc_length.size]
        bends = arc_length > self._start(samples.depth[:, None])
        return SectionForces(*(np.where(bends, np.take_along_axis(each, ranks, axis=1), 0.0) for each in (moment, -force)))

    def _start(self, depth: Array) -> Array:
        """Return the arc length [m] from which on the needle bends, under ``entry`` the surface."""
        if self.scene.support.kind == "hub":
            return np.full(depth.shape, -np.inf)
        return np.where(depth > self.plant.smallest_depth, self.length - depth, np.inf)

    def _knots(self, depth: Array, arc_length: Array, jump: Array) -> tuple[Array, NDArray[np.int64]]:
        """Return rising arc lengths between which everything is smooth (T, m), and the order in which they were found.

        ``jump``: y [m] where the path begins, to which the tip has bent already.
        """
        breaks = np.concatenate([self.breaks, jump[np.isfinite(jump)]])
        nodes = np.stack([self.plant.frame.axis_positions(self.plant.shapes.breaks, float(one)) for one in depth[:, 0]])
        moving = np.concatenate([nodes, np.broadcast_to(breaks, (len(depth), breaks.size))], axis=1)
        found = np.concatenate([np.broadcast_to(arc_length, (len(depth), arc_length.size)), moving + self.length - depth], axis=1)
        found = np.clip(found, np.clip(self._start(depth), 0.0, self.length), self.length)
        order = np.argsort(found, axis=1, kind="stable")
        return np.take_along_axis(found, order, axis=1), order

    def _line_load(self, samples: Samples, arc_length: Array) -> Array:
        """Return q [N/m] of tissue that rests on a straight line at arc lengths (T, pieces, points)."""
        depth, speed = (values[:, None, None] for values in (samples.depth, samples.speed))
        field = _Field(self.plant, arc_length, np.broadcast_to(depth, arc_length.shape))
        y, drift = arc_length - (self.length - depth), speed * field.drift
        modulus, damping = self._layers(samples, 0.5 * (y[..., 0] + y[..., -1]))
        load = -modulus[..., None] * field.of(samples.coordinates)
        if self.is_viscous:
            rate = field.of(samples.velocities) + drift * field.of(samples.coordinates, 1)
            load -= damping[..., None] * rate
        if np.any(samples.accelerations):
            load -= self.scene.needle.mass_per_length * self._acceleration(samples, field, speed)
        return load

    def _rest_load(self, samples: Samples, path: CutPath, knots: Array) -> tuple[Array, Array]:
        """Return what the path adds to the force between knots [N], and to its moment about the tip [N m] (T, pieces)."""
        if not len(path.coefficients):
            return np.zeros((len(samples), 1)), np.zeros((len(samples), 1))
        depth = samples.depth[:, None]
        y = knots - (self.length - depth)
        once, moment = (np.diff(values, axis=1) for values in path.integrals(y))
        modulus = self._layers(samples, 0.5 * (y[:, 1:] + y[:, :-1]))[0]
        return modulus * once, modulus * (depth * once - moment)

    def _layers(self, samples: Samples, y: Array) -> tuple[Array, Array]:
        """Return m(t) k and c at positions (T, ...)."""
        factor = as_function(self.scene.tissue.stiffness_factor).value(samples.time)
        modulus = tip_values(self.scene.tissue.layers, y, lambda layer: layer.foundation_modulus)
        return modulus * factor[:, None], tip_values(self.scene.tissue.layers, y, lambda layer: layer.damping)

    def _acceleration(self, samples: Samples, field: _Field, speed: Array) -> Array:
        """Return D^2w/Dt^2 [m/s^2]; of a fixed-frame needle the second derivative at a fixed y."""
        drift = field.drift + self.is_material  # how fast places pass on the shapes, over the speed
        gained = self._insertion_acceleration(samples)[:, None, None]
        second = drift * (gained - 2.0 * speed**2 * field.stretch_rate / field.stretch)
        found = field.of(samples.accelerations)
        if np.any(drift):
            found = found + 2.0 * speed * drift * field.of(samples.velocities, 1) + second * field.of(samples.coordinates, 1)
            found = found + (speed * drift) ** 2 * field.of(samples.coordinates, 2)
        return found

    def _insertion_acceleration(self, samples: Samples) -> Array:
        needle = self.scene.needle
        unbalanced = samples.push_force - samples.friction_force - samples.cutting_force + samples.axial_force
        return unbalanced / (needle.mass_per_length * needle.length)

    def _point_forces(self, samples: Samples) -> list[tuple[Array, Array]]:
        """Return distance from the tip [m] and force [N] (T,) of guides, lateral loads and the tip."""
        lateral = samples.lateral_forces(self.positions.size - samples.guide_force.shape[1])
        forces = [*samples.guide_force.T, *lateral.T]
        places = [samples.depth - position for position in self.positions]
        at_tip, scene = samples.tip_force.copy(), self.scene
        tip = _Field(self.plant, np.full((len(samples), 1, 1), self.length), samples.depth[:, None, None])
        if scene.tissue.tip_stiffness:
            factor = as_function(scene.tissue.stiffness_factor).value(samples.time)
            at_tip -= factor * scene.tissue.tip_stiffness * tip.of(samples.coordinates)[:, 0, 0]
        if not self.is_material and np.any(samples.accelerations):  # of the domain's moving end: docs/theory.md, "fixed-frame"
            rate = tip.of(samples.velocities) + samples.speed[:, None, None] * tip.drift * tip.of(samples.coordinates, 1)
            at_tip -= scene.needle.mass_per_length * samples.speed * rate[:, 0, 0]
        return [*zip(places, forces, strict=True), (np.zeros(len(samples)), at_tip)]


class _Field:
    """Deflections of samples, each at arc lengths of its own (T, ...), and how its places move."""

    def __init__(self, plant: PolynomialNeedle, arc_length: Array, depth: Array) -> None:
        self._shapes, shape = plant.shapes, arc_length.shape
        depth = np.maximum(depth, plant.smallest_depth)
        places, stretch = plant.frame.places(arc_length, plant.scene.needle.length, depth)
        self._rows = np.broadcast_to(np.arange(shape[0])[:, None, None], shape)
        self._places, self.stretch, self.stretch_rate = places, stretch, plant.frame.stretch_rate
        power = plant.frame.power
        # How fast places pass on the shapes at a fixed y, in metres, over the speed.
        self.drift: Array | float = 0.0 if power is None else -(places**power)

    def of(self, coordinates: Array, derivative: int = 0) -> Array:
        """Return w of coordinates (T, n), or a derivative by arc length."""
        values = values_at(self._shapes, coordinates, self._rows.ravel(), self._places.ravel(), derivative)
        return values.reshape(self._places.shape) / self.stretch**derivative


def _beyond(pieces: Array) -> Array:
    """Return the sums over pieces (T, m) from each of their ends (T, m + 1) to the last."""
    sums = np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1]
    return np.concatenate([sums, np.zeros((len(pieces), 1))], axis=1)
