"""A needle that goes through equilibria: instants, works and samples as in the loop over time steps, no method between them.

    (K + m G) q = N' P,   guides: N q + B P + compliance R = 0

Equilibria know no rates: matrices without inertia and without viscosity. Works are integrated by Gauss's rule of three nodes.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.axial import cutting_work
from fem_needle.dynamics.compilation import entrance, inner
from fem_needle.dynamics.forces import add_point_forces, add_tissue_forces
from fem_needle.dynamics.guides import guide_columns, guide_system, hold_guides
from fem_needle.dynamics.instant import beam_at, prepare_matrices, prepare_points, set_loads, set_motion, set_place
from fem_needle.dynamics.jump_works import force_jump_works
from fem_needle.dynamics.jumps import clamp_jumps, drop
from fem_needle.dynamics.points import finite
from fem_needle.dynamics.record import keep_output
from fem_needle.dynamics.reduced import factor_functions, solve_functions
from fem_needle.dynamics.sweep import eliminate_one, solve_one
from fem_needle.dynamics.system import fill_rest
from fem_needle.dynamics.works import add_ends, add_node, load_product, set_sums


@inner
def set_straight(arrays, at):
    """Set the coordinates of a straight needle that stands as the clamp does."""
    switches, clamp, nodes = integers_1(arrays, ix.SWITCH), floats_3(arrays, ix.CLAMP)[at, 0], floats_1(arrays, ix.PIECE_NODES)
    q, stride = floats_2(arrays, ix.KNOWN)[at], switches[ix.STRIDE]
    angle = clamp[1] if switches[ix.PRESCRIBED] == 2 else 0.0
    q[:] = 0.0
    if stride == 0:
        q[0], q[1] = clamp[0], angle
        return
    for number in range(len(nodes)):
        q[stride * number], q[stride * number + 1] = clamp[0] + angle * nodes[number], angle


@inner
def factor_rest(arrays, at):
    """Form and factor K + m G of an instant."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)
    matrices, changed, tissue = (
        floats_3(arrays, ix.MATRICES),
        integers_1(arrays, ix.CHANGED),
        floats_5(arrays, ix.TISSUE_BLOCKS)[at],
    )
    beam, stiffness = beams[beam_at(beams, at)], floats_1(arrays, ix.STIFFNESSES)
    for block in range(matrices.shape[0]):
        fill_rest(block, course, beam, tissue, switches, matrices[block])
        changed[block] = 1
    stretch = course[ix.STRETCH]
    stiffness[0] = floats_1(arrays, ix.NUMBER)[ix.BENDING_STIFFNESS] / (stretch * stretch * stretch)
    if switches[ix.STRIDE]:
        eliminate_one(
            matrices.shape[0] - 1, switches[ix.PRESCRIBED], floats_1(arrays, ix.PIECE_NODES), stiffness, matrices, changed,
            floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES),
        )  # fmt: skip
    else:
        factor_functions(arrays, 1, at)


@inner
def answer_at_rest(arrays, at, values):
    """Replace a right-hand side (n,) by the deflection beside the straight needle."""
    switches = integers_1(arrays, ix.SWITCH)
    if switches[ix.STRIDE]:
        solve_one(
            switches[ix.PRESCRIBED], floats_1(arrays, ix.PIECE_NODES), floats_1(arrays, ix.STIFFNESSES),
            floats_3(arrays, ix.MATRICES), floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES),
            floats_2(arrays, ix.BEAM_GAPS), values,
        )  # fmt: skip
    else:
        solve_functions(arrays, 1, at, values)


@inner
def hold_rest(arrays, at, side):
    """Add the guides' forces at an instant to an answer."""
    switches, columns, answers = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COLUMNS), floats_2(arrays, ix.ANSWERS)
    rows, first = floats_3(arrays, ix.POINT_ROWS)[at : at + 1], integers_2(arrays, ix.POINT_FIRST)[at : at + 1]
    flexible, forces, gaps = (
        floats_3(arrays, ix.FLEXIBLE)[at : at + 1],
        floats_2(arrays, ix.FORCES)[at : at + 1],
        floats_1(arrays, ix.GAPS),
    )
    guide_columns(1, switches, rows, first, columns)
    for number in range(switches[ix.GUIDES]):
        for i in range(columns.shape[1]):
            answers[number, i] = columns[number, i]
        answer_at_rest(arrays, at, answers[number])
    guide_system(1, switches, rows, first, flexible, floats_1(arrays, ix.COMPLIANCE), answers, floats_2(arrays, ix.DENSE))
    hold_guides(
        1, True, switches, rows, first, flexible, forces, floats_2(arrays, ix.KNOWN)[at : at + 1], answers,
        floats_2(arrays, ix.DENSE), floats_2(arrays, ix.SCRATCH), gaps, side,
    )  # fmt: skip
    for guide in range(switches[ix.GUIDES]):
        forces[0, guide] = gaps[guide]


@inner
def rest_at(arrays, at, time, middle):
    """Set the equilibrium of an instant; a needle that is hardly inserted is straight."""
    switches, course = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at]
    q, side, forces = floats_2(arrays, ix.KNOWN)[at], floats_1(arrays, ix.ANSWER), floats_2(arrays, ix.FORCES)[at]
    set_motion(time, middle, floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), course)
    set_place(switches, floats_1(arrays, ix.NUMBER), course)
    set_loads(arrays, at, middle)
    prepare_matrices(arrays, at, integers_1(arrays, ix.OTHER_CHANGED))
    prepare_points(arrays, at)
    if course[ix.OWN_DEPTH] < floats_1(arrays, ix.NUMBER)[ix.SMALLEST_DEPTH]:
        q[:] = 0.0
        for guide in range(switches[ix.GUIDES]):
            forces[guide] = 0.0
        return
    set_straight(arrays, at)
    side[:] = 0.0
    add_tissue_forces(course, floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at], switches, q, q, side)
    add_point_forces(
        switches[ix.GUIDES], floats_3(arrays, ix.POINT_ROWS)[at], integers_2(arrays, ix.POINT_FIRST)[at], forces, side
    )
    factor_rest(arrays, at)
    answer_at_rest(arrays, at, side)
    if switches[ix.GUIDES]:
        hold_rest(arrays, at, side)
    for i in range(len(q)):
        q[i] += side[i]


