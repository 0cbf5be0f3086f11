"""Input-output linearization of the tip on the quasi-static model."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

from fem_needle.control.controller import Command, Measurement
from fem_needle.control.model_response import ModelResponse
from fem_needle.control.signals import FREE, Limits, Reader
from fem_needle.errors import ComputationError

SLACK = 1e-9  # of a period: rounding of the times of decisions


class InverseState(NamedTuple):
    """Last command; depth [m] and time [s] from which the speed is reckoned (None: none yet); speed [m/s]."""

    command: float
    depth: float | None = None
    time: float = 0.0
    speed: float = 0.0


@dataclass(frozen=True)
class InverseDynamics:
    """Brings the error of the tip down as exp(-rate t), if the tip is y0(z) + g(z) u + an unknown constant.

        y_d = target + (y - target) exp(-rate T),   z' = z + T (speed by the last two depths)
        u <- u + (y_d - y - [y0(z') - y0(z)] - [g(z') - g(z)] u) / g(z')

    Attributes
    ----------
    input, read, target
        What is commanded, how the output y is read, where it shall be.
    period, rate
        T [s], rate [1/s].
    response
        g and y0 of the model.
    smallest_response
        Smallest |g| that is divided by, as a share of the largest.
    encoder_period
        Between two readings of the depth, at least the period [s]: the speed is reckoned no oftener.
    limits, initial
        Of the actuator; the command before the first decision.
    """

    input: str
    read: Reader
    target: float
    period: float
    rate: float
    response: ModelResponse
    smallest_response: float
    encoder_period: float
    limits: Limits = FREE
    initial: float = 0.0

    def begin(self) -> InverseState:
        """Return the state before the first decision."""
        return InverseState(self.initial)

    def update(self, state: InverseState, time: float, measurement: Measurement) -> tuple[InverseState, Command]:
        """Return the next state and the command; see `Controller`.

        Raises
        ------
        ComputationError
            Where the model's gain is too small to divide by.
        """
        output, depth = self.read(measurement), measurement.get("depth")
        if output is None or depth is None:
            return state, {self.input: state.command}
        before, since, speed = self._motion(state, time, depth)
        ahead = depth + speed * self.period
        gain, rest, last = self.response.gain, self.response.rest, state.command
        response = gain(ahead)
        if abs(response) < self.smallest_response * self.response.largest_gain:
            raise ComputationError(self._refusal(time, ahead, response))
        fall = (output - self.target) * (1.0 - exp(-self.rate * self.period))
        moved = rest(ahead) - rest(depth) + (response - gain(depth)) * last
        command = self.limits.cut(last - (fall + moved) / response, last)
        return InverseState(command, before, since, speed), {self.input: command}

    def _motion(self, state: InverseState, time: float, depth: float) -> tuple[float, float, float]:
        """Return the depth and time from which the next speed is reckoned, and the speed now."""
        if state.depth is None:
            return depth, time, 0.0
        passed = time - state.time
        if passed < self.encoder_period - SLACK * self.period:
            return state.depth, state.time, state.speed
        return depth, time, (depth - state.depth) / passed

    def _refusal(self, time: float, depth: float, response: float) -> str:
        largest = self.response.largest_gain
        return (
            f"inverse dynamics at time {time:g} s, depth {depth:g} m: {self.input} hardly moves the tip (static gain "
            f"{response:.3g}, allowed at least {self.smallest_response:g} of the largest on the way, {largest:.3g}, in SI); "
            "choose another controller.input, a pid with schedule = 'model-gain', or stop the insertion before"
        )
