"""The forces that a picture of a run shows at one sample: loads and supports, where and how large."""

from __future__ import annotations

from fem_needle.trajectory import Trajectory

Forces = list[tuple[float, float]]


def lateral_forces(run: Trajectory, row: int) -> Forces:
    """Return place y [m] and force [N] of each lateral load."""
    return list(zip((load.position for load in run.scene.lateral_loads), run.lateral_force[row].tolist(), strict=True))


def tip_force(run: Trajectory, row: int) -> tuple[float, float]:
    """Return place y [m] and sum [N] of the tip's loads."""
    return float(run.depth[row]), float(run.tip_force[row])


def support_forces(run: Trajectory, row: int) -> Forces:
    """Return place y [m] and force on the needle [N] of the clamp and of each guide."""
    scene, depth = run.scene, float(run.depth[row])
    clamp = depth - scene.needle.length if scene.support.kind == "hub" else 0.0
    guides = zip((guide.position for guide in scene.support.guides), run.guide_force[row].tolist(), strict=True)
    return [(clamp, float(run.hub_force[row])), *guides]
