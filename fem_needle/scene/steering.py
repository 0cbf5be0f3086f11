"""A closed loop: target, sensors, controller, actuators, and what differs from one repetition to the next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import model_validator

from fem_needle.scene.part import Mistake, Part, raise_mistakes, shown
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.signals import (
    IMAGE_ERROR,
    INPUT_UNITS,
    READINGS,
    InputName,
    SensorKind,
    gain_units,
    limit_units,
    output_units,
)
from fem_needle.scene.spelling import known_name
from fem_needle.scene.units import to_si

__all__ = [
    "GAIN_KEYS",
    "IMAGE_ERROR",
    "INPUT_UNITS",
    "READINGS",
    "VARIANTS",
    "Actuator",
    "Actuators",
    "Controller",
    "Gains",
    "Scatter",
    "Sensor",
    "Target",
]

ControllerKind = Literal["none", "pid", "inverse-dynamics", "incremental", "proportional"]

SIGNAL_PREFIXES = ("command_", "measurement_")
_IMAGING = ("tip-imaging", "tissue-deformation", "needle-shape")
# Keys of a sensor that only some kinds take.
_SENSOR_KEYS = {
    "pixel_size": _IMAGING,
    "resolution": ("base-force", "base-moment", "encoder"),
    "decay_length": ("tissue-deformation",),
    "marker_spacing": ("tissue-deformation",),
    "stations": ("needle-shape",),
}
GAIN_KEYS: dict[str, tuple[str, ...]] = {
    "none": (),
    "pid": ("proportional", "integral", "derivative", "filter_time"),
    "inverse-dynamics": ("position", "velocity", "rate", "smallest_response"),
    "incremental": ("smallest_error", "smallest_change", "largest_command", "increment"),
    "proportional": ("proportional", "smallest_change", "largest_error"),
}
_NAMES = {"input": tuple(INPUT_UNITS), "output": (*output_units(), IMAGE_ERROR)}
VARIANTS: dict[str, tuple[str, ...]] = {
    "none": (),
    "pid": (),
    "inverse-dynamics": ("realizable", "fully-actuated"),
    "incremental": ("intended",),
    "proportional": ("intended", "as-printed"),
}


def signal_description(name: str) -> tuple[str, str]:
    """Return unit and meaning of a command or measurement, ``command_<input>`` or ``measurement_<reading>``."""
    kind, _, what = name.partition("_")
    if kind == "command":
        return INPUT_UNITS[what], f"{what.replace('_', ' ')} as the actuator gives it"
    readings = {reading: about for found in READINGS.values() for reading, about in found.items()}
    unit, meaning = readings[what]
    return unit, f"latest reading: {meaning}"


def _in_si(title: str, data: Any, units: Mapping[str, str], prefix: str = "") -> Any:
    """Return plain data with the texts of some keys in SI: their units depend on another key."""
    if not isinstance(data, Mapping):
        return data
    found, mistakes = dict(data), []
    for key, unit in units.items():
        if isinstance(found.get(key), str):
            try:
                found[key] = to_si(found[key], unit)
            except ValueError as error:
                limits = f"got {shown(found[key])}; allowed a number of {unit}"
                mistakes.append(Mistake(prefix + key, f"{error} ({limits})", found[key]))
    raise_mistakes(title, mistakes)
    return found


def _reading_unit(kind: Any) -> str:
    """Return the unit of what a kind of sensor measures; "1" of an unknown kind."""
    readings = READINGS.get(kind, {}) if isinstance(kind, str) else {}
    return next((unit for unit, _ in readings.values()), "1")


class Target(Part):
    """Where the tip shall arrive.

    Parameters
    ----------
    depth
        y [m] at which the tip's error is taken; None: the end of the run.
    lateral
        Wanted lateral place of the tip [m], also on the way.
    """

    depth: Annotated[float | None, Quantity("m", above=0.0, optional=True)] = None
    lateral: Annotated[float, Quantity("m")] = 0.0


class Sensor(Part):
    """What a controller may know.

    Parameters
    ----------
    kind
        ``"tip-imaging"``, ``"tissue-deformation"``, ``"base-force"``, ``"base-moment"``, ``"needle-shape"`` or ``"encoder"``.
    period
        Between two readings [s].
    delay
        From the instant that a reading shows until it is known [s].
    noise
        Standard deviation of what is measured, in its SI unit; of a tissue deformation that of each marker's place.
    pixel_size
        Of imaging sensors [m]: places are rounded to it; 0: not at all.
    resolution
        Of the other sensors, in the SI unit of the reading: it is rounded to it; 0: not at all.
    dropped_fraction
        Share of readings that never arrive.
    decay_length
        Of a tissue deformation, required there [m]: an assumption, displacements fall as exp(-distance / decay_length) away
        from the needle.
    marker_spacing
        Of the grid of markers of a tissue deformation [m].
    stations
        Of a needle shape: how many, equally spaced from hub to tip.
    """

    kind: SensorKind
    period: Annotated[float, Quantity("s", above=0.0)] = 1 / 30
    delay: Annotated[float, Quantity("s", at_least=0.0)] = 0.0
    noise: Annotated[float, Quantity(at_least=0.0)] = 0.0
    pixel_size: Annotated[float, Quantity("m", at_least=0.0)] = 0.0
    resolution: Annotated[float, Quantity(at_least=0.0)] = 0.0
    dropped_fraction: Annotated[float, Quantity(at_least=0.0, below=1.0)] = 0.0
    decay_length: Annotated[float | None, Quantity("m", above=0.0, optional=True)] = None
    marker_spacing: Annotated[float, Quantity("m", above=0.0)] = 0.01
    stations: Annotated[int, Quantity(at_least=2, at_most=10_000, integer=True)] = 11

    @model_validator(mode="before")
    @classmethod
    def _units(cls, data: Any) -> Any:
        kind = data.get("kind") if isinstance(data, Mapping) else None
        return _in_si("Sensor", data, dict.fromkeys(("noise", "resolution"), _reading_unit(kind)))

    def own_units(self) -> dict[str, str | None]:
        """Return the unit of what is measured; other kinds' keys have no meaning."""
        units: dict[str, str | None] = dict.fromkeys(("noise", "resolution"), _reading_unit(self.kind))
        return units | {key: None for key, kinds in _SENSOR_KEYS.items() if self.kind not in kinds}

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Sensor", self._mistakes())
        return self

    def _mistakes(self) -> Iterator[Mistake]:
        for key, kinds in _SENSOR_KEYS.items():
            value = getattr(self, key)
            if self.kind not in kinds and value != type(self).model_fields[key].default:
                limits = f"got {shown(value)}; allowed with {', '.join(kinds)}"
                yield Mistake(key, f"has no meaning for a sensor of kind '{self.kind}' ({limits})", value)
        if self.kind == "tissue-deformation" and self.decay_length is None:
            yield Mistake("decay_length", "is required by kind 'tissue-deformation' (allowed above 0 m)")

    @property
    def readings(self) -> dict[str, tuple[str, str]]:
        """Names of the readings, with unit and meaning."""
        return READINGS[self.kind]


