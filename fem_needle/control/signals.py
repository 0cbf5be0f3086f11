"""What goes into a controller and out of it: the output read, the input's own value, the actuator's limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from fem_needle.control.controller import Measurement
from fem_needle.scene import Scene, TipLoad, as_function
from fem_needle.scene.signals import IMAGE_ERROR

Reader = Callable[[Measurement], float | None]


def output_reader(output: str) -> Reader:
    """Return the function that finds the output in a measurement, None while a reading is missing.

    Parameters
    ----------
    output
        Name of a reading, or ``"image_error"``: (tip deflection + tissue displacement) / 2 [m].
    """
    if output != IMAGE_ERROR:
        return lambda measurement: measurement.get(output)

    def image_error(measurement: Measurement) -> float | None:
        tip, tissue = measurement.get("tip_deflection"), measurement.get("tissue_displacement")
        return None if tip is None or tissue is None else 0.5 * (tip + tissue)

    return image_error


def own_value(scene: Scene, name: str, time: float = 0.0) -> float:
    """Return what the scene itself gives an input that it has, at a time [s], in SI."""
    if name == "tip_direction":
        value = next(load.direction for load in scene.loads if isinstance(load, TipLoad))
    elif name == "lateral_force":
        value = scene.lateral_loads[0].force
    else:
        value = getattr(scene.insertion if name in {"push_force", "speed"} else scene.support, name)
    return float(as_function(0.0 if value is None else value).value(time))


@dataclass(frozen=True)
class Limits:
    """What an actuator can do, in SI.

    Attributes
    ----------
    minimum, maximum
        Of the command.
    step
        Largest change in one period: rate times period.
    """

    minimum: float = -inf
    maximum: float = inf
    step: float = inf

    def cut(self, wanted: float, last: float) -> float:
        """Return the allowed command nearest to the wanted one: in the range, then at most a step from the last."""
        inside = min(max(wanted, self.minimum), self.maximum)
        return min(max(inside, last - self.step), last + self.step)


FREE = Limits()


def limited(scene: Scene, name: str, wanted: float) -> float:
    """Return a command cut to the limits of its actuator, SI; a direction is a cosine and never leaves -1 to 1."""
    actuator = getattr(scene.actuators, name)
    if name == "tip_direction":
        wanted = min(max(wanted, -1.0), 1.0)
    if actuator is None:
        return wanted
    if actuator.maximum is not None:
        wanted = min(wanted, actuator.maximum)
    return wanted if actuator.minimum is None else max(wanted, actuator.minimum)


def actuator_rate(scene: Scene, name: str) -> float:
    """Return by how much an input may change in a second, SI."""
    actuator = getattr(scene.actuators, name)
    return inf if actuator is None or actuator.rate is None else actuator.rate


def actuator_limits(scene: Scene) -> Limits:
    """Return the limits of the controller's input."""
    name = scene.controller.input
    step = actuator_rate(scene, name) * scene.controller.period
    return Limits(limited(scene, name, -inf), limited(scene, name, inf), step)
