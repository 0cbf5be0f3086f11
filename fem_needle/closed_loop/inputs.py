"""What a command does to a scene: limits, rates, and the scene as it is while commands hold."""

from __future__ import annotations

from collections.abc import Mapping
from math import copysign, inf, isfinite
from types import MappingProxyType
from typing import Any, NamedTuple

from fem_needle.control.signals import actuator_rate, limited, own_value
from fem_needle.errors import SceneError
from fem_needle.scene import LateralLoad, Scene, Table, TipLoad
from fem_needle.scene.cross_checks import input_obstacle
from fem_needle.scene.time_quantity import TimeValue


class Ramp(NamedTuple):
    """An input that goes from a value to a target at a limited rate and stays there.

    Attributes
    ----------
    time, start
        When it was commanded [s], and its value then, in the SI unit of the input.
    target
        Where it goes.
    rate
        Largest change per second; infinity: at once.
    """

    time: float
    start: float
    target: float
    rate: float = inf

    @property
    def arrival(self) -> float:
        """When the target is reached [s]."""
        return self.time + abs(self.target - self.start) / self.rate

    def value(self, time: float) -> float:
        """Return the value at a time [s], from the right."""
        if time >= self.arrival:
            return self.target
        return self.start + copysign(self.rate, self.target - self.start) * (time - self.time)

    def slope(self, time: float) -> float:
        """Return the change per second at a time [s], from the right."""
        return 0.0 if time >= self.arrival else copysign(self.rate, self.target - self.start)

    def function(self, time: float) -> TimeValue:
        """Return the input from a time [s] on, as a scene holds it: a number once it has arrived."""
        if time >= self.arrival:
            return self.target
        return Table(time=(self.time, self.arrival), value=(self.start, self.target))


class Inputs(NamedTuple):
    """The inputs of a scene that were commanded; the others are the scene's own.

    Attributes
    ----------
    scene
        The scene.
    ramps
        By name.
    """

    scene: Scene
    ramps: Mapping[str, Ramp] = MappingProxyType({})

    def commanded(self, time: float, command: Mapping[str, float]) -> Inputs:
        """Return the inputs after a command [SI] at a time [s]: cut to the limits, approached at the rate of its actuator.

        Raises
        ------
        SceneError
            If the scene has no such input, or the command is not finite.
        """
        changed: dict[str, Ramp] = {}
        for name, wanted in command.items():
            known = self.ramps.get(name)
            if known is None:
                _check_input(self.scene, name)
            if not isfinite(wanted):
                raise SceneError(f"{name}: is not finite (got {wanted:g} at time {time:g} s; allowed any finite number)")
            target = limited(self.scene, name, float(wanted))
            if known is None or known.target != target:
                changed[name] = Ramp(time, self.value(name, time), target, actuator_rate(self.scene, name))
        return Inputs(self.scene, {**self.ramps, **changed}) if changed else self

    def value(self, name: str, time: float) -> float:
        """Return an input [SI] at a time [s], from the right; the scene's own where it was never commanded."""
        ramp = self.ramps.get(name)
        return own_value(self.scene, name, time) if ramp is None else ramp.value(time)

    def own_value(self, name: str, time: float) -> float:
        """Return what the scene itself says of an input [SI] at a time [s]."""
        return own_value(self.scene, name, time)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how it is made again: from a plain dictionary."""
        return Inputs, (self.scene, dict(self.ramps))

    def next_kink(self, time: float) -> float:
        """Return when the next ramp after a time arrives [s]; infinity where none is under way."""
        found = inf
        for ramp in self.ramps.values():
            if time < ramp.arrival < found:
                found = ramp.arrival
        return found


def _check_input(scene: Scene, name: str) -> None:
    obstacle = input_obstacle(scene, name)
    if obstacle is not None:
        raise SceneError(f"command: '{name}' {obstacle}")


def with_inputs(scene: Scene, functions: Mapping[str, TimeValue]) -> Scene:
    """Return a scene with some inputs replaced, without checking it again: commands are numbers within limits."""
    support = {name: value for name, value in functions.items() if name in {"hub_deflection", "hub_angle", "hub_torque"}}
    changes: dict[str, Any] = {"support": scene.support.model_copy(update=support)} if support else {}
    if "push_force" in functions:
        changes["insertion"] = scene.insertion.model_copy(update={"push_force": functions["push_force"]})
    loads = {LateralLoad: ("force", "lateral_force"), TipLoad: ("direction", "tip_direction")}
    if {"lateral_force", "tip_direction"} & set(functions):
        changed = []
        for load in scene.loads:
            key, name = loads[type(load)]
            changed.append(load.model_copy(update={key: functions[name]}) if name in functions else load)
        changes["loads"] = tuple(changed)
    return scene.model_copy(update=changes)
