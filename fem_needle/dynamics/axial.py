"""The axial side: friction, cutting, and a push whose speed follows from the forces along the needle.

Pi = rho A l v + dT/dv,   Pi' = push - friction - cutting + (A without - d(dT/dv)/dt)    at the nodes of the lateral method
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.compilation import inner


@inner
def coulomb_force(numbers, depth):
    """Return mu_s + mu_s' z."""
    return numbers[ix.COULOMB] + numbers[ix.COULOMB_PER_LENGTH] * depth


@inner
def viscous_coefficient(numbers, depth):
    """Return mu_v + mu_v' z."""
    return numbers[ix.VISCOUS_FRICTION] + numbers[ix.VISCOUS_FRICTION_PER_LENGTH] * depth


@inner
def friction_force(numbers, depth, speed):
    """Return the shaft's friction, 0 at rest, where it takes what it must."""
    if speed == 0.0:
        return 0.0
    return np.sign(speed) * coulomb_force(numbers, depth) + viscous_coefficient(numbers, depth) * speed


@inner
def cutting_force(layers, depth, speed, deepest):
    """Return the cutting force of the layer at the tip: only while the tip advances into uncut tissue."""
    if speed > 0.0 and depth >= deepest:
        for number in range(layers.shape[0]):
            if depth >= layers[number, ix.LAYER_START] and depth < layers[number, ix.LAYER_END]:
                return layers[number, ix.CUTTING]
    return 0.0


@inner
def cutting_work(layers, start, end):
    """Return the work that cutting takes from one deepest point to the next."""
    total = 0.0
    for number in range(layers.shape[0]):
        if layers[number, ix.CUTTING] != 0.0:
            first, last = max(layers[number, ix.LAYER_START], start), max(layers[number, ix.LAYER_END], start)
            total += layers[number, ix.CUTTING] * (min(max(end, first), last) - first)
    return total


@inner
def node_speeds(h, inverse, numbers, direction, cutting, begin, depths, pushes, configuration, momenta, speeds):
    """Set the speeds at both nodes that the axial equations give on the lateral solution of a trial motion.

    begin: Pi at the start; configuration: A without - d(dT/dv)/dt; momenta: dT/dv at the nodes.
    """
    mass = numbers[ix.MASS_PER_LENGTH] * numbers[ix.LENGTH]
    det = inverse[0, 0] * inverse[1, 1] - inverse[0, 1] * inverse[1, 0]
    a00, a01 = h * inverse[1, 1] / det, -h * inverse[0, 1] / det
    a10, a11 = -h * inverse[1, 0] / det, h * inverse[0, 0] / det
    viscous0, viscous1 = viscous_coefficient(numbers, depths[0]), viscous_coefficient(numbers, depths[1])
    f0 = pushes[0] - direction * coulomb_force(numbers, depths[0]) - cutting + configuration[0]
    f1 = pushes[1] - direction * coulomb_force(numbers, depths[1]) - cutting + configuration[1]
    r0, r1 = begin - momenta[0] + a00 * f0 + a01 * f1, begin - momenta[1] + a10 * f0 + a11 * f1
    m00, m01, m10, m11 = mass + a00 * viscous0, a01 * viscous1, a10 * viscous0, mass + a11 * viscous1
    det = m00 * m11 - m01 * m10
    speeds[0], speeds[1] = (m11 * r0 - m01 * r1) / det, (m00 * r1 - m10 * r0) / det
