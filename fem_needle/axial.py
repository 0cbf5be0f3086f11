"""The axial side of an insertion: friction, cutting, puncture, and when a needle at rest begins to move."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign

from fem_needle.scene import Layer, Scene
from fem_needle.segments import tip_layer


def coulomb_force(scene: Scene, depth: float) -> float:
    """Return mu_s + mu_s' z [N]."""
    return scene.friction.coulomb + scene.friction.coulomb_per_length * depth


def viscous_coefficient(scene: Scene, depth: float) -> float:
    """Return mu_v + mu_v' z [N s/m]."""
    return scene.friction.viscous + scene.friction.viscous_per_length * depth


def friction_force(scene: Scene, depth: float, speed: float) -> float:
    """Return sign(v) (mu_s + mu_s' z) + (mu_v + mu_v' z) v [N]; 0 at rest, where friction takes what it must."""
    if speed == 0.0:
        return 0.0
    return copysign(coulomb_force(scene, depth), speed) + viscous_coefficient(scene, depth) * speed


def cutting_force(scene: Scene, depth: float, speed: float, deepest: float) -> float:
    """Return the cutting force [N] of the layer at the tip: only while the tip advances into uncut tissue."""
    if speed <= 0.0 or depth < deepest:
        return 0.0
    layer = tip_layer(scene.tissue.layers, depth)
    return 0.0 if layer is None else scene.tissue.layers[layer].cutting_force


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
