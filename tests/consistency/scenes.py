"""Scenes of the consistency tests, and how errors become orders."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from fem_needle.scene import Guide, Insertion, LateralLoad, Layer, Needle, Run, Scene, Sinusoid, Support, Table, TipLoad, Tissue

LENGTH, STIFFNESS, MASS = 0.2, 0.0256, 0.01016
NEEDLE = Needle(length=LENGTH, bending_stiffness=STIFFNESS, mass_per_length=MASS)
GEL = (Layer(start=0.0, foundation_modulus=5e3),)
# A gap from 80 to 100 mm and a far side at 150 mm.
LAYERS = (
    Layer(start=0.0, end=0.05, foundation_modulus=5e3),
    Layer(start=0.05, end=0.08, foundation_modulus=2e4),
    Layer(start=0.1, end=0.15, foundation_modulus=5e4),
)
DAMPED = (
    Layer(start=0.0, end=0.05, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, end=0.08, foundation_modulus=2e4),
    Layer(start=0.1, foundation_modulus=5e4, damping=20.0),
)
BUZZ = Sinusoid(mean=0.1, amplitude=0.05, frequency=30.0, phase=0.5)
PUSH = (TipLoad(force=0.1),)


def scene_of(kind: str, insertion: Insertion, layers: Any = GEL, loads: Any = PUSH, **parts: Any) -> Scene:
    """Return a scene with the needle of this file; ``support`` holds the support's other values."""
    return Scene(
        **{
            "needle": NEEDLE,
            "support": Support(kind=kind, **parts.pop("support", {})),
            "tissue": Tissue(layers=layers, **parts.pop("tissue", {})),
            "insertion": insertion,
            "loads": loads,
            "run": Run(duration=parts.pop("duration", 1.0)),
            **parts,
        }
    )


def held(depth: float) -> Insertion:
    return Insertion(kind="hold", initial_depth=depth)


def moving(speed: float, start: float, end: float) -> Insertion:
    return Insertion(kind="speed", initial_depth=start, speed=speed, final_depth=end)


def profile(time: list[float], depth: list[float]) -> Insertion:
    return Insertion(kind="profile", depth=Table(time=time, value=depth))


def characteristic_modulus(number: float, stiffness: float = STIFFNESS, length: float = LENGTH) -> float:
    """Return k with (k / 4EI)^(1/4) l = ``number``."""
    return 4.0 * stiffness * (number / length) ** 4


def static_scenes() -> dict[str, Scene]:
    """Return held scenes of every kind of support, layer, guide and load, tip at 0.1 or 0.17 m."""
    stiff = (Layer(start=0.0, foundation_modulus=characteristic_modulus(12.0)),)
    cell = LENGTH / 64
    clamp = {"hub_deflection": 2e-3, "hub_angle": 0.01}
    lateral = LateralLoad(position=-0.0043, force=0.3)
    return {
        "entry": scene_of("entry", held(0.1)),
        "entry stiff": scene_of("entry", held(LENGTH), stiff),
        "entry layers": scene_of("entry", held(0.13), LAYERS),
        "entry far side": scene_of("entry", held(0.17), LAYERS),
        "entry bevel": scene_of("entry", held(0.12), LAYERS, [TipLoad(bevel_coefficient=1e-6), *PUSH]),
        "hub": scene_of("hub", held(0.1)),
        "hub stiff": scene_of("hub", held(0.1), stiff, [*PUSH, lateral]),
        "hub moved": scene_of("hub", held(0.17), LAYERS, (), support=clamp),
        "rigid guide at a node": scene_of(
            "hub", held(0.1), LAYERS, [*PUSH, lateral], support={"guides": [Guide(position=-10 * cell)]}
        ),
        "rigid guide beside a node": scene_of(
            "hub", held(0.1), LAYERS, PUSH, support={"guides": [Guide(position=-10 * cell + 1e-12)]}
        ),
        "rigid guide in an element": scene_of(
            "hub", held(0.1), LAYERS, PUSH, support={"guides": [Guide(position=-0.0317)], **clamp}
        ),
        "force at a node": scene_of("hub", held(0.1), LAYERS, [LateralLoad(position=-3 * cell, force=0.3)]),
        "force beside a node": scene_of("hub", held(0.1), LAYERS, [LateralLoad(position=-3 * cell - 1e-12, force=0.3)]),
        "elastic guides and a force in one element": scene_of(
            "hub",
            held(0.1),
            GEL,
            [LateralLoad(position=-0.0312, force=0.3), *PUSH],
            support={"guides": [Guide(position=-0.032, stiffness=2e3), Guide(position=-0.0305, stiffness=500.0)], **clamp},
        ),
        "two rigid guides in one element": scene_of(
            "hub", held(0.06), GEL, PUSH, support={"guides": [Guide(position=-0.0615), Guide(position=-0.0605)]}
        ),
        "force in a gap": scene_of("hub", held(0.17), LAYERS, [LateralLoad(position=0.0912, force=0.2), *PUSH], support=clamp),
    }


def rates(errors: list[float], ratio: float = 2.0, floor: float = 0.0) -> list[float]:
    """Return the observed order between successive errors, as far as the coarser one is above the floor."""
    return [float(np.log(a / b) / np.log(ratio)) for a, b in pairwise(errors) if a > floor]


def relative(found: Any, expected: Any) -> float:
    """Return the largest difference over the largest expected value."""
    return float(np.max(np.abs(np.asarray(found) - expected)) / np.max(np.abs(expected)))
