"""What a scene does not need, and why: one small rule each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.collocation import collocation
from fem_needle.free_response import ringing
from fem_needle.march import TimeGrid, march
from fem_needle.motion import depth_law, landing_times, run_duration, shortest_period
from fem_needle.plant import Plant
from fem_needle.samples import Sample
from fem_needle.scene import LateralLoad, Scene
from fem_needle.statics import depth_derivative, solve_guided, solve_static
from fem_needle.steppers import DynamicStepper, Massless, StaticStepper, Stepper

Array = NDArray[np.float64]

PILOT_POINTS = 200  # instants of the inertia-free pilot run
POINTS_PER_PERIOD = 24
INERTIA_SHARE = 0.25  # of the tolerance: what leaving out inertia may cost


@dataclass(frozen=True)
class Skipped:
    """A term that was left out and why."""

    term: str
    reason: str


def inertia_free_stepper(plant: Plant) -> Stepper:
    """Return equilibria where the tissue has no memory, creep (L-stable) where it is viscous or remembers a path."""
    tissue = plant.scene.tissue
    remembers = tissue.rest_line == "cut-path" or plant.scene.insertion.kind == "force"
    if remembers or any(layer.damping > 0 for layer in tissue.layers):
        return DynamicStepper(Massless(plant), collocation(0.0), inertia=False)
    return StaticStepper(plant)


def inertia_effect(plant: Plant) -> float:
    """Return a bound on how far inertia moves the tip, relative to the largest tip deflection.

    From an inertia-free pilot run q_0(t): 2 max |tip of K^-1 M q_0''| plus, for each jump of q_0' (at the start, at kinks), the
    largest tip deflection of the free vibration that the jump starts. It assumes loads slower than the lowest natural
    frequency; where they are not, the first term is of order one by itself. Derivation: docs/theory.md.
    """
    scene = plant.scene
    if scene.initial.shape != "equilibrium":
        return float("inf")
    pieces = _pilot(plant)
    tips = [abs(float(plant.points(s.depth).rows[-1] @ s.coordinates)) for piece in pieces for s in piece]
    largest = max(*tips, scene.numerics.absolute_tolerance)
    forced = max((_forced_effect(plant, piece) for piece in pieces), default=0.0)
    rates = [_end_rates(piece) for piece in pieces]
    starts = [piece[0] for piece in pieces]
    jumps = [rates[0][0] - _starting_rate(plant, starts[0])]
    jumps += [right[0] - left[1] for left, right in pairwise(rates)]
    vibration = sum(
        ringing(plant, max(sample.depth, plant.smallest_depth), sample.time, jump)
        for sample, jump in zip(starts, jumps, strict=True)
        if np.any(jump)
    )
    return (2.0 * forced + vibration) / largest


def unneeded_terms(scene: Scene) -> Iterator[Skipped]:
    """Yield the terms that are absent from the scene and cost nothing."""
    if scene.support.kind == "entry":
        yield Skipped("needle outside the tissue", "support 'entry' clamps it straight at the surface")
    if not any(layer.damping > 0 for layer in scene.tissue.layers):
        yield Skipped("tissue viscosity", "no layer has damping")
    if isinstance(scene.tissue.stiffness_factor, float):
        yield Skipped("swelling", "the stiffness factor is constant")
    if not any(isinstance(load, LateralLoad) for load in scene.loads) and not scene.support.guides:
        yield Skipped("points between hub and tissue", "no guide and no lateral load")


def _pilot(plant: Plant) -> list[list[Sample]]:
    """Run without inertia and split the samples at the kinks."""
    scene, law, duration = plant.scene, depth_law(plant.scene), run_duration(plant.scene)
    step = min(duration / PILOT_POINTS, shortest_period(scene) / POINTS_PER_PERIOD)
    landings = landing_times(scene, law, duration, plant.smallest_depth)
    marks, outputs = [0.0, *landings, duration], [0.0]
    for start, end in pairwise(marks):
        outputs += np.linspace(start, end, max(3, int(np.ceil((end - start) / step))) + 1)[1:].tolist()
    samples = list(march(plant, inertia_free_stepper(plant), TimeGrid(tuple(outputs), landings, duration)))
    edges = [samples[0], *(s for s in samples if s.time in landings), samples[-1]]
    return [
        [s for s in samples if first.time <= s.time <= second.time] for first, second in pairwise(edges)
    ]


def _forced_effect(plant: Plant, piece: list[Sample]) -> float:
    """Return the largest |tip of K^-1 M q''| over a smooth piece, q'' by second differences."""
    effect = 0.0
    for before, now, after in zip(piece, piece[1:], piece[2:], strict=False):
        first, second = now.time - before.time, after.time - now.time
        slope = (after.coordinates - now.coordinates) / second - (now.coordinates - before.coordinates) / first
        acceleration = 2.0 * slope / (first + second)
        operators, points = plant.operators(now.depth, now.time), plant.points(now.depth)
        force = -banded.multiply(operators.mass, acceleration)
        moved, _ = solve_guided(plant, operators, points, force, np.zeros(points.guides))
        effect = max(effect, abs(float(points.rows[-1] @ moved)))
    return effect


def _end_rates(piece: list[Sample]) -> tuple[Array, Array]:
    """Return q' at both ends of a piece, by one-sided differences of second order."""

    def one_sided(a: Sample, b: Sample, c: Sample) -> Array:
        near, far = b.time - a.time, c.time - a.time
        return (
            (b.coordinates - a.coordinates) * (far / near) - (c.coordinates - a.coordinates) * (near / far)
        ) / (far - near)

    return one_sided(*piece[:3]), one_sided(*piece[:-4:-1])


def _starting_rate(plant: Plant, first: Sample) -> Array:
    if not first.speed:
        return np.zeros(plant.size)
    rest = solve_static(plant, depth=first.depth, time=first.time)
    return first.speed * depth_derivative(plant, rest)[0]
