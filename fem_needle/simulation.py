"""Run a scene or a plant from start to end: the only place where a run begins."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Generator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fem_needle.choices import Choice, choose, first_time_step
from fem_needle.collocation import collocation
from fem_needle.errors import ComputationError, SuspiciousValueWarning
from fem_needle.march import RunEnd, TimeGrid, march, time_grid
from fem_needle.mesh_file import mesh_positions
from fem_needle.modal_stepper import ModalStepper, needs_no_steps
from fem_needle.models import ChosenPlant, model_family
from fem_needle.plant import Plant
from fem_needle.pushed_march import march_pushed
from fem_needle.samples import Sample
from fem_needle.scene import Scene
from fem_needle.scene.settings import overriding
from fem_needle.skipping import inertia_free_stepper
from fem_needle.steppers import DynamicStepper, Inviscid, StaticStepper, Stepper
from fem_needle.trajectory import Trajectory, summary_of, trajectory_from_samples

MOST_HALVINGS = 8
TIME_SHARE = 0.5  # of the tolerance: what the time step may cost
RESIDUAL_SHARE = 0.01  # of the tolerance: the energy residual that automatic settings allow


class Observer(Protocol):
    """Somebody who watches a run: a progress bar, a writer of run folders."""

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Learn what is going to be computed."""

    def progress(self, fraction: float) -> None:
        """Learn how much of the run is done, 0 to 1; a refined run starts again."""

    def sample(self, sample: Sample) -> None:
        """Receive the next sample, once each; of a run that is being refined, when it is accurate enough."""


@dataclass(frozen=True)
class _Job:
    """A plant, the scene with the settings of this run, what was chosen, and who watches."""

    chosen: ChosenPlant
    scene: Scene
    choice: Choice
    observer: Observer
    started: float

    @property
    def plant(self) -> Plant:
        return self.chosen.plant


