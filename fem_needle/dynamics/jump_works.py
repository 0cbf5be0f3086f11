"""The works of what a kink does at once: mean force times jump of deflection, mean velocity times jump of momentum."""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.points import along, deflection_at
from fem_needle.dynamics.products import bending_form, covered_form

SMALLEST_JUMP = 1e-12  # m and rad: a smaller one is the rounding of a clamp that moves
SAME_FORCE = 1e-9  # of a force: less is no jump
JUMP_FRACTION = 1e-9  # of a step: in this time viscosity lets nothing move


@inner
def elastic_energy(arrays, right, left):
    """Return the change of 1/2 q.(K + m G) q - m q.H from one state to another."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[ix.START], floats_5(arrays, ix.BEAM)
    tissue, covered, load = (
        floats_5(arrays, ix.TISSUE_BLOCKS)[ix.START],
        floats_3(arrays, ix.COVERED)[ix.START],
        floats_2(arrays, ix.PATH_LOAD)[ix.START],
    )
    beam, nodes, total = beams[beam_at(beams, ix.START)], floats_1(arrays, ix.PIECE_NODES), 0.0
    stretch, stiffness = course[ix.STRETCH], floats_1(arrays, ix.NUMBER)[ix.BENDING_STIFFNESS]
    for side in range(2):
        q, sign = right if side == 0 else left, 1.0 if side == 0 else -1.0
        bent = bending_form(beam, switches[ix.STRIDE], switches[ix.DEGREE], stiffness, nodes, q) / (stretch * stretch * stretch)
        held = course[ix.FACTOR] * stretch * covered_form(tissue, ix.TISSUE, covered, switches[ix.STRIDE], q, q)
        total += sign * 0.5 * (bent + held)
        if switches[ix.CUTS]:
            total -= sign * course[ix.FACTOR] * along(load, 0, q)
    return total


@inner
def force_jump_works(arrays, jumped):
    """Add the works where the needle follows at once: mean force times jump of deflection; of a clamp that jumps, what resists.

    What resists is the change of bending and tissue energy less what the points do: viscosity takes as much as time is left, and
    stands on neither side.
    """
    switches, left, held = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.KEPT_LATERAL)[0], floats_1(arrays, ix.KEPT_HELD)
    rows, first, flexible = (
        floats_3(arrays, ix.POINT_ROWS)[ix.START],
        integers_2(arrays, ix.POINT_FIRST)[ix.START],
        floats_3(arrays, ix.FLEXIBLE)[ix.START],
    )
    forces, known, ledger = (
        floats_2(arrays, ix.FORCES)[ix.START],
        floats_2(arrays, ix.KNOWN)[ix.START],
        floats_1(arrays, ix.LEDGER_STATE),
    )
    taken = 0.0
    for point in range(len(forces)):
        mean = 0.5 * (forces[point] + held[point])
        moved = deflection_at(point, rows, first, flexible, known, forces)
        if point >= switches[ix.GUIDES]:
            ledger[ix.LOAD_WORK] += mean * (moved - deflection_at(point, rows, first, flexible, left, held))
        taken += mean * (along(rows[point], first[point], known) - along(rows[point], first[point], left))
    if jumped:
        ledger[ix.HUB_WORK] += elastic_energy(arrays, known, left) - taken


@inner
def momentum_jump_works(arrays, pace, jumped):
    """Add the works at a jump of speed or of the hub's velocity: mean velocity times jump of momentum."""
    axial, ledger, clamp = (
        floats_1(arrays, ix.AXIAL_STATE),
        floats_1(arrays, ix.LEDGER_STATE),
        floats_3(arrays, ix.CLAMP)[ix.START],
    )
    lateral, left, rates = (
        floats_3(arrays, ix.LATERAL)[0],
        floats_2(arrays, ix.KEPT_LATERAL),
        floats_2(arrays, ix.RATES)[ix.START],
    )
    sums, speed, struck = floats_2(arrays, ix.INSTANT_SUMS)[ix.START], floats_2(arrays, ix.COURSES)[ix.START, ix.SPEED], 0.0
    ledger[ix.BOUNDARY] += 0.5 * (pace + speed) * (sums[ix.S_MOMENTUM] - axial[ix.LAST_AXIAL_MOMENTUM])
    rate, turn = 0.5 * (axial[ix.LAST_HUB_RATE] + clamp[1, 0]), 0.5 * (axial[ix.LAST_ANGLE_RATE] + clamp[1, 1])
    ledger[ix.HUB_WORK] += rate * (lateral[1, 0] - left[1, 0]) + turn * (lateral[1, 1] - left[1, 1])
    for i in range(integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], len(rates)):
        change = lateral[1, i] - left[1, i]
        if change != 0.0:  # a guide's strike, or the momentum that viscous tissue leaves
            struck += 0.5 * (floats_2(arrays, ix.SIDES)[0, i] + rates[i]) * change
    ledger[ix.HUB_WORK if jumped else ix.BOUNDARY] += struck
