"""The controller of a scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fem_needle.control.controller import Controller, Uncontrolled
from fem_needle.control.defaults import Settings
from fem_needle.control.incremental import Incremental
from fem_needle.control.inverse_dynamics import InverseDynamics
from fem_needle.control.pid import Pid
from fem_needle.control.printed import FORCE_PER_PIXEL, LARGEST_TOTAL, SMALLEST_RISE, PrintedProportional
from fem_needle.control.proportional import Proportional
from fem_needle.control.signals import output_reader, own_value
from fem_needle.errors import SceneError
from fem_needle.plant import Plant
from fem_needle.scene import Scene


def controller_of(scene: Scene, model: Plant | None = None) -> Controller[Any]:
    """Return the controller that a scene describes.

    Parameters
    ----------
    scene
        Its controller, target, sensors and actuators.
    model
        The plant that the controller believes in, where a gain of the model is needed; None: the scene's own.

    Returns
    -------
    Controller
        Of a fully actuated inverse dynamics, which is a law of continuous time and not sampled, one that commands nothing.

    Raises
    ------
    SceneError
        If a gain is missing that has no default with this input or output, or the schedule has no static gain to follow.
    ComputationError
        If the model has no equilibrium on the way.
    """
    controller = scene.controller
    if not controller.commands_input:
        return Uncontrolled()
    if controller.variant == "as-printed":
        return _printed(scene)
    return _MAKERS[controller.kind](Settings(scene, model))


def reference(scene: Scene) -> float:
    """Return where the output shall be, SI: the target's depth where the output is the depth, else its lateral place."""
    if scene.controller.output == "depth" and scene.target.depth is not None:
        return scene.target.depth
    return scene.target.lateral


def _common(settings: Settings) -> dict[str, Any]:
    scene = settings.scene
    controller = scene.controller
    return {
        "input": controller.input,
        "read": output_reader(controller.output),
        "target": reference(scene),
        "limits": settings.limits,
        "initial": own_value(scene, controller.input),
    }


def _pid(settings: Settings) -> Pid:
    proportional, integral, derivative, filter_time = settings.pid_gains()
    return Pid(
        period=settings.scene.controller.period,
        proportional=proportional,
        integral=integral,
        derivative=derivative,
        filter_time=filter_time,
        schedule=settings.schedule,
        **_common(settings),
    )


def _inverse_dynamics(settings: Settings) -> InverseDynamics:
    return InverseDynamics(
        period=settings.scene.controller.period,
        rate=settings.rate(),
        response=settings.response,
        smallest_response=settings.smallest_response,
        encoder_period=settings.encoder_period,
        **_common(settings),
    )


def _incremental(settings: Settings) -> Incremental:
    return Incremental(
        smallest_error=settings.smallest_error,
        smallest_change=settings.smallest_change,
        increment=settings.increment,
        largest_command=settings.largest_command,
        schedule=settings.schedule,
        **_common(settings),
    )


def _proportional(settings: Settings) -> Proportional:
    proportional, change, fault = settings.proportional_gains()
    return Proportional(
        proportional=proportional, smallest_change=change, largest_error=fault, schedule=settings.schedule, **_common(settings)
    )


def _printed(scene: Scene) -> PrintedProportional:
    """Return the printed program; its gains count in pixels, in a scene too."""
    controller, gains = scene.controller, scene.controller.gains
    index, sensor = next(
        (index, sensor) for index, sensor in enumerate(scene.sensors) if "tissue_deformation" in sensor.readings
    )
    pixel = sensor.pixel_size
    if pixel == 0.0:
        message = "the printed program counts in pixels (got 0; allowed above 0 m)"
        raise SceneError(f"sensors.{index}.pixel_size: {message}")
    return PrintedProportional(
        input=controller.input,
        period=controller.period,
        pixel_size=pixel,
        gain=FORCE_PER_PIXEL if gains.proportional is None else gains.proportional,
        smallest_rise=SMALLEST_RISE if gains.smallest_change is None else gains.smallest_change,
        largest_total=LARGEST_TOTAL if gains.largest_error is None else gains.largest_error,
        initial=own_value(scene, controller.input),
    )


_MAKERS: dict[str, Callable[[Settings], Controller[Any]]] = {
    "pid": _pid,
    "inverse-dynamics": _inverse_dynamics,
    "incremental": _incremental,
    "proportional": _proportional,
}
