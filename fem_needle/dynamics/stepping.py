"""The phases of one step around its lateral solution: motion in time, the state at its end, what a kink before it does."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.axial import node_speeds
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cut_path import (
    add_fresh,
    add_tip_rest,
    append_piece,
    parabola,
    path_value,
    rest_constant,
    set_history,
    squared,
    through_four,
)
from fem_needle.dynamics.energy import axial_momentum
from fem_needle.dynamics.forces import add_momentum
from fem_needle.dynamics.guides import soft_reactions
from fem_needle.dynamics.instant import beam_at, set_motion, set_place
from fem_needle.dynamics.names import (
    ACCELERATION,
    AHEAD,
    AXIAL_ACTS,
    AXIAL_STATE,
    BEAM,
    CHOSEN,
    CLAMP,
    COMPLIANCE,
    COURSES,
    CUBIC,
    CUTTING_LIMIT,
    DEEPEST,
    DENSE,
    DEPTH,
    DIRECTION,
    END,
    END_SHARES,
    END_SLOPE,
    FLEXIBLE,
    FORCES,
    FRAME,
    FRONT,
    GAPS,
    GUIDES,
    HELD,
    INERTIA,
    INSTANT_SUMS,
    INVERSE,
    KNOWN,
    LAST_AXIAL_MOMENTUM,
    LATERAL,
    LAYER,
    LAYER_END,
    LAYER_START,
    LENGTH,
    LIMITS,
    MASS_PER_LENGTH,
    MATERIAL,
    METHOD,
    MODULUS,
    MOMENTA,
    NODE_TIPS,
    NUMBER,
    OTHER_CUBIC,
    OWN_DEPTH,
    OWN_SIDE,
    PACE,
    PAIR,
    PASCAL,
    PATH_CONSTANTS,
    PATH_COUNT,
    PATH_CUBICS,
    PATH_EDGES,
    PATH_LOAD,
    PATH_LOAD_RATE,
    PATH_MOMENTS,
    PATH_SQUARES,
    PLACES,
    POINT_FIRST,
    POINT_ROWS,
    PRESCRIBED,
    PUSH_SIGNAL,
    RATES,
    ROUNDINGS,
    S_CONFIGURATION,
    S_MOMENTUM,
    SIDE,
    SIGNAL_ENDS,
    SIGNALS,
    SOFTEST,
    SPEED,
    STRETCH,
    SWITCH,
    TIME,
    VECTORS,
    WAY,
    WEIGHTS,
)
from fem_needle.dynamics.points import along
from fem_needle.dynamics.reduced import factor_mass, solve_mass
from fem_needle.dynamics.signals import row_at, value_of


@inner
def set_given_motion(arrays, t, h, until):
    """Set the motion at nodes and end of a step of a prescribed insertion."""
    rows, offsets, course = floats_2(arrays, SIGNALS), integers_1(arrays, SIGNAL_ENDS), floats_2(arrays, COURSES)
    places, middle = floats_2(arrays, METHOD)[PLACES], t + 0.5 * h
    for at in (0, 1, END):
        time = until
        if at != END and places[at] != 1.0:
            time = t + places[at] * h
        set_motion(time, middle, rows, offsets, course[at])
        set_place(integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), course[at])


@inner
def set_pushed_motion(arrays, t, h, until, first, second, last):
    """Set the motion at nodes and end of a step whose speeds at the nodes and at the end are tried."""
    inverse, method, course = floats_2(arrays, INVERSE), floats_2(arrays, METHOD), floats_2(arrays, COURSES)
    axial, ahead, places = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LIMITS)[AHEAD], method[PLACES]
    det = inverse[0, 0] * inverse[1, 1] - inverse[0, 1] * inverse[1, 0]
    way0 = h * (inverse[1, 1] * first - inverse[0, 1] * second) / det
    way1 = h * (inverse[0, 0] * second - inverse[1, 0] * first) / det
    start = axial[PACE]
    for s in range(2):
        course[s, TIME] = until if places[s] == 1.0 else t + places[s] * h
        course[s, OWN_DEPTH], course[s, SPEED] = axial[WAY] + (way1 if s else way0), second if s else first
        course[s, ACCELERATION] = (inverse[s, 0] * (first - start) + inverse[s, 1] * (second - start)) / h
    way = h * (method[WEIGHTS, 0] * first + method[WEIGHTS, 1] * second)
    course[END, TIME], course[END, OWN_DEPTH], course[END, SPEED] = until, axial[WAY] + way, last
    change = method[END_SLOPE, 0] * (first - start) + method[END_SLOPE, 1] * (second - start)
    course[END, ACCELERATION] = change / h
    for at in (0, 1, END):
        course[at, OWN_SIDE] = ahead
        set_place(integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), course[at])


@inner
def set_velocities(arrays, at):
    """Set q' at an end from P = M q' + v S q and the clamp's own velocity, and the clamp's part of P."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_5(arrays, BEAM)
    known, rates, right = floats_2(arrays, KNOWN)[at], floats_2(arrays, RATES)[at], floats_2(arrays, VECTORS)[0]
    lateral, clamped, beam = floats_3(arrays, LATERAL)[0], switches[PRESCRIBED], beams[beam_at(beams, at)]
    for i in range(len(known)):
        rates[i], right[i] = 0.0, lateral[1, i]
    if not switches[INERTIA]:
        return
    for i in range(clamped):
        rates[i] = floats_3(arrays, CLAMP)[at, 1, i]
    add_momentum(-1.0, course, beam, switches, known, rates, right)
    if beams.shape[0] > 1:
        factor_mass(arrays, at)
    solve_mass(arrays, at, right)
    for i in range(clamped, len(known)):
        rates[i] = right[i] / course[STRETCH]
    right[:] = 0.0
    add_momentum(1.0, course, beam, switches, known, rates, right)
    for i in range(clamped):
        lateral[1, i] = right[i]


