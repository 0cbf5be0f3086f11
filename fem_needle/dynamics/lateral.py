"""The lateral side of a step: both stages solved together, guides and the path that is being cut included."""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cut_path import add_fresh, parabola, set_history
from fem_needle.dynamics.dense import solve_small
from fem_needle.dynamics.forces import (
    add_bending,
    add_inertial_forces,
    add_mistakes,
    add_momentum,
    add_point_forces,
    add_tissue_forces,
)
from fem_needle.dynamics.guides import guide_columns, guide_system, hold_guides
from fem_needle.dynamics.instant import beam_at, mark_new
from fem_needle.dynamics.points import along
from fem_needle.dynamics.reduced import factor_functions, solve_functions
from fem_needle.dynamics.sweep import eliminate_two, solve_two
from fem_needle.dynamics.system import fill_step, set_gaps


@inner
def add_errors(errors, h, inverse, matrix):
    """Add X and Y of printed mistakes to a step's matrix."""
    n = errors.shape[2]
    for s in range(2):
        for o in range(2):
            for i in range(n):
                for j in range(n):
                    value = inverse[s, o] / h * errors[s, 1, i, j] + (errors[s, 0, i, j] if s == o else 0.0)
                    matrix[2 * i + 1 - s, 2 * j + 1 - o] += value


@inner
def factor_step(arrays, h):
    """Form and factor what has changed of the step's matrix."""
    switches, course, covered = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES), floats_3(arrays, ix.COVERED)
    changed, matrices, inverse = integers_1(arrays, ix.CHANGED), floats_3(arrays, ix.MATRICES), floats_2(arrays, ix.INVERSE)
    last = mark_new(h, switches, course, covered, changed, floats_1(arrays, ix.KEY))
    if last < 0:
        return
    beam, tissue, stiffness = floats_5(arrays, ix.BEAM), floats_5(arrays, ix.TISSUE_BLOCKS), floats_1(arrays, ix.STIFFNESSES)
    first, second = beam[beam_at(beam, 0)], beam[beam_at(beam, 1)]
    for block in range(last + 1):
        if changed[block]:
            is_covered = False
            for s in range(2):
                for part in range(3):
                    is_covered = is_covered or covered[s, block, part] != 0.0
            fill_step(block, h, inverse, course, first, second, tissue, is_covered, switches, matrices[block])
    for s in range(2):
        stretch = course[s, ix.STRETCH]
        stiffness[s] = floats_1(arrays, ix.NUMBER)[ix.BENDING_STIFFNESS] / (stretch * stretch * stretch)
    if switches[ix.STRIDE]:
        eliminate_two(
            last, switches[ix.PRESCRIBED], floats_1(arrays, ix.PIECE_NODES), stiffness, matrices, changed,
            floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES),
        )  # fmt: skip
    else:
        if switches[ix.PRINTED]:
            add_errors(floats_4(arrays, ix.PRINTED_ERRORS), h, inverse, matrices[0])
        factor_functions(arrays, 2, 0)
    for block in range(last + 1):
        changed[block] = 0


@inner
def solve_step(arrays, is_whole, values):
    """Replace a right-hand side (2 n,) by the increments; ``is_whole``: beside what is known."""
    switches, gaps = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.BEAM_GAPS)
    if switches[ix.STRIDE]:
        nodes = floats_1(arrays, ix.PIECE_NODES)
        if is_whole:
            set_gaps(2, nodes, switches[ix.STRIDE], floats_2(arrays, ix.KNOWN), gaps)
        else:
            gaps[:, :] = 0.0
        solve_two(
            switches[ix.PRESCRIBED], nodes, floats_1(arrays, ix.STIFFNESSES), floats_3(arrays, ix.MATRICES),
            floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES), gaps, values,
        )  # fmt: skip
    else:
        solve_functions(arrays, 2, 0, values)