class _Nobody:
    """Watches nothing."""

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Ignore."""

    def progress(self, fraction: float) -> None:
        """Ignore."""

    def sample(self, sample: Sample) -> None:
        """Ignore."""


def run_scene(
    scene: Scene,
    *,
    model: str | None = None,
    modes: int | None = None,
    variant: str | None = None,
    basis: str | None = None,
    static_corrections: bool | None = None,
    elements: int | None = None,
    mesh: str | Path | ArrayLike | None = None,
    degree: int | None = None,
    time_step: float | None = None,
    tolerance: float | None = None,
    analysis: str | None = None,
    output_step: float | None = None,
    observer: Observer | None = None,
) -> Trajectory:
    """Run a scene as ``fem-needle run`` does.

    Parameters
    ----------
    scene
        What to run. Every other argument overrides its ``[model]`` or ``[numerics]`` value.
    model
        "fem", "assumed-modes" or another installed model.
    modes, variant, basis, static_corrections
        Of the assumed modes.
    elements, degree
        Mesh; default: chosen from the tolerance.
    mesh
        In place of elements: a mesh file, or the positions of the nodes from the hub to the tip [m].
    time_step
        Largest step [s]; default: chosen from the tolerance.
    tolerance
        Largest tip error over the run / largest |tip deflection|.
    analysis
        "auto", "dynamic", "quasi-static" or "static".
    output_step
        Time between samples [s].
    observer
        Receives each sample.

    Returns
    -------
    Trajectory
        On an interrupt, of what was computed, with ``summary["stop_reason"] == "interrupted"``.

    Raises
    ------
    SceneError
        If a setting is impossible.
    ComputationError
        If a step fails; ``error.partial`` holds the trajectory so far, or None.
    """
    values = {
        "model.kind": model,
        "model.modes": modes,
        "model.variant": variant,
        "model.basis": basis,
        "model.static_corrections": static_corrections,
        "numerics.elements": elements,
        "numerics.mesh": None if mesh is None else mesh_positions(mesh).tolist(),
        "numerics.degree": degree,
        "numerics.time_step": time_step,
        "numerics.tolerance": tolerance,
        "numerics.analysis": analysis,
        "numerics.output_step": output_step,
    }
    scene = scene.with_values(overriding({path: value for path, value in values.items() if value is not None}))
    started = clock.perf_counter()
    family = model_family(scene.model.kind)
    choice = choose(scene, lambda: family.pilot(scene))
    return _run(_Job(family.choose(scene, choice.analysis), scene, choice, observer or _Nobody(), started))


def simulate(
    plant: Plant,
    *,
    time_step: float | Literal["auto"] | None = None,
    analysis: str | None = None,
    output_step: float | None = None,
    tolerance: float | None = None,
    observer: Observer | None = None,
) -> Trajectory:
    """Run a plant through its scene; arguments and errors as in `run_scene`."""
    values = {
        "numerics.time_step": time_step,
        "numerics.analysis": analysis,
        "numerics.output_step": output_step,
        "numerics.tolerance": tolerance,
    }
    scene = plant.scene.with_values({path: value for path, value in values.items() if value is not None})
    started = clock.perf_counter()
    choice = choose(scene, lambda: plant)
    return _run(_Job(ChosenPlant(plant, None), scene, choice, observer or _Nobody(), started))


def _run(job: _Job) -> Trajectory:
    """Run with the given step, or with steps that are halved until two runs agree."""
    for message in job.plant.warnings:
        warnings.warn(message, SuspiciousValueWarning, stacklevel=3)
    given, analysis = job.scene.numerics.time_step, job.choice.analysis
    if isinstance(given, float):
        return _run_live(job, given, None)
    stepper = _stepper(job)
    if isinstance(stepper, ModalStepper):
        return _run_live(job, job.choice.output_step, 0.0)
    step = first_time_step(job.plant, analysis, job.choice.output_step)
    if isinstance(stepper, StaticStepper):
        return _run_live(job, step, 0.0)
    return _run_refined(job, step)


def _run_live(job: _Job, time_step: float, time_error: float | None) -> Trajectory:
    """Run once; the observer sees each sample as it comes."""
    grid = time_grid(job.plant, time_step, job.choice.output_step)
    _begin(job, grid)
    samples: list[Sample] = []
    end = _collect(job, grid, samples, live=True)
    return _trajectory(job, grid, samples, time_error, end)


def _run_refined(job: _Job, time_step: float) -> Trajectory:
    """Halve the step until tips and energy ledger agree with the tolerance; then show the samples."""
    grid = time_grid(job.plant, time_step, job.choice.output_step)
    _begin(job, grid)
    coarser: Trajectory | None = None
    for _ in range(MOST_HALVINGS + 1):
        samples: list[Sample] = []
        end = _collect(job, grid, samples, live=False)
        run = _trajectory(job, grid, samples, None, end)
        if end.reason == "interrupted":
            break
        if coarser is not None:
            error = _difference(coarser, run)
            run.summary["error_estimate"] = _total(job, error)
            if _is_accurate(job, error, run):
                break
        coarser, grid = run, replace(grid, time_step=_largest_step(grid) / 2)
    else:
        run.summary["warnings"].append(
            f"the tolerance {job.scene.numerics.tolerance:g} was not reached with {run.summary['steps']} steps: "
            "see error_estimate and relative_energy_residual"
        )
    return _shown(job, run, samples)


def _shown(job: _Job, run: Trajectory, samples: list[Sample]) -> Trajectory:
    """Show finished samples to the observer; an interrupt while it writes leaves the run whole."""
    try:
        for sample in samples:
            job.observer.sample(sample)
    except KeyboardInterrupt:
        run.summary["stop_reason"] = "interrupted"
    return run


def _is_accurate(job: _Job, error: float, run: Trajectory) -> bool:
    tolerance = job.scene.numerics.tolerance
    residual = run.summary["relative_energy_residual"]
    return error <= TIME_SHARE * tolerance and residual <= RESIDUAL_SHARE * tolerance


def _difference(coarser: Trajectory, finer: Trajectory) -> float:
    """Return the largest tip difference of two runs relative to the largest tip: a bound on the finer one's error."""
    scale = max(float(np.max(np.abs(finer.tip_deflection))), finer.scene.numerics.absolute_tolerance)
    common = min(len(coarser.time), len(finer.time)) - 1  # a push may end at slightly different times
    last = abs(float(coarser.tip_deflection[-1] - finer.tip_deflection[-1]))
    before = np.abs(coarser.tip_deflection[:common] - finer.tip_deflection[:common])
    return max(last, float(np.max(before, initial=0.0))) / scale


