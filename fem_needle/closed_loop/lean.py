"""Which engine knows a needle without works and energy balance, where there is a quicker one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.engine import Engine
from fem_needle.closed_loop.response_engine import ResponseEngine, why_no_response
from fem_needle.loops import why_not_compiled
from fem_needle.plant import Plant
from fem_needle.steppers import DynamicStepper, StaticStepper, Stepper

FORCES = ("lateral_force", "tip_direction", "hub_torque")  # what the compiled engine can be commanded

Upcoming = Callable[[float], NDArray[np.float64]]


def lean_engine(plant: Plant, stepper: Stepper, time_step: float, upcoming: Upcoming) -> Engine | None:
    """Return an engine that computes no works, None where there is none; arguments as for those engines."""
    scene = plant.scene
    if isinstance(stepper, StaticStepper) and not why_no_response(scene, stepper):
        return ResponseEngine(plant, stepper)
    if not isinstance(stepper, DynamicStepper) or scene.controller.input not in FORCES or why_not_compiled(plant, stepper):
        return None
    from fem_needle.closed_loop.compiled_engine import CompiledEngine

    return CompiledEngine(plant, stepper, time_step, upcoming)
