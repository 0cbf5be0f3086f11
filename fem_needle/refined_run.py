"""Runs whose mesh and time step follow from the tolerance: a few cheap trial runs, a final run, an error estimate from them.

Trial runs with long steps tell how much the mesh costs in motion and, by their differences, with which order the error falls and
which step is needed; the next run takes it. Derivation: docs/theory.md, "What may be left out" and what follows it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from fem_needle.detuning import detuning
from fem_needle.dynamics.grid import RunEnd, TimeGrid, time_grid
from fem_needle.errors import ComputationError
from fem_needle.expectation import Expectation, expectation
from fem_needle.run_job import Course, Job, begin, collect, shown, total_error, trajectory_of
from fem_needle.sample_arrays import Samples, joined, tips_of
from fem_needle.trajectory import Trajectory, guide_advice
from fem_needle.trial_steps import coarsest_step, is_passing, is_undamped, resolving_step, sampled_grid, shares_of

Array = NDArray[np.float64]

MOST_RUNS = 14
MOST_STEPS = 4_000_000
MOST_MESHES = 6
MOST_FAILURES = 5
AIM = 0.9  # of the allowed error
LEAST_TIME_SHARE = 0.5  # of the tolerance
MESH_SHARE = 0.3  # of the tolerance: what the mesh may cost in motion
TIME_ORDER = 4.0  # of the integrator with a spectral radius of 1, otherwise 3
LEAST_FINER = 1.3  # times as many elements: a mesh to compare with
SURE_ORDER = 3.0  # of the mesh's error in motion, at least
MESH_ORDER = 5.0  # of the mesh's error in motion, to guess the elements that are needed
MUCH_LONGER = 2.5  # ratio of steps
LEAST_REFINEMENT = 0.7  # largest ratio of successive steps
SHORTEST = 0.33  # smallest ratio of successive steps


@dataclass(frozen=True, eq=False)
class _Trial:
    """A run with one step on one mesh."""

    job: Job
    grid: TimeGrid
    samples: Samples
    end: RunEnd

    @property
    def step(self) -> float:
        """Largest step [s]."""
        return self.grid.time_step

    @property
    def shortest(self) -> float:
        """Largest step [s] of those parts of the run in which steps are shortest."""
        return self.step * min((share for _, share in self.grid.shares), default=1.0)

    @property
    def is_whole(self) -> bool:
        """Whether it has all outputs of the run."""
        return self.step <= self.job.choice.output_step * (1 + 1e-9)

    @property
    def cost(self) -> int:
        """Steps times unknowns."""
        return self.end.steps * self.job.plant.size

    @property
    def tips(self) -> Array:
        """Tip deflections [m] at the samples."""
        return tips_of(self.job.plant, self.samples)


class _InterruptedError(Exception):
    """Somebody interrupted a trial run; it is the last one."""


@dataclass
class _Search:
    """What changes while mesh and step are looked for.

    Attributes
    ----------
    job
        With the mesh of the final run.
    trials
        All runs so far, the one that is delivered last.
    error
        Estimated time error of the last run, relative to the largest tip deflection; None before the final run.
    detuned
        What the mesh costs vibrations, as far as meshes were not compared for it.
    """

    job: Job
    trials: list[_Trial]
    error: float | None = None
    detuned: float = 0.0

    @property
    def tolerance(self) -> float:
        """The scene's tolerance."""
        return self.job.scene.numerics.tolerance

    @property
    def allowed(self) -> float:
        """What the time step may cost: what mesh and left-out inertia leave of the tolerance, at least a part of it."""
        others = (self.job.chosen.error or 0.0) + self.job.choice.inertia_error
        return max(self.tolerance - others, LEAST_TIME_SHARE * self.tolerance)

    def run(self, job: Job, step: float, *, final: bool = False) -> _Trial:
        """Run once with a step of at most ``step`` [s]; a final run has all outputs.

        Raises
        ------
        ComputationError
            With the trajectory so far.
        """
        first = self.trials[0].grid if self.trials else None
        sampled = sampled_grid(job, min(step, job.choice.output_step) if final else step)
        grid = replace(sampled, shares=first.shares if first else shares_of(job, step), coarser=first)
        blocks = list[Samples]()
        try:
            end = collect(job, grid, blocks, live=False)
        except ComputationError:
            if blocks:
                self.trials.append(_Trial(job, grid, joined(blocks), RunEnd("failed", grid.steps)))
            raise
        self.trials.append(_Trial(job, grid, joined(blocks), end))
        if end.reason == "interrupted":
            raise _InterruptedError
        return self.trials[-1]