@inner
def finish(arrays):
    """Set the momenta at the nodes, coordinates and momentum at the end of the step, from the polynomial through the nodes."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES), floats_5(arrays, BEAM)
    known, rates, momenta = floats_2(arrays, KNOWN), floats_2(arrays, RATES), floats_2(arrays, MOMENTA)
    lateral, end = floats_3(arrays, LATERAL)[0], floats_2(arrays, METHOD)[END_SHARES]
    rest = 1.0 - end[0] - end[1]
    for s in range(2):
        momenta[s, :] = 0.0
        add_momentum(1.0, course[s], beams[beam_at(beams, s)], switches, known[s], rates[s], momenta[s])
    for i in range(known.shape[1]):
        lateral[0, i] = rest * lateral[0, i] + end[0] * known[0, i] + end[1] * known[1, i]
        if switches[INERTIA]:
            lateral[1, i] = rest * lateral[1, i] + end[0] * momenta[0, i] + end[1] * momenta[1, i]
    for i in range(switches[PRESCRIBED]):
        lateral[0, i] = floats_3(arrays, CLAMP)[END, 0, i]
    for i in range(known.shape[1]):
        known[END, i] = lateral[0, i]


@inner
def set_end_forces(arrays, count):
    """Set the forces at the points at the end of a step of ``count`` nodes: rigid guides keep their mean over it."""
    switches, forces, held = integers_1(arrays, SWITCH), floats_2(arrays, FORCES), floats_1(arrays, HELD)
    guides, weights = switches[GUIDES], floats_2(arrays, METHOD)[WEIGHTS]
    for guide in range(guides):
        forces[END, guide] = 0.0
        for node in range(count):
            forces[END, guide] += weights[node] * forces[node, guide]
    if guides:
        soft_reactions(
            switches, floats_1(arrays, NUMBER)[SOFTEST], floats_3(arrays, POINT_ROWS)[END], integers_2(arrays, POINT_FIRST)[END],
            floats_3(arrays, FLEXIBLE)[END], floats_1(arrays, COMPLIANCE), floats_2(arrays, KNOWN)[END], forces[END],
            floats_2(arrays, DENSE), floats_1(arrays, GAPS), integers_1(arrays, CHOSEN),
        )  # fmt: skip
    for point in range(len(held)):
        held[point] = forces[END, point]


@inner
def set_path_constants(arrays, at, tip):
    """Complete the path's terms at an instant: what is just in front of the tip, and the constants."""
    course, layers = floats_2(arrays, COURSES)[at], floats_2(arrays, LAYER)
    edges, cubics, count = floats_1(arrays, PATH_EDGES), floats_2(arrays, PATH_CUBICS), integers_1(arrays, PATH_COUNT)[0]
    constants, depth = floats_2(arrays, PATH_CONSTANTS)[at], course[OWN_DEPTH]
    front = tip if depth >= edges[count] else path_value(depth, count, edges, cubics)
    rows, first = floats_3(arrays, POINT_ROWS)[at], integers_2(arrays, POINT_FIRST)[at]
    last = rows.shape[0] - 1
    constants[1] = add_tip_rest(front, course, layers, rows[last], first[last], floats_2(arrays, PATH_LOAD_RATE)[at])
    constants[0] = rest_constant(course, count, edges, cubics, floats_1(arrays, PATH_SQUARES), layers)


