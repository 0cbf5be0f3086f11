"""The forces and the hub's motion of a scene at one instant."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import pi
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Scene, Sinusoid, TimeFunction, TipLoad, as_function
from fem_needle.segments import tip_values

Array = NDArray[np.float64]
FloatOrArray = TypeVar("FloatOrArray", float, Array)


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


def second_derivative(function: TimeFunction, time: FloatOrArray) -> FloatOrArray:
    """Return the second derivative of a time function from the right, without the jumps of its slope."""
    if not isinstance(function, Sinusoid):
        return 0.0 * time
    return -((2 * pi * function.frequency) ** 2) * (function.value(time) - function.mean)


def turns_with_needle(scene: Scene) -> bool:
    """Return whether the hub's rotation is a coordinate of the needle."""
    return scene.support.kind == "hub" and scene.support.hub_rotation == "free"


def is_steady(scene: Scene) -> bool:
    """Return whether forces and hub stay the same at a fixed depth."""
    support = scene.support
    values = [support.hub_deflection, support.hub_angle, support.hub_torque, scene.tissue.stiffness_factor]
    values += [load.force for load in scene.loads if load.force is not None]
    values += [load.direction for load in scene.loads if isinstance(load, TipLoad)]
    return all(isinstance(value, float) for value in values)


def load_case(scene: Scene, depth: float, time: float) -> LoadCase:
    """Return the loads at a depth [m] (the bevel law asks for the layer at the tip) and time [s]."""
    cases = load_cases(scene, np.array([depth]), np.array([time]))
    return LoadCase(*(getattr(cases, part.name)[0] for part in fields(LoadCase)))


def load_cases(scene: Scene, depths: Array, times: Array) -> LoadCase:
    """Return the loads at many depths [m] and times [s] (T,): every array has a row for each."""
    known = [as_function(load.force) for load in scene.lateral_loads]
    if turns_with_needle(scene):
        known.append(as_function(scene.support.hub_torque))
    tip, tip_rate = _tip_forces(scene, depths, times)
    clamp = [as_function(scene.support.hub_deflection), as_function(scene.support.hub_angle)]
    return LoadCase(
        np.stack([*(function.value(times) for function in known), tip], axis=1),
        np.stack([*(function.derivative(times) for function in known), tip_rate], axis=1),
        np.stack([function.value(times) for function in clamp], axis=1),
        np.stack([function.derivative(times) for function in clamp], axis=1),
        np.stack([second_derivative(function, times) for function in clamp], axis=1),
    )


def _tip_forces(scene: Scene, depths: Array, times: Array) -> tuple[Array, Array]:
    """Sum the tip loads, each times its direction; the bevel law is F = a k(y) m(t) with the modulus at the tip."""
    total, rate = np.zeros_like(times), np.zeros_like(times)
    factor = as_function(scene.tissue.stiffness_factor)
    for load in scene.loads:
        if not isinstance(load, TipLoad):
            continue
        if load.bevel_coefficient is None:
            force, scale = as_function(0.0 if load.force is None else load.force), np.ones_like(times)
        else:
            moduli = tip_values(scene.tissue.layers, depths, lambda layer: layer.foundation_modulus)
            force, scale = factor, load.bevel_coefficient * moduli
        turned = as_function(load.direction)
        total = total + scale * force.value(times) * turned.value(times)
        rate = rate + scale * (force.derivative(times) * turned.value(times) + force.value(times) * turned.derivative(times))
    return total, rate
