"""Suspicious values: possible, but more likely a slip. Each message names its inequality."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from itertools import pairwise
from math import inf, pi

from fem_needle.errors import SuspiciousValueWarning
from fem_needle.scene import Model, Scene, TipLoad
from fem_needle.scene.listing import entries
from fem_needle.scene.time_functions import Sinusoid, Table
from fem_needle.scene.time_quantity import TimeValue, extremes
from fem_needle.segments import interfaces, tip_layer

EPOCH = 1e8  # s: three years
FAST = 5.0  # m/s: no needle is that fast
OLD_READINGS = 0.1  # a controller's period by that of the sensor it reads: below, it decides on old readings
STATIONS = 200  # depths at which a push is judged
CLAMPED_PINNED = 20.19  # EI / L^2: tan x = x at x = 4.4934, squared (Timoshenko, Theory of Elastic Stability)
LONG_DELAY = 5.0  # a sensor's delay by the controller's period: above, several commands are on the way unseen

NOT_YOUNGS_MODULUS = (
    "foundation_modulus is lateral force per length and deflection [N/m^2], "
    "not the Young's modulus of the tissue"
)


def suspicious(scene: Scene) -> tuple[str, ...]:
    """Return a message for each suspicious value; none for an ordinary scene."""
    checks = (_units, _needle, _layers, _push, _tip_force, _times, _tables, _model, _sensors, _feedback)
    return tuple(message for check in checks for message in check(scene))


def notes(scene: Scene) -> tuple[str, ...]:
    """Return what is no slip but may surprise: a message each, with the key to change."""
    bevels = [index for index, load in enumerate(scene.loads) if getattr(load, "bevel_coefficient", None)]
    if not bevels or scene.tissue.rest_line != "straight" or scene.insertion.kind == "hold":
        return ()
    return (
        f"loads.{bevels[0]}.bevel_coefficient with tissue.rest_line = 'straight': the tissue pulls the needle back to the axis, "
        "the tip stays near it at any depth; tissue.rest_line = 'cut-path' lets the needle follow the path that its bevel cuts",
    )


def warn_if_suspicious(scene: Scene) -> tuple[str, ...]:
    """Issue a `SuspiciousValueWarning` for each message of `suspicious`, and return them."""
    messages = suspicious(scene)
    for message in messages:
        warnings.warn(message, SuspiciousValueWarning, stacklevel=2)
    return messages


def _largest(value: TimeValue) -> float:
    """Return the largest magnitude of a value over all times."""
    return max(abs(extreme) for extreme in extremes(value))


def _units(scene: Scene) -> Iterator[str]:
    """Look for numbers written in another unit than SI: mm, GPa, degrees, mm/s."""
    for path, value, quantity in entries(scene):
        if quantity is None or not isinstance(value, float | Table | Sinusoid):
            continue
        largest = _largest(value)
        if quantity.unit == "m" and largest > 1.0:
            yield f"{path} = {largest:g} m > 1 m: looks like mm"
        elif quantity.unit == "Pa" and largest < 1e6:
            yield f"{path} = {largest:g} Pa < 1e6 Pa: looks like GPa"
        elif quantity.unit == "rad" and largest > 0.5:
            yield f"{path} = {largest:g} rad > 0.5 rad: looks like degrees"
        elif quantity.unit == "m/s" and largest >= FAST:
            yield f"{path} = {largest:g} m/s >= {FAST:g} m/s: looks like mm/s (or cm/s)"


def _needle(scene: Scene) -> Iterator[str]:
    length, diameter = scene.needle.length, scene.needle.outer_diameter
    if diameter is not None and diameter > length / 10.0:
        yield (
            f"needle.outer_diameter = {diameter:g} m > length / 10 = {length / 10.0:g} m: "
            "too thick for a slender beam, or a unit is wrong"
        )


def _layers(scene: Scene) -> Iterator[str]:
    thinnest = scene.needle.length / 1000.0
    for index, layer in enumerate(scene.tissue.layers):
        path = f"tissue.layers.{index}"
        if layer.foundation_modulus > 1e6:
            yield (
                f"{path}.foundation_modulus = {layer.foundation_modulus:g} N/m^2 > 1e6 N/m^2: "
                f"looks like a Young's modulus; {NOT_YOUNGS_MODULUS}"
            )
        if layer.far_side - layer.start < thinnest:
            thickness = layer.far_side - layer.start
            yield f"{path}: thickness {thickness:g} m < needle.length / 1000 = {thinnest:g} m: very thin"


def _push(scene: Scene) -> Iterator[str]:
    """Compare the push, given or needed, with the Euler loads of the parts before the skin, at every depth on the way."""
    if scene.support.kind == "entry":  # clamped at the skin
        return
    found = [(_needed_push(scene, depth), *_euler_load(scene, depth), depth) for depth in _depths(scene)]
    push, euler, what, depth = max(found, key=lambda one: one[0] / one[1])
    if push > euler:
        yield f"the push at {depth:.4g} m, {push:.3g} N > {euler:.3g} N, the Euler load {what}: the needle may buckle"


def _depths(scene: Scene) -> list[float]:
    """Return the depths of an insertion [m], those just inside each layer among them; of a given push the first alone."""
    low, high = scene.insertion.depth_range(scene.duration)
    if scene.insertion.push_force is not None:
        return [scene.insertion.first_depth]
    inside = [level for level in interfaces(scene.tissue.layers) if low <= level <= high]
    return [low + (high - low) * part / STATIONS for part in range(STATIONS + 1)] + inside


def _needed_push(scene: Scene, depth: float) -> float:
    """Return the largest push, or the friction and cutting force that a prescribed motion overcomes at a depth [N]."""
    if scene.insertion.push_force is not None:
        return _largest(scene.insertion.push_force)
    friction, layer = scene.friction, tip_layer(scene.tissue.layers, depth)
    speed = 0.0 if scene.insertion.speed is None else _largest(scene.insertion.speed)
    coulomb = friction.coulomb + friction.coulomb_per_length * depth
    viscous = friction.viscous + friction.viscous_per_length * depth
    return coulomb + viscous * speed + (0.0 if layer is None else scene.tissue.layers[layer].cutting_force)


def _euler_load(scene: Scene, depth: float) -> tuple[float, str]:
    """Return the smallest Euler load of the parts between hub, rigid guides and skin at a depth [N], and which part that is.

    The first part is clamped at the hub: P = 20.19 EI / L^2 where a guide ends it, pi^2 EI / (2 L)^2 where nothing but tissue
    does; parts behind a guide are pinned at both ends, pi^2 EI / L^2.
    """
    stiffness, hub = scene.needle.bending_stiffness, depth - scene.needle.length
    guides = sorted(guide.position for guide in scene.support.guides if guide.stiffness == "rigid" and guide.position > hub)
    factor, form, end = (CLAMPED_PINNED, "20.19 EI / L^2", "guide") if guides else (pi**2 / 4.0, "pi^2 EI / (2 L)^2", "skin")
    spans = [(hub, [*guides, 0.0][0], factor, f"{form} of the part from hub to {end}")]
    spans += [(*pair, pi**2, "pi^2 EI / L^2 of the part behind a guide") for pair in pairwise([*guides, 0.0])]
    loads = [(part * stiffness / (last - first) ** 2, what, last - first) for first, last, part, what in spans if last > first]
    load, what, length = min(loads, default=(inf, "", 0.0))
    return load, f"{what} (L = {length:.4g} m)"


def _tip_force(scene: Scene) -> Iterator[str]:
    """Estimate the tip deflection as that of a cantilever, F L^3 / (3 EI).

    L is the length that bends, at most (3/2)^(1/3) / lambda, with
    lambda = (k / 4 EI)^(1/4): there the cantilever deflects as the end of a
    half-infinite beam on a foundation, 2 F lambda / k (Hetenyi).
    """
    stiffness = scene.needle.bending_stiffness
    moduli = [layer.foundation_modulus for layer in scene.tissue.layers]
    softest, stiffest = min(moduli, default=0.0), max(moduli, default=0.0)
    _, deepest = scene.insertion.depth_range(scene.duration)
    bending = scene.needle.length if scene.support.kind == "hub" else deepest
    decay = (softest / (4.0 * stiffness)) ** 0.25
    estimate_length, limit = bending, 0.1 * bending
    if decay > 0.0:
        estimate_length, limit = min(bending, 1.5 ** (1.0 / 3.0) / decay), 0.1 * min(bending, 2.0 / decay)
    force = sum(_tip_load(load, stiffest) for load in scene.loads if isinstance(load, TipLoad))
    deflection = force * estimate_length**3 / (3.0 * stiffness)
    if deflection > limit:
        yield (
            f"the tip force {force:.3g} N bends the needle by about F L^3 / (3 EI) = {deflection:.3g} m > "
            f"{limit:.3g} m, 10 % of the length that bends: too much for small deflections"
        )


def _tip_load(load: TipLoad, modulus: float) -> float:
    """Return the largest magnitude of a tip load [N]."""
    if load.force is not None:
        return _largest(load.force)
    return abs(load.bevel_coefficient or 0.0) * modulus


def _model(scene: Scene) -> Iterator[str]:
    """Tell what is set for another model than the scene's."""
    model, numerics = scene.model, scene.numerics
    if model.kind == "fem":
        plain = Model()
        for name in ("modes", "variant", "basis", "static_corrections"):
            value = getattr(model, name)
            if value != getattr(plain, name):
                effect = "only makes it fixed-frame" if name == "variant" else "has no effect"
                yield f"model.{name} = {value!r} {effect}: model.kind = 'fem', not 'assumed-modes'"
    if model.kind == "assumed-modes" and (numerics.elements != "auto" or numerics.mesh is not None):
        yield "numerics.elements or mesh has no effect: model.kind = 'assumed-modes', not 'fem'"


