"""The insertion while a commanded speed holds or ramps."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, sqrt

from fem_needle.motion import Instant


@dataclass(frozen=True)
class CommandedMotion:
    """z(t) from an instant on, with a constant acceleration: what a stepper asks of a depth law.

    Attributes
    ----------
    origin
        Time [s], depth [m], speed [m/s] and acceleration [m/s^2] from which it goes on.
    """

    origin: Instant

    def depth(self, time: float) -> float:
        """Return z(t) [m]."""
        passed = time - self.origin.time
        return self.origin.depth + passed * (self.origin.speed + 0.5 * self.origin.acceleration * passed)

    def layer_depth(self, start: float, end: float) -> float:
        """Return the depth in the middle of a step [m]."""
        return self.depth(0.5 * (start + end))

    def after(self, time: float) -> Instant:
        """Return the motion just after a time."""
        speed = self.origin.speed + self.origin.acceleration * (time - self.origin.time)
        return Instant(time, self.depth(time), speed, self.origin.acceleration)

    def before(self, time: float) -> Instant:
        """Return the motion just before a time."""
        return self.after(time)

    def turning_time(self) -> float:
        """Return when it turns round [s], infinity where it does not."""
        acceleration = self.origin.acceleration
        passed = -self.origin.speed / acceleration if acceleration else inf
        return self.origin.time + passed if isfinite(passed) and passed > 0.0 else inf

    def passing_time(self, level: float) -> float:
        """Return when it first passes a level [m] that it is not at, infinity where it never does."""
        gap, speed, acceleration = level - self.origin.depth, self.origin.speed, self.origin.acceleration
        if gap == 0.0:
            return inf
        if acceleration == 0.0:
            passed = gap / speed if speed else inf
            return self.origin.time + passed if passed > 0.0 else inf
        square = speed**2 + 2.0 * acceleration * gap
        if square < 0.0:
            return inf
        root = sqrt(square)
        # Both roots of z(t) = level, without the difference of nearly equal numbers.
        larger = -(speed + root) if speed >= 0.0 else root - speed
        found = [larger / acceleration, -2.0 * gap / larger if larger else inf]
        return self.origin.time + min((passed for passed in found if passed > 0.0), default=inf)
