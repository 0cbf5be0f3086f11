"""How a needle advances while its inputs are commanded: the steps of `march` and `pushed_march`, from one command to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, inf
from typing import Any, Protocol

import numpy as np

from fem_needle.closed_loop.inputs import Driven, Inputs
from fem_needle.closed_loop.motion import CommandedMotion
from fem_needle.ledger import StepEnd
from fem_needle.march import started
from fem_needle.motion import Instant, Motion, depth_law, landing_times, run_duration, shortest_period
from fem_needle.plant import Plant
from fem_needle.pushed_march import STEPS_PER_PERIOD, PushMarching, run_limits, started_push
from fem_needle.pushing import Pusher
from fem_needle.samples import Sample
from fem_needle.segments import interfaces
from fem_needle.steppers import DynamicStepper, Stepper

SAME_DEPTH = 1e-12  # of the needle's length
SAME_TIME = 1e-9  # of a time step: two instants closer than this are one


class Engine(Protocol):
    """A needle under way.

    Attributes
    ----------
    has_works
        Whether its samples know the works since the start.
    """

    has_works: bool

    @property
    def time(self) -> float:
        """Time [s]."""

    @property
    def depth(self) -> float:
        """Inserted length [m]."""

    @property
    def speed(self) -> float:
        """Insertion speed [m/s]."""

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m]."""

    @property
    def end(self) -> StepEnd:
        """The lateral state."""

    @property
    def steps(self) -> int:
        """How many steps were taken."""

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on."""

    def advance(self, until: float) -> str | None:
        """Go to a time [s]; returns why the run has ended before, None where it has not."""

    def passing_time(self, level: float) -> float:
        """Return when the tip will pass a depth [m] as things are [s]; infinity where it will not, or nobody knows."""

    def sample(self) -> Sample:
        """Return everything that is known of the present instant."""

    def sample_later(self) -> Callable[[], Sample]:
        """Return what gives that sample, also after the needle has gone on."""


def engine_of(plant: Plant, stepper: Stepper, time_step: float) -> Engine:
    """Return a needle at t = 0 that takes steps of at most ``time_step`` [s]."""
    if plant.scene.insertion.kind == "force" and isinstance(stepper, DynamicStepper):
        return PushEngine(plant, stepper, time_step)
    return PositionEngine(plant, stepper, time_step)


@dataclass(frozen=True)
class _Segment:
    """A stretch of time over which nothing has a kink: what acts, and until when."""

    stepper: Stepper
    law: Motion
    until: float


def _end(until: float, kink: float, time_step: float) -> float:
    """Return the nearer of two times, the kink where both are one."""
    return kink if kink <= until + SAME_TIME * time_step else until


class Kinks:
    """The times at which the scene itself has a kink, looked up further ahead as the run goes on: it may outlast the scene's."""

    def __init__(self, plant: Plant) -> None:
        self._plant, self._law = plant, depth_law(plant.scene)
        self._horizon, self._times = 0.0, np.zeros(0)

    def after(self, time: float) -> float:
        """Return the first kink after a time [s], infinity where none is near."""
        if time >= self._horizon:
            planned = run_duration(self._plant.scene)
            self._horizon = planned if time < planned else 4.0 * time
            found = landing_times(self._plant.scene, self._law, self._horizon, self._plant.smallest_depth)
            self._times = np.array([*found, self._horizon])
        return float(self._times[np.searchsorted(self._times, time, side="right")])


def _already(sample: Sample) -> Callable[[], Sample]:
    return lambda: sample


def _tip(end: StepEnd) -> float:
    return float(end.stage.points.deflections(end.solution.coordinates, end.solution.forces)[-1])


