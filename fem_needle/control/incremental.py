"""Incremental control: a step of the command when the error is large and changes."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from fem_needle.control.controller import Command, Measurement
from fem_needle.control.gain_schedule import GainSchedule, sign_at
from fem_needle.control.signals import FREE, Limits, Reader


class IncrementalState(NamedTuple):
    """Last command and the error of the decision before."""

    command: float
    error: float = 0.0


@dataclass(frozen=True)
class Incremental:
    """u <- u - sign(e) sign(g) b where |e| > threshold 1 and |e - e_before| > threshold 2, e = y - target; |u| <= threshold 3.

    sign(g) is the schedule's (0 where the model's gain is too small), 1 without one. Before the first reading e_before is 0.

    Attributes
    ----------
    input, read, target
        What is commanded, how the output y is read, where it shall be.
    smallest_error, smallest_change
        Thresholds 1 and 2, in the unit of the output.
    increment
        b, in the unit of the input.
    largest_command
        Threshold 3, in the unit of the input.
    limits, schedule, initial
        Of the actuator; of the sign; the command before the first decision.
    """

    input: str
    read: Reader
    target: float
    smallest_error: float
    smallest_change: float
    increment: float
    largest_command: float = inf
    limits: Limits = FREE
    schedule: GainSchedule | None = None
    initial: float = 0.0

    def begin(self) -> IncrementalState:
        """Return the state before the first decision."""
        return IncrementalState(self.initial)

    def update(self, state: IncrementalState, time: float, measurement: Measurement) -> tuple[IncrementalState, Command]:
        """Return the next state and the command; see `Controller`."""
        output, sign = self.read(measurement), sign_at(self.schedule, measurement)
        if output is None or sign is None:
            return state, {self.input: state.command}
        error, command = output - self.target, state.command
        if abs(error) > self.smallest_error and abs(error - state.error) > self.smallest_change:
            command -= sign * self.increment if error > 0.0 else -sign * self.increment
        command = min(max(command, -self.largest_command), self.largest_command)
        command = self.limits.cut(command, state.command)
        return IncrementalState(command, error), {self.input: command}
