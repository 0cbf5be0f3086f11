"""A needle as the kernel takes it: arrays of its shapes, layers and points, and room to work in.

Enters: a plant on shapes that are polynomials on pieces. Leaves: `Model`, whose arrays never change, and `Work`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from math import comb
from typing import Any, TypeGuard
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fem_needle.beam_needle import PolynomialNeedle, points_of
from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import bevel_of
from fem_needle.frames import MaterialFrame, StretchedFrame
from fem_needle.gauss import gauss_rule
from fem_needle.piecewise import PiecewisePolynomials
from fem_needle.plant import SMALLEST_COMPLIANCE, Plant
from fem_needle.scene import Scene, TipLoad
from fem_needle.shapes import Shapes

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_DERIVATIVES = {at.UNIT_MASS: (0, 0), at.UNIT_DRAG: (0, 1), at.UNIT_SLIP: (1, 1), at.UNIT_BENDING: (2, 2)}
_KINDS = {at.UNIT_MASS: "mass", at.UNIT_DRAG: "drag", at.UNIT_SLIP: "slip", at.UNIT_BENDING: "bending"}


@dataclass(frozen=True, eq=False)
class Model:
    """The constant arrays of a needle (`fem_needle.dynamics.names`).

    Attributes
    ----------
    size, points
        Numbers of coordinates and of points.
    arrays
        By name.
    """

    size: int
    points: int
    arrays: dict[int, NDArray[Any]]

    @property
    def switches(self) -> Integers:
        """Whole numbers of the needle."""
        return self.arrays[at.SWITCH]

    @property
    def record_ends(self) -> tuple[int, ...]:
        """Where the parts of a record end: numbers, coordinates, point forces, guides, velocities, accelerations."""
        sizes = (at.RECORD, self.size, self.points, int(self.switches[at.GUIDES]), self.size, self.size)
        return tuple(accumulate(sizes))


# Made once for each needle; gone with it.
_CONSTANTS: WeakKeyDictionary[PolynomialNeedle, dict[int, NDArray[Any]]] = WeakKeyDictionary()


def is_known(plant: Plant) -> TypeGuard[PolynomialNeedle]:
    """Return whether a plant's shapes are polynomials that say all of it: else the kernel asks it for its matrices."""
    return isinstance(plant, PolynomialNeedle) and plant.is_polynomial


def model_of(plant: PolynomialNeedle, *, inertia: bool, viscous: bool = True) -> Model:
    """Return the arrays of a needle; without viscosity, or without inertia, where these are left out."""
    if plant not in _CONSTANTS:
        _CONSTANTS[plant] = _constant_arrays(plant)
    arrays = _CONSTANTS[plant]
    switches = arrays[at.SWITCH].copy()
    switches[at.INERTIA], switches[at.VISCOUS] = inertia, viscous and plant.foundation.is_damped
    return Model(plant.size, int(switches[at.POINTS]), arrays | {at.SWITCH: switches})


def _constant_arrays(plant: PolynomialNeedle) -> dict[int, NDArray[Any]]:
    """Return the arrays of a needle that nothing writes to: all its engines may share them."""
    scene, polynomials = plant.scene, plant.shapes.polynomials()
    frame = _frame_of(plant)
    units = _unit_integrals(plant.shapes, polynomials, 1 if frame == at.STRETCHED else 0)
    constants = _beam_matrices(plant, polynomials, units, frame)
    switches = _switches(plant, polynomials, frame)
    sums = np.zeros((1, 4, 1, 1))
    if polynomials.stride == 0:
        sums = np.concatenate([np.zeros((1, *units.shape[1:])), np.cumsum(units, axis=0)])
    points, weights = gauss_rule(polynomials.coefficients.shape[2])
    orders = polynomials.coefficients.shape[2]
    compliance = [0.0 if guide.stiffness == "rigid" else 1.0 / guide.stiffness for guide in scene.support.guides]
    arrays = {
        at.SWITCH: switches,
        at.NUMBER: numbers_of(plant),
        at.LAYER: layer_rows(scene),
        at.POSITION: np.array([point.position for point in points_of(scene)]),
        at.COMPLIANCE: np.array(compliance),
        at.BEVEL: bevel_of(scene),
        at.ONE: np.asarray(plant.deflection_at_one, dtype=float),
        at.MASS_FACTOR: mass_factor(constants[0], polynomials.stride, plant.size, plant.prescribed),
        at.PASCAL: np.array([[float(comb(k, n)) for n in range(orders)] for k in range(orders)]),
        at.PIECE_NODES: polynomials.nodes,
        at.COEFFICIENTS: polynomials.coefficients,
        at.RULE: np.array([points, weights]),
        at.UNIT: units,
        at.UNIT_SUMS: sums,
        at.BEAM: constants,
    }
    return {name: np.ascontiguousarray(array) for name, array in arrays.items()}


