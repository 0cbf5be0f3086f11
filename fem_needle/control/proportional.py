"""Proportional control that waits for a change and ignores faults of the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from fem_needle.control.controller import Command, Measurement
from fem_needle.control.gain_schedule import GainSchedule, factor_at
from fem_needle.control.signals import FREE, Limits, Reader


class ProportionalState(NamedTuple):
    """Last command and the error that it follows, None before the first."""

    command: float
    used: float | None = None


@dataclass(frozen=True)
class Proportional:
    """u = -f P e_used with e = y - target; e_used <- e where |e - e_used| > smallest_change and |e| < largest_error.

    f is the factor of the schedule at the present depth, 1 without one. Until the first change e_used is 0 and the command stays.

    Attributes
    ----------
    input, read, target
        What is commanded, how the output y is read, where it shall be.
    proportional
        P, input per output.
    smallest_change, largest_error
        In the unit of the output.
    limits, schedule, initial
        Of the actuator; of the gain; the command before the first decision.
    """

    input: str
    read: Reader
    target: float
    proportional: float
    smallest_change: float
    largest_error: float
    limits: Limits = FREE
    schedule: GainSchedule | None = None
    initial: float = 0.0

    def begin(self) -> ProportionalState:
        """Return the state before the first decision."""
        return ProportionalState(self.initial)

    def update(self, state: ProportionalState, time: float, measurement: Measurement) -> tuple[ProportionalState, Command]:
        """Return the next state and the command; see `Controller`."""
        output, factor = self.read(measurement), factor_at(self.schedule, measurement)
        if output is None or factor is None:
            return state, {self.input: state.command}
        error, used = output - self.target, state.used
        if abs(error) < self.largest_error and abs(error - (used or 0.0)) > self.smallest_change:
            used = error
        if used is None:
            return state, {self.input: state.command}
        command = self.limits.cut(-factor * self.proportional * used, state.command)
        return ProportionalState(command, used), {self.input: command}
