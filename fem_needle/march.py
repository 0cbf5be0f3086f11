"""The loop over time: steps between landing times, works added up, a sample at every output time."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil

import numpy as np

from fem_needle import axial
from fem_needle.banded import SingularMatrixError
from fem_needle.errors import ComputationError
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd, Works, energies, force_jump_work, jump_works, row_correction, step_works
from fem_needle.motion import DepthLaw, depth_law, landing_times, run_duration
from fem_needle.plant import Plant
from fem_needle.samples import Sample, sample_step
from fem_needle.scene import Scene
from fem_needle.stages import trivial_solution
from fem_needle.steppers import Step, Stepper


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
    landings = landing_times(plant.scene, depth_law(plant.scene), duration, plant.smallest_depth)
    outputs = output_times(duration, output_step)
    # An output within round-off of a landing is moved onto it: no steps of 1e-17 s, no kink inside a step.
    outputs = tuple(_snapped(time, landings, 1e-12 * duration) for time in outputs)
    return TimeGrid(outputs, landings, time_step)


def _snapped(time: float, landings: tuple[float, ...], distance: float) -> float:
    return next((landing for landing in landings if abs(landing - time) <= distance), time)


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
    law, inertia = depth_law(plant.scene), stepper.inertia
    state, works, last = initial_state(stepper.plant, law), Works(), None
    landings, outputs = set(grid.landings) | {0.0}, set(grid.outputs)
    deepest = law.depth(0.0)
    for start, end, count in grid.intervals():
        times = np.linspace(start, end, count + 1)
        times[-1] = end
        for time, until in pairwise(times.tolist()):
            if time in landings:
                state, work = pass_landing(plant, stepper, law, state, time, until)
                works = works if time == 0.0 else works + work
            step = _advance(plant, stepper, law, state, until, last)
            if time == 0.0:
                yield sample_step(plant, step, works, deepest, law.depth(0.0), at_start=True, inertia=inertia)
            works = works + row_change(last, step, landed=time in landings, inertia=inertia)
            works = works + _works_of(plant, stepper, step, deepest)
            state, last, deepest = step.ends[1], step, max(deepest, law.depth(until))
        if end in outputs:
            shown = works + row_correction(step, inertia=inertia, at_start=False)
            yield sample_step(plant, step, shown, deepest, law.depth(end), at_start=False, inertia=inertia)
    return RunEnd("final-depth" if ends_by_itself(plant.scene) else "duration", grid.steps)


def ends_by_itself(scene: Scene) -> bool:
    """Return whether a position-driven run ends where its insertion does."""
    return scene.run.duration is None and scene.insertion.final_depth is not None


def pass_landing(
    plant: Plant, stepper: Stepper, law: DepthLaw, before: StepEnd, time: float, until: float
) -> tuple[StepEnd, Works]:
    """Return the state just after a kink and what the kink did; a needle that leaves the tissue leaves its energy."""
    if law.depth(0.5 * (time + until)) < plant.smallest_depth:
        solution = before.solution
        held = energies(before.stage, solution, inertia=stepper.inertia).total
        dropped = trivial_solution(plant, before.stage)
        return StepEnd(before.stage, dropped), Works(boundary_energy=-held)
    after = stepper.start(law, time, until, before)
    return after, jump_works(before, after) if stepper.inertia else force_jump_work(before, after)


def _advance(plant: Plant, stepper: Stepper, law: DepthLaw, state: StepEnd, until: float, last: Step | None) -> Step:
    time = state.stage.instant.time
    try:
        step = stepper.advance(law, state, until, last)
    except (SingularMatrixError, np.linalg.LinAlgError, FloatingPointError) as error:
        raise failed_step(time, law.depth(time), str(error)) from error
    if not np.all(np.isfinite(step.ends[1].solution.coordinates)):
        raise failed_step(time, law.depth(time), "the deflection is not finite")
    return step


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


def _works_of(plant: Plant, stepper: Stepper, step: Step, deepest: float) -> Works:
    works = step_works(step, inertia=stepper.inertia)
    friction = cutting = 0.0
    for weight, stage in zip(step.method.weights * step.length, step.stages, strict=True):
        depth, speed = stage.instant.depth, stage.instant.speed
        friction += weight * speed * axial.friction_force(plant.scene, depth, speed)
        cutting += weight * speed * axial.cutting_force(plant.scene, depth, speed, deepest)
    return replace(works, friction_dissipation=friction, cutting_work=cutting)
