"""The loop over time: steps between landing times, works added up, a sample at every output time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil

import numpy as np

from fem_needle import axial
from fem_needle.banded import SingularMatrixError
from fem_needle.errors import ComputationError
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd, Works, energies, landing_works, row_correction, step_works
from fem_needle.limits import check_samples, check_steps
from fem_needle.motion import DepthLaw, Motion, depth_law, landing_times, run_duration
from fem_needle.plant import Plant
from fem_needle.samples import Sample, sample_step
from fem_needle.scene import Scene
from fem_needle.stages import trivial_solution
from fem_needle.steppers import Step, Stepper

AT_ONCE = 4096  # times


@dataclass(frozen=True)
class TimeGrid:
    """Times of a run [s].

    Attributes
    ----------
    outputs
        Times of the samples, 0 and the end included.
    landings
        Times at which something has a kink; a step ends there.
    time_step
        Largest step.
    """

    outputs: tuple[float, ...]
    landings: tuple[float, ...]
    time_step: float

    def intervals(self) -> Iterator[tuple[float, float, int]]:
        """Yield (start, end, steps) between successive outputs and landings."""
        marks = sorted({*self.outputs, *self.landings})
        for start, end in pairwise(marks):
            yield start, end, max(1, ceil((end - start) / self.time_step - 1e-9))

    def has_landing(self, time: float, distance: float) -> bool:
        """Return whether there is a landing within a distance of a time [s]."""
        first = bisect_left(self.landings, time - distance)
        return first < len(self.landings) and self.landings[first] <= time + distance

    @property
    def steps(self) -> int:
        """Number of steps."""
        return sum(count for _, _, count in self.intervals())


def output_times(duration: float, output_step: float) -> tuple[float, ...]:
    """Return 0, S, 2 S, ... and the end [s]."""
    count = int(np.floor(duration / output_step * (1 + 1e-12)))
    times = [index * output_step for index in range(count + 1)]
    if times[-1] > duration * (1 - 1e-12):
        times[-1] = duration
    else:
        times.append(duration)
    return tuple(times)


def time_grid(plant: Plant, time_step: float, output_step: float) -> TimeGrid:
    """Return the times of a scene's run."""
    duration = run_duration(plant.scene)
    check_steps(duration, time_step)
    check_samples(duration, output_step, plant.size, plant.scene.numerics.output_points)
    landings = landing_times(plant.scene, depth_law(plant.scene), duration, plant.smallest_depth)
    outputs = output_times(duration, output_step)
    # An output within round-off of a landing is moved onto it: no steps of 1e-17 s, no kink inside a step.
    outputs = tuple(_snapped(time, landings, 1e-12 * duration) for time in outputs)
    return TimeGrid(outputs, landings, time_step)


def _snapped(time: float, landings: tuple[float, ...], distance: float) -> float:
    first = bisect_left(landings, time - distance)
    return landings[first] if first < len(landings) and landings[first] <= time + distance else time


def equal_times(start: float, end: float, count: int) -> Iterator[float]:
    """Yield ``count`` + 1 equally spaced times, those of `numpy.linspace` to the last bit; never all in memory."""
    step = (end - start) / count
    for first in range(0, count, AT_ONCE):
        yield from (np.arange(first, min(first + AT_ONCE, count)) * step + start).tolist()
    yield end


@dataclass(frozen=True)
class RunEnd:
    """Why a run ended, and after how many steps."""

    reason: str
    steps: int