@inner
def begin_rest(arrays, t, h):
    """Set the equilibrium at the start of a call or behind a kink, and the works of what jumps there."""
    axial, limits, held = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS), floats_1(arrays, ix.HELD)
    lateral, known, course = floats_3(arrays, ix.LATERAL)[0], floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.COURSES)
    is_kink = axial[ix.LANDED] == ix.KINK
    for i in range(known.shape[1]):
        floats_2(arrays, ix.KEPT_LATERAL)[0, i] = lateral[0, i]
    for point in range(len(held)):
        floats_1(arrays, ix.KEPT_HELD)[point] = held[point]
    rest_at(arrays, ix.START, t, t + 0.5 * h)
    jumped = clamp_jumps(arrays)
    if is_kink and course[ix.START, ix.OWN_SIDE] < floats_1(arrays, ix.NUMBER)[ix.SMALLEST_DEPTH]:
        for i in range(known.shape[1]):  # what it leaves behind
            known[ix.START, i] = lateral[0, i]
        drop(arrays)
    elif is_kink and limits[ix.COUNTED] != 0.0:
        force_jump_works(arrays, jumped)
    for i in range(known.shape[1]):
        lateral[0, i] = known[ix.START, i]
    for point in range(len(held)):
        held[point] = floats_2(arrays, ix.FORCES)[ix.START, point]
    axial[ix.LAST_PRODUCT] = load_product(arrays, ix.START)


@inner
def take_rest(arrays, t, h, until, is_output):
    """Go from one equilibrium to the next, with the works between and an output at the end."""
    axial, ledger, cursor = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LEDGER_STATE), integers_1(arrays, ix.CURSOR)
    known, course, method = floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.COURSES), floats_2(arrays, ix.METHOD)
    lateral, held, deepest = floats_3(arrays, ix.LATERAL)[0], floats_1(arrays, ix.HELD), axial[ix.DEEPEST]
    if axial[ix.LANDED] != 0.0:
        begin_rest(arrays, t, h)
    else:
        for i in range(known.shape[1]):
            known[ix.START, i] = known[ix.END, i]
    for at in (0, 1, 2, ix.END):
        rest_at(arrays, at, until if at == ix.END else t + method[ix.PLACES, at] * h, t + 0.5 * h)
        set_sums(arrays, at, at == ix.END and is_output)
        if at != ix.END:
            add_node(arrays, at, method[ix.WEIGHTS, at] * h)
    if not finite(known[ix.END]):
        return ix.FAILED
    add_ends(arrays, h)
    axial[ix.DEEPEST] = max(deepest, course[ix.END, ix.OWN_DEPTH])
    ledger[ix.CUTTING_WORK] += cutting_work(floats_2(arrays, ix.LAYER), deepest, axial[ix.DEEPEST])
    axial[ix.NOW], axial[ix.WAY], axial[ix.PACE] = until, course[ix.END, ix.OWN_DEPTH], course[ix.END, ix.SPEED]
    axial[ix.LAST_LENGTH], axial[ix.LANDED], axial[ix.STEPS] = h, 0.0, axial[ix.STEPS] + 1.0
    for i in range(known.shape[1]):
        lateral[0, i] = known[ix.END, i]
    for point in range(len(held)):
        held[point] = floats_2(arrays, ix.FORCES)[ix.END, point]
    for at in (ix.START, ix.END):
        if (at == ix.START and cursor[3]) or (at == ix.END and is_output):
            if at == ix.START:
                cursor[3] = 0
                set_sums(arrays, at, at == ix.START)
            keep_output(
                arrays, at, 3, h, deepest if at == ix.START else axial[ix.DEEPEST], floats_2(arrays, ix.RECORDS)[cursor[2]]
            )
            cursor[2] += 1
    return ix.DONE


@entrance("equilibria", 110)
def run_rests(arrays):
    """Go through the equilibria of smooth intervals, as `fem_needle.dynamics.loop.run_steps` goes through steps."""
    intervals, cursor, axial = floats_2(arrays, ix.INTERVALS), integers_1(arrays, ix.CURSOR), floats_1(arrays, ix.AXIAL_STATE)
    if axial[ix.LANDED] == 0.0:
        axial[ix.LANDED] = ix.CONTINUED
    while cursor[0] < intervals.shape[0]:
        interval = intervals[cursor[0]]
        steps, kind = int(interval[2]), int(interval[3])
        h = (interval[1] - interval[0]) / steps
        if kind >= ix.BEGINS_AT_KINK and cursor[1] == 0:
            axial[ix.LANDED] = ix.KINK
        while cursor[1] < steps:
            is_last = cursor[1] + 1 == steps
            until = interval[1] if is_last else interval[0] + (cursor[1] + 1) * h
            status = take_rest(arrays, interval[0] + cursor[1] * h, h, until, is_last and kind % 2 == ix.ENDS_AT_OUTPUT)
            if status != ix.DONE:
                return status
            cursor[1] += 1
        cursor[0], cursor[1] = cursor[0] + 1, 0
    return ix.DONE