@inner
def right_side(arrays, h):
    """Set the right-hand side with what the increments do not change: the clamp moves, the rest stays where it was."""
    switches, course, inverse = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES), floats_2(arrays, ix.INVERSE)
    known, rates, side, answer = (
        floats_2(arrays, ix.KNOWN),
        floats_2(arrays, ix.RATES),
        floats_2(arrays, ix.SIDES),
        floats_1(arrays, ix.ANSWER),
    )
    beams, tissue, covered = floats_5(arrays, ix.BEAM), floats_5(arrays, ix.TISSUE_BLOCKS), floats_3(arrays, ix.COVERED)
    load, start, n = floats_2(arrays, ix.PATH_LOAD), floats_3(arrays, ix.LATERAL)[0], known.shape[1]
    side[:, :] = 0.0
    for s in range(2):
        beam = beams[beam_at(beams, s)]
        add_tissue_forces(course[s], tissue[s], covered[s], switches, known[s], rates[s], side[s])
        add_inertial_forces(course[s], beam, switches, known[s], rates[s], side[s])
        add_bending(course[s], beam, switches, known[s], side[s])
        add_mistakes(floats_4(arrays, ix.PRINTED_ERRORS)[s], switches, known[s], rates[s], side[s])
        add_point_forces(
            switches[ix.GUIDES],
            floats_3(arrays, ix.POINT_ROWS)[s],
            integers_2(arrays, ix.POINT_FIRST)[s],
            floats_2(arrays, ix.FORCES)[s],
            side[s],
        )
        if switches[ix.CUTS]:
            for i in range(n):
                side[s, i] += course[s, ix.FACTOR] * load[s, i]
        for o in range(2):
            slope = inverse[o, s] / h
            if switches[ix.INERTIA]:
                add_momentum(-slope, course[s], beam, switches, known[s], rates[s], side[o])
                for i in range(n):
                    side[o, i] += slope * start[1, i]
    for s in range(2):
        for i in range(n):
            answer[2 * i + 1 - s] = side[s, i]


@inner
def moves_slowly(course, beam, h):
    """Return whether no coordinate's own vibration goes far in a step: h^2 K_ii < M_ii."""
    stiff, heavy = h * h / (course[ix.STRETCH] * course[ix.STRETCH] * course[ix.STRETCH]), course[ix.STRETCH]
    for block in range(beam.shape[0]):
        for i in range(beam.shape[2]):
            if stiff * beam[block, ix.BENDING, i, i] > heavy * beam[block, ix.MASS, i, i]:
                return False
    return True


@inner
def begin_nodes(arrays, h):
    """Set coordinates and velocities at the nodes with the unknowns at zero.

    In short steps the needle goes on as it moves. Its factors' rounding, the same in every step, would otherwise act on the whole
    advance and not on what forces change of it: energy would grow or shrink with the number of steps. Where a vibration goes far,
    its velocity times the step is larger than its advance, and rounds more.
    """
    known, rates, clamp = floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.RATES), floats_3(arrays, ix.CLAMP)
    start, places = floats_3(arrays, ix.LATERAL)[0], floats_2(arrays, ix.METHOD)[ix.PLACES]
    moves = integers_1(arrays, ix.SWITCH)[ix.INERTIA] != 0 and moves_slowly(
        floats_2(arrays, ix.COURSES)[0], floats_5(arrays, ix.BEAM)[0], h
    )
    for s in range(2):
        for i in range(known.shape[1]):
            rates[s, i] = rates[ix.START, i] if moves else 0.0
            known[s, i] = start[0, i] + places[s] * h * rates[s, i]
        for i in range(integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED]):
            known[s, i], rates[s, i] = clamp[s, 0, i], clamp[s, 1, i]


@inner
def set_path_loads(arrays, cutting):
    """Set the path's loads at the nodes: history and, where the tip cuts, what the tip at the start gives of the new piece."""
    course, axial, cubic = floats_2(arrays, ix.COURSES), floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.CUBIC)
    load, load_rate = floats_2(arrays, ix.PATH_LOAD), floats_2(arrays, ix.PATH_LOAD_RATE)
    if cutting:
        parabola(course[0, ix.OWN_DEPTH] - axial[ix.DEEPEST], course[1, ix.OWN_DEPTH] - axial[ix.DEEPEST], 0, cubic)
        for i in range(4):
            cubic[i] *= axial[ix.FRONT]
    for s in range(2):
        set_history(arrays, s)
        if cutting:
            add_fresh(arrays, s, cubic, load[s], load_rate[s])


@inner
def answer_to_cut(arrays, which, column):
    """Set the answer of a step to a path whose new piece is 1 at one of the nodes and 0 at the others, and the guides' forces."""
    course, axial, cubic = floats_2(arrays, ix.COURSES), floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.CUBIC)
    load, load_rate = floats_2(arrays, ix.CUT_LOAD), floats_2(arrays, ix.CUT_LOAD_RATE)
    parabola(course[0, ix.OWN_DEPTH] - axial[ix.DEEPEST], course[1, ix.OWN_DEPTH] - axial[ix.DEEPEST], 1 + which, cubic)
    load[:, :] = 0.0
    for s in range(2):
        add_fresh(arrays, s, cubic, load[s], load_rate[s])
        for i in range(load.shape[1]):
            column[2 * i + 1 - s] = course[s, ix.FACTOR] * load[s, i]
    solve_step(arrays, which < 0, column)
    hold_step(arrays, which < 0, column, 1 + which)