class Gains(Part):
    """Numbers of a controller, in SI units of its input and output; what is missing follows from the model (docs/control.md).

    Parameters
    ----------
    proportional, integral, derivative
        Of pid: input per output, per output and second, times second; ``proportional`` also of the proportional controller.
    filter_time
        Time constant of the filter of the derivative [s].
    position, velocity
        Of fully-actuated inverse dynamics: k_p [1/s^2] and k_v [1/s].
    rate
        Of realizable inverse dynamics: the rate at which the error of the tip decays [1/s].
    smallest_response
        The smallest static gain that may be divided by, as a share of the largest on the way.
    smallest_error, smallest_change
        Thresholds 1 and 2 of incremental control, in the unit of the output; the second also of proportional control.
    largest_command
        Threshold 3, in the unit of the input.
    increment
        b, in the unit of the input.
    largest_error
        Of proportional control: a larger error is taken for a fault of the image and changes nothing.
    """

    proportional: Annotated[float | None, Quantity(optional=True)] = None
    integral: Annotated[float | None, Quantity(optional=True)] = None
    derivative: Annotated[float | None, Quantity(optional=True)] = None
    filter_time: Annotated[float | None, Quantity("s", at_least=0.0, optional=True)] = None
    position: Annotated[float | None, Quantity("1/s^2", above=0.0, optional=True)] = None
    velocity: Annotated[float | None, Quantity("1/s", above=0.0, optional=True)] = None
    rate: Annotated[float | None, Quantity("1/s", above=0.0, optional=True)] = None
    smallest_response: Annotated[float | None, Quantity(above=0.0, below=1.0, optional=True)] = None
    smallest_error: Annotated[float | None, Quantity(at_least=0.0, optional=True)] = None
    smallest_change: Annotated[float | None, Quantity(at_least=0.0, optional=True)] = None
    largest_command: Annotated[float | None, Quantity(above=0.0, optional=True)] = None
    increment: Annotated[float | None, Quantity(optional=True)] = None
    largest_error: Annotated[float | None, Quantity(above=0.0, optional=True)] = None