class PositionEngine:
    """A needle whose depth is prescribed, or follows a commanded speed."""

    has_works = True

    def __init__(self, plant: Plant, stepper: Stepper, time_step: float) -> None:
        scene = plant.scene
        self._base, self._time_step, self._inputs = stepper, time_step, Inputs(scene)
        self._law = depth_law(scene)
        self._kinks = Kinks(plant)
        self._levels = sorted({*interfaces(scene.tissue.layers), plant.smallest_depth} - {0.0})
        self._limits = run_limits(scene)
        self._march = started(plant, stepper, self._law)
        self._segment: _Segment | None = None
        self._crossings: dict[float, tuple[float, ...]] = {}
        self._steps = 0
        self._first = self._first_sample()
        self._march.land(time_step, counted=False)

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._march.time

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self._march.law.depth(self.time)

    @property
    def speed(self) -> float:
        """Insertion speed [m/s], just before the instant."""
        return self.end.stage.instant.speed

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m]."""
        return _tip(self.end)

    @property
    def end(self) -> StepEnd:
        """The lateral state."""
        return self._march.state

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return self._steps

    def sample(self) -> Sample:
        """Return everything that is known of the present instant."""
        return self._first if self._march.last is None else self._march.sample()

    def sample_later(self) -> Callable[[], Sample]:
        """Return what gives the sample of this instant."""
        return _already(self.sample())

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on."""
        if inputs is not self._inputs:
            self._inputs, self._segment = inputs, None

    def advance(self, until: float) -> str | None:
        """Go to a time [s]; a commanded speed ends the run where the needle cannot go further."""
        while until - self.time > SAME_TIME * self._time_step:
            if self._segment is None:
                self._segment = self._next_segment()
                reason = self._end_reason()
                if reason is not None:
                    return reason
                self._march.stepper, self._march.law = self._segment.stepper, self._segment.law
                self._march.land(min(until, self._segment.until), counted=True)
            end = _end(until, self._segment.until, self._time_step)
            self._go(end)
            if end == self._segment.until:
                self._segment = None
                reason = self._end_reason()
                if reason is not None:
                    return reason
        return None

    def passing_time(self, level: float) -> float:
        """Return when the tip will pass a depth [m] as things are [s]; infinity where it will not."""
        if "speed" in self._inputs.ramps:
            segment = self._segment or self._next_segment()
            return min(segment.law.passing_time(level), segment.until) if isinstance(segment.law, CommandedMotion) else inf
        if level not in self._crossings:
            self._crossings[level] = self._law.crossings(level, run_duration(self._march.plant.scene))
        return next((time for time in self._crossings[level] if time > self.time), inf)

    def _go(self, end: float) -> None:
        start = self.time
        count = max(1, ceil((end - start) / self._time_step - 1e-9))
        times = np.linspace(start, end, count + 1)[1:].tolist()
        times[-1] = end
        for time in times:
            self._march.step(time)
            self._steps += 1

    def _next_segment(self) -> _Segment:
        time, inputs = self.time, self._inputs
        scene = inputs.driven_scene(time)
        stepper: Any = replace(self._base, plant=Driven(self._base.plant, scene))  # type: ignore[type-var]
        landing = self._kinks.after(time + SAME_TIME * self._time_step)
        until = min(inputs.next_kink(time), landing)
        if "speed" not in inputs.ramps:
            return _Segment(stepper, self._law, until)
        ramp = inputs.ramps["speed"]
        levels = [*self._levels, 0.0, self._limits.contact]
        if scene.tissue.rest_line == "cut-path":  # from there on the needle cuts again
            levels.append(self._march.deepest)
        if self._limits.final_depth is not None and ramp.target > 0.0:
            levels.append(self._limits.final_depth)
        # At a level, and not a rounding before it, which would be passed again.
        slack = SAME_DEPTH * scene.needle.length
        depth = next((level for level in levels if abs(level - self.depth) <= slack), self.depth)
        motion = CommandedMotion(Instant(time, depth, ramp.value(time), ramp.slope(time)))
        until = min([until, motion.turning_time(), *(motion.passing_time(level) for level in levels)])
        return _Segment(stepper, motion, until)

    def _end_reason(self) -> str | None:
        """Return why a commanded speed ends the run here."""
        if "speed" not in self._inputs.ramps:
            return None
        ramp, depth, limits = self._inputs.ramps["speed"], self.depth, self._limits
        speed = ramp.value(self.time) or ramp.slope(self.time)
        slack = SAME_DEPTH * self._march.plant.scene.needle.length
        if limits.final_depth is not None and speed > 0.0 and abs(depth - limits.final_depth) <= slack:
            return "final-depth"
        if speed > 0.0 and depth >= limits.contact - slack:
            return limits.contact_reason
        return "withdrawn" if speed < 0.0 and depth <= slack else None

    def _first_sample(self) -> Sample:
        """Return the sample at t = 0 from a trial step under the scene's own inputs."""
        trial = replace(self._march)
        until = min(self._time_step, self._kinks.after(0.0))
        trial.land(until, counted=False)
        trial.step(until)
        return trial.sample(at_start=True)


