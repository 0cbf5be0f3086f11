"""What a console and a notebook show of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fem_needle.display import Card, in_millimeters
from fem_needle.scene.time_functions import Sinusoid, Table
from fem_needle.scene.time_quantity import extremes
from fem_needle.scene.tissue import Layer

if TYPE_CHECKING:
    from fem_needle.scene.scene import Scene

KILO = 1e3


def scene_card(scene: Scene) -> Card:
    """Return needle, support, tissue, insertion, loads and model, with a table of the layers."""
    needle, layers = scene.needle, sorted(scene.tissue.layers, key=lambda layer: layer.start)
    count = f"{len(layers)} layer{'s' * (len(layers) != 1)}" if scene.tissue.kind == "foundation" else "spring at the tip"
    facts = [
        ("needle", in_millimeters(needle.length)),
        ("support", f"{scene.support.kind}{_guides(scene)}"),
        ("tissue", count),
        ("insertion", _insertion(scene)),
        ("model", scene.model.kind),
        ("bending stiffness", f"{needle.bending_stiffness:.4g} N m²"),
        ("mass per length", f"{KILO * needle.mass_per_length:.4g} g/m"),
        ("rest line of the tissue", scene.tissue.rest_line),
        ("loads", ", ".join(load.kind for load in scene.loads) or "none"),
        ("duration", f"{scene.duration:.4g} s" if scene.duration else "until it ends"),
    ]
    if scene.controller.kind != "none":
        facts.append(("controller", f"{scene.controller.kind} of {scene.controller.input}"))
    return Card("Scene", scene.title, tuple(facts), _table(layers))


def _guides(scene: Scene) -> str:
    count = len(scene.support.guides)
    return f" with {count} guide{'s' * (count != 1)}" if count else ""


def _insertion(scene: Scene) -> str:
    """Return the insertion in words: what is prescribed, and the depths [mm]."""
    insertion = scene.insertion
    first, last = in_millimeters(insertion.first_depth), insertion.final_depth
    if insertion.kind == "hold":
        return f"held at {first}"
    if insertion.kind == "profile":
        low, high = extremes(insertion.depth or 0.0)
        return f"between {in_millimeters(low)} and {in_millimeters(high)}"
    way = f"from {first}" + ("" if last is None else f" to {in_millimeters(last)}")
    if insertion.kind == "force":
        return f"pushed {way}"
    return f"{way}{_speed(insertion.speed)}"


def _speed(speed: Any) -> str:
    return "" if speed is None or isinstance(speed, Table | Sinusoid) else f" at {in_millimeters(speed)}/s"


def _table(layers: list[Layer]) -> dict[str, list[Any]]:
    if not layers:
        return {}
    return {
        "layer": [layer.name for layer in layers],
        "start [mm]": [KILO * layer.start for layer in layers],
        "end [mm]": [None if layer.end is None else KILO * layer.end for layer in layers],
        "foundation modulus [kN/m²]": [layer.foundation_modulus / KILO for layer in layers],
        "damping [N s/m²]": [layer.damping for layer in layers],
        "cutting force [N]": [layer.cutting_force for layer in layers],
    }
