"""Many runs at once: tips over time, for scenes or for arrays of a scene's values."""

from __future__ import annotations

import os
import time as clock
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.display import Card, Shown, in_millimeters
from fem_needle.dynamics import warming
from fem_needle.errors import ComputationError, SceneError, SuspiciousValueWarning
from fem_needle.models import build_plant
from fem_needle.progress_bar import ProgressBar
from fem_needle.scene import Scene
from fem_needle.scene.spelling import known_name
from fem_needle.simulation import run_scene, simulate
from fem_needle.threads import one_thread
from fem_needle.trajectory import VARIABLES

Array = NDArray[np.float64]
Progress = Callable[[float], None]

SHORT = 0.1  # s: of shorter runs most is spent on choosing mesh and steps, in Python, whose threads wait for each other


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
    variables
        What else was asked for, by its name in ``series.nc``, as the tips; SI.
    """

    time: Array
    depth: Array
    tip_deflection: Array
    error_estimate: float
    steps: int
    variables: dict[str, Array] = field(default_factory=dict)

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
    variables: Sequence[str] = (),
    time_step: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cores: int | None = None,
    vibrations: int | None = None,
) -> ManyRuns:
    """Compute the tips of many runs.

    Parameters
    ----------
    scenes
        Scenes, or one scene whose values ``parameters`` vary.
    parameters
        Arrays of equal length by path, one value for each run: ``{"loads.0.force": forces, "insertion.speed": speeds}``.
    variables
        Names of more variables over time of ``series.nc`` to return of every run, such as ``"push_force"``.
    time_step
        Largest step [s] of all runs; default: what every scene says, chosen for each run from its tolerance where it says
        nothing.
    threads
        How many to use; default: as many as there are cores.
    progress
        Is told which fraction of the runs is done; default: a bar on stderr, after a second, on terminals and in notebooks.
    cores, vibrations
        Of former versions: ``cores`` is ``threads``, ``vibrations`` changes nothing.

    Returns
    -------
    ManyRuns
        In the order of the scenes, the same whatever the number of threads.

    Raises
    ------
    SceneError
        If a path, a value or a variable's name is impossible, or there is nothing to compute.
    ComputationError
        Of a run that fails, with its number; ``error.partial`` has the runs that were finished.

    Notes
    -----
    Where a scene gives its mesh and its time step, nothing but that run is computed; otherwise they are chosen as `run_scene`
    does, which takes trial runs. Threads share one interpreter: they help as far as runs spend their time in compiled steps. Of
    short runs whose settings are chosen, one thread is used.
    """
    for name, value in (("cores", cores), ("vibrations", vibrations)):
        if value is not None:
            instead = "threads is its name now" if name == "cores" else "every run has all that its model has"
            warnings.warn(f"{name}: an argument of former versions; {instead}", SuspiciousValueWarning, stacklevel=3)
    variables = tuple(known_name(name, VARIABLES) for name in variables)
    for name in variables:
        if name not in VARIABLES:
            raise SceneError(f"variables: unknown (got {name!r}; allowed {', '.join(VARIABLES)})")
    many = _all(scenes, parameters)
    if time_step is not None:
        many = [scene.with_value("numerics.time_step", time_step) for scene in many]
    bar = ProgressBar(f"{len(many)} runs", needs_reader=True)
    try:
        return _gathered(many, tuple(variables), threads or cores or os.cpu_count() or 1, progress or bar.progress)
    finally:
        bar.stop()


def _all(scenes: Scene | Sequence[Scene], parameters: Mapping[str, ArrayLike] | None) -> list[Scene]:
    if isinstance(scenes, Scene):
        return _varied(scenes, parameters or {})
    if parameters is not None:
        raise SceneError("parameters: vary one scene (got several; allowed one scene with parameters, or scenes alone)")
    if not scenes:
        raise SceneError("scenes: nothing to compute (got 0; allowed 1 or more)")
    return list(scenes)


def _varied(scene: Scene, parameters: Mapping[str, ArrayLike]) -> list[Scene]:
    columns = {path: np.atleast_1d(np.asarray(values, dtype=float)).tolist() for path, values in parameters.items()}
    counts = sorted({len(values) for values in columns.values()})
    if len(counts) > 1:
        raise SceneError(f"parameters: as many values each (got {counts}; allowed one number of them)")
    found = [scene.with_values(dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
    if columns and not found:
        raise SceneError("parameters: nothing to compute (got arrays of 0 values; allowed 1 or more)")
    return found or [scene]


@dataclass(frozen=True, eq=False)
class _One:
    """One run: rows of time, depth, tip deflection and what else was asked for (3 + variables, outputs)."""

    rows: Array
    error: float
    steps: int


def _gathered(scenes: list[Scene], names: tuple[str, ...], threads: int, progress: Progress) -> ManyRuns:
    """Run every scene in a thread, and gather what they gave; compiled code is there before threads start."""
    warming.prepare()
    started = clock.perf_counter()
    with ThreadPoolExecutor(1) as alone:
        first = alone.submit(_one, scenes[0], names)
    pays = _is_given(scenes[0]) or clock.perf_counter() - started > SHORT
    with ThreadPoolExecutor(threads if pays else 1) as pool:
        waiting = [first, *(pool.submit(_one, scene, names) for scene in scenes[1:])]
        try:
            for done, finished in enumerate(as_completed(waiting), start=1):
                finished.result()
                progress(done / len(scenes))
        except ComputationError as error:
            pool.shutdown(cancel_futures=True)
            failed = next(number for number, run in enumerate(waiting) if run.done() and not run.cancelled() and run.exception())
            located = ComputationError(f"run {failed}: {error}")
            located.partial = _table([_finished(run) for run in waiting], names)
            raise located from error
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
        return _table([run.result() for run in waiting], names)


def _finished(run: Future[_One]) -> _One | None:
    return run.result() if run.done() and not run.cancelled() and run.exception() is None else None


def _table(runs: Sequence[_One | None], names: tuple[str, ...]) -> ManyRuns:
    """Return all runs; NaN where there is none."""
    found = [run for run in runs if run is not None]
    columns = np.full((3 + len(names), len(runs), max((run.rows.shape[1] for run in found), default=0)), np.nan)
    for number, run in enumerate(runs):
        if run is not None:
            columns[:, number, : run.rows.shape[1]] = run.rows
    error = float(np.max([run.error for run in found])) if found else np.nan
    variables = dict(zip(names, columns[3:], strict=True))
    return ManyRuns(columns[0], columns[1], columns[2], error, sum(run.steps for run in found), variables)


def _one(scene: Scene, names: tuple[str, ...]) -> _One:
    """Run a scene: where it gives mesh and step, without a look at what they cost."""
    run = simulate(build_plant(scene)) if _is_given(scene) else run_scene(scene)
    estimate = run.summary["error_estimate"]
    rows = np.stack([run.time, run.depth, run.tip_deflection, *(run.series[name] for name in names)])
    return _One(rows, np.nan if estimate is None else estimate, int(run.summary["steps"]))


def _is_given(scene: Scene) -> bool:
    """Return whether neither mesh nor step is to be chosen."""
    numerics = scene.numerics
    has_mesh = scene.model.kind != "fem" or numerics.elements != "auto" or numerics.mesh is not None
    return has_mesh and numerics.time_step != "auto"