def run_refined(job: Job) -> Trajectory:
    """Run with the steps that the tolerance needs, and on the mesh that it needs where the mesh is free.

    Raises
    ------
    ComputationError
        If a step fails, or if rounding alone costs more than the tolerance allows.
    """
    search = _Search(job, [])
    try:
        _find_step(search, _settle_mesh(search))
    except _InterruptedError:
        search.error = None
    except ComputationError as error:
        if error.partial is not None:
            _show(search)
        raise
    return _show(search)


def _settle_mesh(search: _Search) -> _Trial:
    """Take more elements until a finer mesh moves the tip little, in runs with the coarsest step; return the last of them."""
    trial = _first_trial(search)
    for _ in range(MOST_MESHES):
        better = _better_mesh(search, trial)
        if better is None:
            break
        trial = better
    return trial


def _better_mesh(search: _Search, trial: _Trial) -> _Trial | None:
    """Compare with a run on a finer mesh; return a run with the same step on the mesh that is needed, None where it is enough."""
    chosen = search.job.chosen
    ladder, plant, allowed = chosen.ladder, chosen.plant, MESH_SHARE * search.tolerance
    finer = None if ladder is None else ladder.finer(plant, LEAST_FINER)
    if ladder is None or finer is None:
        return None
    other = search.run(replace(search.job, chosen=ladder.choice(finer, 0.0)), trial.step)
    moved = difference(trial, other) / (1.0 - (plant.size / finer.size) ** SURE_ORDER)
    search.job = replace(search.job, chosen=ladder.choice(plant, moved))
    if moved <= allowed:
        return None
    wanted = ladder.finer(plant, (moved / allowed) ** (1.0 / MESH_ORDER))
    if wanted is None or wanted.size <= finer.size:
        wanted = finer
    search.job = replace(search.job, chosen=ladder.choice(wanted, moved))
    return other if wanted is finer else search.run(search.job, trial.step)


def _lost_to_mesh(search: _Search, swing: float) -> float:
    """Return what the mesh costs vibrations of a size (relative to the largest tip), infinite where that has to be seen."""
    chosen = search.job.chosen
    finer = None if chosen.ladder is None else chosen.ladder.finer(chosen.plant, LEAST_FINER)
    if finer is None or resolving_step(search.job) == inf:
        return 0.0
    if search.job.scene.initial.shape != "equilibrium":  # let go: what the mesh does to a shape shows as it swings
        return inf
    return swing * detuning(chosen.plant, finer)


def _settle_vibrations(search: _Search, coarser: _Trial, final: _Trial) -> None:
    """Compare meshes with a step that follows the vibrations, and run again on a finer one where they differ.

    Steps that are much longer than the last ones do not follow the faster vibrations, which the mesh makes wrong first.
    """
    if coarser.step > MUCH_LONGER * final.step:
        coarser = final
    first = coarser
    for _ in range(MOST_MESHES):
        better = _better_mesh(search, coarser)
        if better is None:
            break
        coarser = better
    if coarser is not first:
        final = search.run(search.job, final.step, final=True)
    search.trials.remove(final)
    search.trials.append(final)


def _first_trial(search: _Search) -> _Trial:
    step = coarsest_step(search.job)
    for _ in range(MOST_FAILURES):
        try:
            return search.run(search.job, step)
        except ComputationError:  # such as a cut path in whose curvature so long a step does not converge
            step /= 2.0
    return search.run(search.job, step)


