"""Options of `steer` that change the loop of a scene: its controller and its sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fem_needle.cli.settings import changed, value_of
from fem_needle.errors import SceneError
from fem_needle.scene.steering import VARIANTS

if TYPE_CHECKING:
    from fem_needle.scene import Controller, Scene, Sensor

Changes = dict[str, Any]


def steered(
    scene: Scene, assignments: Sequence[str], options: Mapping[str, Any], controller: str | None, sensors: Sequence[str]
) -> Scene:
    """Return a scene with the settings of the command line: loop, then assignments, then options, as far as they collide.

    Raises
    ------
    SceneError
        If a setting has another form, or the changed scene is impossible.
    """
    removed, replaced = _controller_changes(scene.controller, controller)
    return changed(scene, assignments, dict(options) | replaced, removed | _sensor_changes(scene, sensors))


def _controller_changes(controller: Controller, text: str | None) -> tuple[Changes, Changes]:
    """Return what ``--controller KIND[:VARIANT]`` removes from a controller, and what it sets.

    Gains, schedule and variant stay with the controller that they were written for; period, input and output are kept.

    Raises
    ------
    SceneError
        If the text is no kind or variant.
    """
    if text is None:
        return {}, {}
    kind, colon, variant = (part.strip() for part in text.partition(":"))
    if not kind or (colon and not variant):
        raise SceneError(f"--controller: got {text!r}; allowed KIND or KIND:VARIANT, for example inverse-dynamics:realizable")
    present = VARIANTS[controller.kind][:1] if controller.variant is None else (controller.variant,)
    if kind == controller.kind and (not colon or variant in present):
        return {}, {"controller.kind": kind}
    removed = {f"controller.{key}": None for key in ("variant", "schedule", "gains")}
    return removed, {"controller.kind": kind} | ({"controller.variant": variant} if colon else {})


def _sensor_changes(scene: Scene, texts: Sequence[str]) -> Changes:
    """Return what ``--sensor KIND[:key=value,...]`` changes: keys of the scene's sensor of that kind, or a new sensor.

    Raises
    ------
    SceneError
        If a text has another form.
    """
    if not texts:
        return {}
    sensors = [_written(sensor) for sensor in scene.sensors]
    for text in texts:
        kind, keys = _sensor(text)
        known = next((sensor for sensor in sensors if sensor["kind"] == kind), None)
        if known is None:
            sensors.append({"kind": kind} | keys)
        else:
            known.update(keys)
    return {"sensors": sensors}


def _written(sensor: Sensor) -> dict[str, Any]:
    return {name: getattr(sensor, name) for name in type(sensor).model_fields if name in sensor.model_fields_set}


def _sensor(text: str) -> tuple[str, dict[str, Any]]:
    kind, colon, rest = (part.strip() for part in text.partition(":"))
    pairs = [part.partition("=") for part in rest.split(",")] if colon else []
    if not kind or not all(key.strip() and equals and value.strip() for key, equals, value in pairs):
        allowed = "allowed KIND or KIND:key=value,..., for example tip-imaging:noise=0.1mm,delay=0.1"
        raise SceneError(f"--sensor: got {text!r}; {allowed}")
    return kind, {key.strip(): value_of(value) for key, _, value in pairs}
