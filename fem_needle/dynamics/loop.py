"""The loop over time steps: from breakpoint to breakpoint in compiled code, all samples of the way as rows of an array.

The only entrance for steps of any needle (equilibria: `fem_needle.dynamics.rest_loop`). What the arrays hold: `names`.
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, integers_1
from fem_needle.dynamics.axial import cutting_work
from fem_needle.dynamics.compilation import entrance, inner, stage
from fem_needle.dynamics.instant import prepare_matrices, prepare_points, set_loads, set_motion, set_place
from fem_needle.dynamics.jumps import has_rigid_guides, land
from fem_needle.dynamics.lateral import solve_nodes
from fem_needle.dynamics.points import finite
from fem_needle.dynamics.record import axial_force, keep_output
from fem_needle.dynamics.signals import row_at, value_of
from fem_needle.dynamics.stepping import (
    complete_nodes,
    end_speed,
    extend_path,
    finish,
    push_speeds,
    set_end_forces,
    set_given_motion,
    set_pushed_motion,
    set_velocities,
)
from fem_needle.dynamics.works import add_ends, add_node, row_correction, set_sums

MOST_ROUNDS = 60
SAME_SPEED, ROUNDED_SPEED = 1e-15, 1e-6  # of the largest speed of a step: the same; no longer approached because of rounding


@inner
def copy_row(source, target):
    """Copy an array of one axis."""
    for i in range(len(source)):
        target[i] = source[i]


@inner
def keep_state(arrays, is_kept):
    """Keep the state at the start of a step, or put it back."""
    lateral, kept = floats_3(arrays, ix.LATERAL)[0], floats_2(arrays, ix.KEPT_LATERAL)
    axial, ledger, held = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LEDGER_STATE), floats_1(arrays, ix.HELD)
    for row in range(2):
        copy_row(lateral[row] if is_kept else kept[row], kept[row] if is_kept else lateral[row])
    copy_row(axial if is_kept else floats_1(arrays, ix.KEPT_AXIAL), floats_1(arrays, ix.KEPT_AXIAL) if is_kept else axial)
    copy_row(ledger if is_kept else floats_1(arrays, ix.KEPT_LEDGER), floats_1(arrays, ix.KEPT_LEDGER) if is_kept else ledger)
    copy_row(held if is_kept else floats_1(arrays, ix.KEPT_HELD), floats_1(arrays, ix.KEPT_HELD) if is_kept else held)


@inner
def begin_step(arrays, t, h):
    """Set the instant at the start of a step: that of the last step's end, or, where there was none in this call, anew."""
    axial, limits, course = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS), floats_2(arrays, ix.COURSES)
    clamp, momenta, lateral = floats_3(arrays, ix.CLAMP), floats_2(arrays, ix.MOMENTA), floats_3(arrays, ix.LATERAL)[0]
    is_held = limits[ix.IS_PUSHED] != 0.0 and has_rigid_guides(arrays)  # which strike a needle that they do not follow
    if axial[ix.LANDED] == 0.0 and not is_held:
        copy_row(course[ix.END], course[ix.START])
        for row in range(3):
            copy_row(clamp[ix.END, row], clamp[ix.START, row])
        copy_row(floats_2(arrays, ix.FORCES)[ix.END], floats_2(arrays, ix.FORCES)[ix.START])
        copy_row(floats_2(arrays, ix.KNOWN)[ix.END], floats_2(arrays, ix.KNOWN)[ix.START])
        copy_row(floats_2(arrays, ix.RATES)[ix.END], floats_2(arrays, ix.RATES)[ix.START])
        copy_row(floats_2(arrays, ix.INSTANT_SUMS)[ix.END], floats_2(arrays, ix.INSTANT_SUMS)[ix.START])
    else:
        at, middle = ix.START, t + 0.5 * h
        if limits[ix.IS_PUSHED] != 0.0:
            course[ix.START, ix.TIME], course[ix.START, ix.OWN_DEPTH], course[ix.START, ix.SPEED] = (
                t,
                axial[ix.WAY],
                axial[ix.PACE],
            )
            course[ix.START, ix.ACCELERATION], course[ix.START, ix.OWN_SIDE] = 0.0, limits[ix.AHEAD]
        else:
            set_motion(t, middle, floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), course[ix.START])
        set_place(integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), course[ix.START])
        set_loads(arrays, at, middle)
        prepare_matrices(arrays, at, integers_1(arrays, ix.OTHER_CHANGED))
        prepare_points(arrays, at)
        land(arrays, h)
    momenta[ix.START, 0], momenta[ix.START, 1] = lateral[1, 0], lateral[1, 1]


