"""The pushed needle as a rigid rod: how long a push takes to reach a depth, for settings that need a duration beforehand."""

from __future__ import annotations

import numpy as np
import scipy  # its parts are loaded where they are used

from fem_needle import axial
from fem_needle.errors import SceneError
from fem_needle.scene import Scene, as_function

HORIZON = 1000.0  # s; a push that takes longer needs a stated duration
CREEP = 1e-6  # m/s: below it Coulomb friction is smoothed


def time_to_depth(scene: Scene) -> float:
    """Return when a rigid needle reaches ``final_depth`` under the push [s].

    rho A l dv/dt = f - friction - cutting; puncture and the bending needle's own axial force are left out.

    Raises
    ------
    SceneError
        If it does not get there within 1000 s.
    """
    insertion, needle = scene.insertion, scene.needle
    push, target = as_function(insertion.push_force or 0.0), float(insertion.final_depth or needle.length)
    mass = needle.mass_per_length * needle.length

    def rate(time: float, state: np.ndarray) -> list[float]:
        depth, speed = float(state[0]), float(state[1])
        smoothed = speed / (abs(speed) + CREEP)
        resisting = axial.coulomb_force(scene, depth) + axial.cutting_force(scene, depth, 1.0, depth)
        return [speed, (push.value(time) - resisting * smoothed - axial.viscous_coefficient(scene, depth) * speed) / mass]

    def arrives(_: float, state: np.ndarray) -> float:
        return float(state[0]) - target

    arrives.terminal = True  # type: ignore[attr-defined]
    start, options = [insertion.first_depth, 0.0], {"method": "LSODA", "max_step": HORIZON / 200}
    found = scipy.integrate.solve_ivp(rate, (0.0, HORIZON), start, events=arrives, **options)
    if not len(found.t_events[0]):
        raise SceneError(
            f"run.duration: is required, because the push does not bring the needle to final_depth = {target:g} m within "
            f"{HORIZON:g} s (allowed above 0 s)"
        )
    return float(found.t_events[0][0])
