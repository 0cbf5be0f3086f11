"""Controllers compared on one needle: error at the target, effort, wrong models, delay, noise, both sides of the sign change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from fem_needle import ComputationError, build_plant, controller_of, load_scene, steer
from fem_needle.control.model_response import depth_range, model_response
from fem_needle.scene import Scene
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from reduced_model.validation.section import Section, blocks, picture, prose, table

SCENE = "steering-stiff"
TARGETS = (0.06, 0.12)  # m, one on each side of the sign change
CONTROLLERS: dict[str, dict[str, Any]] = {
    "none": {"kind": "none"},
    "pid": {"kind": "pid"},
    "pid, model gain": {"kind": "pid", "schedule": "model-gain"},
    "incremental": {"kind": "incremental"},
    "incremental, model gain": {"kind": "incremental", "schedule": "model-gain"},
    "proportional": {"kind": "proportional"},
    "proportional, model gain": {"kind": "proportional", "schedule": "model-gain"},
    "inverse dynamics": {"kind": "inverse-dynamics"},
    "inverse dynamics, tip direction": {"kind": "inverse-dynamics", "input": "tip_direction"},
}
FACTORS = (0.5, 0.8, 1.2, 1.5)
PICTURE = "steering_comparison.png"
SHOWN = ("none", "pid", "pid, model gain", "inverse dynamics, tip direction")


@dataclass(frozen=True)
class Outcome:
    """What a loop came to.

    Attributes
    ----------
    error
        Of the tip at the target [m]; nan where it was not reached.
    effort
        Integral of the command's magnitude, in its SI unit times seconds.
    ending
        "" where it arrived; else why not.
    """

    error: float
    effort: float
    ending: str = ""

    @property
    def text(self) -> str:
        """The error in mm, or why there is none."""
        return self.ending or f"{1e3 * abs(self.error):.2f}"


def scene_of(target: float) -> Scene:
    """Return the scene with a target at a depth [m], where the needle stops; without viscosity, which images hardly show."""
    changes = {"target.depth": target, "insertion.final_depth": target, "tissue.layers.0.damping": 0.0}
    return load_scene(SCENE).with_values(changes)


def conditions(scene: Scene) -> dict[str, dict[str, Any]]:
    """Return what the needle and its sensors really are where the controller believes in the scene."""
    stiffness, layer = scene.needle.bending_stiffness, scene.tissue.layers[0]
    found: dict[str, dict[str, Any]] = {"as believed": {}}
    for factor in FACTORS:
        found[f"E x {factor:g}"] = {"needle.bending_stiffness": factor * stiffness}
    for factor in FACTORS:
        found[f"k x {factor:g}"] = {
            "tissue.layers.0.foundation_modulus": factor * layer.foundation_modulus,
            "loads.0.bevel_coefficient": (scene.loads[0].bevel_coefficient or 0.0) / factor,  # type: ignore[union-attr]
        }
    return found | {"delay 0.3 s": {"sensors.0.delay": 0.3}, "noise 1 mm": {"sensors.0.noise": 1e-3}}


@cache
def outcome(name: str, condition: str, target: float, model: str = "fem") -> Outcome:
    """Return what comes of a controller under a condition."""
    scene = scene_of(target).with_value("controller", CONTROLLERS[name])
    scene = scene.with_value("model.kind", model)
    true = scene.with_values(conditions(scene)[condition])
    try:
        run = steer(true, controller=controller_of(scene))
    except ComputationError as error:
        ending = "unstable" if type(error) is not ComputationError else _where(error)
        effort = 0.0 if error.partial is None else _effort(error.partial.summary)
        return Outcome(float("nan"), effort, ending)
    return Outcome(run.summary["target_error"], _effort(run.summary))


def _where(error: ComputationError) -> str:
    depth = error.partial.depth[-1] if error.partial is not None else float("nan")
    return f"stops at {1e3 * depth:.0f} mm"


def _effort(summary: dict[str, Any]) -> float:
    return float(sum(summary["effort"].values()))


@cache
def sign_change() -> float:
    """Return the depth [m] beyond which the tip goes against the finger."""
    scene = scene_of(TARGETS[-1])
    return model_response(build_plant(scene), "lateral_force", depths=depth_range(scene)).sign_changes[0]


def _errors(target: float) -> str:
    names = list(conditions(scene_of(target)))
    rows = [[name, *(outcome(name, condition, target).text for condition in names)] for name in CONTROLLERS]
    return table(["error [mm]", *names], rows)


def _efforts() -> str:
    header = ["controller", *(f"effort to {1e3 * target:.0f} mm" for target in TARGETS)]
    header += [f"on two modes, {1e3 * target:.0f} mm: error [mm]" for target in TARGETS]
    rows = []
    for name, keys in CONTROLLERS.items():
        unit = "s" if keys.get("input") == "tip_direction" else "N s"
        efforts = [f"{outcome(name, 'as believed', target).effort:.2g} {unit}" for target in TARGETS]
        others = [outcome(name, "as believed", target, "assumed-modes").text for target in TARGETS]
        rows.append([name, *(efforts if name != "none" else ["-", "-"]), *others])
    return table(header, rows)


def findings() -> tuple[str, ...]:
    """Return what the tables say, from their numbers."""
    before, beyond = TARGETS
    plain, scheduled = outcome("pid", "as believed", beyond), outcome("pid, model gain", "as believed", beyond)
    turned = outcome("inverse dynamics, tip direction", "as believed", beyond)
    none = outcome("none", "as believed", beyond)
    worst = [
        1e3 * max(abs(outcome("pid, model gain", name, target).error) for name in conditions(scene_of(target)))
        for target in TARGETS
    ]
    softer = 1e3 * abs(outcome("proportional, model gain", "k x 0.5", before).error)
    return (
        prose(f"""The tip goes with the finger down to {1e3 * sign_change():.1f} mm and against it beyond. A pid with gains of
            fixed sign ends {_against(plain, none)} at {1e3 * beyond:.0f} mm; with the model's gain at the present depth it ends
            at {scheduled.text} mm: what the finger's 3 N can still do there."""),
        prose(f"""Inverse dynamics through the finger stops before the sign change: its gain vanishes there, and it says so.
            Through the direction of the bevel, whose gain keeps its sign, it ends at {turned.text} mm."""),
        prose(f"""Where the model is wrong by up to 50 %, with delay and with noise, the scheduled pid stays within
            {worst[0]:.2f} mm at {1e3 * before:.0f} mm and {worst[1]:.2f} mm at {1e3 * beyond:.0f} mm."""),
        prose(f"""Tissue that is softer than believed makes a loop gain too high: the scheduled proportional control, which holds
            an old image's force until the error has changed, is {softer:.1f} mm off at {1e3 * before:.0f} mm in half the modulus,
            more than without control."""),
        prose("""Incremental control holds its force while the error hardly changes, so that beyond the sign change it does not
            take back in time what it has pushed, whatever the schedule says."""),
    )