@inner
def fresh_constant(course, cubic, deepest, layers):
    """Return 1/2 k integral r^2 of the piece that is being cut, up to the tip."""
    total = 0.0
    for number in range(layers.shape[0]):
        if layers[number, MODULUS] != 0.0 and course[SIDE] > layers[number, LAYER_START]:
            low, high = max(layers[number, LAYER_START], deepest), min(layers[number, LAYER_END], course[DEPTH])
            if high > low:
                total += 0.5 * layers[number, MODULUS] * squared(cubic, low - deepest, high - deepest)
    return total


@inner
def complete_nodes(arrays):
    """Complete the path's terms at both nodes, with the parabola through the tips where the tip cuts."""
    course, tips, axial = floats_2(arrays, COURSES), floats_1(arrays, NODE_TIPS), floats_1(arrays, AXIAL_STATE)
    cubic, unit = floats_1(arrays, CUBIC), floats_1(arrays, OTHER_CUBIC)
    d1, d2 = course[0, OWN_DEPTH] - axial[DEEPEST], course[1, OWN_DEPTH] - axial[DEEPEST]
    cutting = d2 > 0.0
    if cutting:  # the history and what the front alone gives are there: what the tips at the nodes add
        cubic[:] = 0.0
        for which in range(2):
            parabola(d1, d2, 1 + which, unit)
            for i in range(3):
                cubic[i] += tips[which] * unit[i]
    for s in range(2):
        if cutting:
            add_fresh(arrays, s, cubic, floats_2(arrays, PATH_LOAD)[s], floats_2(arrays, PATH_LOAD_RATE)[s])
        set_path_constants(arrays, s, tips[s])
    if cutting:
        parabola(d1, d2, 0, unit)
        for i in range(3):
            cubic[i] += axial[FRONT] * unit[i]
        for s in range(2):
            floats_2(arrays, PATH_CONSTANTS)[s, 0] += fresh_constant(course[s], cubic, axial[DEEPEST], floats_2(arrays, LAYER))


@inner
def tip_of(arrays, at):
    """Return the tip's deflection at an instant."""
    rows, first = floats_3(arrays, POINT_ROWS)[at], integers_2(arrays, POINT_FIRST)[at]
    return along(rows[rows.shape[0] - 1], first[rows.shape[0] - 1], floats_2(arrays, KNOWN)[at])


