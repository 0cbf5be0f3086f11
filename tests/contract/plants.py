"""The plants that must meet the contract: one list, where another model joins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fem_needle import FiniteElementNeedle
from fem_needle.plant import Plant
from fem_needle.scene import Guide, LateralLoad, Layer, Model, Scene, Sinusoid, TipLoad
from reduced_model import AssumedModeNeedle, mode_basis, project
from tests.consistency.scenes import held, scene_of

LAYERS = (
    Layer(start=0.0, end=0.0437, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, end=0.0913, foundation_modulus=2e4),
    Layer(start=0.0913, foundation_modulus=5e4, damping=20.0),
)
SWELLING = {"stiffness_factor": Sinusoid(mean=1.5, amplitude=0.5, frequency=2.0)}
TIP = [TipLoad(force=0.1)]
POINTS = [*TIP, LateralLoad(position=-0.0123, force=0.3)]
GUIDES = {"guides": [Guide(position=-0.0317, stiffness=1e3), Guide(position=-0.0291)], "hub_angle": 0.01}


@dataclass(frozen=True)
class Case:
    """A scene, how a plant is made of it, and what the plant calls itself."""

    scene: Scene
    make: Callable[[Scene], Plant]
    name: str

    @property
    def plant(self) -> Plant:
        return self.make(self.scene)


def _elements(count: int, degree: int) -> Callable[[Scene], Plant]:
    return lambda scene: FiniteElementNeedle(scene, elements=count, degree=degree)


def _modes(count: int, basis: str, corrections: bool, scene: Scene) -> Case:
    def make(scene: Scene) -> Plant:
        return AssumedModeNeedle(scene, modes=count, basis=basis, static_corrections=corrections)

    return Case(scene, make, "assumed-modes")


def _projected(scene: Scene) -> Plant:
    needle = FiniteElementNeedle(scene, elements=9)
    return project(needle, mode_basis(needle, 3))


SCENES = {
    "entry": scene_of("entry", held(0.1), LAYERS, TIP, tissue=SWELLING),
    "entry, fixed-frame": scene_of("entry", held(0.1), LAYERS, TIP, tissue=SWELLING, model=Model(kinematics="fixed-frame")),
    "hub": scene_of("hub", held(0.1), LAYERS, POINTS, tissue=SWELLING),
    "hub, guides": scene_of("hub", held(0.1), LAYERS, POINTS, tissue=SWELLING, support=GUIDES),
}
ELEMENTS = {
    f"elements of degree {degree}, {name}": Case(scene, _elements(7, degree), "fem")
    for degree in (3, 4)
    for name, scene in SCENES.items()
}
MODES = {
    f"{count} modes, {basis}{', corrected' * corrections}, {name}": _modes(count, basis, corrections, scene)
    for count, basis, corrections in (
        (2, "full-length", False),
        (4, "inserted-length", False),
        (5, "full-length", False),
        (2, "full-length", True),
    )
    for name, scene in SCENES.items()
    if basis == "full-length" or "entry" in name
}
PROJECTIONS = {
    f"projected, {name}": Case(scene, _projected, "projected") for name, scene in SCENES.items()
}
CASES = ELEMENTS | MODES | PROJECTIONS
