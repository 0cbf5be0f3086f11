"""The axial side of an insertion: friction, cutting, puncture, and when a needle at rest begins to move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Layer, Scene
from fem_needle.segments import tip_values

Array = NDArray[np.float64]
FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])


def coulomb_force(scene: Scene, depth: FloatOrArray) -> FloatOrArray:
    """Return mu_s + mu_s' z [N]."""
    return scene.friction.coulomb + scene.friction.coulomb_per_length * depth


def viscous_coefficient(scene: Scene, depth: FloatOrArray) -> FloatOrArray:
    """Return mu_v + mu_v' z [N s/m]."""
    return scene.friction.viscous + scene.friction.viscous_per_length * depth


def friction_force(scene: Scene, depth: FloatOrArray, speed: FloatOrArray) -> FloatOrArray:
    """Return sign(v) (mu_s + mu_s' z) + (mu_v + mu_v' z) v [N]; 0 at rest, where friction takes what it must."""
    return np.sign(speed) * coulomb_force(scene, depth) + viscous_coefficient(scene, depth) * speed


def cutting_force(scene: Scene, depth: float, speed: float, deepest: float) -> float:
    """Return the cutting force [N] of the layer at the tip: only while the tip advances into uncut tissue."""
    return float(cutting_forces(scene, np.array([depth]), np.array([speed]), np.array([deepest]))[0])


def cutting_forces(scene: Scene, depths: Array, speeds: Array, deepest: Array) -> Array:
    """Return the same at many instants (T,)."""
    advances = (speeds > 0.0) & (depths >= deepest)
    return np.where(advances, tip_values(scene.tissue.layers, depths, lambda layer: layer.cutting_force), 0.0)


def cutting_work(scene: Scene, start: float, deepest: Array) -> Array:
    """Return the work [J] that cutting takes from a depth [m] to deeper ones (T,): each layer's force times the way in it."""
    ways = [(layer.cutting_force, np.clip([layer.start, layer.far_side], start, None)) for layer in scene.tissue.layers]
    taken = [force * (np.clip(deepest, first, last) - first) for force, (first, last) in ways if force]
    return np.asarray(np.sum(taken, axis=0) if taken else np.zeros_like(deepest), dtype=float)


@dataclass(frozen=True)
class Hold:
    """What holds a needle that rests.

    Attributes
    ----------
    inward, outward
        It moves in when push + A exceeds ``inward`` [N], out when push + A falls below -``outward`` [N].
    membrane
        Index of the layer whose puncture force is part of ``inward``; None elsewhere.
    """

    inward: float
    outward: float
    membrane: int | None


def hold_at(scene: Scene, depth: float, deepest: float, punctured: frozenset[int]) -> Hold:
    """Return the thresholds at a depth: friction, and in front of uncut tissue its cutting or puncture force."""
    coulomb = coulomb_force(scene, depth)
    membrane = membrane_at(scene, depth, punctured)
    if membrane is not None:
        return Hold(coulomb + scene.tissue.layers[membrane].puncture_force, coulomb, membrane)
    return Hold(coulomb + cutting_force(scene, depth, 1.0, deepest), coulomb, None)


def membrane_at(scene: Scene, depth: float, punctured: frozenset[int]) -> int | None:
    """Return the layer that starts exactly at a depth and has not been entered, if it has a puncture force."""
    for index, layer in enumerate(scene.tissue.layers):
        if layer.start == depth and has_membrane(layer) and index not in punctured:
            return index
    return None


def has_membrane(layer: Layer) -> bool:
    """Return whether entering a layer takes a puncture force."""
    return layer.puncture_force > 0.0


def entered_layers(scene: Scene, depth: float) -> frozenset[int]:
    """Return the layers that a tip at a depth has entered already."""
    return frozenset(index for index, layer in enumerate(scene.tissue.layers) if depth > layer.start)
