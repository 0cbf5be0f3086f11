"""Steps of trial runs: how long they may be in which part of a run, and at which instants runs are sampled to be compared."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import replace
from itertools import pairwise
from math import ceil, floor, inf, pi, sqrt

import numpy as np

from fem_needle.choices import likely_duration, longest_period
from fem_needle.dynamics.engine import CREEP
from fem_needle.dynamics.grid import TimeGrid, time_grid
from fem_needle.dynamics.parts import FOLLOWED, PASSED_OVER
from fem_needle.dynamics.push import longest_step
from fem_needle.limits import check_steps
from fem_needle.motion import shortest_period
from fem_needle.run_job import Job, integration
from fem_needle.run_parts import VIBRATION_SHARE

FEWEST_STEPS = 25  # of the coarsest trial run
BEHIND_KINKS = 3  # outputs behind a kink at which runs with long steps are compared
FEWEST_SAMPLES = 50  # of a finer run: instants at which runs are compared
STEPS_PER_LOAD_PERIOD = 4  # of the coarsest trial run
STEPS_PER_NATURAL_PERIOD = 1.5  # with which vibrations are resolved
DAMPED_STEPS_PER_PERIOD = 24.0  # the same of a method that damps vibrations: longer steps agree that nothing vibrates
PARTS_STEPS_PER_PERIOD = 8.0  # where vibrations are followed in parts of a run
LEAST_TURN = 2.25  # that an unresolved vibration must appear to turn over the coarsest run, in rad: differences then show it
APPARENT = 12.0  # an unresolved vibration appears to turn by 12 / (omega h) in a step


def is_undamped(job: Job) -> bool:
    """Return whether the integrator has a spectral radius of 1, and with it its full order."""
    method = integration(job).method
    return method is not None and abs(float(np.sum(method.nodes)) - 1.0) < 1e-12


def is_passing(job: Job) -> bool:
    """Return whether steps pass over vibrations in parts of the run, or throughout."""
    return any(part.how == PASSED_OVER for part in job.choice.parts)


def is_graded(job: Job) -> bool:
    """Return whether the needle relaxes behind kinks, so that steps have to begin short there."""
    if job.scene.insertion.kind == "force":
        return False
    is_damped = any(layer.damping > 0.0 for layer in job.scene.tissue.layers)
    return (is_passing(job) and is_damped) or integration(job).kind == CREEP


def shares_of(job: Job, step: float) -> tuple[tuple[float, float], ...]:
    """Return the ends of the parts of a run and how long steps may be in them, as a share of the longest step [s]."""
    parts = job.choice.parts
    if len(parts) < 2:
        return ()
    return tuple((part.end, min(1.0, _following_step(job) / step) if part.how == FOLLOWED else 1.0) for part in parts)


def resolving_step(job: Job) -> float:
    """Return the longest step [s] that resolves the slowest vibration, infinite where none matters."""
    if job.choice.analysis != "dynamic" or job.choice.vibration <= VIBRATION_SHARE * job.scene.numerics.tolerance:
        return inf
    return longest_period(job.plant) / (STEPS_PER_NATURAL_PERIOD if is_undamped(job) else DAMPED_STEPS_PER_PERIOD)


def coarsest_step(job: Job) -> float:
    """Return the step [s] of the first trial run: loads are just resolved, and vibrations that matter show in its differences.

    With a spectral radius of 1 a vibration of large omega h appears to turn by 12 / (omega h) in a step h, 12 T / (omega h^2) in
    the run: runs with different steps disagree about it long before they resolve it. Otherwise it is damped out, and nothing
    would show it.
    """
    step = min(likely_duration(job.scene) / FEWEST_STEPS, shortest_period(job.scene) / STEPS_PER_LOAD_PERIOD)
    if job.scene.insertion.kind == "force":
        step = min(step, longest_step(job.scene))
    return step if is_passing(job) else min(step, _following_step(job))


def _following_step(job: Job) -> float:
    """Return the longest step [s] of a first run that shows the vibrations in parts of a run in which they are followed.

    Where they are followed in parts alone these may be too short for vibrations to turn by the least angle: they are resolved.
    """
    resolving = resolving_step(job)
    if resolving == inf or not is_undamped(job):
        return resolving
    if is_passing(job):
        return resolving * STEPS_PER_NATURAL_PERIOD / PARTS_STEPS_PER_PERIOD
    frequency = 2 * pi / (STEPS_PER_NATURAL_PERIOD * resolving)
    return max(resolving, sqrt(APPARENT * likely_duration(job.scene) / (LEAST_TURN * frequency)))


def sampled_grid(job: Job, step: float) -> TimeGrid:
    """Return the grid of a trial run with steps of at most ``step`` [s], which samples often enough to be compared.

    Long steps skip outputs, but for those next to kinks; short ones divide them evenly. Steps without inertia, or over vibrations
    that the tissue damps, are graded behind kinks.
    """
    output, duration = job.choice.output_step, likely_duration(job.scene)
    check_steps(duration, step)
    grid = replace(time_grid(job.plant, output, output), is_graded=is_graded(job))
    if step >= output * (1 - 1e-9):
        every = max(1, floor(step / output * (1 + 1e-9)))
        chosen = {*range(0, len(grid.outputs), every), len(grid.outputs) - 1}
        for landing in grid.landings:  # where a run has most to go wrong
            first = bisect_right(grid.outputs, landing)
            chosen |= set(range(first, min(first + BEHIND_KINKS, len(grid.outputs))))
        chosen |= {bisect_left(grid.outputs, part.begin) for part in job.choice.parts}
        return replace(grid, outputs=tuple(grid.outputs[index] for index in sorted(chosen)), time_step=every * output)
    parts = ceil(output / step * (1 - 1e-9))
    between = ceil(parts / ceil(FEWEST_SAMPLES * output / duration))  # steps from sample to sample
    samples = ceil(parts / between)
    times = [grid.outputs[0]]
    for start, end in pairwise(grid.outputs):
        count = max(1, ceil((end - start) / output * samples - 1e-9))
        inner = np.linspace(start, end, count + 1)[1:-1].tolist()
        times += [time for time in inner if not grid.has_landing(time, 1e-9 * output)]
        times.append(end)
    return replace(grid, outputs=tuple(times), time_step=output / (samples * between))