@stage
def solve_round(arrays, t, h, until, first, second, last, is_first):
    """Solve the stages for a motion that is given, or tried."""
    limits, middle = floats_1(arrays, ix.LIMITS), t + 0.5 * h
    if limits[ix.IS_PUSHED] != 0.0:
        set_pushed_motion(arrays, t, h, until, first, second, last)
    else:
        set_given_motion(arrays, t, h, until)
    if is_first:
        for at in (0, 1, ix.END):
            set_loads(arrays, at, middle)
    for s in range(2):
        prepare_matrices(arrays, s, integers_1(arrays, ix.CHANGED))
        prepare_points(arrays, s)
    solve_nodes(arrays, h)
    if integers_1(arrays, ix.SWITCH)[ix.CUTS]:
        complete_nodes(arrays)


@stage
def solve_stages(arrays, t, h, until):
    """Solve the stages of a step, of a push until the axial equations give the speeds with which they were solved."""
    axial, limits = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS)
    places, pair = floats_2(arrays, ix.METHOD)[ix.PLACES], floats_1(arrays, ix.PAIR)
    first, second, before, begin = axial[ix.PACE], axial[ix.PACE], np.inf, 0.0
    if axial[ix.LANDED] != ix.KINK and axial[ix.LAST_LENGTH] > 0.0:
        slope = (axial[ix.NODE_PACE_2] - axial[ix.NODE_PACE_1]) / (places[1] - places[0]) * (h / axial[ix.LAST_LENGTH])
        first, second = axial[ix.PACE] + slope * places[0], axial[ix.PACE] + slope * places[1]
    if limits[ix.DIRECTION] == 0.0:
        first, second = 0.0, 0.0
    for count in range(MOST_ROUNDS):
        solve_round(arrays, t, h, until, first, second, second, count == 0)
        if limits[ix.IS_PUSHED] == 0.0:
            return ix.DONE
        for s in range(2):
            set_sums(arrays, s, count >= 0)
        axial[ix.ROUNDS] += 1.0
        if limits[ix.DIRECTION] == 0.0:
            return ix.DONE
        begin = push_speeds(arrays, h, t + 0.5 * h)
        change, largest = max(abs(pair[8] - first), abs(pair[9] - second)), max(abs(pair[8]), abs(pair[9]))
        first, second = pair[8], pair[9]
        if not np.isfinite(change):
            return ix.DIVERGED
        if change <= SAME_SPEED * largest or before <= change <= ROUNDED_SPEED * largest:
            pair[10] = begin
            return ix.DONE
        before = change
    return ix.DIVERGED


@inner
def accelerate_start(arrays, h):
    """Let the acceleration at the start of a pushed step be that of its own polynomial, which its power contains."""
    course, sums, axial = (
        floats_2(arrays, ix.COURSES),
        floats_2(arrays, ix.INSTANT_SUMS)[ix.START],
        floats_1(arrays, ix.AXIAL_STATE),
    )
    slopes, start = floats_2(arrays, ix.METHOD)[ix.START_SLOPE], course[ix.START, ix.SPEED]
    found = (slopes[0] * (course[0, ix.SPEED] - start) + slopes[1] * (course[1, ix.SPEED] - start)) / h
    sums[ix.S_POWER] += (course[ix.START, ix.ACCELERATION] - found) * sums[ix.S_MOMENTUM]
    course[ix.START, ix.ACCELERATION], axial[ix.LAST_POWER] = found, sums[ix.S_POWER]


@stage
def end_step(arrays, t, h, until, is_output):
    """Set the state at the end of a step; returns FAILED where it is not finite."""
    limits, switches, pair = floats_1(arrays, ix.LIMITS), integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.PAIR)
    is_pushed, first, second = limits[ix.IS_PUSHED] != 0.0, pair[8], pair[9]
    finish(arrays)
    whole = is_output or is_pushed or switches[ix.FRAME] != ix.MATERIAL
    if is_pushed and limits[ix.DIRECTION] != 0.0:
        # Matrices first: dT/dv is part of the momentum along the axis.
        prepare_matrices(arrays, ix.END, integers_1(arrays, ix.OTHER_CHANGED))
        set_pushed_motion(arrays, t, h, until, first, second, end_speed(arrays, pair[10], first, second))
    if whole:
        prepare_matrices(arrays, ix.END, integers_1(arrays, ix.OTHER_CHANGED))
    prepare_points(arrays, ix.END)
    set_end_forces(arrays, 2)
    set_velocities(arrays, ix.END)
    if switches[ix.CUTS]:
        extend_path(arrays)
    axial = floats_1(arrays, ix.AXIAL_STATE)
    axial[ix.DEEPEST] = max(axial[ix.DEEPEST], floats_2(arrays, ix.COURSES)[ix.END, ix.OWN_DEPTH])
    set_sums(arrays, ix.END, whole)
    return ix.DONE if finite(floats_2(arrays, ix.KNOWN)[ix.END]) else ix.FAILED


