"""The axial side of an insertion: friction, cutting, and the push that a prescribed motion needs."""

from __future__ import annotations

from math import copysign

from fem_needle.scene import Scene
from fem_needle.segments import tip_layer


def friction_force(scene: Scene, depth: float, speed: float) -> float:
    """Return sign(v) (mu_s + mu_s' z) + (mu_v + mu_v' z) v [N]; 0 at rest, where friction takes what it must."""
    if speed == 0.0:
        return 0.0
    friction = scene.friction
    coulomb = friction.coulomb + friction.coulomb_per_length * depth
    viscous = friction.viscous + friction.viscous_per_length * depth
    return copysign(coulomb, speed) + viscous * speed


def cutting_force(scene: Scene, depth: float, speed: float, deepest: float) -> float:
    """Return the cutting force [N] of the layer at the tip: only while the tip advances into uncut tissue."""
    layer = tip_layer(scene.tissue.layers, depth)
    if speed <= 0.0 or depth < deepest or layer is None:
        return 0.0
    return scene.tissue.layers[layer].cutting_force
