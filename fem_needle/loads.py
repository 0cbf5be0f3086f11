"""The forces and the hub's motion of a scene at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import LateralLoad, Scene, Sinusoid, TimeFunction, TipLoad, as_function
from fem_needle.segments import tip_layer

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadCase:
    """Known forces and clamp motion.

    Attributes
    ----------
    forces, force_rates
        Lateral loads in the scene's order, then the torque of a hub that turns with the needle [N m], the sum of all tip
        loads last [N], [N/s].
    clamp, clamp_rates, clamp_accelerations
        Deflection [m] and angle [rad] of the hub, and their first two rates; zero under ``entry``.
    """

    forces: Array
    force_rates: Array
    clamp: Array
    clamp_rates: Array
    clamp_accelerations: Array


def second_derivative(function: TimeFunction, time: float) -> float:
    """Return the second derivative of a time function from the right, without the jumps of its slope."""
    if not isinstance(function, Sinusoid):
        return 0.0
    return -((2 * pi * function.frequency) ** 2) * (function.value(time) - function.mean)


def turns_with_needle(scene: Scene) -> bool:
    """Return whether the hub's rotation is a coordinate of the needle."""
    return scene.support.kind == "hub" and scene.support.hub_rotation == "free"


def is_steady(scene: Scene) -> bool:
    """Return whether forces and hub stay the same at a fixed depth."""
    support = scene.support
    values = [support.hub_deflection, support.hub_angle, support.hub_torque, scene.tissue.stiffness_factor]
    values += [load.force for load in scene.loads if load.force is not None]
    return all(isinstance(value, float) for value in values)


def load_case(scene: Scene, depth: float, time: float) -> LoadCase:
    """Return the loads at a depth [m] (the bevel law asks for the layer at the tip) and time [s]."""
    known = [as_function(load.force) for load in scene.loads if isinstance(load, LateralLoad)]
    if turns_with_needle(scene):
        known.append(as_function(scene.support.hub_torque))
    forces = [function.value(time) for function in known]
    rates = [function.derivative(time) for function in known]
    tip, tip_rate = _tip_force(scene, depth, time)
    clamp = [as_function(scene.support.hub_deflection), as_function(scene.support.hub_angle)]
    return LoadCase(
        np.array([*forces, tip]),
        np.array([*rates, tip_rate]),
        np.array([function.value(time) for function in clamp]),
        np.array([function.derivative(time) for function in clamp]),
        np.array([second_derivative(function, time) for function in clamp]),
    )


def _tip_force(scene: Scene, depth: float, time: float) -> tuple[float, float]:
    """Sum the tip loads; the bevel law is F = a k(y) m(t) with the modulus at the tip."""
    total = rate = 0.0
    layer = tip_layer(scene.tissue.layers, depth)
    modulus = 0.0 if layer is None else scene.tissue.layers[layer].foundation_modulus
    factor = as_function(scene.tissue.stiffness_factor)
    for load in scene.loads:
        if not isinstance(load, TipLoad):
            continue
        if load.bevel_coefficient is None:
            force = as_function(0.0 if load.force is None else load.force)
            total, rate = total + force.value(time), rate + force.derivative(time)
        else:
            scale = load.bevel_coefficient * modulus
            total, rate = total + scale * factor.value(time), rate + scale * factor.derivative(time)
    return float(total), float(rate)