@stage
def book_step(arrays, h, is_last, is_shown):
    """Add the works of a step; ``is_last``: it may be the last of a row of equal steps; ``is_shown``: an output."""
    axial, ledger, switches = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LEDGER_STATE), integers_1(arrays, ix.SWITCH)
    course, limits, weights = floats_2(arrays, ix.COURSES), floats_1(arrays, ix.LIMITS), floats_2(arrays, ix.METHOD)[ix.WEIGHTS]
    is_pushed, moves = limits[ix.IS_PUSHED] != 0.0, False
    for at in (0, 1, ix.END, ix.START):
        moves = moves or course[at, ix.SPEED] != 0.0 or course[at, ix.ACCELERATION] != 0.0
    starts = axial[ix.LANDED] == ix.KINK or abs(axial[ix.LAST_LENGTH] - h) > 1e-9 * h
    corrects = (
        switches[ix.INERTIA] != 0 and moves and (is_last or starts or is_pushed)
    )  # any step of a push may turn out to be the last
    if not is_pushed and (corrects or is_shown or not switches[ix.INERTIA]):
        for s in range(2):
            set_sums(arrays, s, corrects)
    if starts:
        ledger[ix.BOUNDARY] += axial[ix.PENDING]
        if corrects:
            ledger[ix.BOUNDARY] += row_correction(arrays, 0, h)
    axial[ix.PENDING] = row_correction(arrays, 1, h) if corrects else 0.0
    for s in range(2):
        add_node(arrays, s, weights[s] * h)
    add_ends(arrays, h)
    if is_pushed:
        rows = floats_2(arrays, ix.SIGNALS)
        row = rows[row_at(rows, integers_1(arrays, ix.SIGNAL_ENDS), ix.PUSH_SIGNAL, course[0, ix.TIME])]
        for s in range(2):
            ledger[ix.PUSH_WORK] += weights[s] * h * value_of(row, course[s, ix.TIME]) * course[s, ix.SPEED]
            ledger[ix.CUTTING_WORK] += weights[s] * h * limits[ix.CUTTING_LIMIT] * course[s, ix.SPEED]
    else:
        ledger[ix.CUTTING_WORK] += cutting_work(
            floats_2(arrays, ix.LAYER), floats_1(arrays, ix.KEPT_AXIAL)[ix.DEEPEST], axial[ix.DEEPEST]
        )


@inner
def arrive(arrays, h, until):
    """Let the state stand at the end of a step."""
    axial, course, clamp = floats_1(arrays, ix.AXIAL_STATE), floats_2(arrays, ix.COURSES), floats_3(arrays, ix.CLAMP)
    axial[ix.NOW], axial[ix.WAY], axial[ix.PACE] = until, course[ix.END, ix.OWN_DEPTH], course[ix.END, ix.SPEED]
    axial[ix.NODE_PACE_1], axial[ix.NODE_PACE_2], axial[ix.LAST_PACE] = (
        course[0, ix.SPEED],
        course[1, ix.SPEED],
        course[ix.END, ix.SPEED],
    )
    axial[ix.LAST_HUB_RATE], axial[ix.LAST_ANGLE_RATE] = clamp[ix.END, 1, 0], clamp[ix.END, 1, 1]
    axial[ix.LAST_LENGTH], axial[ix.LANDED], axial[ix.STEPS] = h, 0.0, axial[ix.STEPS] + 1.0


@inner
def happened(arrays, until, middle):
    """Return whether a push has passed a level, stopped, or broken away."""
    axial, limits, rows = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS), floats_2(arrays, ix.SIGNALS)
    direction = limits[ix.DIRECTION]
    if limits[ix.EVENTS] == 0.0:
        return False
    if direction != 0.0:
        return (axial[ix.WAY] - limits[ix.LEVEL]) * direction >= 0.0 or axial[ix.PACE] * direction <= 0.0
    row = rows[row_at(rows, integers_1(arrays, ix.SIGNAL_ENDS), ix.PUSH_SIGNAL, middle)]
    driving = value_of(row, until) + axial[ix.AXIAL_FORCE]
    return driving > limits[ix.INWARD] or driving < -limits[ix.OUTWARD]


