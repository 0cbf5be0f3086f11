"""Many runs at once: tips over time, for scenes or for arrays of a scene's values."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.batch import columns as at
from fem_needle.batch.rows import can_vary, depths_of, row_of, rows_of, times_of
from fem_needle.batch.spectrum import Spectrum, is_uniform, spectrum_of
from fem_needle.choices import choose
from fem_needle.collocation import collocation
from fem_needle.display import Card, Shown, in_millimeters
from fem_needle.dynamics.grid import time_grid
from fem_needle.dynamics.run import integration_of, run_samples
from fem_needle.errors import ComputationError, SceneError
from fem_needle.models import build_plant
from fem_needle.sample_arrays import Samples, joined
from fem_needle.scene import Scene
from fem_needle.simulation import run_scene
from fem_needle.threads import one_thread

Array = NDArray[np.float64]
Progress = Callable[[float], None]

PIECES = 16  # of the work, for each core
STEPS_PER_PERIOD = 12  # of the loads, to begin with
MOST_LEVELS = 9
FIRST = (12, 4)  # elements and moving vibrations to begin with
LAST = (96, 32)


@dataclass(frozen=True, eq=False, repr=False)
class ManyRuns(Shown):
    """What many runs have computed; SI.

    Attributes
    ----------
    time, depth, tip_deflection
        A row for each run, a column for each of its outputs (runs, outputs); NaN after a run's end.
    error_estimate
        Largest estimated tip error of all runs, relative to the run's largest tip deflection; NaN where settings are given.
    steps
        Time steps of all runs together.
    """

    time: Array
    depth: Array
    tip_deflection: Array
    error_estimate: float
    steps: int

    def _card(self) -> Card:
        tips = self.final_tip_deflection
        spread = f"{in_millimeters(float(np.min(tips)))} to {in_millimeters(float(np.max(tips)))}" if len(self) else "none"
        facts = (
            ("runs", str(len(self))),
            ("outputs", str(self.time.shape[1])),
            ("tips at the end", spread),
            ("steps", str(self.steps)),
            ("error estimate", f"{self.error_estimate:.1e}"),
        )
        return Card("ManyRuns", "", facts)

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.time)

    @property
    def final_tip_deflection(self) -> Array:
        """Tip deflection at each run's end [m] (runs,)."""
        last = np.sum(np.isfinite(self.time), axis=1) - 1
        return self.tip_deflection[np.arange(len(last)), last]


@one_thread
def simulate_many(
    scenes: Scene | Sequence[Scene],
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    time_step: float | None = None,
    vibrations: int | None = None,
    cores: int | None = None,
    progress: Progress | None = None,
) -> ManyRuns:
    """Compute the tips of many runs.

    Parameters
    ----------
    scenes
        Scenes, or one scene whose values ``parameters`` vary.
    parameters
        Arrays of equal length by path, one value for each run: ``{"loads.0.force": forces, "insertion.speed": speeds}``.
    time_step
        Largest step [s] of all runs; default: what each scene says, or what its tolerance needs.
    vibrations
        Number of moving vibrations of uniform runs; default: doubled, with halved steps, until all runs agree to half the first
        scene's tolerance.
    cores
        How many to use; default: all.
    progress
        Is told which fraction of the runs is done; from 0 again where they are computed with finer settings.

    Returns
    -------
    ManyRuns
        In the order of the scenes, the same whatever the number of cores.

    Raises
    ------
    SceneError
        If a path or a value is impossible, or there is nothing to compute.

    Notes
    -----
    Runs of the uniform kind (support ``entry``, one layer, constant speed, tip forces that are constant or a sinusoid) that share
    needle length and model go through one compiled loop, without any Python for a run. All others are run one by one, in as many
    threads as there are cores: as they are where a scene gives its mesh and its time step, as `run_scene` runs them where these
    are to be chosen.
    """
    told = progress or _nobody
    workers = cores or os.cpu_count() or 1
    if isinstance(scenes, Scene):
        given = parameters or {}
        if is_uniform(scenes) and can_vary(scenes, list(given)):
            return _compiled(scenes, rows_of(scenes, given), time_step, vibrations, workers, told)
        return _one_by_one(_stepped(_varied(scenes, given), time_step), workers, told)
    if parameters is not None:
        raise SceneError("parameters: vary one scene (got several; allowed one scene with parameters, or scenes alone)")
    many = list(scenes)
    if not many:
        raise SceneError("scenes: nothing to compute (got 0; allowed 1 or more)")
    if all(is_uniform(scene) and _shares(scene, many[0]) for scene in many):
        return _compiled(many[0], np.array([row_of(scene) for scene in many]), time_step, vibrations, workers, told)
    return _one_by_one(_stepped(many, time_step), workers, told)


