"""An instant of a step: the insertion, the loads and the hub at its time, then all of the needle that depends on the depth."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.callback import ask
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import cover_elements, cover_functions, grow
from fem_needle.dynamics.names import (
    ACCELERATION,
    ANGLE_SIGNAL,
    ASK_MATRICES,
    ASKED,
    BEAM,
    BEVEL,
    CLAMP,
    COEFFICIENTS,
    COURSES,
    COVERED,
    DEPTH,
    DEPTH_SIGNAL,
    FACTOR,
    FACTOR_RATE,
    FACTOR_SIGNAL,
    FIXED,
    FLEXIBLE,
    FLEXIBLE_RATE,
    FORCE_RATES,
    FORCES,
    FRAME,
    FRESH,
    GIVEN,
    GUIDES,
    HUB_SIGNAL,
    LAYER,
    LAYER_END,
    LAYER_START,
    LOAD_SIGNAL,
    MODULUS,
    NUMBER,
    OWN_DEPTH,
    OWN_SIDE,
    PIECE_NODES,
    POINT_FIRST,
    POINT_PLACES,
    POINT_RATES,
    POINT_ROWS,
    POINTS,
    POSITION,
    RULE,
    SHAPE,
    SIDE,
    SIGNAL_ENDS,
    SIGNALS,
    SMALLEST_DEPTH,
    SPEED,
    STRETCH,
    STRETCHED,
    STRIDE,
    SWITCH,
    TIME,
    TIPS,
    TISSUE_BLOCKS,
    UNIT,
    UNIT_SUMS,
)
from fem_needle.dynamics.points import set_points
from fem_needle.dynamics.signals import curvature_of, rate_of, row_at, value_of


@inner
def set_motion(time, middle, rows, offsets, course):
    """Set the motion of a prescribed insertion at a time; ``middle``: a time inside the step, whose rows hold at its ends too."""
    row = rows[row_at(rows, offsets, DEPTH_SIGNAL, middle)]
    course[TIME], course[OWN_DEPTH] = time, value_of(row, time)
    course[SPEED], course[ACCELERATION] = rate_of(row, time), curvature_of(row, time)
    course[OWN_SIDE] = value_of(row, middle)


@inner
def set_place(switches, numbers, course):
    """Set what follows from the depth: that of the matrices, not less than the smallest, and the stretch."""
    course[DEPTH] = max(course[OWN_DEPTH], numbers[SMALLEST_DEPTH])
    course[SIDE] = max(course[OWN_SIDE], numbers[SMALLEST_DEPTH])
    course[STRETCH] = course[DEPTH] if switches[FRAME] == STRETCHED else 1.0


@inner
def set_loads(arrays, at, middle):
    """Set factor, hub (value, rate, second rate of deflection and angle) and loads at an instant, behind the guides' forces.

    Tip loads are force times direction, of the bevel law a k(layer at the tip) m(t) times direction.
    """
    rows, offsets, switches = floats_2(arrays, SIGNALS), integers_1(arrays, SIGNAL_ENDS), integers_1(arrays, SWITCH)
    course, clamp = floats_2(arrays, COURSES)[at], floats_3(arrays, CLAMP)[at]
    forces, force_rates = floats_2(arrays, FORCES)[at], floats_2(arrays, FORCE_RATES)[at]
    time, guides = course[TIME], switches[GUIDES]
    row = rows[row_at(rows, offsets, FACTOR_SIGNAL, middle)]
    course[FACTOR], course[FACTOR_RATE] = value_of(row, time), rate_of(row, time)
    for number in range(HUB_SIGNAL, ANGLE_SIGNAL + 1):
        row, which = rows[row_at(rows, offsets, number, middle)], number - HUB_SIGNAL
        clamp[0, which], clamp[1, which], clamp[2, which] = value_of(row, time), rate_of(row, time), curvature_of(row, time)
    known = switches[POINTS] - guides - 1
    for load in range(known):
        row = rows[row_at(rows, offsets, LOAD_SIGNAL + load, middle)]
        forces[guides + load], force_rates[load] = value_of(row, time), rate_of(row, time)
    set_tip_force(arrays, middle, known, course, forces, force_rates)


@inner
def set_tip_force(arrays, middle, known, course, forces, force_rates):
    """Set the sum of the tip loads and its rate behind the ``known`` other loads."""
    rows, offsets, switches = floats_2(arrays, SIGNALS), integers_1(arrays, SIGNAL_ENDS), integers_1(arrays, SWITCH)
    layers, bevel = floats_2(arrays, LAYER), floats_1(arrays, BEVEL)
    modulus, time = 0.0, course[TIME]
    for number in range(layers.shape[0] - 1, -1, -1):
        if course[OWN_SIDE] >= layers[number, LAYER_START] and course[OWN_SIDE] < layers[number, LAYER_END]:
            modulus = layers[number, MODULUS]
    total, total_rate = 0.0, 0.0
    for tip in range(switches[TIPS]):
        one = rows[row_at(rows, offsets, LOAD_SIGNAL + known + 2 * tip, middle)]
        other = rows[row_at(rows, offsets, LOAD_SIGNAL + known + 2 * tip + 1, middle)]
        scale = 1.0 if np.isnan(bevel[tip]) else bevel[tip] * modulus
        total += scale * value_of(one, time) * value_of(other, time)
        total_rate += scale * (rate_of(one, time) * value_of(other, time) + value_of(one, time) * rate_of(other, time))
    forces[switches[GUIDES] + known], force_rates[known] = total, total_rate


@inner
def prepare_matrices(arrays, at, changed):
    """Form the matrices of an instant, and mark blocks that are others than before."""
    switches, numbers, layers = integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), floats_2(arrays, LAYER)
    nodes, coef, quad, shape = (
        floats_1(arrays, PIECE_NODES),
        floats_3(arrays, COEFFICIENTS),
        floats_2(arrays, RULE),
        floats_2(arrays, SHAPE),
    )
    course, tissue, covered = floats_2(arrays, COURSES)[at], floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at]
    if switches[STRIDE]:
        units, fresh = floats_4(arrays, UNIT), floats_2(arrays, FRESH)
        cover_elements(course, nodes, coef, quad, units, switches, numbers, layers, tissue, covered, fresh, shape, changed)
        return
    if switches[GIVEN]:
        if covered[0, 0] != course[DEPTH] or covered[0, 1] != course[TIME]:
            covered[0, 0], covered[0, 1], changed[0] = course[DEPTH], course[TIME], 1
            ask(integers_1(arrays, ASKED)[0], at, ASK_MATRICES)
        return
    sums = floats_4(arrays, UNIT_SUMS)
    if switches[FRAME] == FIXED and not (covered[0, 0] == course[DEPTH] and covered[0, 1] == course[SIDE]):
        grow(course, nodes, coef, quad, sums, switches, numbers, shape, floats_5(arrays, BEAM)[at, 0])
    cover_functions(course, nodes, coef, quad, sums, switches, numbers, layers, tissue, covered, shape, changed)


@inner
def prepare_points(arrays, at):
    """Set the points of an instant; a model that is asked has set them with its matrices."""
    if integers_1(arrays, SWITCH)[GIVEN]:
        return
    set_points(
        floats_2(arrays, COURSES)[at], floats_1(arrays, PIECE_NODES), floats_3(arrays, COEFFICIENTS), integers_1(arrays, SWITCH),
        floats_1(arrays, NUMBER), floats_1(arrays, POSITION), floats_2(arrays, SHAPE), floats_3(arrays, POINT_ROWS)[at],
        floats_3(arrays, POINT_RATES)[at], integers_2(arrays, POINT_FIRST)[at], floats_3(arrays, POINT_PLACES)[at],
        floats_3(arrays, FLEXIBLE)[at], floats_3(arrays, FLEXIBLE_RATE)[at],
    )  # fmt: skip


@inner
def beam_at(beam, at):
    """Return which of the beam's matrices (*, B, 4, m, m) belong to an instant: the only ones, or those of a grown beam."""
    return at if beam.shape[0] > 1 else 0


@inner
def mark_new(h, switches, course, covered, changed, key):
    """Mark blocks whose part of the step's matrix is another than before; returns the last of them, -1 without one.

    ``key``: length, speeds, factors and stretches of the matrices that stand there (7,).
    """
    every = key[0] != h or key[5] != course[0, STRETCH] or key[6] != course[1, STRETCH]
    moved = key[1] != course[0, SPEED] or key[2] != course[1, SPEED]
    swollen = key[3] != course[0, FACTOR] or key[4] != course[1, FACTOR]
    every = every or (moved and switches[FRAME] != 0)
    key[0] = h
    for s in range(2):
        key[1 + s], key[3 + s], key[5 + s] = course[s, SPEED], course[s, FACTOR], course[s, STRETCH]
    last = -1
    for block in range(len(changed)):
        if every:
            changed[block] = 1
        elif swollen or moved:
            for s in range(2):
                if covered[s, block, 2] != 0.0 or (swollen and covered[s, block, 0] != 0.0) or covered[s, block, 1] != 0.0:
                    changed[block] = 1
        if changed[block]:
            last = block
    return last