@inner
def extend_path(arrays):
    """Let the path follow the tip to the end of the step, and set its terms there."""
    course, tips, axial = floats_2(arrays, COURSES), floats_1(arrays, NODE_TIPS), floats_1(arrays, AXIAL_STATE)
    count, cubic = integers_1(arrays, PATH_COUNT), floats_1(arrays, CUBIC)
    tip, depth, deepest = tip_of(arrays, END), course[END, OWN_DEPTH], axial[DEEPEST]
    if depth > deepest * (1.0 + ROUNDINGS) and course[1, OWN_DEPTH] > deepest:
        d1, d2 = course[0, OWN_DEPTH] - deepest, course[1, OWN_DEPTH] - deepest
        through_four(d1, d2, depth - deepest, axial[FRONT], tips[0], tips[1], tip, cubic)
        append_piece(
            depth, cubic, count[0], floats_1(arrays, PATH_EDGES), floats_2(arrays, PATH_CUBICS), floats_2(arrays, PATH_MOMENTS),
            floats_1(arrays, PATH_SQUARES), floats_2(arrays, PASCAL),
        )  # fmt: skip
        count[0] += 1
    if depth >= deepest * (1.0 - ROUNDINGS):
        axial[FRONT] = tip
    axial[DEEPEST] = max(deepest, depth)
    set_history(arrays, END)
    set_path_constants(arrays, END, tip)


@inner
def push_speeds(arrays, h, middle):
    """Set the speeds at the nodes in ``PAIR`` 8, 9 from the axial equations; returns the momentum Pi at the start."""
    numbers, course, axial = floats_1(arrays, NUMBER), floats_2(arrays, COURSES), floats_1(arrays, AXIAL_STATE)
    limits, sums, pair = floats_1(arrays, LIMITS), floats_2(arrays, INSTANT_SUMS), floats_1(arrays, PAIR)
    rows = floats_2(arrays, SIGNALS)
    begin = numbers[MASS_PER_LENGTH] * numbers[LENGTH] * axial[PACE] + axial[LAST_AXIAL_MOMENTUM]
    row, acts = rows[row_at(rows, integers_1(arrays, SIGNAL_ENDS), PUSH_SIGNAL, middle)], integers_1(arrays, SWITCH)[AXIAL_ACTS]
    for s in range(2):
        pair[s], pair[2 + s] = course[s, OWN_DEPTH], value_of(row, course[s, TIME])
        pair[4 + s], pair[6 + s] = sums[s, S_CONFIGURATION] if acts else 0.0, sums[s, S_MOMENTUM]
    node_speeds(
        h, floats_2(arrays, INVERSE), numbers, limits[DIRECTION], limits[CUTTING_LIMIT], begin, pair[0:2], pair[2:4], pair[4:6],
        pair[6:8], pair[8:10],
    )  # fmt: skip
    return begin


@inner
def end_speed(arrays, begin, first, second):
    """Return the speed at the end of a pushed step: Pi there less dT/dv, which itself depends on the speed."""
    numbers, switches, sums = floats_1(arrays, NUMBER), integers_1(arrays, SWITCH), floats_2(arrays, INSTANT_SUMS)
    mass, end = numbers[MASS_PER_LENGTH] * numbers[LENGTH], floats_2(arrays, METHOD)[END_SHARES]
    change = end[0] * (mass * first + sums[0, S_MOMENTUM] - begin) + end[1] * (mass * second + sums[1, S_MOMENTUM] - begin)
    speed = (begin + change) / mass
    if switches[FRAME] == MATERIAL or not switches[INERTIA]:
        return speed
    for _ in range(20):
        floats_2(arrays, COURSES)[END, SPEED] = speed
        set_velocities(arrays, END)
        found = (begin + change - axial_momentum(arrays, END)) / mass
        settled = np.abs(found - speed) <= 1e-15 * np.abs(found)
        speed = found
        if settled:
            break
    return speed
