"""The forces that a picture of a run shows at one sample: loads and supports, where and how large."""

from __future__ import annotations

import numpy as np

from fem_needle.loads import load_case
from fem_needle.scene import LateralLoad
from fem_needle.trajectory import Trajectory

Forces = list[tuple[float, float]]


def lateral_forces(run: Trajectory, row: int) -> Forces:
    """Return place y [m] and force [N] of each lateral load; the command of a loop stands for the first."""
    places = [load.position for load in run.scene.loads if isinstance(load, LateralLoad)]
    given = load_case(run.scene, float(run.depth[row]), float(run.time[row])).forces[: len(places)]
    forces = [float(force) for force in given]
    if forces:
        forces[0] = _commanded(run, "lateral_force", row, forces[0])
    return list(zip(places, forces, strict=True))


def tip_force(run: Trajectory, row: int) -> tuple[float, float]:
    """Return place y [m] and sum [N] of the tip's loads, turned as a loop commands."""
    depth = float(run.depth[row])
    force = float(load_case(run.scene, depth, float(run.time[row])).forces[-1])
    return depth, force * _commanded(run, "tip_direction", row, 1.0)


def support_forces(run: Trajectory, row: int) -> Forces:
    """Return place y [m] and force on the needle [N] of the clamp and of each guide."""
    scene, depth = run.scene, float(run.depth[row])
    clamp = depth - scene.needle.length if scene.support.kind == "hub" else 0.0
    guides = zip((guide.position for guide in scene.support.guides), run.guide_force[row].tolist(), strict=True)
    return [(clamp, float(run.hub_force[row])), *guides]


def _commanded(run: Trajectory, name: str, row: int, given: float) -> float:
    """Return what a loop has commanded in place of a given value."""
    values = run.signals.get(f"command_{name}")
    return float(values[row]) if values is not None and np.isfinite(values[row]) else given
