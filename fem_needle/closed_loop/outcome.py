"""What a loop is judged by: the tip at the target, and what the actuators spent on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

from fem_needle.closed_loop.inputs import Inputs, Ramp
from fem_needle.scene import Scene

SAME_DEPTH = 1e-12  # of the needle's length


@dataclass(frozen=True)
class Arrival:
    """The tip where it is nearest to the target: at its depth, or, as long as it has not been there, now.

    Attributes
    ----------
    time, depth, tip_deflection
        [s], [m], [m].
    reached
        Whether the target's depth has been reached; True where the target has none.
    """

    time: float
    depth: float
    tip_deflection: float
    reached: bool

    def followed(self, scene: Scene, time: float, depth: float, tip_deflection: float) -> Arrival:
        """Return the arrival after the needle has gone on to a state; what lies between is taken as linear in the depth."""
        target, slack = scene.target.depth, SAME_DEPTH * scene.needle.length
        if target is None:
            return Arrival(time, depth, tip_deflection, True)
        if self.reached:
            return self
        if depth < target - slack:
            return Arrival(time, depth, tip_deflection, False)
        share = (target - self.depth) / (depth - self.depth) if depth - target > slack and depth > self.depth else 1.0
        return Arrival(
            self.time + share * (time - self.time),
            target,
            self.tip_deflection + share * (tip_deflection - self.tip_deflection),
            True,
        )


def first_arrival(scene: Scene, depth: float, tip_deflection: float) -> Arrival:
    """Return the arrival at t = 0."""
    start = Arrival(0.0, depth, tip_deflection, False)
    return start.followed(scene, 0.0, depth, tip_deflection)


class Effort(NamedTuple):
    """What an input has done.

    Attributes
    ----------
    integral
        Integral of its magnitude over time, in its SI unit times seconds.
    largest
        Its largest magnitude.
    """

    integral: float = 0.0
    largest: float = 0.0

    def after(self, ramp: Ramp, start: float, end: float) -> Effort:
        """Return the effort after an input has acted from one time to another [s]."""
        if start >= ramp.arrival:
            held = abs(ramp.target)
            return Effort(self.integral + held * (end - start), max(self.largest, held))
        largest = max(self.largest, abs(ramp.value(start)), abs(ramp.value(end)))
        return Effort(self.integral + magnitude_integral(ramp, start, end), largest)


class AccountState(NamedTuple):
    """What an account remembers: efforts, arrival, where the tip was last, until when efforts are counted [s], `awaits`."""

    efforts: dict[str, Effort]
    arrival: Arrival
    last: tuple[float, float, float]
    closed: float
    awaits: float


class Account:
    """Arrival and efforts of a run under way; what is asked at every decision is kept cheap.

    Attributes
    ----------
    awaits
        Depth [m] of the target that the tip has not reached yet; 0 where there is none.
    """

    def __init__(self, scene: Scene, depth: float, tip_deflection: float) -> None:
        self._scene, self._efforts = scene, dict[str, Effort]()
        self._arrival = first_arrival(scene, depth, tip_deflection)
        self._last, self._closed = (0.0, depth, tip_deflection), 0.0
        target = scene.target.depth
        self.awaits = 0.0 if target is None or self._arrival.reached else target
        self._slack = SAME_DEPTH * scene.needle.length

    def follow(self, time: float, depth: float, tip_deflection: float) -> None:
        """Note where the tip is."""
        if self.awaits and depth >= self.awaits - self._slack:
            before = Arrival(*self._last, False)
            self._arrival = before.followed(self._scene, time, depth, tip_deflection)
            self.awaits = 0.0
        self._last = (time, depth, tip_deflection)

    def close(self, time: float, inputs: Inputs) -> None:
        """Add what the inputs have done since they were commanded, before they change at a time [s]."""
        for name, ramp in inputs.ramps.items():
            self._efforts[name] = self._efforts.get(name, Effort()).after(ramp, self._closed, time)
        self._closed = time

    def closed(self, time: float, inputs: Inputs) -> tuple[Arrival, dict[str, Effort]]:
        """Return the arrival, or the present state where the target is not reached, and the efforts up to a time [s]."""
        self.close(time, inputs)
        no_target = self._scene.target.depth is None
        arrival = Arrival(*self._last, no_target) if self.awaits or no_target else self._arrival
        return arrival, dict(self._efforts)

    def state(self) -> AccountState:
        """Return a copy of everything that is remembered."""
        return AccountState(self._efforts.copy(), self._arrival, self._last, self._closed, self.awaits)

    def restore(self, state: AccountState) -> None:
        """Go back to a state."""
        efforts, self._arrival, self._last, self._closed, self.awaits = state
        self._efforts = efforts.copy()


def magnitude_integral(ramp: Ramp, start: float, end: float) -> float:
    """Return the integral of the magnitude of an input over time, exactly."""
    slope = ramp.slope(ramp.time)
    zero = ramp.time - ramp.start / slope if slope else inf
    marks = [start, *sorted(mark for mark in (zero, ramp.arrival) if start < mark < end), end]
    values = [abs(ramp.value(mark)) for mark in marks]
    return sum(0.5 * (values[index] + values[index + 1]) * (marks[index + 1] - marks[index]) for index in range(len(marks) - 1))


def outcome(scene: Scene, arrival: Arrival, efforts: Mapping[str, Effort]) -> dict[str, Any]:
    """Return what the summary of a loop says beside that of a run, SI."""
    return {
        "controller": {
            "kind": scene.controller.kind,
            "variant": scene.controller.variant,
            "schedule": scene.controller.schedule,
            "input": scene.controller.input,
            "period": scene.controller.period,
        },
        "sensors": [sensor.kind for sensor in scene.sensors],
        "target_reached": arrival.reached,
        "target_time": arrival.time,
        "target_depth": arrival.depth,
        "target_error": arrival.tip_deflection - scene.target.lateral,
        "effort": {name: effort.integral for name, effort in efforts.items()},
        "largest_command": {name: effort.largest for name, effort in efforts.items()},
    }
