"""The works of what a kink does at once: mean force times jump of deflection, mean velocity times jump of momentum."""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.names import (
    AXIAL_STATE,
    BEAM,
    BENDING_STIFFNESS,
    BOUNDARY,
    CLAMP,
    COURSES,
    COVERED,
    CUTS,
    DEGREE,
    FACTOR,
    FLEXIBLE,
    FORCES,
    GUIDES,
    HUB_WORK,
    INSTANT_SUMS,
    KEPT_HELD,
    KEPT_LATERAL,
    KNOWN,
    LAST_ANGLE_RATE,
    LAST_AXIAL_MOMENTUM,
    LAST_HUB_RATE,
    LATERAL,
    LEDGER_STATE,
    LOAD_WORK,
    NUMBER,
    PATH_LOAD,
    PIECE_NODES,
    POINT_FIRST,
    POINT_ROWS,
    PRESCRIBED,
    RATES,
    S_MOMENTUM,
    SIDES,
    SPEED,
    START,
    STRETCH,
    STRIDE,
    SWITCH,
    TISSUE,
    TISSUE_BLOCKS,
)
from fem_needle.dynamics.points import along, deflection_at
from fem_needle.dynamics.products import bending_form, covered_form

SMALLEST_JUMP = 1e-12  # m and rad: a smaller one is the rounding of a clamp that moves
SAME_FORCE = 1e-9  # of a force: less is no jump
JUMP_FRACTION = 1e-9  # of a step: in this time viscosity lets nothing move


@inner
def elastic_energy(arrays, right, left):
    """Return the change of 1/2 q.(K + m G) q - m q.H from one state to another."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[START], floats_5(arrays, BEAM)
    tissue, covered, load = (
        floats_5(arrays, TISSUE_BLOCKS)[START],
        floats_3(arrays, COVERED)[START],
        floats_2(arrays, PATH_LOAD)[START],
    )
    beam, nodes, total = beams[beam_at(beams, START)], floats_1(arrays, PIECE_NODES), 0.0
    stretch, stiffness = course[STRETCH], floats_1(arrays, NUMBER)[BENDING_STIFFNESS]
    for side in range(2):
        q, sign = right if side == 0 else left, 1.0 if side == 0 else -1.0
        bent = bending_form(beam, switches[STRIDE], switches[DEGREE], stiffness, nodes, q) / (stretch * stretch * stretch)
        held = course[FACTOR] * stretch * covered_form(tissue, TISSUE, covered, switches[STRIDE], q, q)
        total += sign * 0.5 * (bent + held)
        if switches[CUTS]:
            total -= sign * course[FACTOR] * along(load, 0, q)
    return total


@inner
def force_jump_works(arrays, jumped):
    """Add the works where the needle follows at once: mean force times jump of deflection; of a clamp that jumps, what resists.

    What resists is the change of bending and tissue energy less what the points do: viscosity takes as much as time is left, and
    stands on neither side.
    """
    switches, left, held = integers_1(arrays, SWITCH), floats_2(arrays, KEPT_LATERAL)[0], floats_1(arrays, KEPT_HELD)
    rows, first, flexible = (
        floats_3(arrays, POINT_ROWS)[START],
        integers_2(arrays, POINT_FIRST)[START],
        floats_3(arrays, FLEXIBLE)[START],
    )
    forces, known, ledger = floats_2(arrays, FORCES)[START], floats_2(arrays, KNOWN)[START], floats_1(arrays, LEDGER_STATE)
    taken = 0.0
    for point in range(len(forces)):
        mean = 0.5 * (forces[point] + held[point])
        moved = deflection_at(point, rows, first, flexible, known, forces)
        if point >= switches[GUIDES]:
            ledger[LOAD_WORK] += mean * (moved - deflection_at(point, rows, first, flexible, left, held))
        taken += mean * (along(rows[point], first[point], known) - along(rows[point], first[point], left))
    if jumped:
        ledger[HUB_WORK] += elastic_energy(arrays, known, left) - taken


@inner
def momentum_jump_works(arrays, pace, jumped):
    """Add the works at a jump of speed or of the hub's velocity: mean velocity times jump of momentum."""
    axial, ledger, clamp = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LEDGER_STATE), floats_3(arrays, CLAMP)[START]
    lateral, left, rates = floats_3(arrays, LATERAL)[0], floats_2(arrays, KEPT_LATERAL), floats_2(arrays, RATES)[START]
    sums, speed, struck = floats_2(arrays, INSTANT_SUMS)[START], floats_2(arrays, COURSES)[START, SPEED], 0.0
    ledger[BOUNDARY] += 0.5 * (pace + speed) * (sums[S_MOMENTUM] - axial[LAST_AXIAL_MOMENTUM])
    rate, turn = 0.5 * (axial[LAST_HUB_RATE] + clamp[1, 0]), 0.5 * (axial[LAST_ANGLE_RATE] + clamp[1, 1])
    ledger[HUB_WORK] += rate * (lateral[1, 0] - left[1, 0]) + turn * (lateral[1, 1] - left[1, 1])
    for i in range(integers_1(arrays, SWITCH)[PRESCRIBED], len(rates)):
        change = lateral[1, i] - left[1, i]
        if change != 0.0:  # a guide's strike, or the momentum that viscous tissue leaves
            struck += 0.5 * (floats_2(arrays, SIDES)[0, i] + rates[i]) * change
    ledger[HUB_WORK if jumped else BOUNDARY] += struck