def _frame_of(plant: PolynomialNeedle) -> int:
    if isinstance(plant.frame, MaterialFrame):
        return at.MATERIAL
    return at.STRETCHED if isinstance(plant.frame, StretchedFrame) else at.FIXED


def _switches(plant: PolynomialNeedle, polynomials: PiecewisePolynomials, frame: int) -> Integers:
    scene, found = plant.scene, np.zeros(at.SWITCHES, dtype=np.int64)
    found[at.FRAME], found[at.PRESCRIBED] = frame, plant.prescribed
    found[at.GUIDES] = len(scene.support.guides)
    found[at.POINTS] = len(points_of(scene)) + plant.turns + 1
    found[at.TIPS] = sum(isinstance(load, TipLoad) for load in scene.loads)
    found[at.STRIDE] = polynomials.stride
    found[at.DEGREE] = polynomials.coefficients.shape[2] - 1
    found[at.CONVECTED] = frame == at.STRETCHED or (frame == at.FIXED and scene.model.kinematics == "material")
    found[at.CUTS] = scene.tissue.rest_line == "cut-path"
    found[at.TURNS], found[at.AXIAL_ACTS] = plant.turns, plant.axial_force_acts
    found[at.RESOLVES] = plant.nearly_dependent
    return found


def numbers_of(plant: Plant) -> Array:
    """Return what one number each says of a needle (NUMBERS,); `names` has their places."""
    scene, found = plant.scene, np.zeros(at.NUMBERS)
    needle, friction = scene.needle, scene.friction
    found[at.LENGTH], found[at.MASS_PER_LENGTH] = needle.length, needle.mass_per_length
    found[at.BENDING_STIFFNESS], found[at.SMALLEST_DEPTH] = needle.bending_stiffness, plant.smallest_depth
    found[at.TIP_STIFFNESS] = scene.tissue.tip_stiffness or 0.0
    found[at.COULOMB], found[at.COULOMB_PER_LENGTH] = friction.coulomb, friction.coulomb_per_length
    found[at.VISCOUS_FRICTION], found[at.VISCOUS_FRICTION_PER_LENGTH] = friction.viscous, friction.viscous_per_length
    found[at.SOFTEST] = SMALLEST_COMPLIANCE * needle.length**3 / (48 * needle.bending_stiffness)
    return found


def layer_rows(scene: Scene) -> Array:
    """Return start, end, foundation modulus, damping and cutting force of every layer (layers, 5)."""
    rows = [
        (layer.start, layer.far_side, layer.foundation_modulus, layer.damping, layer.cutting_force)
        for layer in scene.tissue.layers
    ]
    return np.array(rows, dtype=float).reshape(-1, 5)


