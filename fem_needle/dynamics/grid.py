"""The times of a run: outputs, breakpoints, and steps between them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil

import numpy as np

from fem_needle.limits import check_samples, check_steps
from fem_needle.motion import depth_law, landing_times, run_duration
from fem_needle.plant import Plant
from fem_needle.scene import Scene

HALVINGS = 10  # of the first step behind a kink
GRADES = tuple(pairwise([0.0, *(2.0**-power for power in range(HALVINGS, -1, -1))]))


@dataclass(frozen=True)
class TimeGrid:
    """Times of a run [s].

    Attributes
    ----------
    outputs
        Times of the samples, 0 and the end included.
    landings
        Times at which something has a kink; a step ends there.
    time_step
        Largest step.
    is_graded
        Whether the first step behind a kink is taken in parts that grow from a thousandth of it.
    shares
        Ends of parts of the run and how long steps in them may be, as a share of the largest.
    coarser
        A grid whose own steps are all to be shortened as its largest step is: near kinks and outputs, too.
    """

    outputs: tuple[float, ...]
    landings: tuple[float, ...]
    time_step: float
    is_graded: bool = False
    shares: tuple[tuple[float, float], ...] = ()
    coarser: TimeGrid | None = None

    def intervals(self) -> Iterator[tuple[float, float, int]]:
        """Yield (start, end, steps) between successive outputs and landings."""
        return iter(self._intervals)

    @cached_property
    def _intervals(self) -> tuple[tuple[float, float, int], ...]:
        return tuple(self._found())

    def _found(self) -> Iterator[tuple[float, float, int]]:
        marks, kinks = sorted({*self.outputs, *self.landings}), {0.0, *self.landings}
        for start, end in pairwise(marks):
            count = max(1, ceil((end - start) / self._longest(0.5 * (start + end)) - 1e-9))
            if self.is_graded and start in kinks:
                step = (end - start) / count
                for part in GRADES:
                    yield start + part[0] * step, start + part[1] * step if count > 1 or part[1] < 1.0 else end, 1
                if count > 1:
                    yield start + step, end, count - 1
            else:
                yield start, end, count

    def _longest(self, time: float) -> float:
        """Return how long a step may be at a time [s]."""
        longest = self.time_step * next((share for end, share in self.shares if time < end), 1.0)
        if self.coarser is None:
            return longest
        ends, steps = self.coarser.plain_steps
        there = steps[min(bisect_left(ends, time), len(steps) - 1)]
        return min(longest, there * self.time_step / self.coarser.time_step)

    @cached_property
    def plain_steps(self) -> tuple[list[float], list[float]]:
        """Ends of the intervals and the steps in them [s], not graded."""
        found = [(end, (end - start) / count) for start, end, count in replace(self, is_graded=False).intervals()]
        return [end for end, _ in found], [step for _, step in found]

    def has_landing(self, time: float, distance: float) -> bool:
        """Return whether there is a landing within a distance of a time [s]."""
        first = bisect_left(self.landings, time - distance)
        return first < len(self.landings) and self.landings[first] <= time + distance

    @property
    def steps(self) -> int:
        """Number of steps."""
        return sum(count for _, _, count in self.intervals())

    @property
    def largest_step(self) -> float:
        """The largest step that is taken [s]."""
        return max((end - start) / count for start, end, count in self.intervals())


@dataclass(frozen=True)
class RunEnd:
    """Why a run ended, and after how many steps."""

    reason: str
    steps: int


def output_times(duration: float, output_step: float) -> tuple[float, ...]:
    """Return 0, S, 2 S, ... and the end [s]."""
    count = int(np.floor(duration / output_step * (1 + 1e-12)))
    times = [index * output_step for index in range(count + 1)]
    if times[-1] > duration * (1 - 1e-12):
        times[-1] = duration
    else:
        times.append(duration)
    return tuple(times)


def time_grid(plant: Plant, time_step: float, output_step: float) -> TimeGrid:
    """Return the times of a scene's run."""
    duration = run_duration(plant.scene)
    check_steps(duration, time_step)
    check_samples(duration, output_step, plant.size, plant.scene.numerics.output_points)
    landings = landing_times(plant.scene, depth_law(plant.scene), duration, plant.smallest_depth)
    outputs = output_times(duration, output_step)
    # An output within round-off of a landing is moved onto it: no steps of 1e-17 s, no kink inside a step.
    outputs = tuple(_snapped(time, landings, 1e-12 * duration) for time in outputs)
    return TimeGrid(outputs, landings, time_step)


def _snapped(time: float, landings: tuple[float, ...], distance: float) -> float:
    first = bisect_left(landings, time - distance)
    return landings[first] if first < len(landings) and landings[first] <= time + distance else time


def ends_by_itself(scene: Scene) -> bool:
    """Return whether a position-driven run ends where its insertion does."""
    return scene.run.duration is None and scene.insertion.final_depth is not None
