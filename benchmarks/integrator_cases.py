"""Scenes in which integrators are compared, and what is true of them: spectral solvers that share nothing with the kernel.

They have polynomials in place of elements and methods of order 5 and 6 with other steps (`tests/references`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle import FiniteElementNeedle
from fem_needle.dynamics.grid import time_grid
from fem_needle.scene import Guide, Insertion, LateralLoad, Layer, Scene, Sinusoid, TipLoad
from tests.consistency.scenes import BUZZ, GEL, moving, scene_of
from tests.references import entry_motion, hub_motion

Array = NDArray[np.float64]

ELEMENTS = 12
STEPS, FINE_STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4), (1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5)  # s
VISCOUS = (
    Layer(start=0.0, end=0.05, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, end=0.08, foundation_modulus=2e4, damping=10.0),
    Layer(start=0.08, foundation_modulus=5e4, damping=20.0),
)
TWO = (
    Layer(start=0.0, end=0.02, foundation_modulus=5e3, damping=50.0),
    Layer(start=0.02, foundation_modulus=2e4, damping=200.0),
)
SWAYING = Sinusoid(mean=0.3, amplitude=0.2, frequency=5.0, phase=0.3)
THRUST = Sinusoid(mean=0.1, amplitude=-0.01, frequency=45.0, phase=np.pi / 2)  # to and fro at up to 2.8 m/s


@dataclass(frozen=True, eq=False)
class Case:
    """A scene with its outputs, the steps that are tried, and how the spectral solver is asked.

    Attributes
    ----------
    name
        In tables.
    scene
        Needle, tissue, motion, loads.
    output
        Time between outputs [s].
    steps
        Time steps [s].
    degree, rate
        Of the spectral solver: polynomials, and steps per second.
    elements
        Of the needle.
    """

    name: str
    scene: Scene
    output: float
    steps: tuple[float, ...]
    degree: int
    rate: float
    elements: int = ELEMENTS
    _known: dict[str, Any] = field(default_factory=dict)

    @property
    def needle(self) -> FiniteElementNeedle:
        """The needle on elements."""
        return self._once("needle", lambda: FiniteElementNeedle(self.scene, elements=self.elements))

    @property
    def true_tips(self) -> Array:
        """Tip deflections [m] at the outputs, t = 0 first, by the spectral solver."""
        return self._once("true", lambda: self._spectral(self.degree, self.rate))

    @property
    def doubt(self) -> float:
        """What a coarser run of the spectral solver differs by, relative to the largest deflection."""
        coarse = self._once("coarse", lambda: self._spectral(self.degree * 3 // 4, self.rate / 2))
        return miss(coarse, self.true_tips)

    def _spectral(self, degree: int, rate: float) -> Array:
        solve = entry_motion if self.scene.support.kind == "entry" else hub_motion
        times = np.array(time_grid(self.needle, self.output, self.output).outputs)
        tips: Array = solve(self.scene, float(times[-1]), times, degree=degree, steps_per_second=rate).tip_deflection
        return tips

    def _once(self, name: str, found: Callable[[], Any]) -> Any:
        if name not in self._known:
            self._known[name] = found()
        return self._known[name]


def miss(found: Array, true: Array) -> float:
    """Return the largest difference relative to the largest true value."""
    return float(np.max(np.abs(found - true)) / np.max(np.abs(true)))


def cases() -> list[Case]:
    """Return the scenes that every method takes."""
    finger, bevel = [TipLoad(force=BUZZ), LateralLoad(position=-0.005, force=SWAYING)], [TipLoad(bevel_coefficient=2e-6)]
    swaying = scene_of("hub", moving(0.05, 0.025, 0.105), TWO, finger, duration=0.4)
    interfaces = scene_of("hub", moving(0.2, 0.04, 0.1), VISCOUS, bevel, duration=0.3)
    growing = scene_of("entry", moving(0.2, 0.04, 0.1), VISCOUS, [TipLoad(force=BUZZ)], duration=0.3)
    ringing = scene_of("entry", moving(0.2, 0.05, 0.1), GEL, [TipLoad(force=BUZZ)], duration=0.25)
    return [
        Case("hub, viscous, swaying loads", swaying, 0.02, STEPS, 48, 8e3, 2 * ELEMENTS),
        Case("hub, viscous, interfaces under a bevel", interfaces, 0.02, STEPS, 40, 64e3),
        Case("entry, viscous", growing, 0.02, STEPS, 30, 8e3),
        Case("entry, elastic", ringing, 0.0125, FINE_STEPS, 24, 32e3),
    ]


def guided() -> Case:
    """Return a hub that is jerked while the needle slides through a rigid guide."""
    turn = {"hub_angle": Sinusoid(amplitude=0.01, frequency=40.0), "hub_deflection": Sinusoid(amplitude=1e-3, frequency=30.0)}
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=BUZZ)]
    insertion, support = Insertion(kind="profile", depth=THRUST), {"guides": [Guide(position=-0.0317)], **turn}
    scene = scene_of("hub", insertion, GEL, loads, support=support, duration=0.01)
    return Case("rigid guide, hub jerked", scene, 2e-4, (1e-4, 5e-5, 2e-5, 1e-5, 5e-6), 48, 4e5, 16)
