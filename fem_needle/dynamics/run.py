"""A whole run: how a needle is integrated, and its samples, stretch by stretch between breakpoints."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation, collocation
from fem_needle.dynamics import names as at
from fem_needle.dynamics.engine import CREEP, DYNAMIC, REST, Engine, failed_step, smooth_stretches
from fem_needle.dynamics.grid import RunEnd, TimeGrid, ends_by_itself
from fem_needle.dynamics.massless import massless
from fem_needle.dynamics.parts import Part, cosines_from, is_passed_over
from fem_needle.dynamics.push import WHY, Push, longest_step, run_limits
from fem_needle.dynamics.vibration import Vibration, under_way, vibration_samples
from fem_needle.initial import initial_state
from fem_needle.limits import check_steps
from fem_needle.motion import depth_law, may_move, wanted_radius
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples
from fem_needle.scene import Scene

Array = NDArray[np.float64]

VIBRATION = "vibration"  # of a held needle, in closed form
SAMPLES_AT_ONCE = 500


@dataclass(frozen=True)
class Integration:
    """How a needle gets from one time to the next.

    Attributes
    ----------
    kind
        "dynamic", "creep" (without inertia), "rest" (through equilibria) or "vibration" (eigenvectors once, then cosines).
    method
        Collocation method of steps.
    parts
        Of the run; in those with steps over vibrations the method is Radau IIA.
    """

    kind: str
    method: Collocation | None = None
    parts: tuple[Part, ...] = ()

    @property
    def steps(self) -> bool:
        """Whether time steps are taken that have an error."""
        return self.kind in {DYNAMIC, CREEP}

    def method_at(self, time: float) -> Collocation | None:
        """Return the method of the steps at a time [s]."""
        return collocation(0.0) if is_passed_over(self.parts, time) else self.method


def integration_of(plant: Plant, scene: Scene, analysis: str) -> Integration:
    """Return how a needle is stepped: with inertia ("dynamic"), without it ("quasi-static"), or through equilibria ("static")."""
    if analysis == "dynamic":
        return Integration(DYNAMIC, collocation(spectral_radius(plant, scene)))
    return Integration(REST) if analysis == "static" else without_inertia(plant.scene)


def without_inertia(scene: Scene) -> Integration:
    """Return equilibria where the tissue has no memory, creep (L-stable) where it is viscous or remembers a path."""
    tissue = scene.tissue
    remembers = tissue.rest_line == "cut-path" or scene.insertion.kind == "force"
    if remembers or any(layer.damping > 0 for layer in tissue.layers):
        return Integration(CREEP, collocation(0.0))
    return Integration(REST)


def spectral_radius(plant: Plant, scene: Scene) -> float:
    """Return what the scene wants, lowered where the plant needs it to stay stable while it moves."""
    wanted = wanted_radius(scene)
    return min(wanted, plant.largest_spectral_radius) if may_move(scene) else wanted


def begun(plant: Plant, integration: Integration) -> Engine:
    """Return a needle at t = 0, as the scene's ``[initial]`` says."""
    law = depth_law(plant.scene)
    engine = Engine(plant, integration.kind, integration.method)
    engine.begin(initial_state(plant if integration.kind == DYNAMIC else massless(plant), law), law.depth(0.0))
    return engine


def run_samples(plant: Plant, integration: Integration, grid: TimeGrid) -> Generator[Samples, None, RunEnd]:
    """Yield the samples of a run in blocks; the generator's value says how it ended.

    Raises
    ------
    ComputationError
        If a step cannot be solved or gives numbers that are not finite; says at which time and depth.
    """
    if integration.kind == VIBRATION:
        return _vibrating(plant, grid)
    if plant.scene.insertion.kind == "force" and integration.steps:
        return _pushed(plant, integration, grid)
    return _moved(plant, integration, grid)


def _moved(plant: Plant, integration: Integration, grid: TimeGrid) -> Generator[Samples, None, RunEnd]:
    engine, first, samples = begun(plant, integration), True, None
    kinks, turns = {0.0, *grid.landings}, {part.begin for part in integration.parts}
    until = cosines_from(integration.parts)
    steps = (interval for interval in grid.intervals() if interval[0] < until)
    for intervals in smooth_stretches(steps, set(grid.outputs), kinks, turns, plant.size):
        engine.use(integration.method_at(float(intervals[0, 0])))
        status, samples = engine.advance(intervals, counted=not first, from_start=first)
        first = False
        if len(samples):
            yield samples
        if status != at.DONE:
            time, depth = float(engine.live.axial[at.NOW]), float(engine.live.axial[at.WAY])
            raise failed_step(time, depth, WHY[status])
    if until < grid.outputs[-1] and samples is not None:
        time, (coordinates, momentum) = float(engine.live.axial[at.NOW]), engine.live.lateral[0]
        outputs = [output for output in grid.outputs if output > until]
        for block in _swings(under_way(plant, time, coordinates, momentum), outputs):
            yield block.after(samples)
    return RunEnd("final-depth" if ends_by_itself(plant.scene) else "duration", grid.steps)


def _pushed(plant: Plant, integration: Integration, grid: TimeGrid) -> Generator[Samples, None, RunEnd]:
    """Yield the samples of a pushed needle until something ends its run."""
    longest = longest_step(plant.scene)
    check_steps(grid.outputs[-1], longest)
    engine = begun(plant, integration)
    push, outputs, first = Push(engine, plant.scene, run_limits(plant.scene)), set(grid.outputs), True
    start, end, count = next(grid.intervals())
    push.begin((end - start) / count)
    for start, end, count in grid.intervals():
        if start in grid.landings:
            engine.land()
        reason, found = push.go(end, min((end - start) / count, longest), output=end in outputs, from_start=first)
        first = False
        yield from (samples for samples in found if len(samples))
        if reason is not None:
            return RunEnd(reason, int(engine.live.axial[at.STEPS]))
    return RunEnd("duration", int(engine.live.axial[at.STEPS]))


def _vibrating(plant: Plant, grid: TimeGrid) -> Generator[Samples, None, RunEnd]:
    yield from _swings(Vibration(plant, initial_state(plant, depth_law(plant.scene))), grid.outputs)
    return RunEnd("duration", grid.steps)


def _swings(vibration: Vibration, outputs: Sequence[float]) -> Iterator[Samples]:
    """Yield the samples of a needle that swings without steps."""
    marks = [*range(0, len(outputs), SAMPLES_AT_ONCE), len(outputs)]
    for first, last in pairwise(marks):
        yield vibration_samples(vibration, np.array(outputs[first:last]))
