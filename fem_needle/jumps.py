"""A clamp that is somewhere else from one instant to the next: the limit of a ramp that takes no time.

While the clamp goes by d_c in a time that tends to zero, velocities grow without bounds and every force that does not grow with
them is forgotten. What remains of the free coordinates' equation, integrated twice, and of the rigid guides' is

    M_ff d_f + M_fc d_c = N_f^T r,      N_f d_f + N_c d_c = 0,

so the inertia of the needle keeps it where it was as well as its shapes can. Integrated once, the viscous tissue leaves a
momentum: P_f jumps by -(C d)_f.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.stages import Stage, StageSolution

Array = NDArray[np.float64]

SMALLEST_JUMP = 1e-12  # m and rad: a smaller one is the rounding of a clamp that moves


def clamp_jump(stage: Stage, coordinates: Array) -> Array | None:
    """Return how far a clamp has jumped (prescribed,), [m] and [rad], from coordinates to what a stage prescribes; None: not."""
    clamped = stage.operators.clamped
    jump = stage.case.clamp[:clamped] - coordinates[:clamped]
    return jump if np.any(np.abs(jump) > SMALLEST_JUMP) else None


def carried(stage: Stage, solution: StageSolution, jump: Array) -> StageSolution:
    """Return a needle with inertia after its clamp has jumped: coordinates and momentum; the rest is as before.

    Parameters
    ----------
    stage
        Just after the jump.
    solution
        Just before it.
    jump
        What `clamp_jump` found.
    """
    operators, points, clamped = stage.operators, stage.points, stage.operators.clamped
    moved = np.zeros_like(solution.coordinates)
    moved[:clamped] = jump
    masses = operators.mass_factorization
    moved[clamped:] = masses.solve(-banded.multiply(operators.mass, moved)[clamped:])
    rigid = np.flatnonzero(points.guide_compliance == 0.0)
    if len(rigid):
        rows = points.rows[rigid, clamped:]
        answers = masses.solve(rows.T)
        moved[clamped:] -= answers @ np.linalg.solve(rows @ answers, points.rows[rigid] @ moved)
    left = solution.momentum.copy()
    if operators.damping is not None:
        left[clamped:] -= banded.multiply(operators.damping, moved)[clamped:]
    return replace(solution, coordinates=solution.coordinates + moved, momentum=left)