@inner
def hold_step(arrays, is_whole, answer, which):
    """Add the guides' forces to an answer, and keep them."""
    switches, gaps, held = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.GAPS), floats_2(arrays, ix.GUIDE_FORCES)
    if switches[ix.GUIDES] == 0:
        return
    hold_guides(
        2, is_whole, switches, floats_3(arrays, ix.POINT_ROWS), integers_2(arrays, ix.POINT_FIRST), floats_3(arrays, ix.FLEXIBLE),
        floats_2(arrays, ix.FORCES), floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.ANSWERS), floats_2(arrays, ix.DENSE),
        floats_2(arrays, ix.SCRATCH), gaps, answer,
    )  # fmt: skip
    for number in range(2 * switches[ix.GUIDES]):
        held[which, number] = gaps[number]


@inner
def solve_cutting(arrays):
    """Complete the answer of a step in which the tip cuts: the new piece of the path passes through the tip at both nodes.

    The answer is linear in these two tips: two more right-hand sides give how they come back, and a 2 x 2 system their values.
    """
    columns, pair, tips = floats_2(arrays, ix.CUT_COLUMNS), floats_2(arrays, ix.CUT_PAIR), floats_1(arrays, ix.NODE_TIPS)
    known, answer, held = floats_2(arrays, ix.KNOWN), floats_1(arrays, ix.ANSWER), floats_2(arrays, ix.GUIDE_FORCES)
    rows, first = floats_3(arrays, ix.POINT_ROWS), integers_2(arrays, ix.POINT_FIRST)
    tip = rows.shape[1] - 1
    for which in range(2):
        answer_to_cut(arrays, which, columns[which])
    for s in range(2):
        tips[s], at = 0.0, first[s, tip]
        for i in range(rows.shape[2]):
            tips[s] += rows[s, tip, i] * (known[s, at + i] + answer[2 * (at + i) + 1 - s])
        for which in range(2):
            total = 0.0
            for i in range(rows.shape[2]):
                total += rows[s, tip, i] * columns[which, 2 * (at + i) + 1 - s]
            pair[s, which] = (1.0 if s == which else 0.0) - total
    solve_small(pair, tips, len(tips))
    for i in range(len(answer)):
        answer[i] += tips[0] * columns[0, i] + tips[1] * columns[1, i]
    for number in range(2 * integers_1(arrays, ix.SWITCH)[ix.GUIDES]):
        held[0, number] += tips[0] * held[1, number] + tips[1] * held[2, number]


@inner
def prepare_guides(arrays):
    """Solve for the answers to unit forces of the guides, and set the matrix of their forces."""
    switches, columns, answers = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COLUMNS), floats_2(arrays, ix.ANSWERS)
    rows, first = floats_3(arrays, ix.POINT_ROWS), integers_2(arrays, ix.POINT_FIRST)
    guide_columns(2, switches, rows, first, columns)
    for number in range(2 * switches[ix.GUIDES]):
        for i in range(columns.shape[1]):
            answers[number, i] = columns[number, i]
        solve_step(arrays, number < 0, answers[number])
    guide_system(
        2,
        switches,
        rows,
        first,
        floats_3(arrays, ix.FLEXIBLE),
        floats_1(arrays, ix.COMPLIANCE),
        answers,
        floats_2(arrays, ix.DENSE),
    )


@inner
def solve_nodes(arrays, h):
    """Solve the stages of a step whose motion is given: coordinates, velocities and guides' forces at the nodes."""
    switches, inverse, course = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.INVERSE), floats_2(arrays, ix.COURSES)
    known, rates, forces = floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.RATES), floats_2(arrays, ix.FORCES)
    answer, held, guides = floats_1(arrays, ix.ANSWER), floats_2(arrays, ix.GUIDE_FORCES), switches[ix.GUIDES]
    factor_step(arrays, h)
    begin_nodes(arrays, h)
    cutting = switches[ix.CUTS] != 0 and course[1, ix.OWN_DEPTH] > floats_1(arrays, ix.AXIAL_STATE)[ix.DEEPEST]
    if switches[ix.CUTS]:
        set_path_loads(arrays, cutting)
    right_side(arrays, h)
    solve_step(arrays, h > 0.0, answer)
    if guides:
        prepare_guides(arrays)
        hold_step(arrays, h > 0.0, answer, 0)
    if cutting:
        solve_cutting(arrays)
    for number in range(2 * guides):
        forces[number // guides, number % guides] = held[0, number]
    for i in range(known.shape[1]):
        early, late = answer[2 * i + 1], answer[2 * i]
        known[0, i] += early
        known[1, i] += late
        rates[0, i] += (inverse[0, 0] * early + inverse[0, 1] * late) / h
        rates[1, i] += (inverse[1, 0] * early + inverse[1, 1] * late) / h
    if switches[ix.CUTS] and not cutting:
        for s in range(2):
            rows, first = floats_3(arrays, ix.POINT_ROWS)[s], integers_2(arrays, ix.POINT_FIRST)[s]
            floats_1(arrays, ix.NODE_TIPS)[s] = along(rows[rows.shape[0] - 1], first[rows.shape[0] - 1], known[s])
