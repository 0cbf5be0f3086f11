"""Needles under command: the models, runs of commands, and the same commands as tables with steep flanks."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle import FiniteElementNeedle, Simulation
from fem_needle.scene import LateralLoad, Layer, Scene, TipLoad
from fem_needle.trajectory import VARIABLES, Trajectory
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import held, scene_of

MODELS = {
    "elements": lambda scene: FiniteElementNeedle(scene, elements=4),
    "modes": lambda scene: AssumedModeNeedle(scene, modes=2),
}
FLANK = 1e-9  # s
DURATION = 0.02
VISCOUS = (Layer(start=0.0, foundation_modulus=5e3, damping=5.0),)
FINGER = LateralLoad(position=-0.0123, force=0.05)
FREE_HUB = {"hub_rotation": "free", "hub_rotational_inertia": 1e-6}
# Where each input is in a scene, and a size of its commands.
INPUTS = {
    "lateral_force": ("loads.1.force", 0.3),
    "tip_direction": ("loads.0.direction", 1.0),
    "hub_deflection": ("support.hub_deflection", 1e-3),
    "hub_angle": ("support.hub_angle", 1e-2),
    "hub_torque": ("support.hub_torque", 1e-3),
    "push_force": ("insertion.push_force", 0.4),
}


def loop_scene(insertion=None, *, kind="hub", layers=VISCOUS, loads=None, duration=DURATION, **parts: Any) -> Scene:
    """Return a scene with a tip force and, under ``hub``, a finger."""
    if loads is None:
        loads = [TipLoad(force=0.1), FINGER] if kind == "hub" else [TipLoad(force=0.1)]
    return scene_of(kind, insertion or held(0.1), layers, loads, duration=duration, **parts)


def scene_for(name: str, insertion=None, **parts: Any) -> Scene:
    """Return a scene that has an input."""
    return loop_scene(insertion, support=FREE_HUB if name == "hub_torque" else {}, **parts)


def commanded(plant, commands, end, *, time_step, analysis, output_step=2e-3) -> Trajectory:
    """Run commands [(time, {name: value})] up to an end, or to where the run ends."""
    simulation = Simulation(plant, time_step=time_step, analysis=analysis, output_step=output_step)
    times = [time for time, _ in commands] + [end]
    if times[0] > 0.0:
        simulation.step({}, times[0])
    for (_, command), until in zip(commands, times[1:], strict=True):
        if simulation.stop_reason is None:
            simulation.step(command, until - simulation.time)
    return simulation.trajectory()


def free_run(plant, end, *, time_step, analysis, output_step=2e-3, pieces=None) -> Trajectory:
    """Run without commands, in steps of the output's length or of given lengths [s]."""
    simulation = Simulation(plant, time_step=time_step, analysis=analysis, output_step=output_step)
    lengths = iter(pieces if pieces is not None else ())
    while simulation.stop_reason is None and end - simulation.time > 1e-12:
        simulation.step({}, min(next(lengths, output_step), end - simulation.time))
    return simulation.trajectory()


def steps_table(before: float, commands: list[tuple[float, float]], end: float) -> dict[str, list[float]]:
    """Return a table that follows piecewise constant commands, with steep flanks."""
    times, values, value = [0.0], [before], before
    for time, target in commands:
        times += [time, time + FLANK]
        values += [value, target]
        value = target
    return {"time": [*times, end], "value": [*values, value]}


def largest_differences(found: Trajectory, expected: Trajectory) -> dict[str, float]:
    """Return the largest difference of every variable over time, by its largest value; of energies and works by the largest."""
    energy = max(float(np.max(np.abs(getattr(expected, name)))) for name in ("bending_energy", "tissue_energy", "load_work"))
    result = {}
    for name in VARIABLES:
        left, right = np.asarray(getattr(found, name)), np.asarray(getattr(expected, name))
        scale = energy if VARIABLES[name][0] == "J" else float(np.max(np.abs(right), initial=0.0))
        difference = float(np.max(np.abs(left - right), initial=0.0))
        result[name] = difference / scale if scale else difference
    return result


def tip_distance(found: Trajectory, expected: Trajectory) -> float:
    """Return the largest difference of the tips at the same samples, relative to the largest tip."""
    assert np.allclose(found.time, expected.time, rtol=0.0, atol=1e-12)
    return float(np.max(np.abs(found.tip_deflection - expected.tip_deflection)) / np.max(np.abs(expected.tip_deflection)))