def _times(scene: Scene) -> Iterator[str]:
    duration = scene.duration
    for name in ("time_step", "output_step"):
        step = getattr(scene.numerics, name)
        if not duration:
            continue  # a push ends by itself
        if isinstance(step, float) and step > duration:
            yield f"numerics.{name} = {step:g} s > {duration:g} s, the duration of the run"
        elif isinstance(step, float) and step < 1e-9 * duration:
            yield f"numerics.{name} = {step:g} s < 1e-9 times {duration:g} s, the duration: a very long run"


def _tables(scene: Scene) -> Iterator[str]:
    """Look for tables whose times are not those of the run."""
    duration = scene.duration or inf
    for path, value, _ in entries(scene):
        if not isinstance(value, Table):
            continue
        seen = sum(0.0 <= time <= duration for time in value.time)
        if value.time[0] > EPOCH:
            yield f"{path}.time begins at {value.time[0]:.10g} s > {EPOCH:g} s: looks like seconds since 1970, not the start"
        elif seen < 2 <= len(value.time):
            what = "none" if seen == 0 else "one"
            points = f"{what} of its {len(value.time)} points in the run, 0 to {duration:g} s"
            yield f"{path}.time has {points}: looks like another unit of time"


def _sensors(scene: Scene) -> Iterator[str]:
    for index, sensor in enumerate(scene.sensors):
        if 0.0 < scene.duration < sensor.period:
            yield f"sensors.{index}.period = {sensor.period:g} s > {scene.duration:g} s, the duration of the run: it reads once"
        if sensor.pixel_size > 1e-2:
            yield f"sensors.{index}.pixel_size = {sensor.pixel_size:g} m > 1e-2 m: looks like mm"


def _feedback(scene: Scene) -> Iterator[str]:
    """Compare the controller's period with those of the sensors that it reads, and with their delays."""
    period = scene.controller.period
    for index, sensor in enumerate(scene.sensors):
        if not scene.controller.feedback & sensor.readings.keys():
            continue
        if period < OLD_READINGS * sensor.period:
            yield (
                f"controller.period = {period:g} s < {OLD_READINGS:g} times sensors.{index}.period = {sensor.period:g} s: "
                "it decides on old readings"
            )
        if sensor.delay > LONG_DELAY * period:
            yield (
                f"sensors.{index}.delay = {sensor.delay:g} s > {LONG_DELAY:g} times controller.period = {period:g} s: "
                "the loop swings unless its gains are small"
            )
