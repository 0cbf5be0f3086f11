"""What a scene does not need, and why: one small rule each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from fem_needle.scene import Scene
from fem_needle.segments import one_layer_holds

INERTIA_SHARE = 0.25  # of the tolerance: what leaving out inertia may cost


@dataclass(frozen=True)
class Skipped:
    """A term that was left out and why."""

    term: str
    reason: str


Rule = Callable[[Scene], str]  # why a scene does not need a term, "" where it does


def outside_part(scene: Scene) -> str:
    """The needle outside the tissue: no coordinates, no mass."""
    return "support 'entry' clamps it straight at the surface" if scene.support.kind == "entry" else ""


def viscosity(scene: Scene) -> str:
    """C, D and E: no damping matrices."""
    return "" if any(layer.damping > 0 for layer in scene.tissue.layers) else "no layer has damping"


def swelling(scene: Scene) -> str:
    """The stiffness factor over time: matrices of an earlier instant at the same depth serve again."""
    return "the stiffness factor is constant" if isinstance(scene.tissue.stiffness_factor, float) else ""


def points_in_front(scene: Scene) -> str:
    """Guides and lateral loads: no rows, no kinks, no guide forces to solve for."""
    return "" if scene.support.guides or scene.lateral_loads else "no guide and no lateral load"


def cut_elements(scene: Scene) -> str:
    """The loop over layers and the elements that their ends cut: the tissue's matrix is a multiple of a constant."""
    if scene.support.kind == "entry" and one_layer_holds(scene.tissue.layers, scene.needle.length):
        return "one layer holds the whole inserted part, which the elements stretch with"
    return "" if scene.tissue.layers else "no layers"


def path_memory(scene: Scene) -> str:
    """The path that the tip has cut: nothing is remembered, no step is iterated."""
    return "the tissue rests on a straight line" if scene.tissue.rest_line == "straight" else ""


def insertion_dynamics(scene: Scene) -> str:
    """The equation of motion along the axis: the push that a given motion needs is evaluated at the outputs."""
    return "" if scene.insertion.kind == "force" else "the depth over time is given"


def hub_motion(scene: Scene) -> str:
    """Rates of the clamp and the work of the hub."""
    support = scene.support
    if support.kind == "entry" or support.hub_rotation == "free":
        return ""
    still = isinstance(support.hub_deflection, float) and isinstance(support.hub_angle, float)
    return "the hub stands still" if still else ""


RULES: dict[str, Rule] = {
    "needle outside the tissue": outside_part,
    "tissue viscosity": viscosity,
    "swelling": swelling,
    "points between hub and tissue": points_in_front,
    "layer loop": cut_elements,
    "path memory": path_memory,
    "insertion dynamics": insertion_dynamics,
    "hub motion": hub_motion,
}


def unneeded_terms(scene: Scene) -> Iterator[Skipped]:
    """Yield the terms that are absent from the scene and cost nothing."""
    for term, rule in RULES.items():
        reason = rule(scene)
        if reason:
            yield Skipped(term, reason)
