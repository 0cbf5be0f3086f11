"""Steer a scene: its controller closes the loop around its needle through its sensors and actuators."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from fem_needle.choices import first_time_step
from fem_needle.closed_loop.fully_actuated import fully_actuated
from fem_needle.closed_loop.inputs import with_inputs
from fem_needle.closed_loop.ledger_option import warn_of_energies
from fem_needle.closed_loop.repetitions import scattered
from fem_needle.closed_loop.simulation import Simulation, analysis_of, output_step_of
from fem_needle.control.build import controller_of
from fem_needle.control.controller import Controller
from fem_needle.dynamics.run import integration_of
from fem_needle.errors import ComputationError, SuspiciousValueWarning
from fem_needle.limits import check_readings, check_samples
from fem_needle.models import build_plant, model_family
from fem_needle.motion import run_duration
from fem_needle.plant import Plant
from fem_needle.scene import Controller as ControllerSettings
from fem_needle.scene import Scene
from fem_needle.threads import one_thread
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

    def simulated(self, time_step: float, log: Log | None = None) -> tuple[Simulation, Log]:
        """Return the run with steps of at most ``time_step`` [s], and what was commanded when; interrupted, as far as it got.

        Parameters
        ----------
        log
            Commands of another run, in place of the controller's.

        Raises
        ------
        ComputationError
            If a step fails, the controller cannot go on, or the loop is unstable; with ``partial``, the trajectory so far.
        """
        simulation = Simulation(self.plant, time_step=time_step, repetition=self.repetition)
        done, duration = Log(), run_duration(self.plant.scene)
        try:
            for until, command in self._decisions(simulation) if log is None else log:
                if simulation.stop_reason is not None:
                    break
                done.append((until, command))
                simulation.step(command, until - simulation.time)
                self.progress(until / duration)
        except KeyboardInterrupt:
            simulation.interrupt()
        return simulation, done

    def _decisions(self, simulation: Simulation) -> Iterator[tuple[float, dict[str, float]]]:
        """Yield the controller's commands and until when they hold [s], each decided when the one before has ended."""
        state = self.controller.begin()
        for until in self._ticks():
            try:
                state, command = self.controller.update(state, simulation.time, simulation.measurement())
            except ComputationError as error:
                error.partial = simulation.trajectory("failed")
                raise
            yield until, command

    def _ticks(self) -> list[float]:
        """Return the ends of the intervals over which a command holds [s]."""
        duration = run_duration(self.plant.scene)
        count = int(np.ceil(duration / self.period * (1 - 1e-12)))
        return [*(number * self.period for number in range(1, count)), duration]


@one_thread
def steer(
    scene: Scene,
    *,
    controller: Controller[Any] | None = None,
    plant: Plant | None = None,
    repetition: int = 0,
    energies: bool | None = None,
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
    energies
        Does nothing any more: works and the energy balance are always computed.
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
    warn_of_energies(energies)
    _check_readings(scene)
    if controller is None:
        controller = controller_of(scene)
    needle = chosen_plant(scattered(scene, repetition)) if plant is None else plant
    if scene.controller.variant == "fully-actuated":
        return fully_actuated(needle)
    for message in needle.warnings:
        warnings.warn(message, SuspiciousValueWarning, stacklevel=3)
    return _refined(Loop(needle, controller, scene.controller.period, repetition, progress))


def _check_readings(scene: Scene) -> None:
    """Refuse sensors and a controller that are asked more often than a run can hold."""
    check_samples(run_duration(scene), output_step_of(scene), stations=scene.numerics.output_points)
    check_readings(run_duration(scene), scene.controller.period, "controller.period")
    for number, sensor in enumerate(scene.sensors):
        check_readings(run_duration(scene), sensor.period, f"sensors.{number}.period")


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
    analysis, given, tolerance = analysis_of(scene), scene.numerics.time_step, scene.numerics.tolerance
    if isinstance(given, float):
        return loop.simulated(given)[0].trajectory()
    step = min(first_time_step(loop.plant, analysis, output_step_of(scene)), loop.period)
    if not integration_of(loop.plant, scene, analysis).steps:
        return loop.simulated(step)[0].trajectory()
    error, missed = inf, list[str]()
    for _ in range(MOST_REFINEMENTS):
        simulation, log = loop.simulated(step)
        finer, _ = loop.simulated(step / 2, log)
        if "interrupted" in {simulation.stop_reason, finer.stop_reason}:
            return simulation.trajectory("interrupted")
        error = tip_difference(simulation, finer)
        if error <= tolerance:
            break
        # The methods are of order three or four; beside kinks of a threshold's decisions the error falls more slowly.
        step *= max(0.1, min(0.5, 0.8 * (tolerance / error) ** (1 / 3)))
    else:
        missed.append(f"the tolerance {tolerance:g} was not reached with steps of {step:g} s: see error_estimate")
    run = simulation.trajectory()
    run.summary["error_estimate"] = error
    run.summary["warnings"] = [*run.summary["warnings"], *missed]
    return run


def tip_difference(one: Simulation, finer: Simulation) -> float:
    """Return the largest difference of two runs' tips by the largest of the finer one's, at the samples that both have."""
    tips, others = one.sampled_tips, finer.sampled_tips
    count = min(len(tips), len(others))
    scale = max(float(np.max(np.abs(others))), one.scene.numerics.absolute_tolerance)
    return float(np.max(np.abs(tips[:count] - others[:count]))) / scale


def described(controller: ControllerSettings) -> str:
    """Return a controller in words."""
    parts = [controller.kind, controller.variant, controller.schedule]
    return ", ".join(part for part in parts if part not in {None, "none"}) or "none"
