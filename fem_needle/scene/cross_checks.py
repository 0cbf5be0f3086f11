"""Mistakes between the parts of a scene: what fits the needle, the tissue and the motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from fem_needle.display import in_millimeters
from fem_needle.mesh_file import length_mistake
from fem_needle.scene.loads import LateralLoad, TipLoad
from fem_needle.scene.part import Mistake
from fem_needle.scene.settings import FIXED_FRAME_VARIANTS

if TYPE_CHECKING:
    from fem_needle.scene.scene import Scene

# Share of the length by which depths may pass 0 and the length, and by which
# the hub stays clear: integrals and differences hit round numbers only to rounding.
ROUNDING = 1e-12


def cross_mistakes(scene: Scene) -> Iterator[Mistake]:
    """Yield all mistakes between parts that are each correct."""
    ends_at_depth = scene.insertion.kind == "force" and scene.insertion.final_depth is not None
    if scene.insertion.end_time is None and scene.run.duration is None and not ends_at_depth:
        message = "is required, because this insertion does not end by itself (allowed above 0 s)"
        yield Mistake("run.duration", message)
        return
    yield from _depth_mistakes(scene)
    yield from _push_mistakes(scene)
    if scene.support.kind == "hub":
        yield from _place_mistakes(scene)
        yield from _kinematics_mistakes(scene)
    else:
        yield from _entry_mistakes(scene)
    yield from _mesh_mistakes(scene)
    yield from _steering_mistakes(scene)


def _depth_mistakes(scene: Scene) -> Iterator[Mistake]:
    length, insertion = scene.needle.length, scene.insertion
    lowest, highest = insertion.depth_range(scene.duration)
    slack = ROUNDING * length
    allowed = f"allowed 0 to {length:g} m, the needle's length"
    for key in ("initial_depth", "final_depth"):
        depth = getattr(insertion, key)
        if depth is not None and depth > length:
            message = f"deeper than the needle is long (got {depth:g}; {allowed})"
            yield Mistake(f"insertion.{key}", message, depth)
            slack = float("inf")  # the same mistake, not to be told twice
    if insertion.kind == "force" and insertion.final_depth is not None and insertion.final_depth <= insertion.first_depth:
        limits = f"got {insertion.final_depth:g}; allowed above initial_depth = {insertion.first_depth:g} m"
        yield Mistake("insertion.final_depth", f"a push ends deeper than it began ({limits})", insertion.final_depth)
    key = {"speed": "speed", "profile": "depth"}.get(insertion.kind, "initial_depth")
    for extreme in (lowest, highest):
        if not -slack <= extreme <= length + slack:
            message = f"the depth leaves the needle in the run (reaches {extreme:.9g}; {allowed})"
            yield Mistake(f"insertion.{key}", message, extreme)


def _push_mistakes(scene: Scene) -> Iterator[Mistake]:
    if scene.insertion.kind == "force" and scene.numerics.analysis == "static":
        message = "a push needs motion (got 'static'; allowed 'dynamic', 'quasi-static', 'auto')"
        yield Mistake("numerics.analysis", message, "static")
    if scene.tissue.rest_line == "cut-path" and scene.numerics.analysis == "static":
        message = "a cut path needs history (got 'static'; allowed 'quasi-static', 'dynamic', 'auto')"
        yield Mistake("numerics.analysis", message, "static")


def _places(scene: Scene) -> Iterator[tuple[str, str, float]]:
    """Yield path, name and y of guides and lateral forces."""
    for index, guide in enumerate(scene.support.guides):
        yield f"support.guides.{index}.position", "guide", guide.position
    for index, load in enumerate(scene.loads):
        if isinstance(load, LateralLoad):
            yield f"loads.{index}.position", "lateral force", load.position


def _place_mistakes(scene: Scene) -> Iterator[Mistake]:
    """Report guides and forces inside tissue, in the hub's way, or off the needle."""
    length = scene.needle.length
    lowest, highest = scene.insertion.depth_range(scene.duration)
    for path, name, y in _places(scene):
        for layer in scene.tissue.layers:
            # y = 0 is the skin, where the robot's finger may touch.
            if layer.holds(y) and y != 0.0:
                beyond = "" if layer.end is None else f" or from {layer.end:g} m"
                outside = f"got {y:g}; allowed at most {layer.start:g} m{beyond}"
                yield Mistake(path, f"the {name} lies inside the tissue ({outside}){_before_the_skin(y)}", y)
        if highest - length >= y - ROUNDING * length:
            limits = f"got {y:g}; allowed above {highest - length:.9g} m, where the hub gets"
            message = f"the hub meets the {name} at the depth {y + length:.9g} m ({limits})"
            yield Mistake(path, message, y)
        if y > 0.0 and y > lowest:
            limits = f"got {y:g}; allowed at most {lowest:.9g} m, the smallest depth of the run"
            yield Mistake(path, f"the {name} is not always on the needle ({limits}){_before_the_skin(y)}", y)


