"""A needle that goes through equilibria: instants, works and samples as in the loop over time steps, no method between them.

    (K + m G) q = N' P,   guides: N q + B P + compliance R = 0

Equilibria know no rates: matrices without inertia and without viscosity. Works are integrated by Gauss's rule of three nodes.
"""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.axial import cutting_work
from fem_needle.dynamics.compilation import entrance, inner
from fem_needle.dynamics.forces import add_point_forces, add_tissue_forces
from fem_needle.dynamics.guides import guide_columns, guide_system, hold_guides
from fem_needle.dynamics.instant import beam_at, prepare_matrices, prepare_points, set_loads, set_motion, set_place
from fem_needle.dynamics.jump_works import force_jump_works
from fem_needle.dynamics.jumps import clamp_jumps, drop
from fem_needle.dynamics.names import (
    ANSWER,
    ANSWERS,
    AXIAL_STATE,
    BEAM,
    BEAM_GAPS,
    BENDING_STIFFNESS,
    CHANGED,
    CLAMP,
    COLUMNS,
    COMPLIANCE,
    CONTINUED,
    COUNTED,
    COURSES,
    COVERED,
    CURSOR,
    CUTTING_WORK,
    DEEPEST,
    DENSE,
    DONE,
    END,
    FAILED,
    FLEXIBLE,
    FORCES,
    GAPS,
    GUIDES,
    HELD,
    INTERVALS,
    KEPT_HELD,
    KEPT_LATERAL,
    KINK,
    KNOWN,
    LANDED,
    LAST_LENGTH,
    LAST_PRODUCT,
    LATERAL,
    LAYER,
    LEDGER_STATE,
    LIMITS,
    MATRICES,
    METHOD,
    NODE_MATRICES,
    NOW,
    NUMBER,
    OTHER_CHANGED,
    OWN_DEPTH,
    OWN_SIDE,
    PACE,
    PIECE_NODES,
    PLACES,
    POINT_FIRST,
    POINT_ROWS,
    PRESCRIBED,
    RECORDS,
    SCRATCH,
    SHARES,
    SIGNAL_ENDS,
    SIGNALS,
    SMALLEST_DEPTH,
    SPEED,
    START,
    STEPS,
    STIFFNESSES,
    STRETCH,
    STRIDE,
    SWITCH,
    TISSUE_BLOCKS,
    WAY,
    WEIGHTS,
)
from fem_needle.dynamics.points import finite
from fem_needle.dynamics.record import keep_output
from fem_needle.dynamics.reduced import factor_functions, solve_functions
from fem_needle.dynamics.sweep import eliminate_one, solve_one
from fem_needle.dynamics.system import fill_rest
from fem_needle.dynamics.works import add_ends, add_node, load_product, set_sums


@inner
def set_straight(arrays, at):
    """Set the coordinates of a straight needle that stands as the clamp does."""
    switches, clamp, nodes = integers_1(arrays, SWITCH), floats_3(arrays, CLAMP)[at, 0], floats_1(arrays, PIECE_NODES)
    q, stride = floats_2(arrays, KNOWN)[at], switches[STRIDE]
    angle = clamp[1] if switches[PRESCRIBED] == 2 else 0.0
    q[:] = 0.0
    if stride == 0:
        q[0], q[1] = clamp[0], angle
        return
    for number in range(len(nodes)):
        q[stride * number], q[stride * number + 1] = clamp[0] + angle * nodes[number], angle


