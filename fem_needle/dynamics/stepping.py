"""The phases of one step around its lateral solution: motion in time, the state at its end, what a kink before it does."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
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
from fem_needle.dynamics.guides import ends_at_node, soft_reactions
from fem_needle.dynamics.instant import beam_at, set_motion, set_place
from fem_needle.dynamics.points import along
from fem_needle.dynamics.reduced import factor_mass, solve_mass
from fem_needle.dynamics.signals import row_at, value_of


@inner
def set_given_motion(arrays, t, h, until):
    """Set the motion at nodes and end of a step of a prescribed insertion."""
    rows, offsets, course = floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), floats_2(arrays, ix.COURSES)
    places, middle = floats_2(arrays, ix.METHOD)[ix.PLACES], t + 0.5 * h
    for at in (0, 1, ix.END):
        time = until
        if at != ix.END and places[at] != 1.0:
            time = t + places[at] * h
        set_motion(time, middle, rows, offsets, course[at])
        set_place(integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), course[at])


@inner
def set_pushed_motion(arrays, t, h, until, first, second, last):
    """Set the motion at nodes and end of a step whose speeds at the nodes and at the end are tried."""
    inverse, method, course = floats_2(arrays, ix.INVERSE), floats_2(arrays, ix.METHOD), floats_2(arrays, ix.COURSES)
    axial, ahead, places = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS)[ix.AHEAD], method[ix.PLACES]
    det = inverse[0, 0] * inverse[1, 1] - inverse[0, 1] * inverse[1, 0]
    way0 = h * (inverse[1, 1] * first - inverse[0, 1] * second) / det
    way1 = h * (inverse[0, 0] * second - inverse[1, 0] * first) / det
    start = axial[ix.PACE]
    for s in range(2):
        course[s, ix.TIME] = until if places[s] == 1.0 else t + places[s] * h
        course[s, ix.OWN_DEPTH], course[s, ix.SPEED] = axial[ix.WAY] + (way1 if s else way0), second if s else first
        course[s, ix.ACCELERATION] = (inverse[s, 0] * (first - start) + inverse[s, 1] * (second - start)) / h
    way = h * (method[ix.WEIGHTS, 0] * first + method[ix.WEIGHTS, 1] * second)
    course[ix.END, ix.TIME], course[ix.END, ix.OWN_DEPTH], course[ix.END, ix.SPEED] = until, axial[ix.WAY] + way, last
    change = method[ix.END_SLOPE, 0] * (first - start) + method[ix.END_SLOPE, 1] * (second - start)
    course[ix.END, ix.ACCELERATION] = change / h
    for at in (0, 1, ix.END):
        course[at, ix.OWN_SIDE] = ahead
        set_place(integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), course[at])


@inner
def set_velocities(arrays, at):
    """Set q' at an end from P = M q' + v S q and the clamp's own velocity, and the clamp's part of P."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)
    known, rates, right = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], floats_2(arrays, ix.VECTORS)[0]
    lateral, clamped, beam = floats_3(arrays, ix.LATERAL)[0], switches[ix.PRESCRIBED], beams[beam_at(beams, at)]
    for i in range(len(known)):
        rates[i], right[i] = 0.0, lateral[1, i]
    if not switches[ix.INERTIA]:
        return
    for i in range(clamped):
        rates[i] = floats_3(arrays, ix.CLAMP)[at, 1, i]
    add_momentum(-1.0, course, beam, switches, known, rates, right)
    if beams.shape[0] > 1:
        factor_mass(arrays, at)
    solve_mass(arrays, at, right)
    for i in range(clamped, len(known)):
        rates[i] = right[i] / course[ix.STRETCH]
    right[:] = 0.0
    add_momentum(1.0, course, beam, switches, known, rates, right)
    for i in range(clamped):
        lateral[1, i] = right[i]