def _before_the_skin(y: float) -> str:
    return f"; negative is before the skin: did you mean {in_millimeters(-y)}?" if y > 0.0 else ""


def _kinematics_mistakes(scene: Scene) -> Iterator[Mistake]:
    if scene.model.variant in FIXED_FRAME_VARIANTS:
        limits = f"got '{scene.model.variant}'; allowed 'conservative'"
        yield Mistake("model.variant", f"is fixed-frame, which has no meaning under 'hub' ({limits})", scene.model.variant)
    elif scene.model.kinematics == "fixed-frame":
        message = "has no meaning under the support 'hub' (got 'fixed-frame'; allowed 'material')"
        yield Mistake("model.kinematics", message, "fixed-frame")


def _entry_mistakes(scene: Scene) -> Iterator[Mistake]:
    for index, load in enumerate(scene.loads):
        if isinstance(load, LateralLoad):
            message = "a lateral force has no meaning under 'entry' (got 'lateral'; allowed 'tip')"
            yield Mistake(f"loads.{index}.kind", message, "lateral")
    if scene.initial.shape == "tip-displaced" and scene.insertion.first_depth <= 1e-6 * scene.needle.length:
        message = "nothing inserted could bend (got 'tip-displaced'; allowed 'equilibrium', 'straight')"
        yield Mistake("initial.shape", message, "tip-displaced")


def _mesh_mistakes(scene: Scene) -> Iterator[Mistake]:
    mesh = scene.numerics.mesh
    message = None if mesh is None else length_mistake(mesh, scene.needle.length)
    if mesh is not None and message is not None:
        yield Mistake("numerics.mesh", message, mesh[-1])


def input_obstacle(scene: Scene, name: str) -> str | None:
    """Return why a scene has no such input, None where it has."""
    support, is_hub = scene.support, scene.support.kind == "hub"
    lateral = len(scene.lateral_loads)
    free = support.hub_rotation == "free"
    obstacles = {
        "push_force": (scene.insertion.kind == "force", "needs insertion.kind = 'force'"),
        "speed": (scene.insertion.kind == "speed", "needs insertion.kind = 'speed'"),
        "lateral_force": (lateral == 1, f"needs one load of kind 'lateral' (got {lateral})"),
        "hub_deflection": (is_hub, "needs the support 'hub'"),
        "hub_angle": (is_hub and not free, "needs the support 'hub' with hub_rotation = 'fixed'"),
        "hub_torque": (is_hub and free, "needs the support 'hub' with hub_rotation = 'free'"),
        "tip_direction": (any(isinstance(load, TipLoad) for load in scene.loads), "needs a load of kind 'tip'"),
    }
    possible, need = obstacles.get(name, (False, f"is unknown (allowed {', '.join(obstacles)})"))
    return None if possible else need


def _steering_mistakes(scene: Scene) -> Iterator[Mistake]:
    """Report inputs that the scene has not, outputs that no sensor reads, and readings of two sensors."""
    names: list[str] = []
    for index, sensor in enumerate(scene.sensors):
        if set(names) & set(sensor.readings):
            message = f"two sensors read the same (got '{sensor.kind}' twice; allowed once)"
            yield Mistake(f"sensors.{index}.kind", message, sensor.kind)
        names += sensor.readings
    for name in type(scene.actuators).model_fields:
        obstacle = input_obstacle(scene, name)
        if getattr(scene.actuators, name) is not None and obstacle:
            yield Mistake(f"actuators.{name}", f"{obstacle}")
    if scene.target.depth is not None and scene.target.depth > scene.needle.length:
        limits = f"got {scene.target.depth:g}; allowed 0 to {scene.needle.length:g} m"
        yield Mistake("target.depth", f"deeper than the needle is long ({limits})", scene.target.depth)
    angle, obstacle = scene.scatter.entry_angle, input_obstacle(scene, "hub_angle")
    if angle and obstacle:  # nobody could turn the needle
        yield Mistake("scatter.entry_angle", f"{obstacle} (got {angle:g}; allowed 0 rad)", angle)
    if scene.controller.feedback:
        yield from _controller_mistakes(scene, names)


def _controller_mistakes(scene: Scene, names: list[str]) -> Iterator[Mistake]:
    controller = scene.controller
    obstacle = input_obstacle(scene, controller.input)
    if obstacle:
        yield Mistake("controller.input", f"'{controller.input}' {obstacle}", controller.input)
    needed = set(controller.feedback)
    if controller.kind == "inverse-dynamics" or controller.schedule == "model-gain":
        needed |= {"depth"}
    if needed - set(names):
        missing = ", ".join(sorted(needed - set(names)))
        yield Mistake("sensors", f"no sensor reads {missing}, which the controller needs (add one, such as kind = 'tip-imaging')")
