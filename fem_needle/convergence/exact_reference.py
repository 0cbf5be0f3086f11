"""The exact answer to a scene, where `fem_needle.exact` has one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.exact import ReleaseFromTipForce, exact_static
from fem_needle.motion import depth_law
from fem_needle.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExactReference:
    """An exact answer.

    Attributes
    ----------
    text
        What it is, one line.
    tips
        Deflection of the tip [m], shape (nt,).
    shape
        Deflection along the needle at the last instant [m], shape (stations,); None where only the tip is known.
    """

    text: str
    tips: Array
    shape: Array | None


def exact_reference(scene: Scene, analysis: str, times: Sequence[float]) -> ExactReference | None:
    """Return the exact answer at instants [s], or None where there is none.

    Parameters
    ----------
    scene
        The scene; the answer is that of the equation which the conservative models approach.
    analysis
        "static" for equilibria; "dynamic".
    times
        Instants [s].
    """
    if not _is_covered(scene):
        return None
    try:
        return _statics(scene, times) if analysis == "static" else _release(scene, analysis, times)
    except SceneError:
        return None


def _is_covered(scene: Scene) -> bool:
    """Return whether rest line, tissue, hub and model are those of the exact cases."""
    springs = scene.tissue.kind == "foundation" and scene.tissue.rest_line == "straight"
    return springs and scene.support.hub_rotation == "fixed" and scene.model.variant == "conservative"


def _statics(scene: Scene, times: Sequence[float]) -> ExactReference:
    law = depth_law(scene)
    answers = [exact_static(scene, law.depth(time), time) for time in times]
    stations = np.linspace(0.0, scene.needle.length, scene.numerics.output_points)
    tips = np.array([answer.tip_deflection for answer in answers])
    return ExactReference("exact: beam equation solved piece by piece", tips, answers[-1].deflection(stations))


def _release(scene: Scene, analysis: str, times: Sequence[float]) -> ExactReference | None:
    if analysis != "dynamic":
        return None
    return ExactReference("exact: sum over modes of a released shape", ReleaseFromTipForce(scene).tip_deflection(times), None)