@inner
def finish(arrays):
    """Set the momenta at the nodes, coordinates and momentum at the end of the step, from the polynomial through the nodes."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES), floats_5(arrays, ix.BEAM)
    known, rates, momenta = floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.RATES), floats_2(arrays, ix.MOMENTA)
    lateral, end = floats_3(arrays, ix.LATERAL)[0], floats_2(arrays, ix.METHOD)[ix.END_SHARES]
    rest = 1.0 - end[0] - end[1]
    for s in range(2):
        momenta[s, :] = 0.0
        add_momentum(1.0, course[s], beams[beam_at(beams, s)], switches, known[s], rates[s], momenta[s])
    for i in range(known.shape[1]):
        lateral[0, i] = rest * lateral[0, i] + end[0] * known[0, i] + end[1] * known[1, i]
        if switches[ix.INERTIA]:
            lateral[1, i] = rest * lateral[1, i] + end[0] * momenta[0, i] + end[1] * momenta[1, i]
    for i in range(switches[ix.PRESCRIBED]):
        lateral[0, i] = floats_3(arrays, ix.CLAMP)[ix.END, 0, i]
    for i in range(known.shape[1]):
        known[ix.END, i] = lateral[0, i]


@inner
def set_end_forces(arrays, count):
    """Set the forces at the points at the end of a step of ``count`` nodes: those of the last node where that is the end.

    Else rigid guides keep their mean over the step, about which their multipliers alternate.
    """
    switches, forces, held = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.FORCES), floats_1(arrays, ix.HELD)
    guides, weights, is_node = switches[ix.GUIDES], floats_2(arrays, ix.METHOD)[ix.WEIGHTS], ends_at_node(arrays, count)
    for guide in range(guides):
        forces[ix.END, guide] = 0.0
        for node in range(count):
            share = (1.0 if node == count - 1 else 0.0) if is_node else weights[node]
            forces[ix.END, guide] += share * forces[node, guide]
    if guides and not is_node:
        soft_reactions(
            switches, floats_1(arrays, ix.NUMBER)[ix.SOFTEST], floats_3(arrays, ix.POINT_ROWS)[ix.END],
            integers_2(arrays, ix.POINT_FIRST)[ix.END], floats_3(arrays, ix.FLEXIBLE)[ix.END], floats_1(arrays, ix.COMPLIANCE),
            floats_2(arrays, ix.KNOWN)[ix.END], forces[ix.END], floats_2(arrays, ix.DENSE), floats_1(arrays, ix.GAPS),
            integers_1(arrays, ix.CHOSEN),
        )  # fmt: skip
    for point in range(len(held)):
        held[point] = forces[ix.END, point]


@inner
def set_path_constants(arrays, at, tip):
    """Complete the path's terms at an instant: what is just in front of the tip, and the constants."""
    course, layers = floats_2(arrays, ix.COURSES)[at], floats_2(arrays, ix.LAYER)
    edges, cubics, count = floats_1(arrays, ix.PATH_EDGES), floats_2(arrays, ix.PATH_CUBICS), integers_1(arrays, ix.PATH_COUNT)[0]
    constants, depth = floats_2(arrays, ix.PATH_CONSTANTS)[at], course[ix.OWN_DEPTH]
    front = tip if depth >= edges[count] else path_value(depth, count, edges, cubics)
    rows, first = floats_3(arrays, ix.POINT_ROWS)[at], integers_2(arrays, ix.POINT_FIRST)[at]
    last = rows.shape[0] - 1
    constants[1] = add_tip_rest(front, course, layers, rows[last], first[last], floats_2(arrays, ix.PATH_LOAD_RATE)[at])
    constants[0] = rest_constant(course, count, edges, cubics, floats_1(arrays, ix.PATH_SQUARES), layers)


@inner
def fresh_constant(course, cubic, deepest, layers):
    """Return 1/2 k integral r^2 of the piece that is being cut, up to the tip."""
    total = 0.0
    for number in range(layers.shape[0]):
        if layers[number, ix.MODULUS] != 0.0 and course[ix.SIDE] > layers[number, ix.LAYER_START]:
            low, high = max(layers[number, ix.LAYER_START], deepest), min(layers[number, ix.LAYER_END], course[ix.DEPTH])
            if high > low:
                total += 0.5 * layers[number, ix.MODULUS] * squared(cubic, low - deepest, high - deepest)
    return total


@inner
def complete_nodes(arrays):
    """Complete the path's terms at both nodes, with the parabola through the tips where the tip cuts."""
    course, tips, axial = floats_2(arrays, ix.COURSES), floats_1(arrays, ix.NODE_TIPS), floats_1(arrays, ix.AXIAL_STATE)
    cubic, unit = floats_1(arrays, ix.CUBIC), floats_1(arrays, ix.OTHER_CUBIC)
    d1, d2 = course[0, ix.OWN_DEPTH] - axial[ix.DEEPEST], course[1, ix.OWN_DEPTH] - axial[ix.DEEPEST]
    cutting = d2 > 0.0
    if cutting:  # the history and what the front alone gives are there: what the tips at the nodes add
        cubic[:] = 0.0
        for which in range(2):
            parabola(d1, d2, 1 + which, unit)
            for i in range(3):
                cubic[i] += tips[which] * unit[i]
    for s in range(2):
        if cutting:
            add_fresh(arrays, s, cubic, floats_2(arrays, ix.PATH_LOAD)[s], floats_2(arrays, ix.PATH_LOAD_RATE)[s])
        set_path_constants(arrays, s, tips[s])
    if cutting:
        parabola(d1, d2, 0, unit)
        for i in range(3):
            cubic[i] += axial[ix.FRONT] * unit[i]
        for s in range(2):
            floats_2(arrays, ix.PATH_CONSTANTS)[s, 0] += fresh_constant(
                course[s], cubic, axial[ix.DEEPEST], floats_2(arrays, ix.LAYER)
            )


