"""Gains of a controller: as the scene gives them, else from the model's static gain, the sensors and the needle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

from fem_needle.control.gain_schedule import GainSchedule
from fem_needle.control.model_response import ModelResponse, depth_range, model_response
from fem_needle.control.signals import Limits, actuator_limits
from fem_needle.errors import SceneError
from fem_needle.models import build_plant
from fem_needle.plant import Plant
from fem_needle.scene import Scene, Sensor
from fem_needle.scene.signals import IMAGE_ERROR

# How much of the tip's deflection each output holds that the static gain is known for.
SHARES = {"tip_deflection": 1.0, IMAGE_ERROR: 0.5}
READ_FOR = {IMAGE_ERROR: ("tip_deflection", "tissue_displacement")}

PID_PROPORTIONAL = 0.2  # of 1 / g_ref
PID_INTEGRAL = 0.2  # of 1 / g_ref, in one sampling time
FILTER_PERIODS = 2.0  # of the derivative
PROPORTIONAL = 0.5  # of 1 / g_ref
DECAY_SAMPLES = 3.0  # sampling times in which inverse dynamics lets an error fall to 1 / e
SMALLEST_RESPONSE = 0.05  # of g_ref
ERROR_PIXELS, CHANGE_PIXELS = 1.5, 0.5  # thresholds 1 and 2: two pixels are an error, one is a change
PLAIN_ERROR = 1e-4  # m: threshold 1 without pixels
LARGEST_MOTION = 0.05  # of the length: what threshold 3 moves the tip
FAULT = 0.1  # of the length: no image of a needle shows such an error


@dataclass(frozen=True)
class Settings:
    """What a controller is made of; the model is built and asked when something needs it.

    Parameters
    ----------
    scene
        With the controller.
    model
        The plant that the controller believes in; None: that of the scene.
    """

    scene: Scene
    model: Plant | None = None

    def given(self, key: str) -> float | None:
        """Return a gain as the scene gives it, None where it does not."""
        value: float | None = getattr(self.scene.controller.gains, key)
        return value

    @cached_property
    def response(self) -> ModelResponse:
        """Static response of the model.

        Raises
        ------
        SceneError
            If input or output have no static gain.
        """
        controller = self.scene.controller
        if controller.output not in SHARES:
            limits = f"got {controller.output!r}; allowed {', '.join(SHARES)}, or all gains given and schedule = 'none'"
            raise SceneError(f"controller.output: the model has no static gain of it ({limits})")
        plant = build_plant(self.scene) if self.model is None else self.model
        return model_response(plant, controller.input, depths=depth_range(self.scene), share=SHARES[controller.output])

    @cached_property
    def schedule(self) -> GainSchedule | None:
        """The schedule of the gains, if the scene asks for one."""
        if self.scene.controller.schedule == "none":
            return None
        return GainSchedule(self.response, SMALLEST_RESPONSE)

    @cached_property
    def limits(self) -> Limits:
        """Limits of the actuator."""
        return actuator_limits(self.scene)

    @property
    def sampling_time(self) -> float:
        """How far the output may lag behind a command [s]: the longer period, of controller or sensor, and the sensor's delay."""
        sensors = self._sensors
        period = max([self.scene.controller.period, *(sensor.period for sensor in sensors)])
        return period + max([0.0, *(sensor.delay for sensor in sensors)])

    @property
    def encoder_period(self) -> float:
        """Between two readings of the depth [s], at least the controller's period."""
        encoders = [sensor.period for sensor in self.scene.sensors if "depth" in sensor.readings]
        return max([self.scene.controller.period, *encoders])

    @property
    def _sensors(self) -> list[Sensor]:
        """Those that read the output."""
        output = self.scene.controller.output
        names = READ_FOR.get(output, (output,))
        return [sensor for sensor in self.scene.sensors if set(names) & set(sensor.readings)]

    @property
    def _unit_command(self) -> float:
        """What moves the output by 1 where the model's gain is largest; signed as the gain at the first depth, or positive."""
        response = self.response
        fixed = self.schedule is None and response.gain(response.first_depth) < 0.0
        return (-1.0 if fixed else 1.0) / response.largest_gain

    def pid_gains(self) -> tuple[float, float, float, float]:
        """Return P, I, D and the filter's time constant [s]."""
        proportional, integral = self.given("proportional"), self.given("integral")
        if proportional is None:
            proportional = PID_PROPORTIONAL * self._unit_command
        if integral is None:
            integral = PID_INTEGRAL * self._unit_command / self.sampling_time
        filter_time = self.given("filter_time")
        if filter_time is None:
            filter_time = FILTER_PERIODS * self.scene.controller.period
        return proportional, integral, self.given("derivative") or 0.0, filter_time

    def proportional_gains(self) -> tuple[float, float, float]:
        """Return P, the smallest change and the largest error of proportional control."""
        proportional, fault = self.given("proportional"), self.given("largest_error")
        if proportional is None:
            proportional = PROPORTIONAL * self._unit_command
        if fault is None:
            fault = FAULT * self._share("largest_error") * self.scene.needle.length
        return proportional, self.smallest_change, fault

    def rate(self) -> float:
        """Return the rate of inverse dynamics [1/s]."""
        return self.given("rate") or 1.0 / (DECAY_SAMPLES * self.sampling_time)

    @property
    def smallest_response(self) -> float:
        """The smallest gain that is divided by, as a share of the largest."""
        return self.given("smallest_response") or SMALLEST_RESPONSE

    @property
    def smallest_error(self) -> float:
        """Threshold 1 in the unit of the output."""
        value = self.given("smallest_error")
        return self._smallest_error("smallest_error") if value is None else value

    def _smallest_error(self, key: str) -> float:
        pixel = self._pixel
        return self._share(key) * (ERROR_PIXELS * pixel if pixel else PLAIN_ERROR)

    @property
    def smallest_change(self) -> float:
        """Threshold 2 in the unit of the output; 0 without pixels, for a needle may bend as slowly as it likes."""
        value = self.given("smallest_change")
        return self._share("smallest_change") * CHANGE_PIXELS * self._pixel if value is None else value

    @property
    def increment(self) -> float:
        """B in the unit of the input: moves the output by the default of threshold 1 where the gain is largest."""
        value = self.given("increment")
        return self._smallest_error("increment") * self._unit_command if value is None else value

    @property
    def largest_command(self) -> float:
        """Threshold 3 in the unit of the input; none needed where the actuator has a range."""
        value = self.given("largest_command")
        if value is not None or (self.limits.minimum > -inf and self.limits.maximum < inf):
            return value or inf
        return LARGEST_MOTION * self._share("largest_command") * self.scene.needle.length * abs(self._unit_command)

    @property
    def _pixel(self) -> float:
        return max([0.0, *(sensor.pixel_size for sensor in self._sensors)])

    def _share(self, key: str) -> float:
        """Return output per deflection of the tip, which the default of a gain needs."""
        output = self.scene.controller.output
        if output not in SHARES:
            limits = f"got none; allowed a number, or controller.output {' or '.join(SHARES)}"
            raise SceneError(f"controller.gains.{key}: has no default with the output {output!r} ({limits})")
        return SHARES[output]
