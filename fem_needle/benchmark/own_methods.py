"""The program itself: elements and steps that are given, a tolerance that is given, few modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.loop import whole_loop, whole_run
from fem_needle.benchmark.methods import OWN, Method, Setting, Solve, over
from fem_needle.models import build_plant
from fem_needle.scene import Scene
from fem_needle.statics import solve_static

Array = NDArray[np.float64]

class OwnMethod(Method):
    """What the program computes: from a scene with the settings in it."""

    kind = OWN

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene of a case with a setting."""
        raise NotImplementedError

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the run of a plant that is there already; at rest, its equilibrium."""
        scene = self.scene(case, setting)
        plant = build_plant(scene)
        if case.at_rest:
            depth = scene.insertion.first_depth
            return lambda: np.array([solve_static(plant, depth=depth).tip_deflection])
        return whole_loop(plant)

    def whole(self, case: Case, setting: Setting) -> Solve | None:
        """Return the run of the scene."""
        run = whole_run(self.scene(case, setting))
        return lambda: _of_case(case, run())


class FixedElements(OwnMethod):
    """Quartic elements and time steps that are given."""

    name = "finite elements"
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {
        "S": over((1, 2, 4, 8)),
        "D": over((2, 4, 8, 16, 32, 64, 128)),
        "M": over((1, 2, 4, 8, 16, 40), time_steps=(1e-2, 1e-2, 1e-2, 1e-2, 2e-3, 1e-3)),
        "M2": over((2, 4, 8, 8, 16, 40, 16, 16), time_steps=(5e-3, 5e-3, 2e-3, 1e-3, 5e-4, 5e-4, 1e-4, 2.5e-5)),
        "brachytherapy": over((4, 8, 16, 32), time_steps=(5e-2, 2e-2, 1e-2, 5e-3)),
    }

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene with elements and time step."""
        return case.scene.with_values({"numerics.elements": setting.elements, "numerics.time_step": setting.time_step or "auto"})


class ToleranceElements(OwnMethod):
    """Elements and time steps that the program chooses for a tolerance; the choosing is timed."""

    name = "tolerance"

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Return the tolerances 1e-2 to 1e-6."""
        return tuple(Setting(tolerance=10.0**-digits) for digits in range(2, 7))

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene with the tolerance."""
        return case.scene.with_value("numerics.tolerance", setting.tolerance)

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the whole run: the choosing of elements and steps is the method."""
        run = whole_run(self.scene(case, setting))
        return lambda: _of_case(case, run())

    def whole(self, case: Case, setting: Setting) -> Solve | None:
        """Return None: nothing is prepared."""
        return None


_FULL, _INSERTED = "full-length", "inserted-length"


class AssumedModes(OwnMethod):
    """Few modes in place of elements."""

    name = "assumed modes"
    _steps: ClassVar[Mapping[str, float | None]] = {"D": None, "M": 1e-2, "M2": 1e-3, "brachytherapy": 2e-2}

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Return modes of both bases, as far as their steps are worth it."""
        counts = (2, 4, 8, 16) if case.name in ("S", "D") else (2, 4)
        step = self._steps.get(case.name)
        bases = (_FULL,) if case.scene.support.kind == "hub" else (_FULL, _INSERTED)
        return tuple(Setting(modes=count, variant=basis, time_step=step) for basis in bases for count in counts)

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene with the modes."""
        values = {"model.kind": "assumed-modes", "model.modes": setting.modes, "model.basis": setting.variant}
        return case.scene.with_values(values | {"numerics.time_step": setting.time_step or "auto"})


def _of_case(case: Case, tips: Array) -> Array:
    """Return the tips that count: at rest one of them."""
    return tips[:1] if case.at_rest else tips