def _against(plain: Outcome, none: Outcome) -> str:
    if plain.ending:
        return plain.ending
    return f"{1e3 * abs(plain.error):.2f} mm off, against {1e3 * abs(none.error):.2f} mm without control,"


def _draw() -> bytes:
    panels = []
    for target in TARGETS:
        curves = []
        for name in SHOWN:
            run = steer(scene_of(target).with_value("controller", CONTROLLERS[name]))
            curves.append(Curve(name, 1e3 * run.depth, 1e3 * run.tip_deflection))
        panels.append(Panel(f"target at {1e3 * target:.0f} mm", "depth [mm]", tuple(curves)))
    return curve_picture("tip deflection [mm]", panels)


def section() -> Section:
    """Return the section."""
    scene = scene_of(TARGETS[0])
    about = prose(f"""Scene `{SCENE}`: an 18 gauge tube (EI = {scene.needle.bending_stiffness:.4g} N m^2) in tissue of
        {1e-3 * scene.tissue.layers[0].foundation_modulus:g} kN/m^2 (its viscosity left out), a finger at the skin, images at
        {1 / scene.sensors[0].period:.0f} Hz. Every controller has its default gains, from the model that it believes in; the
        needle or the tissue is then made another one (the bevel's force stays the same). Wanted: the straight line.""")
    parts = [about]
    for target in TARGETS:
        where = f"{_side(target)} the sign change at {1e3 * sign_change():.1f} mm"
        parts += [f"Target at {1e3 * target:.0f} mm, {where}:", _errors(target)]
    parts += ["Effort as believed, and the same controllers on the two-mode model:", _efforts()]
    parts += [picture(PICTURE, "Tip deflection over depth of four controllers, two targets"), _listed(findings())]
    return Section("3 Controllers compared", blocks(*parts), (), {PICTURE: _draw})


def _side(target: float) -> str:
    return "before" if target < sign_change() else "beyond"


def _listed(sentences: Sequence[str]) -> str:
    return "\n".join(f"- {sentence}" for sentence in sentences)
