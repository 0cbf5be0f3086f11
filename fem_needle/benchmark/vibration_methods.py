"""The program's loop for uniform needles, in the vibrations of elements or modes (`fem_needle.batch`): tips, nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from fem_needle.batch.many import prepared, simulate_many
from fem_needle.batch.rows import row_of, times_of
from fem_needle.batch.spectrum import spectrum_of
from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.methods import OWN, Method, Setting, Solve
from fem_needle.models import build_plant
from fem_needle.scene import Scene

NO_STEPS = 1.0  # s: where nothing moves, or cosines need none


class Vibrations(Method):
    """A few vibrations of a model that move, the others at equilibrium; ``modes`` of a setting says how many move."""

    kind = OWN

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene of a case with a setting."""
        raise NotImplementedError

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the compiled loop on a spectrum that is there already."""
        scene = self.scene(case, setting)
        rows = row_of(scene)[None]
        moving = 0 if case.at_rest or setting.time_step is None else int(setting.modes or 0)
        compute = prepared(rows, spectrum_of(build_plant(scene), moving), setting.time_step or NO_STEPS)
        tips = np.zeros(times_of(rows).shape)

        def solve() -> np.ndarray:
            compute(tips, 0, 1)
            return tips[0, :1].copy() if case.at_rest else tips[0].copy()

        return solve

    def whole(self, case: Case, setting: Setting) -> Solve | None:
        """Return the whole answer, spectrum included."""
        scene = self.scene(case, setting)
        steps = {"time_step": setting.time_step or NO_STEPS, "vibrations": 0 if setting.time_step is None else setting.modes}

        def solve() -> np.ndarray:
            tips = simulate_many(scene, cores=1, **steps).tip_deflection[0]  # type: ignore[arg-type]
            return tips[:1] if case.at_rest else tips

        return solve


class ElementVibrations(Vibrations):
    """Vibrations of quartic elements."""

    name = "vibrations of elements"
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {
        "S": tuple(Setting(elements=count) for count in (2, 4, 8)),
        "D": tuple(Setting(elements=count) for count in (8, 32, 128)),
        "M": (Setting(elements=8), Setting(elements=8, modes=2, time_step=1e-2), Setting(elements=40, modes=2, time_step=5e-4)),
        "M2": (
            Setting(elements=8, modes=2, time_step=5e-3),
            Setting(elements=8, modes=2, time_step=2.5e-3),
            Setting(elements=40, modes=2, time_step=5e-4),
            Setting(elements=16, modes=4, time_step=5e-5),
            Setting(elements=16, modes=4, time_step=2.5e-5),
        ),
    }

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene with the elements."""
        return case.scene.with_value("numerics.elements", setting.elements)


class ModeVibrations(Vibrations):
    """Modes of the inserted length, which are its vibrations."""

    name = "vibrations of modes"
    choices: ClassVar[Mapping[str, tuple[Setting, ...]]] = {
        "D": tuple(Setting(modes=count) for count in (4, 12, 40)),
        "M2": (Setting(modes=2, time_step=1e-3), Setting(modes=4, time_step=1e-3)),
    }

    def scene(self, case: Case, setting: Setting) -> Scene:
        """Return the scene with the modes."""
        values = {"model.kind": "assumed-modes", "model.basis": "inserted-length", "model.modes": setting.modes}
        return case.scene.with_values(values)
