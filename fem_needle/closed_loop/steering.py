"""Steer a scene: its controller closes the loop around its needle through its sensors and actuators."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_needle.choices import first_time_step
from fem_needle.closed_loop.fully_actuated import fully_actuated
from fem_needle.closed_loop.inputs import with_inputs
from fem_needle.closed_loop.repetitions import scattered
from fem_needle.closed_loop.simulation import Simulation, analysis_of, output_step_of
from fem_needle.control.build import controller_of
from fem_needle.control.controller import Controller
from fem_needle.errors import ComputationError, SuspiciousValueWarning
from fem_needle.models import build_plant, model_family
from fem_needle.motion import run_duration
from fem_needle.plant import Plant
from fem_needle.run_job import time_stepper
from fem_needle.scene import Controller as ControllerSettings
from fem_needle.scene import Scene
from fem_needle.steppers import StaticStepper
from fem_needle.trajectory import Trajectory

MOST_REFINEMENTS = 10
# By how much an input is moved to find out which mesh it needs, where no limit says how far it goes; SI.
USUAL_COMMANDS = {
    "lateral_force": 1.0,
    "hub_deflection": 1e-3,
    "hub_angle": 1e-2,
    "hub_torque": 1e-2,
    "tip_direction": 1.0,
}

Log = list[tuple[float, dict[str, float]]]
Progress = Callable[[float], None]


def _nobody(fraction: float) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class Loop:
    """Everything of a closed loop but its time step.

    Attributes
    ----------
    plant
        The needle.
    controller
        Who decides.
    period
        Between two decisions [s].
    repetition
        Number of the run among its repetitions.
    progress
        Is told which share of a run is done; every finer run starts again.
    """

    plant: Plant
    controller: Controller[Any]
    period: float
    repetition: int = 0
    progress: Progress = _nobody

    def run(self, time_step: float) -> tuple[Trajectory, Log]:
        """Return the run with steps of at most ``time_step`` [s], and what was commanded when; interrupted, as far as it got.

        Raises
        ------
        ComputationError
            If a step fails, the controller cannot go on, or the loop is unstable; with ``partial``, the trajectory so far.
        """
        simulation, log = self._simulation(time_step), Log()
        try:
            state, measurement = self.controller.begin(), simulation.measurement()
            for until in self._ticks():
                if simulation.stop_reason is not None:
                    break
                state, command = self._decided(simulation, state, measurement)
                log.append((until, command))
                measurement = simulation.step(command, until - simulation.time)
                self.progress(until / run_duration(self.plant.scene))
        except KeyboardInterrupt:
            return simulation.trajectory("interrupted"), log
        return simulation.trajectory(), log

    def replay(self, log: Log, time_step: float) -> Trajectory:
        """Return the run with the commands of another one; interrupted, as far as it got."""
        simulation = self._simulation(time_step)
        try:
            for until, command in log:
                if simulation.stop_reason is None:
                    simulation.step(command, until - simulation.time)
                    self.progress(until / log[-1][0])
        except KeyboardInterrupt:
            return simulation.trajectory("interrupted")
        return simulation.trajectory()

    def _simulation(self, time_step: float) -> Simulation:
        return Simulation(self.plant, time_step=time_step, repetition=self.repetition)

    def _decided(self, simulation: Simulation, state: Any, measurement: Mapping[str, Any]) -> tuple[Any, dict[str, float]]:
        try:
            return self.controller.update(state, simulation.time, measurement)
        except ComputationError as error:
            error.partial = simulation.trajectory("failed")
            raise

    def _ticks(self) -> list[float]:
        """Return the ends of the intervals over which a command holds [s]."""
        duration = run_duration(self.plant.scene)
        count = int(np.ceil(duration / self.period * (1 - 1e-12)))
        return [*(number * self.period for number in range(1, count)), duration]


def steer(
    scene: Scene,
    *,
    controller: Controller[Any] | None = None,
    plant: Plant | None = None,
    repetition: int = 0,
    progress: Progress = _nobody,
) -> Trajectory:
    """Steer a needle as ``fem-needle steer`` does.

    Parameters
    ----------
    scene
        With ``[controller]``, ``[[sensors]]``, ``[actuators]``, ``[target]`` and ``[scatter]``.
    controller
        In place of the scene's: any object with ``begin`` and ``update`` (`fem_needle.control.controller`), asked once in every
        ``scene.controller.period``. The scene's own believes in the scene as it is written, without scatter.
    plant
        The needle in place of the scene's, for a controller that believes in a wrong one.
    repetition
        0 is the scene as it is; from 1 on, ``[scatter]`` makes each run different.
    progress
        Is told which share of a run is done, 0 to 1; from 0 again where it is computed with finer steps.

    Returns
    -------
    Trajectory
        With ``command_*`` and ``measurement_*`` as `signals`. On an interrupt, of what was computed, with
        ``summary["stop_reason"] == "interrupted"``.

    Raises
    ------
    SceneError
        If the scene or a setting is impossible.
    ComputationError
        If a step fails, the controller cannot go on, or the loop is unstable; ``error.partial`` holds the trajectory so far.

    Notes
    -----
    Where ``numerics.time_step`` is "auto", the commands of a run are replayed with steps of half the length until the tip agrees
    within the tolerance: what is compared is the integration, not decisions that a threshold turns round.
    """
    if controller is None:
        controller = controller_of(scene)
    needle = chosen_plant(scattered(scene, repetition)) if plant is None else plant
    if scene.controller.variant == "fully-actuated":
        return fully_actuated(needle)
    for message in needle.warnings:
        warnings.warn(message, SuspiciousValueWarning, stacklevel=2)
    return _refined(Loop(needle, controller, scene.controller.period, repetition, progress))


def chosen_plant(scene: Scene) -> Plant:
    """Return the plant of a loop: on "auto" with the mesh that the tip needs under what may be commanded."""
    family = model_family(scene.model.kind)
    if scene.numerics.elements != "auto" or scene.numerics.mesh is not None or scene.model.kind != "fem":
        return family.build(scene)
    name = scene.controller.input
    loaded = scene
    if scene.controller.kind != "none" and name in USUAL_COMMANDS:
        actuator = getattr(scene.actuators, name)
        largest = actuator.maximum if actuator is not None and actuator.maximum else USUAL_COMMANDS[name]
        loaded = with_inputs(scene, {name: largest})
    elements = family.choose(loaded, "quasi-static").plant.describe()["elements"]
    return build_plant(scene.with_value("numerics.elements", int(elements)))


def _refined(loop: Loop) -> Trajectory:
    """Run with the scene's step, or with steps that the tolerance needs."""
    scene = loop.plant.scene
    analysis = analysis_of(scene)
    given = scene.numerics.time_step
    if isinstance(given, float):
        return loop.run(given)[0]
    step = min(first_time_step(loop.plant, analysis, output_step_of(scene)), loop.period)
    if isinstance(time_stepper(loop.plant, scene, analysis), StaticStepper):
        return loop.run(step)[0]
    run, log = loop.run(step)
    for _ in range(MOST_REFINEMENTS):
        if _is_interrupted(run):
            return run
        finer = loop.replay(log, step / 2)
        if _is_interrupted(finer):
            run.summary["stop_reason"] = "interrupted"
            return run
        error = tip_difference(run, finer)
        run.summary["error_estimate"] = error
        if error <= scene.numerics.tolerance:
            return run
        step /= 2
        run, log = loop.run(step)
    missed = f"the tolerance {scene.numerics.tolerance:g} was not reached with steps of {step:g} s: see error_estimate"
    run.summary["warnings"] = [*run.summary["warnings"], missed]
    return run


def _is_interrupted(run: Trajectory) -> bool:
    return bool(run.summary["stop_reason"] == "interrupted")


def tip_difference(run: Trajectory, finer: Trajectory) -> float:
    """Return the largest difference of two runs' tips by the largest of the finer one's, at the samples that both have."""
    count = min(len(run.time), len(finer.time))
    scale = max(float(np.max(np.abs(finer.tip_deflection))), run.scene.numerics.absolute_tolerance)
    return float(np.max(np.abs(run.tip_deflection[:count] - finer.tip_deflection[:count]))) / scale


def described(controller: ControllerSettings) -> str:
    """Return a controller in words."""
    parts = [controller.kind, controller.variant, controller.schedule]
    return ", ".join(part for part in parts if part not in {None, "none"}) or "none"
