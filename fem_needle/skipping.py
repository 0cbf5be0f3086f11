"""What a scene does not need, and why: one small rule each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fem_needle.collocation import collocation
from fem_needle.plant import Plant
from fem_needle.scene import LateralLoad, Scene
from fem_needle.steppers import DynamicStepper, Massless, StaticStepper, Stepper

INERTIA_SHARE = 0.25  # of the tolerance: what leaving out inertia may cost


@dataclass(frozen=True)
class Skipped:
    """A term that was left out and why."""

    term: str
    reason: str


def inertia_free_stepper(plant: Plant) -> Stepper:
    """Return equilibria where the tissue has no memory, creep (L-stable) where it is viscous or remembers a path."""
    tissue = plant.scene.tissue
    remembers = tissue.rest_line == "cut-path" or plant.scene.insertion.kind == "force"
    if remembers or any(layer.damping > 0 for layer in tissue.layers):
        return DynamicStepper(Massless(plant), collocation(0.0), inertia=False)
    return StaticStepper(plant)


def unneeded_terms(scene: Scene) -> Iterator[Skipped]:
    """Yield the terms that are absent from the scene and cost nothing."""
    if scene.support.kind == "entry":
        yield Skipped("needle outside the tissue", "support 'entry' clamps it straight at the surface")
    if not any(layer.damping > 0 for layer in scene.tissue.layers):
        yield Skipped("tissue viscosity", "no layer has damping")
    if isinstance(scene.tissue.stiffness_factor, float):
        yield Skipped("swelling", "the stiffness factor is constant")
    if not any(isinstance(load, LateralLoad) for load in scene.loads) and not scene.support.guides:
        yield Skipped("points between hub and tissue", "no guide and no lateral load")
