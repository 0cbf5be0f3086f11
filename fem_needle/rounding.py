"""What rounding does to the tip: the true answer does not move with the last digits of the depth, the computed one does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem_needle.loads import load_case
from fem_needle.plant import Plant
from fem_needle.statics import statics_at

_NUDGES = (1, 2, 3, 5, 8, 13)  # units in which the depth is moved to see the round-off
_NUDGE = 2.0**-50


def round_off(plant: Plant, depth: float, time: float, *, stepped: bool) -> float:
    """Return the largest relative change of the tip's answer to a tip force as the depth moves by a few last digits.

    With the stiffness matrix that time steps use, ``stepped``, or as equilibria are solved. The true change is as small as the
    digits; what shows is the round-off of forming and solving the equations.
    """
    if depth < 2.0 * plant.smallest_depth:
        return 0.0
    found = [_tip_compliance(plant, depth * (1.0 - nudge * _NUDGE), time, stepped=stepped) for nudge in (0, *_NUDGES)]
    return max(abs(value - found[0]) for value in found) / abs(found[0])


def _tip_compliance(plant: Plant, depth: float, time: float, *, stepped: bool) -> float:
    """Return the tip's deflection under a tip force of 1 N and nothing else [m]."""
    statics, case = statics_at(plant, depth, time), load_case(plant.scene, depth, time)
    if stepped:
        statics = replace(statics, operators=replace(statics.operators, beam=None))
    forces = np.zeros_like(case.forces)
    forces[-1] = 1.0
    alone = replace(case, forces=forces, clamp=np.zeros_like(case.clamp))
    return float(statics.points.rows[-1] @ statics.state(alone)[0])
