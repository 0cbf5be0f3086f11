"""A needle whose loop is closed from outside: one call for each stretch of time over which a command holds."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cached_property
from math import atan2
from typing import Any, Literal, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import first_time_step
from fem_needle.closed_loop.engine import SAME_TIME, Engine, engine_of
from fem_needle.closed_loop.inputs import Inputs
from fem_needle.closed_loop.lean import lean_engine
from fem_needle.closed_loop.outcome import Account, outcome
from fem_needle.closed_loop.truth import State
from fem_needle.errors import ComputationError, SceneError
from fem_needle.march import ends_by_itself
from fem_needle.motion import run_duration
from fem_needle.plant import Plant
from fem_needle.run_job import time_stepper
from fem_needle.samples import Sample, stacked
from fem_needle.scene import Scene
from fem_needle.sensing.rig import SensorRig
from fem_needle.skipping import Skipped, unneeded_terms
from fem_needle.threads import one_thread
from fem_needle.trajectory import Trajectory, energy_warnings, summary_of, trajectory_from_samples

Array = NDArray[np.float64]
Reading = float | Array

OUTPUTS = 200
EXPECTED = 200  # decisions that are prepared for
LARGEST_DEFLECTION = 0.5  # of the needle's length: beyond it a loop is called unstable


class Row(NamedTuple):
    """One sample: what gives it, its time [s], the tip [m], commands and measurements."""

    sample: Callable[[], Sample]
    time: float
    tip_deflection: float
    known: dict[str, Reading]


class UnstableLoopError(ComputationError):
    """A loop that drives the needle out of all bounds; ``partial`` is the trajectory so far."""


class Simulation:
    """A needle under way, to be advanced step by step.

    Parameters
    ----------
    plant
        Any model of a needle; its scene says what happens where nothing is commanded.
    time_step
        Largest time step [s] of the integrator; "auto": resolves the longest natural period.
    analysis
        "dynamic", "quasi-static" or "static"; default: the scene's, and "dynamic" where that says "auto".
    output_step
        Time between the samples of `trajectory` [s]; default: the scene's, and a 200th of the run where that says "auto".
    repetition
        Which of several runs of the same scene it is: the sensors' noise differs.
    energies
        Whether `trajectory` shall have works and the energy balance (else nan). Without them a needle without inertia and
        viscosity, on a prescribed way and under steady loads, is known by its gains: decisions then cost microseconds.

    Raises
    ------
    SceneError
        If a setting is impossible.

    Notes
    -----
    A command holds until the next one (zero-order hold), within the limits and rates of `Scene.actuators`. The integrator's
    steps end at every change of a command, so that no pulse is stepped over, however short.
    """

    @one_thread
    def __init__(
        self,
        plant: Plant,
        *,
        time_step: float | Literal["auto"] | None = None,
        analysis: str | None = None,
        output_step: float | None = None,
        repetition: int = 0,
        energies: bool = True,
    ) -> None:
        given = {"time_step": time_step, "analysis": analysis, "output_step": output_step}
        scene = plant.scene.with_values({f"numerics.{key}": value for key, value in given.items() if value is not None})
        self._started = clock.perf_counter()
        self.plant, self.scene, self.analysis = plant, scene, analysis_of(scene)
        self._output_step = output_step_of(scene)
        step = scene.numerics.time_step
        self.time_step = step if isinstance(step, float) else first_time_step(plant, self.analysis, self._output_step)
        stepper = time_stepper(plant, scene, self.analysis)
        lean = None if energies else lean_engine(plant, stepper, self.time_step, self._upcoming)
        self._engine: Engine = lean or engine_of(plant, stepper, self.time_step)
        self._tick = (0.0, self.time_step)  # end and duration of the step that is being taken
        self._state = State(plant, self._engine)
        self._rig = SensorRig(scene, scene.run.seed, repetition)
        self._inputs, self._commands = Inputs(scene), _commanded_names(scene)
        self._has_sensors = bool(scene.sensors)
        self._rows: list[Row] = []
        self.stop_reason: str | None = None
        self._account = Account(scene, self.depth, self.tip_deflection)
        self._bound = LARGEST_DEFLECTION * scene.needle.length
        self._rig.sample(self._state)
        self._rows.append(self._row())

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._engine.time

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self._engine.depth

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m], the true one."""
        return self._engine.tip_deflection

    @property
    def has_works(self) -> bool:
        """Whether works and the energy balance are computed."""
        return self._engine.has_works

    @property
    def sampled_tips(self) -> Array:
        """Deflections of the tip [m] at the samples so far."""
        return np.array([row.tip_deflection for row in self._rows])

    def interrupt(self) -> None:
        """End the run here: the last step may not be whole."""
        self.stop_reason = "interrupted"

    @property
    def steps(self) -> int:
        """How many time steps were taken."""
        return self._engine.steps

    @one_thread
    def step(self, command: Mapping[str, float] | None = None, duration: float | None = None) -> dict[str, Any]:
        """Let a command act for a while and return what the sensors tell at its end.

        Parameters
        ----------
        command
            Inputs by name, SI: ``push_force``, ``speed``, ``lateral_force``, ``hub_deflection``, ``hub_angle``, ``hub_torque``,
            ``tip_direction``. What is not named keeps its last command, or the scene's own value where it has none.
        duration
            [s]; default: one ``time_step``.

        Returns
        -------
        dict
            The latest readings that have arrived, by name, SI (`fem_needle.scene.steering.READINGS`); of a scene without sensors
            the exact ``tip_deflection``, ``needle_angle`` and ``depth``.

        Raises
        ------
        SceneError
            If the scene has no such input, a command is not finite, the duration not above 0, or the run has ended.
        UnstableLoopError
            If the tip leaves all bounds.
        ComputationError
            If a step fails; both with ``partial``, the trajectory so far.
        """
        duration = self.time_step if duration is None else duration
        if not 0.0 < duration < np.inf:
            raise SceneError(f"duration: out of range (got {duration!r}; allowed above 0 s)")
        if self.stop_reason is not None:
            raise SceneError(f"the run has ended at time {self.time:g} s, depth {self.depth:g} m: {self.stop_reason}")
        time = self._engine.time
        if command:
            self._command(time, command)
        self._tick = (time + duration, duration)
        try:
            self._advance(time + duration)
        except ComputationError as error:
            error.partial = self.trajectory("unstable" if isinstance(error, UnstableLoopError) else "failed")
            raise
        return self.measurement()

    def measurement(self) -> dict[str, Any]:
        """Return what the sensors tell now; see `step`."""
        if self._has_sensors:
            return self._rig.known(self._engine.time)
        tip, depth = self._engine.tip_deflection, self._engine.depth
        return {"tip_deflection": tip, "needle_angle": atan2(tip, depth) if depth else 0.0, "depth": depth}

    def trajectory(self, stop_reason: str | None = None) -> Trajectory:
        """Return the run so far, with commands and measurements at each sample; of an interrupted one up to the last sample."""
        rows = [*self._rows]
        stop_reason = stop_reason or self.stop_reason
        if stop_reason != "interrupted" and self.time > rows[-1].time:
            rows.append(self._row())
        run = trajectory_from_samples(self.plant, stacked([row.sample() for row in rows]), {}, self.scene)
        run.signals.update(self._signal_arrays(rows))
        run.summary.update(
            self.plant.describe()
            | {
                "analysis": self.analysis,
                "time_step": self.time_step,
                "steps": self.steps,
                "skipped": [asdict(skipped) for skipped in self._skipped],
            }
            | summary_of(run)
            | outcome(self.scene, *self._account.closed(self.time, self._inputs))
            | {
                "error_estimate": None,
                "warnings": [*self.plant.warnings, *(energy_warnings(run) if self._engine.has_works else ())],
                "stop_reason": stop_reason or self._usual_end(),
                "solve_time": clock.perf_counter() - self._started,
                "wall_time": clock.perf_counter() - self._started,
            }
        )
        if not self._engine.has_works:
            run.summary["relative_energy_residual"] = None
        return run

    def _usual_end(self) -> str:
        """Return why a run ends that nothing has ended before."""
        rested = self.scene.insertion.rest_time
        at_rest = "speed" not in self._inputs.ramps and rested is not None and self.time >= rested * (1 - SAME_TIME)
        return "final-depth" if at_rest and ends_by_itself(self.scene) else "duration"

    @cached_property
    def _skipped(self) -> tuple[Skipped, ...]:
        asked = () if self.analysis == "dynamic" else (Skipped("inertia", f"analysis = '{self.analysis}' was asked for"),)
        if not self._engine.has_works:
            asked = (*asked, Skipped("works and the energy balance", "energies = False was asked for"))
        return (*asked, *unneeded_terms(self.scene))

    def _command(self, time: float, command: Mapping[str, float]) -> None:
        """Let a command act from a time on."""
        inputs = self._inputs.commanded(time, command)
        if inputs is not self._inputs:
            self._account.close(time, self._inputs)
            self._inputs = inputs
            self._engine.command(inputs)
            self._commands |= set(command)

    def _advance(self, end: float) -> None:
        """Go to a time, with readings and samples on the way."""
        engine, rig, account, same = self._engine, self._rig, self._account, SAME_TIME * self.time_step
        while self.stop_reason is None and end - engine.time > same:
            following = len(self._rows) * self._output_step
            until = min(end, rig.next_time, following)
            if account.awaits:
                until = min(until, engine.passing_time(account.awaits))
            self.stop_reason = engine.advance(end if end - until <= same else until)
            time, tip = engine.time, engine.tip_deflection
            if not abs(tip) <= self._bound:
                self._leave(tip)
            account.follow(time, engine.depth, tip)
            if rig.next_time <= time + same:
                rig.sample(self._state)
            if following <= time + same:
                self._rows.append(self._row())

    def _upcoming(self, time: float) -> Array:
        """Return when something will happen after a time [s] if decisions go on as they come now, rising."""
        end, duration = self._tick
        ticks = end + duration * np.arange(EXPECTED)
        periods = [self._output_step, *(sensor.period for sensor in self.scene.sensors)]
        marks = [ticks, *(np.arange(time // period, ticks[-1] / period) * period for period in periods)]
        found = np.sort(np.concatenate(marks))
        found = found[found > time + SAME_TIME * self.time_step]
        return found[np.append(True, np.diff(found) > SAME_TIME * self.time_step)] if len(found) else found

    def _leave(self, tip: float) -> NoReturn:
        """Give up a needle whose tip has left all bounds.

        Raises
        ------
        UnstableLoopError
            Always.
        """
        at = f"at time {self.time:g} s, depth {self.depth:g} m"
        advice = "use smaller gains, a shorter delay or limits on the actuator; where the tip's response changes its sign, "
        raise UnstableLoopError(
            f"the tip has gone to {1e3 * tip:.4g} mm {at}, more than half the needle's length ({1e3 * self._bound:.4g} mm): the "
            f"loop is unstable; {advice}schedule = 'model-gain'"
        )

    def _row(self) -> Row:
        """Return what is known of the present instant, with commands and measurements."""
        commands: dict[str, Reading] = {f"command_{name}": self._inputs.value(name, self.time) for name in self._commands}
        known = self._rig.known(self.time)
        measured = {f"measurement_{name}": value for name, value in known.items()}
        return Row(self._engine.sample_later(), self.time, self._engine.tip_deflection, commands | measured)

    def _signal_arrays(self, rows: list[Row]) -> dict[str, Array]:
        """Return commands and measurements over the samples; nan, or the scene's own input, where there was none yet."""
        found: dict[str, Array] = {}
        for name in sorted(self._commands):
            values = [row.known.get(f"command_{name}", self._inputs.own_value(name, row.time)) for row in rows]
            found[f"command_{name}"] = np.array(values)
        for sensor in self.scene.sensors:
            for name in sensor.readings:
                empty = np.full(sensor.stations, np.nan) if name == "needle_shape" else np.nan
                found[f"measurement_{name}"] = np.array([row.known.get(f"measurement_{name}", empty) for row in rows])
        return found


def analysis_of(scene: Scene) -> str:
    """Return the analysis of a loop: the scene's; with inertia where that says "auto", for a command may excite vibrations."""
    return "dynamic" if scene.numerics.analysis == "auto" else scene.numerics.analysis


def output_step_of(scene: Scene) -> float:
    """Return the time between the samples of a loop [s]."""
    step = scene.numerics.output_step
    return step if isinstance(step, float) else run_duration(scene) / OUTPUTS


def _commanded_names(scene: Scene) -> set[str]:
    """Return the inputs that are recorded from the start: the controller's."""
    return set() if scene.controller.kind == "none" else {scene.controller.input}
