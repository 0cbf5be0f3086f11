"""Proportional, integral and derivative control."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from fem_needle.control.controller import Command, Measurement
from fem_needle.control.gain_schedule import GainSchedule, factor_at
from fem_needle.control.signals import FREE, Limits, Reader


class PidState(NamedTuple):
    """Last command, integral of the error, last output (None: none yet) and its filtered rate with the sign of the error's."""

    command: float
    integral: float = 0.0
    output: float | None = None
    rate: float = 0.0


@dataclass(frozen=True)
class Pid:
    """u = f (P e + I S + D d), e = target - y, cut to the limits; once in a period T

        S <- S + T e,      d <- (T_f d - (y - y_before)) / (T_f + T):

    the integral by rectangles, the derivative that of the measurement through a first-order filter, backward Euler both. f is the
    factor of the schedule, 1 without one. S does not advance while the command is cut and e would drive it further.

    Attributes
    ----------
    input, read, target
        What is commanded, how the output y is read, where it shall be.
    period
        T [s].
    proportional, integral, derivative
        P, I, D: input per output, per output and second, times second.
    filter_time
        T_f [s].
    limits, schedule, initial
        Of the actuator; of the gains; the command before the first decision.
    """

    input: str
    read: Reader
    target: float
    period: float
    proportional: float
    integral: float
    derivative: float
    filter_time: float
    limits: Limits = FREE
    schedule: GainSchedule | None = None
    initial: float = 0.0

    def begin(self) -> PidState:
        """Return the state before the first decision."""
        return PidState(self.initial)

    def update(self, state: PidState, time: float, measurement: Measurement) -> tuple[PidState, Command]:
        """Return the next state and the command; see `Controller`."""
        output, factor = self.read(measurement), factor_at(self.schedule, measurement)
        if output is None or factor is None:
            return state, {self.input: state.command}
        error = self.target - output
        change = 0.0 if state.output is None else output - state.output
        rate = (self.filter_time * state.rate - change) / (self.filter_time + self.period)
        direct = factor * (self.proportional * error + self.derivative * rate)
        gain, total = factor * self.integral, state.integral + self.period * error
        wanted = direct + gain * total
        command = self.limits.cut(wanted, state.command)
        if (wanted - command) * gain * error > 0.0:
            total = state.integral
            command = self.limits.cut(direct + gain * total, state.command)
        return PidState(command, total, output, rate), {self.input: command}