def _nobody(fraction: float) -> None:
    """Tell nobody."""


def _stepped(scenes: list[Scene], time_step: float | None) -> list[Scene]:
    return scenes if time_step is None else [scene.with_value("numerics.time_step", time_step) for scene in scenes]


def _shares(scene: Scene, first: Scene) -> bool:
    return scene.model == first.model and scene.needle.length == first.needle.length


def _varied(scene: Scene, parameters: Mapping[str, ArrayLike]) -> list[Scene]:
    columns = {path: np.atleast_1d(np.asarray(values, dtype=float)).tolist() for path, values in parameters.items()}
    counts = sorted({len(values) for values in columns.values()})
    if len(counts) > 1:
        raise SceneError(f"parameters: as many values each (got {counts}; allowed one number of them)")
    return [scene.with_values(dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)] or [scene]


def _compiled(
    scene: Scene, rows: Array, time_step: float | None, vibrations: int | None, cores: int, progress: Progress
) -> ManyRuns:
    """Compute uniform runs, with finer and finer settings where none are given."""
    times = times_of(rows)
    elements, moving = FIRST
    step = min(float(np.min(rows[:, at.OUTPUT_STEP])), _shortest_period(rows) / STEPS_PER_PERIOD)
    is_given = time_step is not None and vibrations is not None
    coarser, estimate = None, np.nan
    for _ in range(MOST_LEVELS):
        spectrum = _spectrum(scene, LAST[0] if is_given else elements, moving if vibrations is None else vibrations)
        tips, steps = _tips(rows, times, spectrum, step if time_step is None else time_step, cores, progress)
        if is_given:
            break
        if coarser is not None:
            estimate = _difference(coarser, tips)
            if estimate <= 0.5 * scene.numerics.tolerance:
                break
        coarser, step = tips, step / 2
        elements, moving = min(2 * elements, LAST[0]), min(2 * moving, LAST[1])
    return ManyRuns(times, depths_of(rows, times), tips, estimate, steps)


def _shortest_period(rows: Array) -> float:
    """Return the shortest period [s] of all runs' forces, infinity where none swings."""
    fastest = float(np.max(np.abs(rows[:, at.FREQUENCY]) * (rows[:, at.AMPLITUDE] != 0.0)))
    return 2 * np.pi / fastest if fastest else np.inf


def _difference(coarser: Array, finer: Array) -> float:
    """Return the largest difference of two tips of a run, relative to its largest tip deflection."""
    scale = np.nanmax(np.abs(finer), axis=1)
    return float(np.max(np.nanmax(np.abs(coarser - finer), axis=1) / np.where(scale > 0.0, scale, 1.0)))


def _spectrum(scene: Scene, elements: int, moving: int) -> Spectrum:
    """Return the spectrum of a scene's model; of finite elements with as many elements as asked, unless the scene says."""
    moves = scene.numerics.analysis in {"auto", "dynamic"}
    if scene.model.kind == "fem" and scene.numerics.elements == "auto":
        scene = scene.with_value("numerics.elements", elements)
    if scene.tissue.layers:  # the rows say how viscous: the matrix of the drag is asked for
        scene = scene.with_value("tissue.layers.0.damping", 1.0)
    return spectrum_of(build_plant(scene), moving if moves else 0)