def _unit_integrals(shapes: Shapes, polynomials: PiecewisePolynomials, power: int, offset: float = 0.0) -> Array:
    """Return psi_i psi_j, (x - offset)^p psi_i psi_j', (x - offset)^2p psi_i' psi_j', psi_i'' psi_j'' of pieces (P, 4, m, m)."""
    if polynomials.stride:  # assembled with scikit-fem on the unit element
        moved = shapes if offset == 0.0 else type(shapes)(shapes.breaks - offset, shapes.degree)  # type: ignore[call-arg, attr-defined]
        parts = [
            moved.interval_integrals(_KINDS[kind], power).local  # type: ignore[arg-type, attr-defined]
            for kind in range(4)
        ]
        return np.ascontiguousarray(np.stack(parts, axis=1))
    nodes, coefficients = polynomials.nodes, polynomials.coefficients
    points, weights = gauss_rule(coefficients.shape[2] + power)
    sizes = np.diff(nodes)
    values = []
    for derivative in range(3):
        powers = np.polynomial.polynomial.polyder(coefficients, derivative, axis=2) if derivative else coefficients
        vander = np.polynomial.polynomial.polyvander(points, powers.shape[2] - 1)
        values.append(np.einsum("pmk,gk->pmg", powers, vander) / sizes[:, None, None] ** derivative)
    places = (nodes[:-1, None] + sizes[:, None] * points - offset) ** power
    result = np.zeros((len(sizes), 4, coefficients.shape[1], coefficients.shape[1]))
    for kind, (left, right) in _DERIVATIVES.items():
        moved_by = {at.UNIT_DRAG: places, at.UNIT_SLIP: places**2}.get(kind, np.ones_like(places))
        share = sizes[:, None] * weights * moved_by
        result[:, kind] = np.einsum("pg,pig,pjg->pij", share, values[left], values[right])
    return result


def _beam_matrices(plant: PolynomialNeedle, polynomials: PiecewisePolynomials, units: Array, frame: int) -> Array:
    """Return M, K, S, R of every block, for a stretch of 1; of a beam that grows, room for those of each instant."""
    scene, needle = plant.scene, plant.scene.needle
    m = polynomials.coefficients.shape[1]
    if frame == at.FIXED:
        return np.zeros((at.INSTANTS, 1, 4, m, m))
    moved = units
    if frame == at.STRETCHED:
        offset = 0.0 if scene.model.kinematics == "fixed-frame" else 1.0
        moved = _unit_integrals(plant.shapes, polynomials, 1, offset)
    parts = np.stack(
        [
            needle.mass_per_length * units[:, at.UNIT_MASS],
            needle.bending_stiffness * units[:, at.UNIT_BENDING],
            -needle.mass_per_length * moved[:, at.UNIT_DRAG],
            needle.mass_per_length * moved[:, at.UNIT_SLIP],
        ],
        axis=1,
    )
    blocks = parts if polynomials.stride else parts.sum(axis=0)[None]
    if plant.turns:
        blocks[0, at.MASS, 1, 1] += scene.support.hub_rotational_inertia or 0.0
    return np.ascontiguousarray(blocks[None])


def mass_factor(blocks: Array, stride: int, size: int, clamped: int) -> Array:
    """Return rows of the lower Cholesky factor of M (n, w + 1), its inverse diagonal last; room for one where M changes."""
    m = blocks.shape[2]
    width = m - 1
    rows = np.zeros((size, width + 1))
    if not np.any(blocks[:, at.MASS]):
        return rows
    band = np.zeros((width + 1, size))  # lower band storage
    for block in range(len(blocks)):
        for offset in range(m):
            band[offset, stride * block : stride * block + m - offset] += np.diagonal(blocks[block, at.MASS], -offset)
    for i in range(clamped, size):
        for j in range(max(clamped, i - width), i + 1):
            total = band[i - j, j]
            first = max(clamped, i - width)
            left, right = rows[i, width - i + first : width - i + j], rows[j, width - j + first : width]
            total -= float(left @ right[: len(left)]) if len(left) else 0.0
            if i == j:
                rows[i, width] = 1.0 / np.sqrt(total)
            else:
                rows[i, width - i + j] = total * rows[j, width]
    return rows