@inner
def tip_of(arrays, at):
    """Return the tip's deflection at an instant."""
    rows, first = floats_3(arrays, ix.POINT_ROWS)[at], integers_2(arrays, ix.POINT_FIRST)[at]
    return along(rows[rows.shape[0] - 1], first[rows.shape[0] - 1], floats_2(arrays, ix.KNOWN)[at])


@inner
def extend_path(arrays):
    """Let the path follow the tip to the end of the step, and set its terms there."""
    course, tips, axial = floats_2(arrays, ix.COURSES), floats_1(arrays, ix.NODE_TIPS), floats_1(arrays, ix.AXIAL_STATE)
    count, cubic = integers_1(arrays, ix.PATH_COUNT), floats_1(arrays, ix.CUBIC)
    tip, depth, deepest = tip_of(arrays, ix.END), course[ix.END, ix.OWN_DEPTH], axial[ix.DEEPEST]
    if depth > deepest * (1.0 + ix.ROUNDINGS) and course[1, ix.OWN_DEPTH] > deepest:
        d1, d2 = course[0, ix.OWN_DEPTH] - deepest, course[1, ix.OWN_DEPTH] - deepest
        through_four(d1, d2, depth - deepest, axial[ix.FRONT], tips[0], tips[1], tip, cubic)
        append_piece(
            depth, cubic, count[0], floats_1(arrays, ix.PATH_EDGES), floats_2(arrays, ix.PATH_CUBICS),
            floats_2(arrays, ix.PATH_MOMENTS), floats_1(arrays, ix.PATH_SQUARES), floats_2(arrays, ix.PASCAL),
        )  # fmt: skip
        count[0] += 1
    if depth >= deepest * (1.0 - ix.ROUNDINGS):
        axial[ix.FRONT] = tip
    axial[ix.DEEPEST] = max(deepest, depth)
    set_history(arrays, ix.END)
    set_path_constants(arrays, ix.END, tip)


@inner
def push_speeds(arrays, h, middle):
    """Set the speeds at the nodes in ``PAIR`` 8, 9 from the axial equations; returns the momentum Pi at the start."""
    numbers, course, axial = floats_1(arrays, ix.NUMBER), floats_2(arrays, ix.COURSES), floats_1(arrays, ix.AXIAL_STATE)
    limits, sums, pair = floats_1(arrays, ix.LIMITS), floats_2(arrays, ix.INSTANT_SUMS), floats_1(arrays, ix.PAIR)
    rows = floats_2(arrays, ix.SIGNALS)
    begin = numbers[ix.MASS_PER_LENGTH] * numbers[ix.LENGTH] * axial[ix.PACE] + axial[ix.LAST_AXIAL_MOMENTUM]
    row, acts = (
        rows[row_at(rows, integers_1(arrays, ix.SIGNAL_ENDS), ix.PUSH_SIGNAL, middle)],
        integers_1(arrays, ix.SWITCH)[ix.AXIAL_ACTS],
    )
    for s in range(2):
        pair[s], pair[2 + s] = course[s, ix.OWN_DEPTH], value_of(row, course[s, ix.TIME])
        pair[4 + s], pair[6 + s] = sums[s, ix.S_CONFIGURATION] if acts else 0.0, sums[s, ix.S_MOMENTUM]
    node_speeds(
        h, floats_2(arrays, ix.INVERSE), numbers, limits[ix.DIRECTION], limits[ix.CUTTING_LIMIT], begin, pair[0:2], pair[2:4],
        pair[4:6], pair[6:8], pair[8:10],
    )  # fmt: skip
    return begin


@inner
def end_speed(arrays, begin, first, second):
    """Return the speed at the end of a pushed step: Pi there less dT/dv, which itself depends on the speed."""
    numbers, switches, sums = floats_1(arrays, ix.NUMBER), integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.INSTANT_SUMS)
    mass, end = numbers[ix.MASS_PER_LENGTH] * numbers[ix.LENGTH], floats_2(arrays, ix.METHOD)[ix.END_SHARES]
    change = end[0] * (mass * first + sums[0, ix.S_MOMENTUM] - begin) + end[1] * (mass * second + sums[1, ix.S_MOMENTUM] - begin)
    speed = (begin + change) / mass
    if switches[ix.FRAME] == ix.MATERIAL or not switches[ix.INERTIA]:
        return speed
    for _ in range(20):
        floats_2(arrays, ix.COURSES)[ix.END, ix.SPEED] = speed
        set_velocities(arrays, ix.END)
        found = (begin + change - axial_momentum(arrays, ix.END)) / mass
        settled = np.abs(found - speed) <= 1e-15 * np.abs(found)
        speed = found
        if settled:
            break
    return speed
