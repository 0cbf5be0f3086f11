"""One computation of a run: who watches, which stepper, samples and summary."""

from __future__ import annotations

import time as clock
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol

import numpy as np

from fem_needle.choices import Choice
from fem_needle.dynamics.grid import RunEnd, TimeGrid, time_grid
from fem_needle.dynamics.parts import COSINES
from fem_needle.dynamics.run import VIBRATION, Integration, integration_of, run_samples, spectral_radius
from fem_needle.errors import ComputationError
from fem_needle.models import ChosenPlant
from fem_needle.motion import wanted_radius
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples, joined
from fem_needle.scene import Scene
from fem_needle.trajectory import Trajectory, energy_warnings, summary_of, trajectory_from_samples


class Observer(Protocol):
    """Somebody who watches a run: a progress bar, a writer of run folders."""

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Learn what is going to be computed."""

    def progress(self, fraction: float) -> None:
        """Learn how much of the run is done, 0 to 1; a refined run starts again."""

    def samples(self, block: Samples) -> None:
        """Receive the next samples, once each; of a run that is being refined, all together when they are accurate enough."""


@dataclass(frozen=True)
class Job:
    """A plant, the scene with the settings of this run, what was chosen, and who watches."""

    chosen: ChosenPlant
    scene: Scene
    choice: Choice
    observer: Observer
    started: float

    @property
    def plant(self) -> Plant:
        """The model that is run."""
        return self.chosen.plant


@dataclass(frozen=True, eq=False)
class Course:
    """In which steps a run was taken: another plant may take the same.

    Attributes
    ----------
    choice
        Analysis and parts of the run.
    grid
        Steps, and instants at which they are sampled.
    outputs
        Those that are shown.
    """

    choice: Choice
    grid: TimeGrid
    outputs: tuple[float, ...]

    def shown(self, samples: Samples) -> Samples:
        """Return the samples that are shown, and the last one."""
        wanted = np.isin(samples.time, self.outputs)
        wanted[-1] = True
        return samples.rows(wanted)


class Nobody:
    """Watches nothing."""

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Ignore."""

    def progress(self, fraction: float) -> None:
        """Ignore."""

    def samples(self, block: Samples) -> None:
        """Ignore."""


def run_live(job: Job, time_step: float, time_error: float | None) -> Trajectory:
    """Run once; the observer sees the samples as they come."""
    grid = time_grid(job.plant, time_step, job.choice.output_step)
    begin(job, grid)
    blocks: list[Samples] = []
    end = collect(job, grid, blocks, live=True)
    run = trajectory_of(job, grid, joined(blocks), time_error, end)
    return replace(run, course=Course(job.choice, grid, grid.outputs))


def run_along(plant: Plant, course: Course, scene: Scene) -> tuple[Trajectory, str]:
    """Run a plant in the steps of another run.

    Returns
    -------
    tuple
        The run, whose ``solve_time`` is that of the steps alone, and why it stopped before its end; empty where it did not.

    Raises
    ------
    ComputationError
        If it fails before its first sample.
    """
    job = Job(ChosenPlant(plant, None), scene, course.choice, Nobody(), clock.perf_counter())
    blocks, failure = list[Samples](), ""
    try:
        end = collect(job, course.grid, blocks, live=False)
    except ComputationError as error:
        if not blocks:
            raise
        end, failure = RunEnd("failed", course.grid.steps), str(error)
    seconds = clock.perf_counter() - job.started
    run = trajectory_of(job, course.grid, course.shown(joined(blocks)), None, end)
    run.summary["solve_time"] = seconds
    return run, failure


def shown(job: Job, run: Trajectory, samples: Samples) -> Trajectory:
    """Show finished samples to the observer; an interrupt while it writes leaves the run whole."""
    try:
        job.observer.samples(samples)
    except KeyboardInterrupt:
        run.summary["stop_reason"] = "interrupted"
    return run


def integration(job: Job) -> Integration:
    """Return how the needle gets from one time to the next."""
    parts = job.choice.parts
    if parts[0].how == COSINES:
        return Integration(VIBRATION)
    return replace(integration_of(job.plant, job.scene, job.choice.analysis), parts=parts)


def _warnings(job: Job) -> list[str]:
    found = [*job.plant.warnings, *job.chosen.warnings]
    radius, asked = spectral_radius(job.plant, job.scene), wanted_radius(job.scene)
    if job.choice.analysis == "dynamic" and radius < asked:
        found.append(
            f"numerics.spectral_radius = {asked:g} > {radius:g}, with which this model stays stable while it moves: "
            f"{radius:g} is used"
        )
    return found


def begin(job: Job, grid: TimeGrid) -> None:
    """Tell the observer what is going to be computed."""
    job.observer.begin(job.plant, _settings(job, grid) | {"output_times": grid.outputs})


def collect(job: Job, grid: TimeGrid, blocks: list[Samples], *, live: bool) -> RunEnd:
    """Append the samples of a run, block by block, and return how it ended.

    Raises
    ------
    ComputationError
        With ``partial``, the trajectory so far.
    """
    try:
        marching = run_samples(job.plant, integration(job), grid)
        while True:
            try:
                block = next(marching)
            except StopIteration as finished:
                if blocks and blocks[-1].time[-1] < grid.outputs[-1]:
                    job.observer.progress(1.0)  # it ended before its time
                return finished.value
            blocks.append(block)
            job.observer.progress(float(block.time[-1]) / grid.outputs[-1])
            if live:
                job.observer.samples(block)
    except KeyboardInterrupt:
        if not blocks:
            raise
        return RunEnd("interrupted", grid.steps)
    except ComputationError as error:
        end = RunEnd("failed", grid.steps)
        error.partial = trajectory_of(job, grid, joined(blocks), None, end) if blocks else None
        raise


def trajectory_of(job: Job, grid: TimeGrid, samples: Samples, time_error: float | None, end: RunEnd) -> Trajectory:
    """Return samples and summary; ``time_error`` is what the steps are estimated to cost, None where nobody knows."""
    now = clock.perf_counter()
    run = trajectory_from_samples(job.plant, samples, {}, job.scene)
    estimate = None if time_error is None else total_error(job, time_error)
    run.summary.update(
        _settings(job, grid)
        | summary_of(run)
        | {
            "error_estimate": estimate,
            "warnings": [*_warnings(job), *energy_warnings(run)],
            "stop_reason": end.reason,
            "steps": end.steps,
            "step_unknowns": end.steps * job.plant.size,
            "solve_time": now - job.started,
            "wall_time": now - job.started,
        }
    )
    return run


def _settings(job: Job, grid: TimeGrid) -> dict[str, Any]:
    return job.plant.describe() | {
        "analysis": job.choice.analysis,
        "time_step": grid.largest_step,
        "steps": grid.steps,
        "skipped": [asdict(skipped) for skipped in job.choice.skipped],
        "parts": [asdict(part) for part in job.choice.parts],
    }


def total_error(job: Job, time_error: float) -> float | None:
    """Return the sum of the estimated errors: time step, mesh, left-out inertia; None where the mesh was not checked."""
    error = job.chosen.error
    return None if error is None else time_error + error + job.choice.inertia_error
