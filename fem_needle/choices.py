"""Automatic settings of any model: which analysis, which time step; and what they are estimated to cost in accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from fem_needle.dynamics.parts import COSINES, FOLLOWED, PASSED_OVER, Part
from fem_needle.dynamics.push import run_limits
from fem_needle.dynamics.rests import tips_at_rest
from fem_needle.dynamics.vibration import needs_no_steps, vibrating_tips
from fem_needle.errors import SceneError
from fem_needle.free_response import natural_frequencies
from fem_needle.inertia_effect import POINTS_PER_PERIOD, SHALLOW, Inertia, inertia_of
from fem_needle.limits import check_samples
from fem_needle.loads import load_cases
from fem_needle.motion import PUSH_SLACK, depth_law, lateral_values, run_duration, shortest_period
from fem_needle.plant import Plant
from fem_needle.run_parts import VIBRATION_SHARE, chooses_steps, parts_with_inertia, without_inertia_throughout
from fem_needle.scene import Scene, as_function
from fem_needle.skipping import INERTIA_SHARE, Skipped, unneeded_terms

Array = NDArray[np.float64]

PILOT_INSTANTS = 7
DRAWN = 50  # times of each part of a run, among which loads are looked for
LARGER = 1.25
SLOW_PERIODS = 10  # longest natural periods: loads that swing faster are taken to make the needle vibrate
HISTORY_POINTS = (400, 2000)  # fewest and most instants at which vibrations of two plants are compared: the outputs else
OUTPUTS = 200
STEPS_PER_PERIOD = 16


@dataclass(frozen=True)
class Choice:
    """Settings of a run.

    Attributes
    ----------
    analysis
        "dynamic", "quasi-static" or "static".
    output_step
        Time between samples [s].
    skipped
        What is left out and why.
    inertia_error
        Bound on what leaving out inertia, or vibrations, costs the tip, relative to its largest deflection.
    vibration
        How far inertia moves the tip at most, relative to its largest deflection, but for vibrations that steps pass over; 1
        where that was not looked at.
    parts
        How the needle gets through the parts of the run.
    """

    analysis: str
    output_step: float
    skipped: tuple[Skipped, ...]
    inertia_error: float
    vibration: float
    parts: tuple[Part, ...]

    @property
    def passes_over(self) -> bool:
        """Whether steps follow vibrations nowhere, because the tissue damps them: an L-stable method passes over them."""
        return all(part.how == PASSED_OVER for part in self.parts)


def choose(scene: Scene, pilot: Callable[[], Plant]) -> Choice:
    """Return analysis, output step and what is skipped; ``pilot`` makes a coarse plant, where one is needed."""
    numerics = scene.numerics
    duration = run_duration(scene)
    step = numerics.output_step if isinstance(numerics.output_step, float) else likely_duration(scene) / OUTPUTS
    check_samples(duration, step, stations=numerics.output_points)
    if step > duration:
        raise SceneError(f"numerics.output_step: longer than the run (got {step:g}; allowed up to {duration:g} s)")
    skipped = tuple(unneeded_terms(scene))
    effect = _effect(scene, pilot)
    allowed = INERTIA_SHARE * numerics.tolerance
    bound = f"moves the tip by at most {effect.bound:.1e} of its largest deflection (allowed {allowed:.1e})"
    if numerics.analysis != "dynamic" and (numerics.analysis != "auto" or effect.bound <= allowed):
        is_free = numerics.analysis == "auto"
        analysis, left_out = ("quasi-static", effect.bound) if is_free else (numerics.analysis, 0.0)
        why = Skipped("inertia", bound if is_free else f"analysis = '{analysis}' was asked for")
        parts: tuple[Part, ...] = (without_inertia_throughout(scene, analysis, why.reason),)
        return Choice(analysis, step, (why, *skipped), left_out, min(effect.lasting, 1.0), parts)
    parts = parts_with_inertia(scene, effect, step)
    if parts[0].how == COSINES:
        skipped = (*skipped, Skipped("time steps", parts[0].reason))
    vibration = max([effect.lasting, *(part.moved for part in parts if part.how == FOLLOWED)])
    return Choice("dynamic", step, skipped, _unresolved(scene, effect, parts), min(vibration, 1.0), parts)


def _effect(scene: Scene, pilot: Callable[[], Plant]) -> Inertia:
    """Return what inertia does, where that decides about something."""
    numerics = scene.numerics
    if scene.insertion.kind != "force" and numerics.analysis == "auto":
        return inertia_of(pilot(), enough=INERTIA_SHARE * numerics.tolerance)
    if numerics.analysis == "dynamic" and chooses_steps(scene):
        coarse = pilot()
        if shortest_period(scene) >= SLOW_PERIODS * longest_period(coarse):
            return inertia_of(coarse)
    return Inertia(inf, 1.0, 0.0)


def _unresolved(scene: Scene, effect: Inertia, parts: tuple[Part, ...]) -> float:
    """Return how far vibrations that are not resolved move the tip, relative to its largest deflection."""
    over = [part.moved for part in parts if part.how == PASSED_OVER]
    if over:
        return max(over)
    return effect.ringing if effect.lasting <= VIBRATION_SHARE * scene.numerics.tolerance else 0.0


def likely_duration(scene: Scene) -> float:
    """Return how long the run will last [s]; of a push that ends by itself, what a rigid needle would take."""
    slack = PUSH_SLACK if scene.run.duration is None and scene.insertion.kind == "force" else 1.0
    return run_duration(scene) / slack


def tip_difference(scene: Scene, plant: Plant, finer: Plant, analysis: str = "static") -> float:
    """Return the largest difference of two plants' tips over the run, relative to the largest of the finer one's.

    Of static tips; of a vibration that needs no steps, where the analysis is "dynamic", over time.
    """
    if analysis != "dynamic" or not needs_no_steps(scene):
        return float(np.max(tip_differences(scene, plant, finer)))
    output = scene.numerics.output_step
    outputs = run_duration(scene) / output if isinstance(output, float) else OUTPUTS
    times = np.linspace(0.0, run_duration(scene), round(min(max(outputs, HISTORY_POINTS[0]), HISTORY_POINTS[1])) + 1)
    return float(np.max(relative_differences(scene, vibrating_tips(plant, times), vibrating_tips(finer, times))))


def tip_differences(scene: Scene, plant: Plant, finer: Plant, count: int = PILOT_INSTANTS) -> Array:
    """Return the differences at each of the `instants`."""
    return relative_differences(scene, static_tips(plant, count), static_tips(finer, count))


def relative_differences(scene: Scene, coarse: Array, fine: Array) -> Array:
    """Return the differences of tips, relative to the largest of the finer ones."""
    scale = max(float(np.max(np.abs(fine))), scene.numerics.absolute_tolerance)
    return np.abs(coarse - fine) / scale


def first_time_step(plant: Plant, analysis: str, output_step: float) -> float:
    """Return a step [s] to begin with: output, load periods and, with inertia, the longest natural period are resolved."""
    step = min(output_step, shortest_period(plant.scene) / POINTS_PER_PERIOD)
    if analysis != "dynamic":
        return step
    return min(step, longest_period(plant) / STEPS_PER_PERIOD)


def longest_period(plant: Plant) -> float:
    """Return the longest natural period [s] over the run."""
    return 2 * pi / min(natural_frequencies(plant, depth, time)[0] for time, depth in instants(plant))


def static_tips(plant: Plant, count: int = PILOT_INSTANTS) -> Array:
    """Return the static tip deflections [m] at the `instants`."""
    return tips_at_rest(plant, instants(plant, count))


def loaded_times(scene: Scene, duration: float, count: int) -> list[float]:
    """Return times [s] spread over a run: of each of so many equal parts the middle, or where loads and hub act most.

    A load that swings vanishes again and again, and may do so at all of any equal times: a model that is looked at there alone
    seems exact. Other times of a part are drawn, always the same ones, and are taken where loads are larger by `LARGER`.
    """
    even = np.linspace(0.0, duration, count)
    half, random = 0.5 * duration / (count - 1), np.random.default_rng(0)
    marks = np.array([time for value in lateral_values(scene) for time in as_function(value).breakpoints])
    drawn = np.concatenate([even, random.uniform(0.0, duration, DRAWN * count), marks[(marks >= 0.0) & (marks <= duration)]])
    case = load_cases(scene, np.full_like(drawn, scene.insertion.first_depth), drawn)
    values = np.abs(np.hstack([case.forces, case.clamp]))
    acting = np.sum(values / np.maximum(np.max(values, axis=0), np.finfo(float).tiny), axis=1)
    times = []
    for place, time in enumerate(even.tolist()):
        part = np.flatnonzero(np.abs(drawn - time) <= half)
        most = part[int(np.argmax(acting[part]))]
        times.append(float(drawn[most]) if acting[most] > LARGER * acting[place] else time)
    return times


def instants(plant: Plant, count: int = PILOT_INSTANTS) -> list[tuple[float, float]]:
    """Return (time, depth) spread over the run, where loads act; what is hardly inserted yet is left out."""
    scene, law = plant.scene, depth_law(plant.scene)
    times = loaded_times(scene, run_duration(scene), count)
    found = [(time, law.depth(time)) for time in times]
    if scene.insertion.kind == "force":  # the depths over time are not known yet: spread them
        last = scene.insertion.final_depth or run_limits(scene).contact
        depths = np.linspace(scene.insertion.first_depth, last, count + 1)[:-1].tolist()
        found = list(zip(times, depths, strict=True))
    shallow = SHALLOW * scene.needle.length if scene.support.kind == "entry" else 0.0
    return [(time, max(depth, shallow)) for time, depth in found]