def prepared(rows: Array, spectrum: Spectrum, time_step: float) -> Callable[[Array, int, int], int]:
    """Return what computes some rows (from, to) into an array of tips (runs, outputs) and returns the number of steps."""
    from fem_needle.batch.loop import compute_runs

    rows, method, count = rows.copy(), collocation(1.0), len(spectrum.convection)
    rows[:, at.TIME_STEP] = time_step
    constants = np.stack([method.nodes, *method.inverse, method.end])
    matrices = (spectrum.convection, spectrum.centrifugal, spectrum.drag)

    def compute(tips: Array, first: int, last: int) -> int:
        work = (np.zeros((2, count)), np.zeros((2 * count, 2 * count)), np.zeros(2 * count))
        chosen = rows[first:last]
        return int(compute_runs(chosen, spectrum.roots, spectrum.tips, *matrices, constants, tips[first:last], *work))

    return compute


def _tips(rows: Array, times: Array, spectrum: Spectrum, time_step: float, cores: int, progress: Progress) -> tuple[Array, int]:
    """Return the tips (runs, outputs) and the number of steps: each core takes one piece of the runs after the other."""
    compute = prepared(rows, spectrum, time_step)
    tips = np.full(times.shape, np.nan)
    edges = np.unique(np.linspace(0, len(rows), min(len(rows), PIECES * cores) + 1).astype(int))
    steps, done = 0, 0
    with ThreadPoolExecutor(cores) as pool:
        waiting = {pool.submit(compute, tips, int(a), int(b)): int(b - a) for a, b in pairwise(edges)}
        for finished in as_completed(waiting):
            steps, done = steps + finished.result(), done + waiting[finished]
            progress(done / len(rows))
    if not np.array_equal(np.isfinite(tips), np.isfinite(times)):
        number = int(np.argmax(np.any(np.isfinite(tips) != np.isfinite(times), axis=1)))
        raise ComputationError(f"run {number} has no finite answer: check its values, or use a smaller time_step")
    return tips, steps


def _one_by_one(scenes: list[Scene], cores: int, progress: Progress) -> ManyRuns:
    """Run every scene on its own, in threads, the first one before them: compiled code is there when they start."""
    found = [_one(scenes[0])]
    progress(1 / len(scenes))
    with ThreadPoolExecutor(cores) as pool:
        waiting = [pool.submit(_one, scene) for scene in scenes[1:]]
        try:
            for done, finished in enumerate(as_completed(waiting), start=2):
                finished.result()
                progress(done / len(scenes))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
        found.extend(run.result() for run in waiting)
    columns = np.full((3, len(scenes), max(run.rows.shape[1] for run in found)), np.nan)
    for number, run in enumerate(found):
        columns[:, number, : run.rows.shape[1]] = run.rows
    return ManyRuns(
        columns[0], columns[1], columns[2], float(np.max([run.error for run in found])), sum(run.steps for run in found)
    )


@dataclass(frozen=True, eq=False)
class _Tips:
    """One run: rows of time, depth and tip deflection (3, outputs), its error estimate and its steps."""

    rows: Array
    error: float
    steps: int


def _one(scene: Scene) -> _Tips:
    if _is_given(scene):
        return _straight(scene)
    run = run_scene(scene)
    estimate = run.summary["error_estimate"]
    rows = np.stack([run.time, run.depth, run.tip_deflection])
    return _Tips(rows, np.nan if estimate is None else estimate, int(run.summary["steps"]))


def _is_given(scene: Scene) -> bool:
    """Return whether neither mesh nor step is to be chosen."""
    numerics = scene.numerics
    has_mesh = scene.model.kind != "fem" or numerics.elements != "auto" or numerics.mesh is not None
    return has_mesh and numerics.time_step != "auto"


def _straight(scene: Scene) -> _Tips:
    """Return the tips of a run whose settings are given, and nothing else."""
    plant = build_plant(scene)
    choice = choose(scene, lambda: plant)
    grid = time_grid(plant, float(scene.numerics.time_step), choice.output_step)
    running = run_samples(plant, integration_of(plant, scene, choice.analysis), grid)
    blocks: list[Samples] = []
    while True:
        try:
            blocks.append(next(running))
        except StopIteration as finished:
            end = finished.value
            break
    samples = joined(blocks)
    tips = plant.deflection(samples.coordinates, samples.point_forces, samples.depth, np.array([scene.needle.length]))
    return _Tips(np.stack([samples.time, samples.depth, tips[:, 0]]), np.nan, end.steps)