def march(plant: Plant, stepper: Stepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Yield a sample at each output time; the generator's value says how the run ended.

    Raises
    ------
    ComputationError
        If a step cannot be solved or gives numbers that are not finite; says at which time and depth.
    """
    law, landings, outputs = depth_law(plant.scene), set(grid.landings) | {0.0}, set(grid.outputs)
    run = started(plant, stepper, law)
    for start, end, count in grid.intervals():
        for time, until in pairwise(equal_times(start, end, count)):
            if time in landings:
                run.land(until, counted=time > 0.0)
            run.step(until)
            if time == 0.0:
                yield run.sample(at_start=True)
        if end in outputs:
            yield run.sample()
    return RunEnd("final-depth" if ends_by_itself(plant.scene) else "duration", grid.steps)


@dataclass
class Marching:
    """A position-driven run between two steps; whoever closes a loop changes stepper and law where something is commanded.

    Attributes
    ----------
    plant
        The model with its inertia.
    stepper, law
        How it steps, and the motion that it follows.
    state, last
        The needle now, and the step that led there (None at the start).
    works
        Since the start, without the correction at the end of a row of steps.
    deepest, start_depth
        The deepest depth so far, and that at the start [m].
    landed
        Whether the next step begins at a kink.
    """

    plant: Plant
    stepper: Stepper
    law: Motion
    state: StepEnd
    works: Works
    deepest: float
    start_depth: float
    last: Step | None = None
    landed: bool = False

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.state.stage.instant.time

    def land(self, until: float, *, counted: bool) -> None:
        """Pass a kink in front of a step to a time; what it did enters the works where it is ``counted``."""
        self.state, work = pass_landing(self.plant, self.stepper, self.law, self.state, self.time, until)
        self.works = self.works + work if counted else self.works
        self.landed = True

    def step(self, until: float) -> None:
        """Advance to a time."""
        inertia = self.stepper.inertia
        step = _advance(self.plant, self.stepper, self.law, self.state, until, self.last)
        self.works = self.works + row_change(self.last, step, landed=self.landed, inertia=inertia)
        self._add_works(step)
        self.state, self.last, self.landed = step.ends[1], step, False
        self.deepest = max(self.deepest, self.law.depth(until))

    def sample(self, *, at_start: bool = False) -> Sample:
        """Return the sample after the last step, or in front of it, where it was the first one."""
        if self.last is None:
            raise ComputationError("there is no sample before the first step")
        inertia, works, depth, deepest = self.stepper.inertia, Works(), self.start_depth, self.start_depth
        if not at_start:
            works = self.works + row_correction(self.last, inertia=inertia, at_start=False)
            depth, deepest = self.law.depth(self.time), self.deepest
        return sample_step(self.plant, self.last, works, deepest, depth, at_start=at_start, inertia=inertia)

    def _add_works(self, step: Step) -> None:
        works = step_works(step, inertia=self.stepper.inertia)
        friction, scene = 0.0, self.plant.scene
        for weight, stage in zip(step.method.weights * step.length, step.stages, strict=True):
            depth, speed = stage.instant.depth, stage.instant.speed
            friction += weight * speed * axial.friction_force(scene, depth, speed)
        reached = max(self.deepest, self.law.depth(step.ends[1].stage.instant.time))
        cutting = float(axial.cutting_work(scene, self.deepest, np.array(reached)))
        self.works = self.works + replace(works, friction_dissipation=friction, cutting_work=cutting)


def started(plant: Plant, stepper: Stepper, law: DepthLaw) -> Marching:
    """Return a run at t = 0."""
    depth = law.depth(0.0)
    return Marching(plant, stepper, law, initial_state(stepper.plant, law), Works(), depth, depth)


def ends_by_itself(scene: Scene) -> bool:
    """Return whether a position-driven run ends where its insertion does."""
    return scene.run.duration is None and scene.insertion.final_depth is not None


def pass_landing(
    plant: Plant, stepper: Stepper, law: Motion, before: StepEnd, time: float, until: float
) -> tuple[StepEnd, Works]:
    """Return the state just after a kink and what the kink did; a needle that leaves the tissue leaves its energy."""
    if law.depth(0.5 * (time + until)) < plant.smallest_depth:
        solution = before.solution
        held = energies(before.stage, solution, inertia=stepper.inertia).total
        dropped = trivial_solution(plant, before.stage)
        return StepEnd(before.stage, dropped), Works(boundary_energy=-held)
    with failing_as_step(time, law.depth(time)):
        after = stepper.start(law, time, until, before)
    return after, landing_works(before, after, inertia=stepper.inertia)


def _advance(plant: Plant, stepper: Stepper, law: Motion, state: StepEnd, until: float, last: Step | None) -> Step:
    time = state.stage.instant.time
    with failing_as_step(time, law.depth(time)):
        step = stepper.advance(law, state, until, last)
    if not np.all(np.isfinite(step.ends[1].solution.coordinates)):
        raise failed_step(time, law.depth(time), "the deflection is not finite")
    return step


@contextmanager
def failing_as_step(time: float, depth: float) -> Iterator[None]:
    """Let failures of linear algebra say where they happened.

    Raises
    ------
    ComputationError
        In place of them.
    """
    try:
        yield
    except (SingularMatrixError, np.linalg.LinAlgError, FloatingPointError) as error:
        raise failed_step(time, depth, str(error)) from error


def failed_step(time: float, depth: float, what: str) -> ComputationError:
    """Return the error of a step from a time [s] and depth [m] that failed."""
    return ComputationError(
        f"the step at time {time:g} s, depth {depth:g} m failed: {what}; use a smaller time_step, or fewer elements"
    )


def row_change(last: Step | None, step: Step, *, landed: bool, inertia: bool) -> Works:
    """Return the corrections where one row of equal steps ends and another begins."""
    if last is None:
        return row_correction(step, inertia=inertia, at_start=True)
    if not landed and abs(last.length - step.length) <= 1e-9 * step.length:
        return Works()
    ended = row_correction(last, inertia=inertia, at_start=False)
    return ended + row_correction(step, inertia=inertia, at_start=True)