def _find_step(search: _Search, first: _Trial) -> None:
    """Run with ever shorter steps until the estimated error of a run with all outputs is allowed."""
    order = TIME_ORDER if is_undamped(search.job) and not is_passing(search.job) else TIME_ORDER - 1
    slowest = resolving_step(search.job)
    runs, differences = [first, _finer_run(search, first)], list[float]()
    while True:
        differences.append(difference(*runs[-2:]))
        resolved = runs[-2].shortest <= slowest
        expected = expectation([run.step for run in runs], differences, order, resolved=resolved)
        search.error = expected.bound
        if search.error <= search.allowed and runs[-1].is_whole:
            lost = _lost_to_mesh(search, max(differences[0], search.job.choice.vibration))
            if lost > MESH_SHARE * search.tolerance:
                _settle_vibrations(search, *runs[-2:])
            else:
                search.detuned = lost
            return
        ratio = next_ratio(expected, AIM * search.allowed)
        if len(search.trials) >= MOST_RUNS or runs[-1].end.steps / ratio > MOST_STEPS:
            break
        _refuse_rounding(search, runs[-1].end.steps / ratio)
        runs.append(search.run(search.job, runs[-1].step * ratio, final=search.error <= search.allowed))
    if not runs[-1].is_whole:
        search.run(search.job, runs[-1].step, final=True)


def _finer_run(search: _Search, run: _Trial) -> _Trial:
    """Return a run with half the step, or less where events and outputs alone have made the steps: the same ones show nothing."""
    step = run.step
    for _ in range(MOST_RUNS):
        step /= 2.0
        finer = search.run(search.job, step)
        if finer.end.steps > run.end.steps:
            break
    return finer


def _refuse_rounding(search: _Search, steps: float) -> None:
    """Refuse steps whose round-off, which adds up as a random walk, is more than the tolerance.

    Raises
    ------
    ComputationError
        With what it would be.
    """
    lost = search.job.chosen.round_off * sqrt(steps)
    if lost > search.allowed:
        raise ComputationError(
            f"numerics.tolerance = {search.tolerance:g} needs about {steps:.0g} steps, in which rounding alone moves the tip by "
            f"{lost:.1e} of its largest deflection: ask for {2 * lost:.1e} or more"
        )


def next_ratio(expected: Expectation, allowed: float) -> float:
    """Return the ratio of the next step to the last one, which leads to the final step where that is near."""
    return min(max(expected.ratio(allowed), SHORTEST), LEAST_REFINEMENT)


def difference(coarser: _Trial, finer: _Trial) -> float:
    """Return the largest difference of two runs' tips at common times and at the end, relative to the finer one's largest tip.

    Of a push also that of the depths, relative to the largest depth: a straight needle has no tip to compare.
    """
    times, others = coarser.samples.time, finer.samples.time
    slack, floor = 1e-9 * others[-1], finer.job.scene.numerics.absolute_tolerance
    places = np.minimum(np.searchsorted(others, times - slack), len(others) - 1)
    common = np.abs(others[places] - times) <= slack
    common[-1] = False  # a push may end at slightly different times

    def relative(values: Array, other_values: Array) -> float:
        before = float(np.max(np.abs(values - other_values[places])[common], initial=0.0))
        apart = max(before, abs(float(values[-1] - other_values[-1])))
        return apart / max(float(np.max(np.abs(other_values))), floor)

    found = relative(coarser.tips, finer.tips)
    if finer.job.scene.insertion.kind != "force":
        return found
    return max(found, relative(coarser.samples.depth, finer.samples.depth))


def _show(search: _Search) -> Trajectory:
    """Show the last run to the observer and return it."""
    trial, job = search.trials[-1], search.trials[-1].job
    grid = time_grid(job.plant, trial.step, job.choice.output_step)
    course = Course(job.choice, trial.grid, grid.outputs)
    samples = course.shown(trial.samples)
    begin(job, grid)
    run = replace(trajectory_of(job, grid, samples, None, trial.end), course=course)
    if search.error is not None:
        run.summary["error_estimate"] = total_error(search.job, search.error + search.detuned)
    if search.error is not None and search.error > search.allowed:
        run.summary["warnings"].append(
            f"the tolerance {search.tolerance:g} was not reached with {trial.end.steps} steps: see error_estimate"
        )
    residual = run.summary["relative_energy_residual"]
    if search.error is not None and residual > search.tolerance:
        lacking = f"the energy balance lacks {residual:.1e} of the largest energy: more than the tolerance"
        run.summary["warnings"].append(lacking + guide_advice(job.scene))
    run.summary["step_unknowns"] = sum(other.cost for other in search.trials)
    return shown(job, run, samples)
