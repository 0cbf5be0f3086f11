"""Closed forms and exact solutions as methods: the best that can be done where they hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.methods import EXACT, Method, Setting, Solve
from fem_needle.exact import ClampedTipForce, exact_static, natural_frequencies, tip_compliance
from fem_needle.motion import depth_law

Array = NDArray[np.float64]

CLOSED, MATCHED = "closed form", "matching conditions"


class ExactStatics(Method):
    """The exact equilibrium at each output: no inertia, no viscosity, no vibration."""

    name = "exact equilibria"
    kind = EXACT
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {
        "S": (Setting(variant=CLOSED), Setting(variant=MATCHED)),
        **dict.fromkeys(("M", "M2", "brachytherapy"), (Setting(variant=MATCHED),)),
    }

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the evaluation at all times."""
        scene, law = case.scene, depth_law(case.scene)
        if setting.variant == CLOSED:
            needle, layer, force = scene.needle, scene.tissue.layers[0], scene.loads[0].force
            depth = scene.insertion.first_depth
            form = ClampedTipForce(needle.bending_stiffness, layer.foundation_modulus, depth, float(force))  # type: ignore[arg-type]
            return lambda: np.array([form.tip_deflection])
        places = [(law.depth(time), time) for time in case.times.tolist()]
        return lambda: np.array([exact_static(scene, depth, time).tip_deflection for depth, time in places])


class ModesAndCosines(Method):
    """The first terms of the exact sum over modes of a needle that is let go."""

    name = "exact modes and cosines"
    kind = EXACT
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {"D": tuple(Setting(modes=count) for count in (1, 2, 5, 10, 20, 50))}

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the sum, frequencies included."""
        scene, times, count = case.scene, case.times, setting.modes or 1
        depth, mass = scene.insertion.first_depth, scene.needle.mass_per_length
        first = float(scene.initial.tip_deflection or 0.0)

        def tips() -> Array:
            frequencies = natural_frequencies(scene, depth, count)
            amplitudes = 4.0 * first / tip_compliance(scene, depth) / (depth * mass * frequencies**2)
            return np.cos(np.multiply.outer(times, frequencies)) @ amplitudes

        return tips
