"""Where a commanded needle goes, from one kink to the next: what the scene does when, levels to land on, and the end."""

from __future__ import annotations

from bisect import bisect_right
from math import inf
from typing import NamedTuple

from fem_needle.closed_loop.inputs import Inputs
from fem_needle.closed_loop.motion import CommandedMotion
from fem_needle.dynamics.push import run_limits
from fem_needle.motion import Instant, depth_law, landing_times, run_duration
from fem_needle.plant import Plant
from fem_needle.segments import interfaces

SAME_DEPTH = 1e-12  # of the needle's length
SAME_TIME = 1e-9  # of a time step: two instants closer than this are one


class Stretch(NamedTuple):
    """A time over which nothing has a kink.

    Attributes
    ----------
    until
        Its end [s].
    motion
        How the depth goes on under a commanded speed; None where the scene says it.
    """

    until: float
    motion: CommandedMotion | None = None


class Course:
    """What a scene does without being commanded, and where a commanded speed leads.

    Parameters
    ----------
    plant
        The needle.
    time_step
        Largest step [s]; kinks that are closer than a billionth of it are one.
    """

    def __init__(self, plant: Plant, time_step: float) -> None:
        scene = plant.scene
        self.law = depth_law(scene)
        self._plant, self._same, self._limits = plant, SAME_TIME * time_step, run_limits(scene)
        self._cuts, self._slack = scene.tissue.rest_line == "cut-path", SAME_DEPTH * scene.needle.length
        self._levels = sorted({*interfaces(scene.tissue.layers), plant.smallest_depth, 0.0, self._limits.contact})
        self._horizon, self._times = 0.0, list[float]()
        self._crossings: dict[float, tuple[float, ...]] = {}

    def stretch(self, time: float, depth: float, deepest: float, inputs: Inputs) -> Stretch:
        """Return what comes after a time [s] at a depth [m]."""
        until = min(inputs.next_kink(time), self._kink_after(time + self._same))
        ramp = inputs.ramps.get("speed")
        if ramp is None:
            return Stretch(until)
        levels = [*self._levels, deepest] if self._cuts else self._levels  # from the deepest point on the needle cuts again
        if self._limits.final_depth is not None and ramp.target > 0.0:
            levels = [*levels, self._limits.final_depth]
        # At a level, and not a rounding before it, which would be passed again.
        start = next((level for level in levels if abs(level - depth) <= self._slack), depth)
        motion = CommandedMotion(Instant(time, start, ramp.value(time), ramp.slope(time)))
        return Stretch(min([until, motion.turning_time(), *(motion.passing_time(level) for level in levels)]), motion)

    def end_reason(self, time: float, depth: float, inputs: Inputs) -> str | None:
        """Return why a commanded speed ends the run here, None where it does not."""
        ramp = inputs.ramps.get("speed")
        if ramp is None:
            return None
        limits, speed = self._limits, ramp.value(time) or ramp.slope(time)
        if limits.final_depth is not None and speed > 0.0 and abs(depth - limits.final_depth) <= self._slack:
            return "final-depth"
        if speed > 0.0 and depth >= limits.contact - self._slack:
            return limits.contact_reason
        return "withdrawn" if speed < 0.0 and depth <= self._slack else None

    def crossing(self, level: float, time: float) -> float:
        """Return when the scene's own motion passes a depth [m] after a time [s]; infinity where it does not."""
        if level not in self._crossings:
            self._crossings[level] = self.law.crossings(level, run_duration(self._plant.scene))
        return next((found for found in self._crossings[level] if found > time), inf)

    def _kink_after(self, time: float) -> float:
        """Return the scene's first kink after a time; looked up further ahead as the run goes on: it may outlast the scene's."""
        if time >= self._horizon:
            planned = run_duration(self._plant.scene)
            self._horizon = planned if time < planned else 4.0 * time
            found = landing_times(self._plant.scene, self.law, self._horizon, self._plant.smallest_depth)
            self._times = [*found, self._horizon]
        return self._times[bisect_right(self._times, time)]