@inner
def factor_rest(arrays, at):
    """Form and factor K + m G of an instant."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_5(arrays, BEAM)
    matrices, changed, tissue = floats_3(arrays, MATRICES), integers_1(arrays, CHANGED), floats_5(arrays, TISSUE_BLOCKS)[at]
    beam, stiffness = beams[beam_at(beams, at)], floats_1(arrays, STIFFNESSES)
    for block in range(matrices.shape[0]):
        fill_rest(block, course, beam, tissue, switches, matrices[block])
        changed[block] = 1
    stretch = course[STRETCH]
    stiffness[0] = floats_1(arrays, NUMBER)[BENDING_STIFFNESS] / (stretch * stretch * stretch)
    if switches[STRIDE]:
        eliminate_one(
            matrices.shape[0] - 1, switches[PRESCRIBED], floats_1(arrays, PIECE_NODES), stiffness, matrices, changed,
            floats_3(arrays, NODE_MATRICES), floats_4(arrays, SHARES),
        )  # fmt: skip
    else:
        factor_functions(arrays, 1, at)


@inner
def answer_at_rest(arrays, at, values):
    """Replace a right-hand side (n,) by the deflection beside the straight needle."""
    switches = integers_1(arrays, SWITCH)
    if switches[STRIDE]:
        solve_one(
            switches[PRESCRIBED], floats_1(arrays, PIECE_NODES), floats_1(arrays, STIFFNESSES), floats_3(arrays, MATRICES),
            floats_3(arrays, NODE_MATRICES), floats_4(arrays, SHARES), floats_2(arrays, BEAM_GAPS), values,
        )  # fmt: skip
    else:
        solve_functions(arrays, 1, at, values)


@inner
def hold_rest(arrays, at, side):
    """Add the guides' forces at an instant to an answer."""
    switches, columns, answers = integers_1(arrays, SWITCH), floats_2(arrays, COLUMNS), floats_2(arrays, ANSWERS)
    rows, first = floats_3(arrays, POINT_ROWS)[at : at + 1], integers_2(arrays, POINT_FIRST)[at : at + 1]
    flexible, forces, gaps = (
        floats_3(arrays, FLEXIBLE)[at : at + 1],
        floats_2(arrays, FORCES)[at : at + 1],
        floats_1(arrays, GAPS),
    )
    guide_columns(1, switches, rows, first, columns)
    for number in range(switches[GUIDES]):
        for i in range(columns.shape[1]):
            answers[number, i] = columns[number, i]
        answer_at_rest(arrays, at, answers[number])
    guide_system(1, switches, rows, first, flexible, floats_1(arrays, COMPLIANCE), answers, floats_2(arrays, DENSE))
    hold_guides(
        1, True, switches, rows, first, flexible, forces, floats_2(arrays, KNOWN)[at : at + 1], answers, floats_2(arrays, DENSE),
        floats_2(arrays, SCRATCH), gaps, side,
    )  # fmt: skip
    for guide in range(switches[GUIDES]):
        forces[0, guide] = gaps[guide]


@inner
def rest_at(arrays, at, time, middle):
    """Set the equilibrium of an instant; a needle that is hardly inserted is straight."""
    switches, course = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at]
    q, side, forces = floats_2(arrays, KNOWN)[at], floats_1(arrays, ANSWER), floats_2(arrays, FORCES)[at]
    set_motion(time, middle, floats_2(arrays, SIGNALS), integers_1(arrays, SIGNAL_ENDS), course)
    set_place(switches, floats_1(arrays, NUMBER), course)
    set_loads(arrays, at, middle)
    prepare_matrices(arrays, at, integers_1(arrays, OTHER_CHANGED))
    prepare_points(arrays, at)
    if course[OWN_DEPTH] < floats_1(arrays, NUMBER)[SMALLEST_DEPTH]:
        q[:] = 0.0
        for guide in range(switches[GUIDES]):
            forces[guide] = 0.0
        return
    set_straight(arrays, at)
    side[:] = 0.0
    add_tissue_forces(course, floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at], switches, q, q, side)
    add_point_forces(switches[GUIDES], floats_3(arrays, POINT_ROWS)[at], integers_2(arrays, POINT_FIRST)[at], forces, side)
    factor_rest(arrays, at)
    answer_at_rest(arrays, at, side)
    if switches[GUIDES]:
        hold_rest(arrays, at, side)
    for i in range(len(q)):
        q[i] += side[i]


