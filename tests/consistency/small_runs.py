"""Every kind of scene on two elements in a few steps, for code that is not compiled.

``python -m tests.consistency.small_runs FILE`` writes every variable of every run.
"""

import sys

import numpy as np

from fem_needle import FiniteElementNeedle, simulate
from reduced_model import AssumedModeNeedle
from tests.consistency.kernel_scenes import MOVED, PUSHED, Case, cases


def variables(case: Case) -> dict[str, np.ndarray]:
    """Return what ``series.nc`` says of a run, by name."""
    scene = (MOVED | PUSHED)[case.scene]
    plant = AssumedModeNeedle(scene, modes=case.modes) if case.modes else FiniteElementNeedle(scene, elements=2)
    steps = 40 if case.scene in PUSHED else 4
    return simulate(plant, time_step=scene.duration / steps, analysis=case.analysis, output_step=scene.duration / 2).series


if __name__ == "__main__":
    np.savez(sys.argv[1], **{f"{case.name}/{key}": value for case in cases() for key, value in variables(case).items()})
