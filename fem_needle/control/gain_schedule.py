"""Gains that follow the model's own static gain over the depth, its sign included."""

from __future__ import annotations

from dataclasses import dataclass

from fem_needle.control.controller import Measurement
from fem_needle.control.model_response import ModelResponse


@dataclass(frozen=True)
class GainSchedule:
    """A factor on gains that were chosen for the largest |g| on the way, g_ref.

    Attributes
    ----------
    response
        Of the model.
    smallest_response
        s, a share of g_ref: where |g| is about it or below, the model's gain is not trusted.
    """

    response: ModelResponse
    smallest_response: float

    def factor(self, depth: float) -> float:
        """Return g g_ref / (g^2 + (s g_ref)^2) at a depth [m]: about g_ref / g, at most 1 / 2s, zero where g is.

        So 0 <= factor g < g_ref: the gain of the loop is never above the one that the gains were chosen for.
        """
        gain, largest = self.response.gain(depth), self.response.largest_gain
        floor = self.smallest_response * largest
        return gain * largest / (gain * gain + floor * floor)

    def sign(self, depth: float) -> float:
        """Return the sign of g at a depth [m], 0 where |g| < s g_ref."""
        gain = self.response.gain(depth)
        if abs(gain) < self.smallest_response * self.response.largest_gain:
            return 0.0
        return 1.0 if gain > 0.0 else -1.0


def factor_at(schedule: GainSchedule | None, measurement: Measurement) -> float | None:
    """Return the factor at the measured depth, 1 without a schedule, None while the depth is unknown."""
    if schedule is None:
        return 1.0
    depth = measurement.get("depth")
    return None if depth is None else schedule.factor(depth)


def sign_at(schedule: GainSchedule | None, measurement: Measurement) -> float | None:
    """Return the sign at the measured depth, 1 without a schedule, None while the depth is unknown."""
    if schedule is None:
        return 1.0
    depth = measurement.get("depth")
    return None if depth is None else schedule.sign(depth)
