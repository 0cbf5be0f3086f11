"""Depth over time of a position-driven insertion, and the times at which it, or the scene around it, has a kink."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import inf, nextafter

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle.loads import second_derivative
from fem_needle.rigid_push import time_to_depth
from fem_needle.scene import Scene, Sinusoid, Table, TimeFunction, TipLoad, as_function
from fem_needle.segments import interfaces

Array = NDArray[np.float64]

PUSH_SLACK = 5.0
SLIDING_RADIUS = 0.0  # spectral radius under rigid guides that a needle slides through


@dataclass(frozen=True)
class Instant:
    """Time [s], depth [m], speed [m/s] and acceleration [m/s^2] of the insertion."""

    time: float
    depth: float
    speed: float
    acceleration: float


@dataclass(frozen=True)
class DepthLaw:
    """Prescribed depth z(t).

    Attributes
    ----------
    scene
        The scene whose ``[insertion]`` it is.
    rests_from
        Time [s] from which the needle rests at ``final_depth``; infinity where it never does.
    """

    scene: Scene
    rests_from: float

    def depth(self, time: float) -> float:
        """Return z(t) [m]."""
        return float(self.depths(np.asarray(time)))

    def depths(self, times: Array) -> Array:
        """Return z at many times [m]."""
        insertion = self.scene.insertion
        if insertion.kind == "profile":
            return self._source.value(times)
        if insertion.kind in {"hold", "force"}:
            return np.full(times.shape, insertion.first_depth)
        moving = insertion.first_depth + self._source.integral(times)
        return moving if insertion.final_depth is None else np.where(times >= self.rests_from, insertion.final_depth, moving)

    def layer_depth(self, start: float, end: float) -> float:
        """Return the depth in the middle of a step [m]."""
        return self.depth(0.5 * (start + end))

    def speed(self, time: float) -> float:
        """Return dz/dt from the right [m/s]."""
        return float(self.speeds(np.asarray(time)))

    def speeds(self, times: Array) -> Array:
        """Return dz/dt from the right at many times [m/s]."""
        insertion = self.scene.insertion
        if insertion.kind == "profile":
            return self._source.derivative(times)
        if insertion.kind in {"hold", "force"}:
            return np.zeros(times.shape)
        return np.where(times >= self.rests_from, 0.0, self._source.value(times))

    def accelerations(self, times: Array) -> Array:
        """Return the second derivative of z from the right at many times, without the jumps of speed [m/s^2]."""
        insertion = self.scene.insertion
        if insertion.kind in {"hold", "force"}:
            return np.zeros(times.shape)
        rate = self._source.derivative(times) if insertion.kind == "speed" else second_derivative(self._source, times)
        return np.where(times >= self.rests_from, 0.0, rate)

    def acceleration(self, time: float) -> float:
        """Return the same at one time [m/s^2]."""
        return float(self.accelerations(np.asarray(time)))

    def after(self, time: float) -> Instant:
        """Return the motion just after a time."""
        return Instant(time, self.depth(time), self.speed(time), self.acceleration(time))

    def before(self, time: float) -> Instant:
        """Return the motion just before a time: at a kink, its left side."""
        earlier = nextafter(time, -inf)
        return Instant(time, self.depth(time), self.speed(earlier), self.acceleration(earlier))

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) where the speed or its slope jumps [s]."""
        times = {time for time in self._source.breakpoints if time < self.rests_from}
        return tuple(sorted(time for time in times | {self.rests_from} if 0 < time < duration))

    def turning_times(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the needle may turn round [s]."""
        source = self._source
        if not isinstance(source, Table | Sinusoid):
            return ()
        is_profile = self.scene.insertion.kind == "profile"
        times = source.turning_points(duration) if is_profile else source.zeros(duration)
        return tuple(float(time) for time in times if time < self.rests_from)

    def crossings(self, level: float, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the depth passes a level [m]."""
        return tuple(
            time for time in _crossings(self.depth, self._monotone_pieces(duration), level) if 0 < time < duration
        )

    def fastest(self, duration: float) -> float:
        """Return the largest speed in either direction [m/s]."""
        times = self._monotone_pieces(duration)
        middles = [0.5 * (first + second) for first, second in pairwise(times)]
        return max(abs(self.speed(time)) for time in [*times, *middles])

    @property
    def _source(self) -> TimeFunction:
        """The scene's depth (profile) or speed as a function of time."""
        insertion = self.scene.insertion
        source = insertion.depth if insertion.kind == "profile" else insertion.speed
        return as_function(0.0 if source is None else source)

    def _monotone_pieces(self, duration: float) -> list[float]:
        """Times between which the depth rises or falls throughout."""
        marks = {0.0, duration, *self.kinks(duration), *self.turning_times(duration)}
        return sorted(time for time in marks if 0 <= time <= duration)


def depth_law(scene: Scene) -> DepthLaw:
    """Return the depth law of a position-driven scene."""
    rests = scene.insertion.rest_time
    return DepthLaw(scene, inf if rests is None else rests)


def run_duration(scene: Scene) -> float:
    """Return how long the run lasts [s]: as the scene says, else until the insertion ends.

    A push to a final depth gets several times what a rigid needle would take: it ends by itself.
    """
    if scene.run.duration is not None:
        return scene.run.duration
    if scene.insertion.kind == "force":
        return PUSH_SLACK * time_to_depth(scene)
    return float(scene.insertion.end_time or 0.0)


def may_move(scene: Scene) -> bool:
    """Return whether the depth changes in a run, or may be made to: a speed of 0 may be commanded to change."""
    lowest, highest = scene.insertion.depth_range(scene.duration)
    return highest > lowest or scene.insertion.kind in {"force", "speed"}


def wanted_radius(scene: Scene) -> float:
    """Return the integrator's spectral radius: the scene's; "auto": 1, but 0 of a needle that slides in rigid guides.

    They are index-3 constraints that move through the mesh: what one step misses of them, an undamped method keeps for ever.
    """
    if isinstance(scene.numerics.spectral_radius, float):
        return scene.numerics.spectral_radius
    slides = may_move(scene) and any(guide.stiffness == "rigid" for guide in scene.support.guides)
    return SLIDING_RADIUS if slides else 1.0


def lateral_values(scene: Scene) -> list[float | Table | Sinusoid]:
    """Return what moves the needle sideways and may vary in time: the hub, the tissue's swelling, forces and their directions."""
    support, loads = scene.support, scene.loads
    values = [support.hub_deflection, support.hub_angle, support.hub_torque, scene.tissue.stiffness_factor]
    values += [load.force for load in loads if load.force is not None]
    return values + [load.direction for load in loads if isinstance(load, TipLoad)]


def shortest_period(scene: Scene) -> float:
    """Return the shortest period [s] of any sinusoid of the scene, infinity without one."""
    insertion = scene.insertion
    sources = [value for value in (insertion.speed, insertion.depth, insertion.push_force) if value is not None]
    sources += lateral_values(scene)
    rates = [abs(source.frequency) for source in sources if isinstance(source, Sinusoid)]
    return 1.0 / max(rates) if rates and max(rates) > 0 else float("inf")


def landing_times(scene: Scene, law: DepthLaw, duration: float, smallest_depth: float) -> tuple[float, ...]:
    """Return every time in (0, duration) on which a step must land: kinks of motion, loads and layers."""
    sources = lateral_values(scene)
    sources += [] if scene.insertion.push_force is None else [scene.insertion.push_force]
    times = set(law.kinks(duration))
    for source in sources:
        times |= {time for time in as_function(source).breakpoints if 0 < time < duration}
    levels = [level for level in interfaces(scene.tissue.layers) if level > 0]
    if smallest_depth:
        levels.append(smallest_depth)
    if scene.tissue.rest_line == "cut-path":  # where the needle turns, and where it reaches uncut tissue again
        turns = law.turning_times(duration)
        times |= set(turns)
        levels += [law.depth(time) for time in turns]
    for level in levels:
        times |= set(law.crossings(level, duration))
    return tuple(sorted(times))


def _crossings(depth: Callable[[float], float], times: list[float], level: float) -> Iterator[float]:
    for first, second in pairwise(times):
        start, end = depth(first) - level, depth(second) - level
        if start == 0.0:
            yield first
        elif start * end < 0:
            yield float(scipy.optimize.brentq(lambda time: depth(time) - level, first, second, xtol=1e-15))
        elif end == 0.0:
            yield second
