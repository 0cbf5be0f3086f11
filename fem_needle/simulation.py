"""Run a scene or a plant from start to end: the only place where a run begins."""

from __future__ import annotations

import time as clock
import warnings
from pathlib import Path
from typing import Literal

from numpy.typing import ArrayLike

from fem_needle.choices import choose, first_time_step
from fem_needle.dynamics.engine import REST
from fem_needle.dynamics.run import VIBRATION
from fem_needle.errors import SceneError, SuspiciousValueWarning
from fem_needle.mesh_file import mesh_positions
from fem_needle.models import ChosenPlant, model_family
from fem_needle.plant import Plant
from fem_needle.refined_run import run_refined
from fem_needle.run_job import Job, Nobody, Observer, integration, run_live
from fem_needle.scene import Scene
from fem_needle.scene.settings import overriding, refuse_idle
from fem_needle.threads import one_thread
from fem_needle.trajectory import Trajectory

ROUNDING_MARGIN = 2.0  # times the round-off: the smallest tolerance that is attempted

@one_thread
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
        Of the assumed modes; refused where the model is "fem", which has none (``variant`` makes it fixed-frame).
    elements, degree
        Mesh; default: chosen from the tolerance.
    mesh
        In place of elements: a mesh file, or the positions of the nodes from the hub to the tip [m].
    time_step
        Largest step [s]; default: chosen from the tolerance.
    tolerance
        Largest tip error over the run / largest magnitude of the tip deflection.
    analysis
        "auto", "dynamic", "quasi-static" or "static".
    output_step
        Time between samples [s].
    observer
        Is told the samples, a few at a time, while they are computed (`fem_needle.run_job.Observer`).

    Returns
    -------
    Trajectory
        On an interrupt, of what was computed, with ``summary["stop_reason"] == "interrupted"``.

    Raises
    ------
    SceneError
        If a setting is impossible, or the tolerance below what double precision keeps.
    ComputationError
        If a step fails, or the steps that the tolerance needs would lose more to rounding than it allows; ``error.partial``
        holds the trajectory so far, or None.
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
    refuse_idle(scene.model.kind, values)
    started = clock.perf_counter()
    family = model_family(scene.model.kind)
    choice = choose(scene, lambda: family.pilot(scene))
    chosen = family.choose(scene, choice.analysis)
    _refuse_rounding(scene, chosen)
    return _run(Job(chosen, scene, choice, observer or Nobody(), started))


@one_thread
def simulate(
    plant: Plant,
    *,
    time_step: float | Literal["auto"] | None = None,
    analysis: str | None = None,
    output_step: float | None = None,
    tolerance: float | None = None,
    observer: Observer | None = None,
) -> Trajectory:
    """Run a plant through its scene; arguments and errors as in `run_scene`.

    Parameters
    ----------
    plant
        Of any model; its scene says what happens.
    time_step, output_step
        [s].
    analysis
        ``"dynamic"``, ``"quasi-static"`` or ``"static"``.
    tolerance
        Largest tip error over the run / largest magnitude of the tip deflection.
    observer
        Is told the samples, a few at a time, while they are computed (`fem_needle.run_job.Observer`).
    """
    values = {
        "numerics.time_step": time_step,
        "numerics.analysis": analysis,
        "numerics.output_step": output_step,
        "numerics.tolerance": tolerance,
    }
    scene = plant.scene.with_values({path: value for path, value in values.items() if value is not None})
    started = clock.perf_counter()
    choice = choose(scene, lambda: plant)
    return _run(Job(ChosenPlant(plant, None), scene, choice, observer or Nobody(), started))


def _refuse_rounding(scene: Scene, chosen: ChosenPlant) -> None:
    """Refuse a tolerance that rounding alone would miss.

    Raises
    ------
    SceneError
        With the smallest tolerance that can be met.
    """
    smallest = ROUNDING_MARGIN * chosen.round_off
    if smallest > scene.numerics.tolerance:
        raise SceneError(
            f"numerics.tolerance: less than double precision keeps of this needle's tip (got {scene.numerics.tolerance:g}; "
            f"allowed from {smallest:.1e} on)"
        )


def _run(job: Job) -> Trajectory:
    """Run with the given step, or with steps chosen from the differences of trial runs."""
    for message in job.plant.warnings:
        warnings.warn(message, SuspiciousValueWarning, stacklevel=4)
    given, analysis = job.scene.numerics.time_step, job.choice.analysis
    if isinstance(given, float):
        return run_live(job, given, None)
    kind = integration(job).kind
    if kind == VIBRATION:
        return run_live(job, job.choice.output_step, 0.0)
    if kind == REST:
        return run_live(job, first_time_step(job.plant, analysis, job.choice.output_step), 0.0)
    return run_refined(job)