class Controller(Part):
    """Who decides the command.

    Parameters
    ----------
    kind
        ``"none"``, ``"pid"``, ``"inverse-dynamics"``, ``"incremental"`` or ``"proportional"``.
    variant
        Of inverse dynamics ``"realizable"`` (default) or ``"fully-actuated"``; of the proportional controller ``"intended"``
        (default) or ``"as-printed"``, the thesis' program with its mistakes.
    period
        Between two decisions [s].
    input
        What it commands.
    output
        The reading that it brings to ``target.lateral``, or ``"image_error"``, the mean of tip deflection and tissue
        displacement.
    schedule
        ``"none"``: gains as given; ``"model-gain"``: divided by the model's own static gain at the present depth.
    gains
        Its numbers.
    """

    kind: ControllerKind = "none"
    variant: Literal["realizable", "fully-actuated", "intended", "as-printed"] | None = None
    period: Annotated[float, Quantity("s", above=0.0)] = 1 / 30
    input: InputName = "lateral_force"
    output: str = "tip_deflection"
    schedule: Literal["none", "model-gain"] = "none"
    gains: Gains = Gains()

    @model_validator(mode="before")
    @classmethod
    def _units(cls, data: Any) -> Any:
        """Read gains with a unit, which follows from those of input and output."""
        if isinstance(data, Mapping):
            named = {key: data[key] for key in _NAMES if isinstance(data.get(key), str)}
            data = dict(data) | {key: known_name(name, _NAMES[key]) for key, name in named.items()}
        gains = data.get("gains") if isinstance(data, Mapping) else None
        if not isinstance(gains, Mapping):
            return data
        output = "pixels" if data.get("variant") == "as-printed" else data.get("output", "tip_deflection")
        units = gain_units(str(data.get("input", "lateral_force")), str(output))
        return dict(data) | {"gains": _in_si("Controller", gains, units, "gains.")}

    def own_units(self) -> dict[str, str | None]:
        """Return the units of those gains that depend on input and output."""
        output = "pixels" if self.variant == "as-printed" else self.output
        return {f"gains.{key}": unit for key, unit in gain_units(self.input, output).items()}

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Controller", self._mistakes())
        return self

    @property
    def commands_input(self) -> bool:
        """Whether it commands its input; fully actuated inverse dynamics acts on every coordinate instead."""
        return self.kind != "none" and self.variant != "fully-actuated"

    @property
    def feedback(self) -> frozenset[str]:
        """Names of the readings that make the error; none of a controller that reads nothing."""
        if not self.commands_input:
            return frozenset()
        if self.variant == "as-printed":
            return frozenset({"needle_angle", "tissue_deformation"})
        return frozenset({"tip_deflection", "tissue_displacement"} if self.output == IMAGE_ERROR else {self.output})

    def _mistakes(self) -> Iterator[Mistake]:
        variants = VARIANTS[self.kind]
        if self.variant is not None and self.variant not in variants:
            allowed = ", ".join(f"'{name}'" for name in variants) or "none"
            message = f"does not belong to a controller of kind '{self.kind}' (got '{self.variant}'; allowed {allowed})"
            yield Mistake("variant", message, self.variant)
        for key in type(self.gains).model_fields:
            value = getattr(self.gains, key)
            if value is not None and key not in GAIN_KEYS[self.kind]:
                found = f"got {shown(value)}; allowed {', '.join(GAIN_KEYS[self.kind]) or 'none'}"
                yield Mistake(f"gains.{key}", f"does not belong to a controller of kind '{self.kind}' ({found})", value)
        if self.schedule == "model-gain" and (self.kind in {"none", "inverse-dynamics"} or self.variant == "as-printed"):
            message = "has no meaning here (got 'model-gain'; allowed 'none', or kind 'pid', 'incremental', 'proportional')"
            yield Mistake("schedule", message, self.schedule)
        outputs = output_units()
        if self.output not in outputs:
            limits = f"got {shown(self.output)}; allowed {', '.join(outputs)}"
            yield Mistake("output", f"is no number that a sensor reads ({limits})", self.output)