class PushEngine:
    """A needle that is pushed by a force."""

    has_works = True

    def __init__(self, plant: Plant, stepper: DynamicStepper, time_step: float) -> None:
        scene = plant.scene
        self._base, self._inputs = stepper, Inputs(scene)
        self._time_step = min(time_step, shortest_period(scene) / STEPS_PER_PERIOD)
        self._kinks = Kinks(plant)
        self._march: PushMarching = started_push(plant, stepper, self._time_step)
        self._until = 0.0
        trial = replace(self._march)
        trial.advance(min(self._time_step, self._kinks.after(0.0)))
        self._first = trial.sample(at_start=True)
        begun = self._march.state if trial.last is None else replace(self._march.state, end=trial.last.ends[0])
        self._march.state, self._march.started = begun, True

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._march.time

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self._march.state.depth

    @property
    def speed(self) -> float:
        """Insertion speed [m/s]."""
        return self._march.state.speed

    @property
    def tip_deflection(self) -> float:
        """Lateral displacement of the tip [m]."""
        return _tip(self.end)

    @property
    def end(self) -> StepEnd:
        """The lateral state."""
        return self._march.state.end

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return self._march.steps

    def sample(self) -> Sample:
        """Return everything that is known of the present instant."""
        return self._march.sample() if self._march.steps else self._first

    def sample_later(self) -> Callable[[], Sample]:
        """Return what gives the sample of this instant."""
        return _already(self.sample())

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on."""
        if inputs is not self._inputs:
            self._inputs, self._until = inputs, self.time

    def advance(self, until: float) -> str | None:
        """Go to a time [s]; returns why the push ends before it, None where it goes on."""
        while until - self.time > SAME_TIME * self._time_step:
            if self.time >= self._until - SAME_TIME * self._time_step:
                self._drive()
            reason = self._go(_end(until, self._until, self._time_step))
            if reason is not None:
                return reason
        return None

    def _go(self, end: float) -> str | None:
        """Take equal steps to a time, shorter ones up to what happens on the way."""
        length = (end - self.time) / max(1, ceil((end - self.time) / self._time_step - 1e-9))
        while self.time < end:
            following = self.time + length
            reason = self._march.advance(end if end - following < SAME_TIME * length else following)
            # Whoever commands the push can push harder.
            if reason is not None and not (reason == "stuck" and "push_force" in self._inputs.ramps):
                return reason
        return None

    def passing_time(self, level: float) -> float:
        """Return infinity: where a push leads is not known before."""
        return inf

    def _drive(self) -> None:
        """Let what is commanded act from now until the next kink."""
        time = self.time
        stepper = replace(self._base, plant=Driven(self._base.plant, self._inputs.driven_scene(time)))
        self._march.pusher, self._march.landed = Pusher(stepper), True
        landing = self._kinks.after(time + SAME_TIME * self._time_step)
        self._until = min(self._inputs.next_kink(time), landing)