def _stepper(job: _Job) -> Stepper:
    if job.choice.analysis == "dynamic":
        if job.scene.numerics.time_step == "auto" and needs_no_steps(job.plant.scene):
            return ModalStepper(job.plant)
        return DynamicStepper(job.plant, collocation(_spectral_radius(job)))
    if job.choice.analysis == "static":
        return StaticStepper(Inviscid(job.plant))
    return inertia_free_stepper(job.plant)


def _spectral_radius(job: _Job) -> float:
    """Return the scene's, lowered where the plant needs it to stay stable while it moves."""
    asked = job.scene.numerics.spectral_radius
    lowest, highest = job.scene.insertion.depth_range(job.scene.duration)
    moves = highest > lowest or job.scene.insertion.kind == "force"
    return min(asked, job.plant.largest_spectral_radius) if moves else asked


def _warnings(job: _Job) -> list[str]:
    found = [*job.plant.warnings, *job.chosen.warnings]
    radius, asked = _spectral_radius(job), job.scene.numerics.spectral_radius
    if job.choice.analysis == "dynamic" and radius < asked:
        found.append(
            f"numerics.spectral_radius = {asked:g} > {radius:g}, with which this model stays stable while it moves: "
            f"{radius:g} is used"
        )
    return found


def _begin(job: _Job, grid: TimeGrid) -> None:
    job.observer.begin(job.plant, _settings(job, grid) | {"output_times": grid.outputs})


def _march(job: _Job, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    stepper = _stepper(job)
    if job.scene.insertion.kind == "force" and isinstance(stepper, DynamicStepper):
        return march_pushed(job.plant, stepper, grid)
    return march(job.plant, stepper, grid)


def _collect(job: _Job, grid: TimeGrid, samples: list[Sample], *, live: bool) -> RunEnd:
    """Append the samples of a run and return how it ended.

    Raises
    ------
    ComputationError
        With ``partial``, the trajectory so far.
    """
    try:
        marching = _march(job, grid)
        while True:
            try:
                sample = next(marching)
            except StopIteration as finished:
                return finished.value
            samples.append(sample)
            job.observer.progress(sample.time / grid.outputs[-1])
            if live:
                job.observer.sample(sample)
    except KeyboardInterrupt:
        if not samples:
            raise
        return RunEnd("interrupted", grid.steps)
    except ComputationError as error:
        if not live:
            for sample in samples:
                job.observer.sample(sample)
        error.partial = _trajectory(job, grid, samples, None, RunEnd("failed", grid.steps)) if samples else None
        raise


def _trajectory(job: _Job, grid: TimeGrid, samples: list[Sample], time_error: float | None, end: RunEnd) -> Trajectory:
    now = clock.perf_counter()
    run = trajectory_from_samples(job.plant, samples, {}, job.scene)
    estimate = None if time_error is None else _total(job, time_error)
    run.summary.update(
        _settings(job, grid)
        | summary_of(run)
        | {
            "error_estimate": estimate,
            "warnings": _warnings(job),
            "stop_reason": end.reason,
            "steps": end.steps,
            "solve_time": now - job.started,
            "wall_time": now - job.started,
        }
    )
    return run


def _settings(job: _Job, grid: TimeGrid) -> dict[str, Any]:
    return job.plant.describe() | {
        "analysis": job.choice.analysis,
        "time_step": _largest_step(grid),
        "steps": grid.steps,
        "skipped": [asdict(skipped) for skipped in job.choice.skipped],
    }


def _largest_step(grid: TimeGrid) -> float:
    return max((end - start) / count for start, end, count in grid.intervals())


def _total(job: _Job, time_error: float) -> float | None:
    """Return the sum of the estimated errors: time step, mesh, left-out inertia; None where the mesh was not checked."""
    error = job.chosen.error
    return None if error is None else time_error + error + job.choice.inertia_error