@stage
def keep_row(arrays, at, time, middle, h, deepest, force, pace):
    """Keep an output; of a push, the push itself, and at rest what friction takes of it."""
    rows, cursor = floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.CURSOR)
    row = floats_2(arrays, ix.RECORDS)[cursor[2]]
    keep_output(arrays, at, 2, h, deepest, row)
    if floats_1(arrays, ix.LIMITS)[ix.IS_PUSHED] != 0.0:
        row[ix.R_PUSH] = value_of(rows[row_at(rows, integers_1(arrays, ix.SIGNAL_ENDS), ix.PUSH_SIGNAL, middle)], time)
        if pace == 0.0:
            row[ix.R_FRICTION] = row[ix.R_PUSH] + force
    cursor[2] += 1


@stage
def take_step(arrays, t, h, until, is_last, is_output):
    """Take a step and keep its output; a step that fails or in which something happens leaves the state as it was."""
    axial, ledger, cursor = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LEDGER_STATE), integers_1(arrays, ix.CURSOR)
    middle, pieces = t + 0.5 * h, integers_1(arrays, ix.PATH_COUNT)[0]
    keep_state(arrays, h > 0.0)
    begin_step(arrays, t, h)
    status = solve_stages(arrays, t, h, until)
    if status == ix.DONE and floats_1(arrays, ix.LIMITS)[ix.IS_PUSHED] != 0.0:
        accelerate_start(arrays, h)
    if status == ix.DONE:
        status = end_step(arrays, t, h, until, is_output)
    if status == ix.DONE:
        book_step(arrays, h, is_last, is_output or cursor[3] != 0)
        arrive(arrays, h, until)
        if floats_1(arrays, ix.LIMITS)[ix.IS_PUSHED] != 0.0:
            axial[ix.AXIAL_FORCE] = axial_force(arrays, ix.END, 2, h)
            if happened(arrays, until, middle):
                status = ix.EVENT
    kept = floats_1(arrays, ix.KEPT_AXIAL)
    if status != ix.DONE:
        keep_state(arrays, h <= 0.0)
        integers_1(arrays, ix.PATH_COUNT)[0] = pieces
        if axial[ix.LANDED] == 0.0:
            axial[ix.LANDED] = ix.CONTINUED
        return status
    for at in (ix.START, ix.END):
        if at == ix.START and cursor[3]:  # the start of the run
            cursor[3] = 0
            keep_row(arrays, at, t, middle, h, kept[ix.DEEPEST], kept[ix.AXIAL_FORCE], kept[ix.PACE])
        elif at == ix.END and is_output:
            ledger[ix.BOUNDARY] += axial[ix.PENDING]
            keep_row(arrays, at, until, middle, h, axial[ix.DEEPEST], axial[ix.AXIAL_FORCE], axial[ix.PACE])
            ledger[ix.BOUNDARY] -= axial[ix.PENDING]
    return status


@entrance("time loop", 186)
def run_steps(arrays):
    """Take the steps of smooth intervals; returns how it ended (`names`: DONE, FAILED, EVENT, DIVERGED).

    ``INTERVALS``: start and end [s], number of steps, ENDS_AT_OUTPUT + BEGINS_AT_KINK (I, 4). ``CURSOR``: interval, step in it,
    rows of the record so far, and whether the first step's start is an output too (4,); where the call stopped.
    """
    intervals, cursor, axial = floats_2(arrays, ix.INTERVALS), integers_1(arrays, ix.CURSOR), floats_1(arrays, ix.AXIAL_STATE)
    if axial[ix.LANDED] == 0.0:
        axial[ix.LANDED] = ix.CONTINUED  # what the last call left to work on may be another state's
    if intervals.shape[0] == 0:  # pass the kink, no more
        keep_state(arrays, True)
        begin_step(arrays, axial[ix.NOW], max(axial[ix.LAST_LENGTH], np.finfo(np.float64).tiny))
    while cursor[0] < intervals.shape[0]:
        interval = intervals[cursor[0]]
        steps, kind = int(interval[2]), int(interval[3])
        h = (interval[1] - interval[0]) / steps
        if kind >= ix.BEGINS_AT_KINK and cursor[1] == 0:
            axial[ix.LANDED] = ix.KINK
        while cursor[1] < steps:
            is_last = cursor[1] + 1 == steps
            t = interval[0] + cursor[1] * h
            until = interval[1] if is_last else interval[0] + (cursor[1] + 1) * h
            status = take_step(arrays, t, h, until, is_last, is_last and kind % 2 == ix.ENDS_AT_OUTPUT)
            if status != ix.DONE:
                return status
            cursor[1] += 1
        cursor[0], cursor[1] = cursor[0] + 1, 0
    return ix.DONE
