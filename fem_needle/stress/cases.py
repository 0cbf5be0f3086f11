"""The cases: each quantity over its range with the others as in a needle, meshes up to 10 000 elements, and random scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any

import numpy as np

from fem_needle.stress.draws import random_numbers
from fem_needle.stress.fine import fine_mesh, many_steps, small_deflections
from fem_needle.stress.numbers import BESIDE, NODES, THINNEST, LayerNumbers, Numbers
from fem_needle.stress.trial import ROUGH, Trial, examine

MODELS: tuple[int | None, ...] = (None, 2, 8)  # finite elements, two modes, eight
EXACT_EVERY = 10  # random scenes are compared with exact solutions
BATCH = 10  # random scenes that a process takes at once
ENTRY, HUB = Numbers(support="entry"), Numbers(support="hub")
LATERAL = replace(HUB, tip_force=0.0, lateral=((-0.02, 1.0),))
CRITICAL = 2.0 * float(np.sqrt(5e3 * HUB.mass_per_length))  # N s/m^2
ELEMENTS = (10, 100, 1000, 10_000)


@dataclass(frozen=True)
class Case:
    """A row of the table.

    Attributes
    ----------
    name, extent
        What is varied, and how far.
    jobs
        Calls that return trials; each runs in a process of its own choice.
    """

    name: str
    extent: str
    jobs: tuple[Callable[[], list[Trial]], ...]


def cases(random_scenes: int, first_seed: int, *, long: bool) -> tuple[Case, ...]:
    """Return all cases: the sweeps, fine meshes, random scenes and, in the long form, ten million steps."""
    rows = [_sweep(name, extent, list(scenes)) for name, extent, scenes in _sweeps()]
    meshes = tuple(partial(fine_mesh, count) for count in ELEMENTS)
    rows.append(Case("fine meshes, tip of benchmark S", "10 to 10 000 elements", meshes))
    rows.append(Case("small deflections: a warning beyond", "1e-12 to 1e4 N", (small_deflections,)))
    steps = 10_000_000 if long else 100_000
    rows.append(Case("steps in one run", f"{steps:.0e}".replace("+0", ""), (partial(many_steps, steps),)))
    return (*rows, *(_random(modes, random_scenes, first_seed) for modes in MODELS))


def model_name(modes: int | None) -> str:
    """Return what a table calls a model."""
    return "finite elements" if modes is None else f"{modes} modes"


def _sweep(name: str, extent: str, scenes: list[Numbers]) -> Case:
    return Case(name, extent, tuple(partial(_examined, name, number, scene) for number, scene in enumerate(scenes)))


def _examined(name: str, number: int, numbers: Numbers) -> list[Trial]:
    return [examine(f"{name}, scene {number}, {model_name(modes)}", numbers, modes) for modes in MODELS]


def _random(modes: int | None, count: int, first_seed: int) -> Case:
    seeds = range(first_seed, first_seed + count)
    batches = tuple(partial(_drawn, modes, tuple(seeds[start : start + BATCH])) for start in range(0, count, BATCH))
    return Case(f"random scenes, {model_name(modes)}", "all of the above together", batches)


def _drawn(modes: int | None, seeds: tuple[int, ...]) -> list[Trial]:
    name = model_name(modes)
    return [
        examine(f"seed {seed}, {name}", random_numbers(seed), modes, brief=seed % EXACT_EVERY > 0, same=ROUGH) for seed in seeds
    ]


def _both(**changes: Any) -> tuple[Numbers, Numbers]:
    return replace(ENTRY, **changes), replace(HUB, **changes)


def _sweeps() -> Iterator[tuple[str, str, Iterator[Numbers]]]:
    yield "foundation modulus", "0 to 1e9 N/m^2", _foundations()
    yield "jump between layers", "1e-6 to 1e6", _jumps()
    yield "bending stiffness", "1e-8 to 1e3 N m^2", _over(_stiff, (10.0 ** np.arange(-8, 4)).tolist())
    yield "length", "1 mm to 10 m", _over(_long, (1e-3, 1e-2, 1.0, 10.0))
    yield "depth", "0 to the length", _over(_deep, np.linspace(0.0, HUB.length, 9).tolist())
    yield "depth beside nodes, interfaces, guides", "1e-12 m", _beside()
    yield "thickness of a layer", "1e-6 m", _thin()
    yield "speed", "0 to 50 m/s", _over(_moved, (0.0, 1e-6, 1e-3, 0.1, 1.0, 50.0))
    yield "turning back at every step", "0.1 mm/s to 10 m/s", _over(_turning, (1e-4, 1e-2, 1.0, 10.0))
    yield "out of the tissue and back", "0.1 to 1000 s, with and without inertia", _retracted()
    yield "time step", "1e-7 to 10 s", _over(_stepped, (10.0 ** np.arange(-7, 2)).tolist())
    yield "damping over critical", "0 to 1e4", _over(_damped, (0.0, 1e-3, 1.0, 1e2, 1e4))
    yield "guides", "1e-3 N/m to rigid", _guided()
    yield "forces", "1e-12 to 1e4 N", _over(_forced, (10.0 ** np.arange(-12, 5, 2)).tolist())


def _over(scenes: Callable[[float], Iterable[Numbers]], values: Iterable[float]) -> Iterator[Numbers]:
    for value in values:
        yield from scenes(value)


def _stiff(bending_stiffness: float) -> Iterable[Numbers]:
    return _both(bending_stiffness=bending_stiffness)


def _deep(depth: float) -> Iterable[Numbers]:
    return _both(depths=(depth,))


def _forced(force: float) -> Iterable[Numbers]:
    return (*_both(tip_force=force), replace(LATERAL, lateral=((-0.02, force),)))


def _foundations() -> Iterator[Numbers]:
    for modulus in (0.0, *(10.0 ** np.arange(-3, 10)).tolist()):
        yield from _both(layers=(LayerNumbers(0.0, None, modulus),))
    yield from (replace(LATERAL, layers=(LayerNumbers(0.0, None, modulus),)) for modulus in (0.0, 1.0, 1e9))


def _jumps() -> Iterator[Numbers]:
    for ratio in 10.0 ** np.arange(-6, 7, 2):
        first = 1e3 if ratio > 1.0 else 1e9
        layers = (LayerNumbers(0.0, 0.05, first), LayerNumbers(0.05, None, min(first * float(ratio), 1e9)))
        yield from _both(layers=layers)
        yield from _both(layers=layers, times=(0.0, 0.02), depths=(0.03, 0.07), analysis="quasi-static")


def _long(length: float) -> Iterator[Numbers]:
    stiffness = HUB.bending_stiffness * (length / HUB.length) ** 4  # the same modulus then bends it alike
    depths = (0.5 * length,)
    yield from _both(length=length, depths=depths)
    yield from (scene for scene in _both(length=length, depths=depths, bending_stiffness=min(max(stiffness, 1e-8), 1e3)))


def _beside() -> Iterator[Numbers]:
    layers = (LayerNumbers(0.0, 0.1, 5e3), LayerNumbers(0.1, None, 5e5))
    for place in (0.1, 0.2 * 11 / NODES, 0.2):
        for beside in (-BESIDE, 0.0, BESIDE):
            yield from _both(depths=(min(place + beside, 0.2),), layers=layers, elements=NODES, analysis="static")
    for beside in (-BESIDE, BESIDE):  # the hub stops just before it meets the guide
        yield replace(HUB, depths=(0.15,), guides=((-0.05 + abs(beside), inf), (-0.01 + beside, 1e3)), elements=NODES)

    yield from _both(depths=(BESIDE,))


def _thin() -> Iterator[Numbers]:
    layers = (LayerNumbers(0.0, 0.05, 5e3), LayerNumbers(0.05, 0.05 + THINNEST, 1e9), LayerNumbers(0.05 + THINNEST, None, 5e3))
    for analysis in ("static", "quasi-static", "dynamic"):
        yield from _both(layers=layers, analysis=analysis)
        yield from _both(layers=layers, analysis=analysis, times=(0.0, 0.02), depths=(0.049, 0.051))


def _moved(speed: float) -> Iterator[Numbers]:
    way = min(0.1, speed * HUB.duration) if speed else 0.0
    duration = way / speed if speed else HUB.duration
    for analysis in ("static", "dynamic"):
        yield from _both(times=(0.0, duration), depths=(0.05, 0.05 + way), time_step=duration / 50, steps=50, analysis=analysis)


def _turning(speed: float) -> Iterator[Numbers]:
    times = HUB.time_step * np.arange(HUB.steps + 1)
    depths = 0.1 + np.where(np.arange(HUB.steps + 1) % 2, min(speed * HUB.time_step, 0.05), 0.0)
    for analysis in ("quasi-static", "dynamic"):
        yield from _both(times=tuple(times.tolist()), depths=tuple(depths.tolist()), analysis=analysis)


def _retracted() -> Iterator[Numbers]:
    for duration in (0.1, 10.0, 1000.0):
        times = (0.0, 0.5 * duration, duration)
        for analysis in ("static", "quasi-static", "dynamic"):
            yield from _both(times=times, depths=(0.1, 0.0, 0.1), time_step=duration / 40, steps=40, analysis=analysis)


def _stepped(time_step: float) -> Iterator[Numbers]:
    layers = (LayerNumbers(0.0, None, 5e3, 5.0),)
    yield from _both(time_step=time_step)
    yield from _both(time_step=time_step, initial_shape="straight")
    duration = time_step * HUB.steps
    for analysis in ("quasi-static", "dynamic"):
        yield from _both(times=(0.0, duration), depths=(0.08, 0.1), time_step=time_step, layers=layers, analysis=analysis)


def _damped(damping: float) -> Iterator[Numbers]:
    layers = (LayerNumbers(0.0, None, 5e3, damping * CRITICAL),)
    for analysis in ("quasi-static", "dynamic"):
        yield from _both(layers=layers, initial_shape="straight", analysis=analysis)
        yield from _both(layers=layers, times=(0.0, 0.02), depths=(0.08, 0.1), analysis=analysis)


def _guided() -> Iterator[Numbers]:
    for stiffness in (*(10.0 ** np.arange(-3, 10, 3)).tolist(), inf):
        guides = ((-0.06, stiffness), (-0.01, stiffness))
        for analysis in ("static", "dynamic"):
            yield replace(LATERAL, guides=guides, analysis=analysis)
            yield replace(HUB, guides=guides, times=(0.0, 0.02), depths=(0.08, 0.1), analysis=analysis)