@inner
def begin_rest(arrays, t, h):
    """Set the equilibrium at the start of a call or behind a kink, and the works of what jumps there."""
    axial, limits, held = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LIMITS), floats_1(arrays, HELD)
    lateral, known, course = floats_3(arrays, LATERAL)[0], floats_2(arrays, KNOWN), floats_2(arrays, COURSES)
    is_kink = axial[LANDED] == KINK
    for i in range(known.shape[1]):
        floats_2(arrays, KEPT_LATERAL)[0, i] = lateral[0, i]
    for point in range(len(held)):
        floats_1(arrays, KEPT_HELD)[point] = held[point]
    rest_at(arrays, START, t, t + 0.5 * h)
    jumped = clamp_jumps(arrays)
    if is_kink and course[START, OWN_SIDE] < floats_1(arrays, NUMBER)[SMALLEST_DEPTH]:
        for i in range(known.shape[1]):  # what it leaves behind
            known[START, i] = lateral[0, i]
        drop(arrays)
    elif is_kink and limits[COUNTED] != 0.0:
        force_jump_works(arrays, jumped)
    for i in range(known.shape[1]):
        lateral[0, i] = known[START, i]
    for point in range(len(held)):
        held[point] = floats_2(arrays, FORCES)[START, point]
    axial[LAST_PRODUCT] = load_product(arrays, START)


@inner
def take_rest(arrays, t, h, until, is_output):
    """Go from one equilibrium to the next, with the works between and an output at the end."""
    axial, ledger, cursor = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LEDGER_STATE), integers_1(arrays, CURSOR)
    known, course, method = floats_2(arrays, KNOWN), floats_2(arrays, COURSES), floats_2(arrays, METHOD)
    lateral, held, deepest = floats_3(arrays, LATERAL)[0], floats_1(arrays, HELD), axial[DEEPEST]
    if axial[LANDED] != 0.0:
        begin_rest(arrays, t, h)
    else:
        for i in range(known.shape[1]):
            known[START, i] = known[END, i]
    for at in (0, 1, 2, END):
        rest_at(arrays, at, until if at == END else t + method[PLACES, at] * h, t + 0.5 * h)
        set_sums(arrays, at, at == END and is_output)
        if at != END:
            add_node(arrays, at, method[WEIGHTS, at] * h)
    if not finite(known[END]):
        return FAILED
    add_ends(arrays, h)
    axial[DEEPEST] = max(deepest, course[END, OWN_DEPTH])
    ledger[CUTTING_WORK] += cutting_work(floats_2(arrays, LAYER), deepest, axial[DEEPEST])
    axial[NOW], axial[WAY], axial[PACE] = until, course[END, OWN_DEPTH], course[END, SPEED]
    axial[LAST_LENGTH], axial[LANDED], axial[STEPS] = h, 0.0, axial[STEPS] + 1.0
    for i in range(known.shape[1]):
        lateral[0, i] = known[END, i]
    for point in range(len(held)):
        held[point] = floats_2(arrays, FORCES)[END, point]
    for at in (START, END):
        if (at == START and cursor[3]) or (at == END and is_output):
            if at == START:
                cursor[3] = 0
                set_sums(arrays, at, at == START)
            keep_output(arrays, at, 3, h, deepest if at == START else axial[DEEPEST], floats_2(arrays, RECORDS)[cursor[2]])
            cursor[2] += 1
    return DONE


@entrance("equilibria", 90)
def run_rests(arrays):
    """Go through the equilibria of smooth intervals, as `fem_needle.dynamics.loop.run_steps` goes through steps."""
    intervals, cursor, axial = floats_2(arrays, INTERVALS), integers_1(arrays, CURSOR), floats_1(arrays, AXIAL_STATE)
    if axial[LANDED] == 0.0:
        axial[LANDED] = CONTINUED
    while cursor[0] < intervals.shape[0]:
        interval = intervals[cursor[0]]
        steps = int(interval[2])
        h = (interval[1] - interval[0]) / steps
        while cursor[1] < steps:
            is_last = cursor[1] + 1 == steps
            until = interval[1] if is_last else interval[0] + (cursor[1] + 1) * h
            status = take_rest(arrays, interval[0] + cursor[1] * h, h, until, is_last and interval[3] != 0.0)
            if status != DONE:
                return status
            cursor[1] += 1
        cursor[0], cursor[1] = cursor[0] + 1, 0
    return DONE
