"""Measurements of single goals; each raises an error that says why where it cannot be done."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import log2
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.batch.many import simulate_many
from fem_needle.benchmark.cases import Case, cases_of
from fem_needle.benchmark.library_elements import NaiveElements
from fem_needle.benchmark.loop import quietly, whole_loop, whole_run
from fem_needle.benchmark.machine import load
from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.own_methods import AssumedModes, FixedElements, ToleranceElements
from fem_needle.benchmark.random_scenes import random_scene
from fem_needle.benchmark.reference import reference_tips
from fem_needle.benchmark.result import Row
from fem_needle.benchmark.timing import seconds
from fem_needle.errors import NeedleError
from fem_needle.models import build_plant
from fem_needle.scene_file import load_scene
from fem_needle.simulation import simulate

Array = NDArray[np.float64]

ELEMENTS, STEP = 40, 5e-4  # s
ROUNDS = 7
HIT_RATE = 99.0  # %
BATCH, FEW = 200, 4
BUSY = 1.5  # processes: what a benchmark alone stays below
MODULUS = "tissue.layers.0.foundation_modulus"
PROCESS_ROUNDS = 5
MICROSECONDS = 1e6
NAIVE = Setting(elements=ELEMENTS, time_step=1e-2)  # of the naive program, on M


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


def _computing(call: Callable[[], Any]) -> tuple[float, str]:
    """Return the median computing time of a call on this thread [s], and the spread in words; called once before."""
    call()
    times = []
    for _ in range(ROUNDS):
        started = clock.thread_time()
        call()
        times.append(clock.thread_time() - started)
    return median(times), f"{1e3 * median(times):.4g} ms ({1e3 * min(times):.4g} to {1e3 * max(times):.4g})"


@cache
def naive_step() -> Measured:
    """Return the computing time [s] of a step of the naive program: 40 cubic elements assembled, factored and solved, on M."""
    case = _case("M")
    time, shown = _computing(NaiveElements().prepare(case, NAIVE))
    return Measured(time / (NAIVE.steps(case) or 1), shown)


def whole_answer(scene: str, changes: dict[str, Any]) -> Measured:
    """Return the computing time of all that `run_scene` does with a shipped scene, in steps of the naive program."""
    time, shown = _computing(whole_run(load_scene(scene).with_values(changes)))
    return Measured(time / naive_step().value, f"{shown}; a naive step {1e3 * naive_step().value:.3g} ms")


def time_per_step(scene: str, changes: dict[str, Any]) -> Measured:
    """Return the computing time of a step of a run whose settings are given, ledger and samples included [us]."""
    plant = build_plant(load_scene(scene).with_values(changes))
    counted: list[int] = []

    def run() -> Array:
        found = simulate(plant)
        counted.append(int(found.summary["steps"]))
        return found.tip_deflection

    time, shown = _computing(lambda: quietly(run))
    return Measured(MICROSECONDS * time / counted[-1], f"{counted[-1]} steps in {shown}")


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


def runs_per_second(threads: int) -> Measured:
    """Return how many runs of 1600 steps a second and thread compute: `brachytherapy` with inertia, 6 elements, many moduli."""
    settings = {"numerics.elements": 6, "numerics.time_step": 6e-3, "numerics.analysis": "dynamic"}
    scene, moduli = load_scene("brachytherapy").with_values(settings), np.linspace(3e3, 5e3, BATCH)

    def run(count: int) -> float:
        return seconds(lambda: simulate_many(scene, {MODULUS: moduli[:count]}, threads=threads))

    run(FEW)
    others = f"; others kept the cores busy, load {load():.1f}" if load() > BUSY else ""
    time = run(BATCH)
    return Measured(BATCH / time, f"{BATCH} runs in {time:.3g} s on {threads} thread{'s' * (threads > 1)}{others}")
