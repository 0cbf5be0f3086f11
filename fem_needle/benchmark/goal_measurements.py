"""Measurements of single goals; each raises an error that says why where it cannot be done."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import log2
from statistics import median

import numpy as np
from numpy.typing import NDArray

from fem_needle import load_scene
from fem_needle.batch.many import simulate_many
from fem_needle.benchmark.cases import Case, cases_of
from fem_needle.benchmark.loop import whole_loop, whole_run
from fem_needle.benchmark.machine import load
from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.own_methods import AssumedModes, FixedElements, ToleranceElements
from fem_needle.benchmark.random_scenes import random_scene
from fem_needle.benchmark.reference import reference_tips
from fem_needle.benchmark.result import Row
from fem_needle.benchmark.timing import seconds
from fem_needle.errors import NeedleError
from fem_needle.models import build_plant

Array = NDArray[np.float64]

ELEMENTS, STEP = 40, 5e-4  # s
LOOP_ROUNDS = 7
HIT_RATE = 99.0  # %
BATCH, FEW = 200, 4
BUSY = 1.5  # processes: what a benchmark alone stays below
MODULUS = "tissue.layers.0.foundation_modulus"
PROCESS_ROUNDS = 5
MICROSECONDS = 1e6


@dataclass(frozen=True)
class Measured:
    """A measured value in the unit of its goal, and by what."""

    value: float
    note: str = ""


def _case(name: str) -> Case:
    return cases_of([name])[0]


def _loop(name: str, step: float) -> Callable[[], Array]:
    case = _case(name)
    return whole_loop(build_plant(FixedElements().scene(case, Setting(elements=ELEMENTS, time_step=step))))


def _median(call: Callable[[], Array]) -> tuple[float, str]:
    """Return the median time of a call [s], and the spread in words."""
    call()
    times = [seconds(call) for _ in range(LOOP_ROUNDS)]
    return median(times), f"{1e3 * median(times):.4g} ms ({1e3 * min(times):.4g} to {1e3 * max(times):.4g})"


@cache
def time_per_step(name: str) -> Measured:
    """Return the median time of a step of 0.5 ms of a case on 40 elements, energies, works and reactions included [us]."""
    steps = Setting(time_step=STEP).steps(_case(name)) or 1
    time, shown = _median(_loop(name, STEP))
    return Measured(MICROSECONDS * time / steps, f"{steps} steps in {shown}")


@cache
def error_of_loop(name: str, step: float = STEP) -> Measured:
    """Return the error of a case with 40 elements, all coordinates (1)."""
    case = _case(name)
    return Measured(case.error(_loop(name, step)(), reference_tips(case)))


def order_of_loop() -> Measured:
    """Return the smallest order in time that the errors of M2 on 40 elements show, above what its start leaves behind."""
    steps = (1e-2, 5e-3, 2.5e-3)
    errors = [error_of_loop("M2", step).value for step in steps]
    orders = [log2(coarse / fine) for coarse, fine in pairwise(errors)]
    shown = ", ".join(f"{1e3 * step:g} ms {error:.1e}" for step, error in zip(steps, errors, strict=True))
    return Measured(min(orders), shown)


@cache
def hit_rate(scenes: int) -> Measured:
    """Return in how many of a number of random scenes the true error is within the tolerance [%].

    Scenes without an answer in time are counted apart.

    Raises
    ------
    NeedleError
        If no scene gives one.
    """
    kept = missed = refused = 0
    for seed in range(scenes):
        example = random_scene(seed)
        scale = float(np.max(np.abs(example.tips)))
        try:
            tips = whole_run(example.scene)()
        except NeedleError:
            refused += 1
            continue
        error = float(np.max(np.abs(tips - example.tips))) / scale
        kept, missed = kept + (error <= example.scene.numerics.tolerance), missed + (error > example.scene.numerics.tolerance)
    if not kept + missed:
        raise NeedleError(f"none of {scenes} scenes gave an answer in time")
    return Measured(100.0 * kept / (kept + missed), f"{missed} missed, {refused} without an answer in time")


def cost_of_tolerance(rows: Sequence[Row]) -> Measured:
    """Return the largest cost of a tolerance over that of the cheapest fixed elements that keep it (1).

    Both are whole runs, from the scene on.

    Raises
    ------
    NeedleError
        If no tolerance of the benchmark has a fixed setting that keeps it.
    """
    worst: Measured | None = None
    fixed = [row for row in rows if row.method == FixedElements.name and row.whole is not None]
    for row in rows:
        if row.method != ToleranceElements.name or row.median is None or row.setting.tolerance is None:
            continue
        keeping = [one for one in fixed if one.case == row.case and (one.error or 0.0) <= row.setting.tolerance]
        if keeping:
            best = min(keeping, key=lambda one: one.whole or 0.0)
            ratio = row.median / (best.whole or 1.0)
            if worst is None or ratio > worst.value:
                worst = Measured(ratio, f"{row.case}, {row.setting.label} against {best.setting.label}")
    if worst is None:
        raise NeedleError("no fixed setting keeps a tolerance that was run")
    return worst


def _two_modes(step: float) -> Callable[[], Array]:
    case = _case("M2")
    coarser = replace(case, output_step=max(step, case.output_step or 0.0))
    return AssumedModes().prepare(coarser, Setting(modes=2, variant="inserted-length", time_step=step))


def stability_of_two_modes() -> Measured:
    """Return the largest |tip| of two modes on M2 at any step over the largest true one (1).

    A load that comes at once moves an undamped needle twice as far as one that comes slowly: up to 2 is no growth.
    """
    largest = float(np.max(np.abs(reference_tips(_case("M2")))))
    found = {step: float(np.max(np.abs(_two_modes(step)()))) / largest for step in (1e-1, 1e-2, 1e-3)}
    worst = max(found, key=lambda step: found[step])
    return Measured(found[worst], f"largest at {1e3 * worst:g} ms")


def time_per_step_of_two_modes() -> Measured:
    """Return the median time of a step of 1 ms of two modes on M2 [us]."""
    steps = Setting(time_step=1e-3).steps(_case("M2")) or 1
    time, shown = _median(_two_modes(1e-3))
    return Measured(MICROSECONDS * time / steps, f"{steps} steps in {shown}")


def time_of_command(*arguments: str) -> Measured:
    """Return the median time of the process `fem-needle ...` [s], caches warm.

    Raises
    ------
    NeedleError
        If it fails.
    """
    command = [sys.executable, "-m", "fem_needle", *arguments]
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(PROCESS_ROUNDS + 1):
            try:
                times.append(seconds(lambda: subprocess.run(command, cwd=folder, capture_output=True, check=True)))
            except subprocess.CalledProcessError as error:
                raise NeedleError(f"the process failed: {error.stderr.decode(errors='replace')[-200:]}") from error
    return Measured(median(times[1:]), f"{min(times[1:]):.2f} to {max(times[1:]):.2f} s")


def batch_efficiency() -> Measured:
    """Return the efficiency of a batch on two cores: time on one / twice the time on two [%].

    The batch is `brachytherapy` with inertia, 6 elements and steps of 6 ms, and 200 foundation moduli.
    """
    settings = {"numerics.elements": 6, "numerics.time_step": 6e-3, "numerics.analysis": "dynamic"}
    scene = load_scene("brachytherapy").with_values(settings)
    moduli = np.linspace(3e3, 5e3, BATCH)

    def run(count: int, threads: int) -> float:
        return seconds(lambda: simulate_many(scene, {MODULUS: moduli[:count]}, threads=threads))

    for threads in (1, 2):
        run(FEW, threads)
    others = f"; others kept the cores busy, load {load():.1f}" if load() > BUSY else ""
    one, two = run(BATCH, 1), run(BATCH, 2)
    return Measured(100.0 * one / (2 * two), f"{BATCH} runs: {one:.3g} s on one core, {two:.3g} s on two{others}")
