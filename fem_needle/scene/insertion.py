"""How the needle goes in: depth as a function of time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import inf
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import model_validator

from fem_needle.scene.part import Mistake, Part, raise_mistakes, shown
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.time_functions import Sinusoid, Table, as_function
from fem_needle.scene.time_quantity import TimeQuantity, TimeValue

# Which keys each kind of insertion needs, and which it takes as well.
_REQUIRED = {
    "hold": ("initial_depth",),
    "speed": ("initial_depth", "speed"),
    "profile": ("depth",),
    "force": ("initial_depth", "push_force"),
}
_ALLOWED = {"hold": (), "speed": ("final_depth",), "profile": ("initial_depth",), "force": ("final_depth",)}
_KEYS = ("initial_depth", "speed", "final_depth", "depth", "push_force")


class Insertion(Part):
    """How the needle goes in: z(t) prescribed, or a push.

    Parameters
    ----------
    kind
        ``"hold"``: stays at the initial depth; ``"speed"``: z is the integral of
        the speed; ``"profile"``: z is given; ``"force"``: z follows from a push.
    initial_depth
        z(0) [m]; a profile has its own.
    speed
        [m/s], positive going in; a plain number needs a final depth.
    final_depth
        z where the needle rests [m], once a speed has brought it there; where the run ends, with a push.
    depth
        z(t) [m] of a profile.
    push_force
        Axial force on the hub [N], positive when it pushes the needle in.
    """

    kind: Literal["hold", "speed", "profile", "force"]
    initial_depth: Annotated[float | None, Quantity("m", at_least=0.0, optional=True)] = None
    speed: Annotated[TimeValue | None, TimeQuantity("m/s", optional=True)] = None
    final_depth: Annotated[float | None, Quantity("m", at_least=0.0, optional=True)] = None
    depth: Annotated[TimeValue | None, TimeQuantity("m", optional=True)] = None
    push_force: Annotated[TimeValue | None, TimeQuantity("N", optional=True)] = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Insertion", self._key_mistakes())
        raise_mistakes("Insertion", self._value_mistakes())
        return self

    def _key_mistakes(self) -> Iterator[Mistake]:
        """Report missing keys and keys of another kind of insertion."""
        for key in _KEYS:
            value = getattr(self, key)
            if value is None and key in _REQUIRED[self.kind]:
                yield Mistake(key, f"is required by an insertion of kind '{self.kind}'")
            if value is not None and key not in _REQUIRED[self.kind] + _ALLOWED[self.kind]:
                allowed = ", ".join(_REQUIRED[self.kind] + _ALLOWED[self.kind])
                found = f"got {shown(value)}; allowed {allowed}"
                message = f"does not belong to an insertion of kind '{self.kind}' ({found})"
                yield Mistake(key, message, value)

    def _value_mistakes(self) -> Iterator[Mistake]:
        if isinstance(self.speed, Table | Sinusoid):
            if self.final_depth is not None and self.rest_time is None:
                limits = f"got {self.final_depth:g}; allowed what the integral of the speed reaches, m"
                yield Mistake("final_depth", f"is never reached ({limits})", self.final_depth)
        elif self.speed is not None:
            yield from self._final_depth_mistakes(self.speed)
        if self.depth is not None and self.initial_depth is not None:
            start = self.first_depth
            if abs(start - self.initial_depth) > 1e-12 * max(1.0, abs(start)):
                limits = f"got {self.initial_depth:g}; allowed {start:g} m"
                yield Mistake("initial_depth", f"the profile starts elsewhere ({limits})", self.initial_depth)

    def _final_depth_mistakes(self, speed: float) -> Iterator[Mistake]:
        if speed == 0.0:
            message = "does not move (got 0; allowed above or below 0 m/s, or kind = 'hold')"
            yield Mistake("speed", message, speed)
        elif self.final_depth is None:
            yield Mistake("final_depth", "is required by a plain speed")
        elif (self.final_depth - self.first_depth) * speed <= 0.0:
            side = "above" if speed > 0.0 else "below"
            limits = f"got {self.final_depth:g}; allowed {side} initial_depth = {self.first_depth:g} m"
            yield Mistake("final_depth", f"is not where the speed leads ({limits})", self.final_depth)

    @property
    def first_depth(self) -> float:
        """The depth at t = 0 [m]."""
        if self.depth is not None:
            return as_function(self.depth).value(0.0)
        return self.initial_depth or 0.0

    @property
    def rest_time(self) -> float | None:
        """When a prescribed speed has brought the needle to its final depth, where it rests [s]; None if it never does."""
        if self.kind != "speed" or self.final_depth is None:
            return None
        way = self.final_depth - self.first_depth
        if isinstance(self.speed, Table | Sinusoid):
            return _time_of_integral(self.speed, way)
        return way / self.speed if self.speed else None

    @property
    def end_time(self) -> float | None:
        """When the insertion ends [s]; None if it never does."""
        if self.rest_time is not None:
            return self.rest_time
        moving = self.speed if self.kind == "speed" else self.depth
        return moving.time[-1] if isinstance(moving, Table) and moving.time[-1] > 0.0 else None

    def depth_range(self, duration: float) -> tuple[float, float]:
        """Return the smallest and the largest depth [m] from 0 to ``duration`` [s], exactly."""
        with np.errstate(over="ignore", invalid="ignore"):
            depths = self._extreme_depths(duration)
        return float(np.min(depths)), float(np.max(depths))

    def _extreme_depths(self, duration: float) -> np.ndarray:
        """Return depths among which are the extremes."""
        first = self.first_depth
        moving = self.speed if self.kind == "speed" else self.depth
        if isinstance(moving, Table | Sinusoid):
            duration = min(duration, inf if self.rest_time is None else self.rest_time)
            inner = moving.zeros(duration) if self.kind == "speed" else moving.turning_points(duration)
            times = np.concatenate(([0.0, duration], inner))
            return first + moving.integral(times) if self.kind == "speed" else moving.value(times)
        if isinstance(moving, float) and self.kind == "speed" and self.final_depth is not None:
            share = min(1.0, duration / (self.end_time or duration))
            return np.array([first, first + share * (self.final_depth - first)])
        return np.array([first])


def _time_of_integral(speed: Table | Sinusoid, way: float) -> float | None:
    """Return the first time [s] at which the integral of a speed is ``way`` [m], by bisection of a monotone piece."""
    if isinstance(speed, Table):
        horizon = speed.time[-1] + abs(way / speed.values[-1]) * 2 + 1.0 if speed.values[-1] else speed.time[-1]
    else:
        horizon = (2.0 + abs(way / speed.mean if speed.mean else 0.0) * speed.frequency) / speed.frequency
    marks = [0.0, *speed.zeros(horizon).tolist(), horizon]
    for start, end in pairwise(marks):
        low, high = speed.integral(start) - way, speed.integral(end) - way
        if low * high > 0.0:
            continue
        return _bisected(speed, way, start, end)
    return None


def _bisected(speed: Table | Sinusoid, way: float, start: float, end: float) -> float:
    """Return where the integral of a speed passes ``way`` between two times that enclose it [s]."""
    sign = speed.integral(start) - way
    while True:
        middle = 0.5 * (start + end)
        if middle in {start, end}:
            return end
        if (speed.integral(middle) - way) * sign > 0.0:
            start = middle
        else:
            end = middle