class Actuator(Part):
    """Limits of an input, in its SI unit.

    Parameters
    ----------
    minimum, maximum
        The command is cut to them; None: no limit.
    rate
        Largest change per second; None: at once.
    """

    minimum: Annotated[float | None, Quantity(optional=True)] = None
    maximum: Annotated[float | None, Quantity(optional=True)] = None
    rate: Annotated[float | None, Quantity(above=0.0, optional=True)] = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.minimum is not None and self.maximum is not None and self.maximum <= self.minimum:
            limits = f"got {self.maximum:g}; allowed above minimum = {self.minimum:g}"
            raise_mistakes("Actuator", [Mistake("maximum", f"leaves no range ({limits})", self.maximum)])
        return self


class Actuators(Part):
    """Limits of the inputs; an input without any is followed exactly.

    Parameters
    ----------
    push_force
        N.
    speed
        m/s.
    lateral_force
        N, of the scene's lateral load.
    hub_deflection
        m.
    hub_angle
        rad.
    hub_torque
        N m.
    tip_direction
        -1 to 1, times the tip forces: the cosine of the angle by which a bevel is turned out of its plane.
    """

    push_force: Actuator | None = None
    speed: Actuator | None = None
    lateral_force: Actuator | None = None
    hub_deflection: Actuator | None = None
    hub_angle: Actuator | None = None
    hub_torque: Actuator | None = None
    tip_direction: Actuator | None = None

    @model_validator(mode="before")
    @classmethod
    def _units(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        return {name: _in_si("Actuators", value, limit_units(str(name)), f"{name}.") for name, value in data.items()}

    def own_units(self) -> dict[str, str | None]:
        """Return the units of all limits."""
        return {f"{name}.{key}": unit for name in INPUT_UNITS for key, unit in limit_units(name).items()}


class Scatter(Part):
    """What differs from one repetition to the next; normally distributed.

    Parameters
    ----------
    modulus
        Standard deviation of the logarithm of a factor on all foundation moduli and dampings.
    entry_angle
        Standard deviation of the needle's angle at the entry point [rad]: the hub is turned and moved so that the straight needle
        goes through the entry point; hub only.
    speed
        Standard deviation of the logarithm of a factor on the insertion's speed.
    """

    modulus: Annotated[float, Quantity(at_least=0.0, at_most=1.0)] = 0.0
    entry_angle: Annotated[float, Quantity("rad", at_least=0.0)] = 0.0
    speed: Annotated[float, Quantity(at_least=0.0, at_most=1.0)] = 0.0
