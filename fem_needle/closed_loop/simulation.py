"""A needle whose loop is closed from outside: one call for each stretch of time over which a command holds."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cached_property
from math import atan2, inf
from typing import Any, Literal, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import first_time_step
from fem_needle.closed_loop.course import SAME_TIME
from fem_needle.closed_loop.ledger_option import warn_of_energies
from fem_needle.closed_loop.needle import DrivenNeedle, NeedleState
from fem_needle.closed_loop.outcome import Account, AccountState, outcome
from fem_needle.closed_loop.record import LoopRecord
from fem_needle.closed_loop.rows import RowsState, flat
from fem_needle.dynamics import names as at
from fem_needle.dynamics.grid import ends_by_itself
from fem_needle.dynamics.run import integration_of
from fem_needle.errors import ComputationError, SceneError
from fem_needle.motion import run_duration
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.sensing.rig import RigState, SensorRig
from fem_needle.skipping import Skipped, unneeded_terms
from fem_needle.threads import one_thread
from fem_needle.trajectory import Trajectory, energy_warnings, summary_of, trajectory_from_samples

Array = NDArray[np.float64]

OUTPUTS = 200
LARGEST_DEFLECTION = 0.5  # of the needle's length: beyond it a loop is called unstable
READS_FORCES = {"base-force", "base-moment"}  # sensors


class UnstableLoopError(ComputationError):
    """A loop that drives the needle out of all bounds; ``partial`` is the trajectory so far."""


class SimulationState(NamedTuple):
    """Everything that a simulation remembers: needle, sensors, efforts, samples, names of inputs that were commanded, its end."""

    needle: NeedleState
    rig: RigState
    account: AccountState
    rows: RowsState
    commands: frozenset[str]
    stop_reason: str | None


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
        Does nothing any more: works and the energy balance are always computed.

    Attributes
    ----------
    stop_reason
        Why the run has ended; None as long as it goes on.

    Raises
    ------
    SceneError
        If a setting is impossible.

    Notes
    -----
    A command holds until the next one (zero-order hold), within the limits and rates of `Scene.actuators`. The integrator's
    steps end at every change of a command, so that no pulse is stepped over, however short.

    `copy.copy`, `copy.deepcopy` and ``pickle`` work: a copy goes on with the same numbers to the last bit.
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
        energies: bool | None = None,
    ) -> None:
        warn_of_energies(energies)
        given = {"time_step": time_step, "analysis": analysis, "output_step": output_step}
        scene = plant.scene.with_values({f"numerics.{key}": value for key, value in given.items() if value is not None})
        self._started = clock.perf_counter()
        self._settings: dict[str, Any] = given | {"repetition": repetition}
        self.plant, self.scene, self.analysis = plant, scene, analysis_of(scene)
        self._output_step = output_step_of(scene)
        step = scene.numerics.time_step
        self.time_step = step if isinstance(step, float) else first_time_step(plant, self.analysis, self._output_step)
        self._needle = DrivenNeedle(plant, integration_of(plant, scene, self.analysis), self.time_step)
        self._begun = self._needle.state()
        self._same, self._bound = SAME_TIME * self.time_step, LARGEST_DEFLECTION * scene.needle.length
        self._has_sensors = bool(scene.sensors)
        self._reads_forces = any(sensor.kind in READS_FORCES for sensor in scene.sensors)
        self._begin(scene.run.seed)

    def _begin(self, seed: int) -> None:
        """Stand at t = 0 with new sensors."""
        self._make(seed)
        self._rig.sample(self._needle)
        self._keep()

    def _make(self, seed: int) -> None:
        """Have new sensors beside the needle, and nothing recorded."""
        needle, scene = self._needle, self.scene
        self._rig = SensorRig(scene, seed, self._settings["repetition"])
        self._commands: frozenset[str] = frozenset({scene.controller.input} if scene.controller.commands_input else ())
        self._record = LoopRecord(scene, needle.width)
        self.stop_reason: str | None = None
        self._account = Account(scene, needle.depth, needle.tip_deflection)

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._needle.time

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self._needle.depth

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m], the true one."""
        return self._needle.tip_deflection

    @property
    def sampled_tips(self) -> Array:
        """Deflections of the tip [m] at the samples so far."""
        tips: Array = self._record.rows.array()[:, at.R_TIP]
        return tips

    @property
    def steps(self) -> int:
        """How many time steps were taken."""
        return self._needle.steps

    @property
    def state(self) -> SimulationState:
        """A copy of everything: the needle and its path, inputs, sensors with their random numbers, efforts, samples so far."""
        return SimulationState(
            self._needle.state(),
            self._rig.state(),
            self._account.state(),
            self._record.rows.state(),
            self._commands,
            self.stop_reason,
        )

    def restore(self, state: SimulationState) -> None:
        """Go back to a state of this simulation, or of another one of the same plant and settings."""
        self._needle.restore(state.needle)
        self._rig.restore(state.rig)
        self._account.restore(state.account)
        self._record.rows.restore(state.rows)
        self._commands, self.stop_reason = state.commands, state.stop_reason

    def copy(self) -> Simulation:
        """Return an independent simulation in the same state."""
        other: Simulation = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        other._needle = self._needle.twin()
        other._make(self.scene.run.seed)
        other.restore(self.state)
        return other

    def reset(self, seed: int | None = None) -> None:
        """Go back to t = 0.

        Parameters
        ----------
        seed
            Of the sensors; default: the scene's.
        """
        self._needle.restore(self._begun)
        self._begin(self.scene.run.seed if seed is None else seed)

    def __copy__(self) -> Simulation:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        return self.copy()

    def __reduce__(self) -> tuple[Callable[..., Simulation], tuple[Any, ...]]:
        """Return how it is made again; what is compiled is not part of it."""
        state = self.state
        state = state._replace(rows=flat(state.rows, self._record.rows.width))
        return _rebuilt, (self.plant, self._settings, state, clock.perf_counter() - self._started)

    def interrupt(self) -> None:
        """End the run here: the last step may not be whole."""
        self.stop_reason = "interrupted"

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
        if not 0.0 < duration < inf:
            raise SceneError(f"duration: out of range (got {duration!r}; allowed above 0 s)")
        if self.stop_reason is not None:
            raise SceneError(f"the run has ended at time {self.time:g} s, depth {self.depth:g} m: {self.stop_reason}")
        time = self._needle.time
        if command:
            self._command(time, command)
        try:
            self._advance(time + duration)
        except ComputationError as error:
            error.partial = self.trajectory("unstable" if isinstance(error, UnstableLoopError) else "failed")
            raise
        return self.measurement()

    def measurement(self) -> dict[str, Any]:
        """Return what the sensors tell now; see `step`."""
        needle = self._needle
        if self._has_sensors:
            return self._rig.known(needle.time)
        tip, depth = needle.tip_deflection, needle.depth
        return {"tip_deflection": tip, "needle_angle": atan2(tip, depth) if depth else 0.0, "depth": depth}

    @one_thread
    def trajectory(self, stop_reason: str | None = None) -> Trajectory:
        """Return the run so far, with commands and measurements at each sample; of an interrupted one up to the last sample."""
        record, stop_reason = self._record, stop_reason or self.stop_reason
        rows = record.rows.array()
        if stop_reason != "interrupted" and self.time > rows[-1, at.R_TIME]:
            rows = record.with_last(self._needle.row(), self._needle.inputs, self._commands, self._rig.known(self.time))
        run = trajectory_from_samples(self.plant, self._needle.samples(record.records(rows)), {}, self.scene)
        run.signals.update(record.signals(rows, run.time, self._needle.inputs, self._commands))
        run.summary.update(self._summary(run, stop_reason or self._usual_end()))
        return run

    def _summary(self, run: Trajectory, stop_reason: str) -> dict[str, Any]:
        elapsed = clock.perf_counter() - self._started
        return (
            self.plant.describe()
            | {
                "analysis": self.analysis,
                "time_step": self.time_step,
                "steps": self.steps,
                "skipped": [asdict(skipped) for skipped in self._skipped],
            }
            | summary_of(run)
            | outcome(self.scene, *self._account.closed(self.time, self._needle.inputs))
            | {
                "error_estimate": None,
                "warnings": [*self.plant.warnings, *energy_warnings(run)],
                "stop_reason": stop_reason,
                "solve_time": elapsed,
                "wall_time": elapsed,
            }
        )

    def _usual_end(self) -> str:
        """Return why a run ends that nothing has ended before."""
        rested = self.scene.insertion.rest_time
        at_rest = "speed" not in self._needle.inputs.ramps and rested is not None and self.time >= rested * (1 - SAME_TIME)
        return "final-depth" if at_rest and ends_by_itself(self.scene) else "duration"

    @cached_property
    def _skipped(self) -> tuple[Skipped, ...]:
        asked = () if self.analysis == "dynamic" else (Skipped("inertia", f"analysis = '{self.analysis}' was asked for"),)
        return (*asked, *unneeded_terms(self.scene))

    def _command(self, time: float, command: Mapping[str, float]) -> None:
        """Let a command act from a time on."""
        inputs = self._needle.inputs.commanded(time, command)
        if inputs is not self._needle.inputs:
            self._account.close(time, self._needle.inputs)
            self._needle.command(inputs)
            if not command.keys() <= self._commands:
                self._commands |= frozenset(command)

    def _advance(self, end: float) -> None:
        """Go to a time, with readings and samples on the way."""
        needle, rig, account, rows, same = self._needle, self._rig, self._account, self._record.rows, self._same
        while self.stop_reason is None and end - needle.time > same:
            following = len(rows) * self._output_step
            until = min(end, rig.next_time, following)
            if account.awaits:
                until = min(until, needle.passing_time(account.awaits))
            if end - until <= same:
                until = end
            is_sampled, is_read = following <= until + same, rig.next_time <= until + same
            reason = needle.advance(until, is_output=is_sampled or (is_read and self._reads_forces))
            time, tip = needle.time, needle.tip_deflection
            if not abs(tip) <= self._bound:
                self._leave(tip)
            account.follow(time, needle.depth, tip)
            if rig.next_time <= time + same:
                rig.sample(needle)
            if following <= time + same:
                self._keep()
            self.stop_reason = reason

    def _keep(self) -> None:
        """Keep a sample of the present instant."""
        needle = self._needle
        self._record.add(needle.row(), needle.inputs, self._commands, self._rig.known(needle.time))

    def _leave(self, tip: float) -> NoReturn:
        """Give up a needle whose tip has left all bounds.

        Raises
        ------
        UnstableLoopError
            Always.
        """
        here = f"at time {self.time:g} s, depth {self.depth:g} m"
        advice = "use smaller gains, a shorter delay or limits on the actuator; where the tip's response changes its sign, "
        raise UnstableLoopError(
            f"the tip has gone to {1e3 * tip:.4g} mm {here}, more than half the needle's length ({1e3 * self._bound:.4g} mm): "
            f"the loop is unstable; {advice}schedule = 'model-gain'"
        )


def _rebuilt(plant: Plant, settings: dict[str, Any], state: SimulationState, elapsed: float) -> Simulation:
    """Return a simulation in a state; ``elapsed``: how long ago it was begun [s]."""
    simulation = Simulation(plant, **settings)
    simulation.restore(state)
    simulation._started = clock.perf_counter() - elapsed
    return simulation


def analysis_of(scene: Scene) -> str:
    """Return the analysis of a loop: the scene's; with inertia where that says "auto", for a command may excite vibrations."""
    return "dynamic" if scene.numerics.analysis == "auto" else scene.numerics.analysis


def output_step_of(scene: Scene) -> float:
    """Return the time between the samples of a loop [s]."""
    step = scene.numerics.output_step
    return step if isinstance(step, float) else run_duration(scene) / OUTPUTS
