"""A scene in sentences, in mm, N, s."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fem_needle.closed_loop.steering import described
from fem_needle.layer_names import layer_name, numbered_layers
from fem_needle.report.numbers import KILO, millimeters, number, quantity, ratio, varying, with_unit
from fem_needle.report.parts import Grid
from fem_needle.scene import Guide, LateralLoad, Scene, TipLoad

_FRICTION = (
    ("coulomb", "N", "{} against the motion"),
    ("viscous", "N s/m", "{} times the speed"),
    ("coulomb_per_length", "N/m", "{} along the inserted length"),
    ("viscous_per_length", "N s/m^2", "{} times speed along the inserted length"),
)


def scene_words(scene: Scene) -> tuple[tuple[str, str], ...]:
    """Return topic and sentences for each part of a scene that says something."""
    topics: dict[str, Callable[[Scene], Iterator[str]]] = {
        "Needle": _needle,
        "Support": _support,
        "Tissue": _tissue,
        "Insertion": _insertion,
        "Friction": _friction,
        "Loads": _loads,
        "Start": _start,
        "Control": _control,
    }
    found = ((topic, " ".join(sentences(scene))) for topic, sentences in topics.items())
    return tuple((topic, text) for topic, text in found if text)


def layer_grids(scene: Scene) -> tuple[Grid, ...]:
    """Return the table of the layers, by depth; none without layers."""
    numbered = numbered_layers(scene)
    layers = [layer for _, layer in numbered]
    if not layers:
        return ()
    columns = {
        "layer": [layer_name(number, layer) for number, layer in numbered],
        "from": [millimeters(layer.start) for layer in layers],
        "to": ["no far side" if layer.end is None else millimeters(layer.end) for layer in layers],
        "foundation modulus": [quantity(layer.foundation_modulus, "N/m^2") for layer in layers],
    }
    if any(layer.damping for layer in layers):
        columns["damping"] = [with_unit(number(layer.damping), "N s/m^2") for layer in layers]
    if any(layer.cutting_force for layer in layers):
        columns["cutting force"] = [quantity(layer.cutting_force, "N") for layer in layers]
    if any(layer.puncture_force for layer in layers):
        columns["puncture force"] = [quantity(layer.puncture_force, "N") for layer in layers]
    rows = tuple(zip(*columns.values(), strict=True))
    return (Grid("Layers of the tissue, places along the insertion axis from the skin", tuple(columns), rows),)


def _needle(scene: Scene) -> Iterator[str]:
    needle = scene.needle
    section = ""
    if needle.outer_diameter is not None:
        inner = needle.inner_diameter or 0.0
        bore = f" and {millimeters(inner)} inside" if inner else " diameter, solid"
        section = f", {millimeters(needle.outer_diameter)}{' outside' if inner else ''}{bore}"
    yield f"The needle is {millimeters(needle.length)} long{section}."
    mass = with_unit(number(KILO * needle.mass_per_length), "g/m")
    yield f"Its bending stiffness is {quantity(needle.bending_stiffness, 'N m^2')}, its mass per length {mass}."


def _support(scene: Scene) -> Iterator[str]:
    support = scene.support
    if support.kind == "entry":
        yield "It is clamped where it enters the tissue, so that only the inserted part bends."
    else:
        yield "It is clamped at its hub, outside the tissue, so that its whole length bends."
    if support.hub_deflection != 0.0:
        yield f"The hub is moved sideways by {varying(support.hub_deflection, 'm')}."
    if support.hub_angle != 0.0:
        yield f"The hub is turned by {varying(support.hub_angle, 'rad')}."
    if support.hub_rotation == "free":
        inertia = with_unit(number(support.hub_rotational_inertia), "kg m^2")
        yield f"The hub turns freely, with a moment of inertia of {inertia} and a torque of {varying(support.hub_torque, 'N m')}."
    yield from (_guide(guide) for guide in support.guides)


def _guide(guide: Guide) -> str:
    kind = "A rigid guide" if guide.stiffness == "rigid" else f"A guide on a spring of {quantity(guide.stiffness, 'N/m')}"
    return f"{kind} holds it {_place(guide.position)}."


def _place(position: float) -> str:
    """Return a place on the insertion axis [m] in words."""
    if position < 0.0:
        return f"{millimeters(-position)} before the skin"
    return "at the skin" if position == 0.0 else f"{millimeters(position)} behind the skin"


def _tissue(scene: Scene) -> Iterator[str]:
    tissue = scene.tissue
    if tissue.kind == "tip-spring":
        yield f"The tissue is one spring of {quantity(tissue.tip_stiffness, 'N/m')} that travels with the tip."
    elif not tissue.layers:
        yield "There is no tissue."
    else:
        count = len(tissue.layers)
        damped = any(layer.damping > 0.0 for layer in tissue.layers)
        kind = "springs and dampers" if damped else "springs"
        noun = f"{count} layers" if count > 1 else "one layer"
        yield f"The tissue has {noun} of {kind} that resist sideways motion along the inserted length."
        path = "the straight insertion axis" if tissue.rest_line == "straight" else "the path that the tip has cut"
        yield f"They are at rest on {path}."
    if tissue.stiffness_factor != 1.0:
        yield f"Its stiffness is multiplied by {varying(tissue.stiffness_factor, '1')}."


def _insertion(scene: Scene) -> Iterator[str]:
    insertion = scene.insertion
    first = millimeters(insertion.first_depth)
    last = "" if insertion.final_depth is None else f" to {millimeters(insertion.final_depth)}"
    if insertion.kind == "hold":
        yield f"The needle is held {first} deep."
    elif insertion.kind == "profile":
        yield f"Its depth over time is given: {varying(insertion.depth, 'm')}."
    elif insertion.kind == "speed":
        yield f"It is inserted from {first}{last} at {varying(insertion.speed, 'm/s')}, whatever force that takes."
    else:
        end = f", until it is {millimeters(insertion.final_depth)} deep" if last else ""
        yield f"A push of {varying(insertion.push_force, 'N')} drives it in from {first}{end}; its depth follows from the forces."
    if scene.duration:
        yield f"The run lasts up to {quantity(scene.duration, 's')}."


def _friction(scene: Scene) -> Iterator[str]:
    given = [(getattr(scene.friction, name), unit, form) for name, unit, form in _FRICTION]
    parts = [form.format(quantity(value, unit)) for value, unit, form in given if value]
    if parts:
        yield f"Friction of the shaft: {', '.join(parts)}."


def _loads(scene: Scene) -> Iterator[str]:
    for load in scene.loads:
        if isinstance(load, LateralLoad):
            yield f"A force of {varying(load.force, 'N')} acts sideways {_place(load.position)}."
        else:
            yield _tip_load(load)
    if not scene.loads:
        yield "No lateral force is applied to it."


def _tip_load(load: TipLoad) -> str:
    turned = "" if load.direction == 1.0 else f", times {varying(load.direction, '1')} for the direction of the bevel"
    if load.bevel_coefficient is not None:
        area = quantity(load.bevel_coefficient, "m^2")
        return f"Its bevel pushes the tip sideways with {area} times the modulus there{turned}."
    return f"A force of {varying(load.force, 'N')} acts sideways at the tip{turned}."


def _start(scene: Scene) -> Iterator[str]:
    initial = scene.initial
    if initial.shape == "equilibrium":
        yield "It starts in equilibrium with its loads."
    elif initial.shape == "straight":
        yield "It starts straight and at rest."
    else:
        yield f"It starts with its tip displaced by {millimeters(initial.tip_deflection)}, and is let go."


def _control(scene: Scene) -> Iterator[str]:
    controller, target = scene.controller, scene.target
    if controller.kind == "none" and not scene.sensors:
        return
    depth = "" if target.depth is None else f" at a depth of {millimeters(target.depth)}"
    yield f"The scene wants the tip {millimeters(target.lateral)} off the axis{depth}."
    if controller.variant == "fully-actuated":
        yield f"Controller: {described(controller)}; it acts on the depth and on every coordinate of the needle."
    elif controller.kind != "none":
        command, period = controller.input.replace("_", " "), quantity(controller.period, "s")
        yield f"Controller: {described(controller)}; it commands the {command} every {period}."
    for sensor in scene.sensors:
        late = f", {quantity(sensor.delay, 's')} late" if sensor.delay else ""
        unit = next((unit for unit, _ in sensor.readings.values()), "1")
        noise = f", with noise of {quantity(sensor.noise, unit)}" if sensor.noise else ""
        lost = f", {ratio(sensor.dropped_fraction)} lost" if sensor.dropped_fraction else ""
        yield f"Sensor {sensor.kind}: a reading every {quantity(sensor.period, 's')}{late}{noise}{lost}."
