"""Scenes of every kind that the kernel steps, and runs of them at given settings.

``python -m tests.consistency.kernel_scenes FILE`` writes every variable of every run.
"""

import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.scene import Friction, Guide, Insertion, LateralLoad, Layer, Scene, Sinusoid, Table, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import BUZZ, DAMPED, LAYERS, held, moving, profile, scene_of

GUIDED = {"guides": (Guide(position=-0.03), Guide(position=-0.01, stiffness=2e3))}
FINGER = (LateralLoad(position=-0.005, force=Table(time=[0.004, 0.01], value=[0.0, 0.5])), TipLoad(force=0.1))
UNDAMPED = {"spectral_radius": 1.0}  # as the loops were, also under rigid guides
SWELLING = {"stiffness_factor": Sinusoid(mean=1.0, amplitude=0.3, frequency=40.0)}
TURNED = {"hub_deflection": BUZZ, "hub_angle": Table(time=[0.0, 0.02], value=[0.0, 0.1])}
FREE = {"hub_rotation": "free", "hub_torque": BUZZ, "hub_rotational_inertia": 1e-5}
SPRING = {"kind": "tip-spring", "tip_stiffness": 50.0}
BEVEL = (TipLoad(bevel_coefficient=2e-6),)
MOVED = {
    "entry": scene_of("entry", moving(3.0, 0.02, 0.08), loads=(TipLoad(force=BUZZ),), duration=0.03),
    "entry-layers": scene_of("entry", moving(3.0, 0.02, 0.14), LAYERS, duration=0.04),
    "entry-damped": scene_of("entry", moving(-2.0, 0.14, 0.06), DAMPED, duration=0.04),
    "entry-fixed-frame": scene_of("entry", moving(5.0, 0.02, 0.14), duration=0.024, model={"kinematics": "fixed-frame"}),
    "entry-out-and-in": scene_of("entry", profile([0.0, 0.01, 0.03], [0.02, 0.05, 0.03]), LAYERS, duration=0.03),
    "entry-swelling": scene_of("entry", held(0.1), DAMPED, tissue=SWELLING, duration=0.02),
    "hub": scene_of("hub", moving(3.0, 0.02, 0.14), LAYERS, duration=0.04),
    "hub-damped": scene_of("hub", moving(3.0, 0.06, 0.16), DAMPED, duration=0.04),
    "guides": scene_of("hub", moving(1.0, 0.02, 0.06), DAMPED, FINGER, support=GUIDED, duration=0.05, numerics=UNDAMPED),
    "moving-hub": scene_of("hub", moving(1.0, 0.02, 0.06), support=TURNED, duration=0.04),
    "free-hub": scene_of("hub", held(0.1), support=FREE, duration=0.03),
    "tip-spring": scene_of("entry", moving(3.0, 0.02, 0.08), (), tissue=SPRING, duration=0.02),
    "bevel": scene_of("hub", moving(3.0, 0.02, 0.14), LAYERS, BEVEL, duration=0.04),
    "cut-path": scene_of("hub", moving(3.0, 0.02, 0.14), LAYERS, tissue={"rest_line": "cut-path"}, duration=0.04),
}
SLIDING = Friction(coulomb=0.2, viscous=20.0)
CAPSULE = (
    Layer(start=0.0, end=0.04, foundation_modulus=5e3, cutting_force=0.4),
    Layer(start=0.04, foundation_modulus=2e4, cutting_force=0.8, puncture_force=1.5),
)


def pushed(kind: str, force: Any, layers: Any, **parts: Any) -> Scene:
    """Return a needle that a force pushes from 20 mm on."""
    insertion = Insertion(kind="force", initial_depth=0.02, push_force=force)
    return scene_of(kind, insertion, layers, friction=SLIDING, **parts)


PUSHED = {
    "push-layers": pushed("hub", 3.0, LAYERS, duration=0.4),
    "push-entry": pushed("entry", 3.0, DAMPED, duration=0.4),
    "push-capsule": pushed("hub", Table(time=[0.0, 0.3], value=[0.0, 4.0]), CAPSULE, duration=0.35),
    "push-guide": pushed("hub", 3.0, LAYERS, support={"guides": (Guide(position=-0.01, stiffness=2e3),)}, duration=0.3),
    "push-cut": pushed("hub", 3.0, LAYERS, tissue={"rest_line": "cut-path"}, duration=0.2),
}


class Case(NamedTuple):
    """One run; ``modes`` says how many assumed modes, or 0 for seven elements."""

    scene: str
    analysis: str
    modes: int = 0

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.scene}, {self.analysis}" + (f", {self.modes} modes" if self.modes else "")


def cases() -> Iterator[Case]:
    """Yield all runs."""
    for name in MOVED:
        for analysis in ("dynamic", "quasi-static", "static"):
            if (name, analysis) not in {("free-hub", "static"), ("cut-path", "static")}:
                yield Case(name, analysis)
    yield from (Case(name, "dynamic") for name in PUSHED)
    for name in ("entry", "entry-damped", "entry-fixed-frame", "hub-damped", "guides", "tip-spring", "cut-path"):
        yield Case(name, "dynamic", 2)
        yield Case(name, "dynamic", 6)


def variables(case: Case) -> dict[str, np.ndarray]:
    """Return what ``series.nc`` says of a run, by name."""
    scene = (MOVED | PUSHED)[case.scene]
    plant = AssumedModeNeedle(scene, modes=case.modes) if case.modes else FiniteElementNeedle(scene, elements=7)
    steps = 400 if case.scene in PUSHED else 60
    run = simulate(plant, time_step=scene.duration / steps, analysis=case.analysis, output_step=scene.duration / 5)
    return run.series | {"guide_force": run.guide_force, "station_deflection": run.station_deflection[:, ::20]}


if __name__ == "__main__":
    found = {f"{case.name}/{key}": value for case in cases() for key, value in variables(case).items()}
    np.savez_compressed(sys.argv[1], **found)
