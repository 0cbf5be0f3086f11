"""An instant of a step: the insertion, the loads and the hub at its time, then all of the needle that depends on the depth."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.callback import ask
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import cover_elements, cover_functions, grow
from fem_needle.dynamics.points import set_points
from fem_needle.dynamics.resolve import resolve
from fem_needle.dynamics.signals import curvature_of, rate_of, row_at, value_of


@inner
def set_motion(time, middle, rows, offsets, course):
    """Set the motion of a prescribed insertion at a time; ``middle``: a time inside the step, whose rows hold at its ends too."""
    row = rows[row_at(rows, offsets, ix.DEPTH_SIGNAL, middle)]
    course[ix.TIME], course[ix.OWN_DEPTH] = time, value_of(row, time)
    course[ix.SPEED], course[ix.ACCELERATION] = rate_of(row, time), curvature_of(row, time)
    course[ix.OWN_SIDE] = value_of(row, middle)


@inner
def set_place(switches, numbers, course):
    """Set what follows from the depth: that of the matrices, not less than the smallest, and the stretch."""
    course[ix.DEPTH] = max(course[ix.OWN_DEPTH], numbers[ix.SMALLEST_DEPTH])
    course[ix.SIDE] = max(course[ix.OWN_SIDE], numbers[ix.SMALLEST_DEPTH])
    course[ix.STRETCH] = course[ix.DEPTH] if switches[ix.FRAME] == ix.STRETCHED else 1.0


@inner
def set_loads(arrays, at, middle):
    """Set factor, hub (value, rate, second rate of deflection and angle) and loads at an instant, behind the guides' forces.

    Tip loads are force times direction, of the bevel law a k(layer at the tip) m(t) times direction.
    """
    rows, offsets, switches = floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), integers_1(arrays, ix.SWITCH)
    course, clamp = floats_2(arrays, ix.COURSES)[at], floats_3(arrays, ix.CLAMP)[at]
    forces, force_rates = floats_2(arrays, ix.FORCES)[at], floats_2(arrays, ix.FORCE_RATES)[at]
    time, guides = course[ix.TIME], switches[ix.GUIDES]
    row = rows[row_at(rows, offsets, ix.FACTOR_SIGNAL, middle)]
    course[ix.FACTOR], course[ix.FACTOR_RATE] = value_of(row, time), rate_of(row, time)
    for number in range(ix.HUB_SIGNAL, ix.ANGLE_SIGNAL + 1):
        row, which = rows[row_at(rows, offsets, number, middle)], number - ix.HUB_SIGNAL
        clamp[0, which], clamp[1, which], clamp[2, which] = value_of(row, time), rate_of(row, time), curvature_of(row, time)
    known = switches[ix.POINTS] - guides - 1
    for load in range(known):
        row = rows[row_at(rows, offsets, ix.LOAD_SIGNAL + load, middle)]
        forces[guides + load], force_rates[load] = value_of(row, time), rate_of(row, time)
    set_tip_force(arrays, middle, known, course, forces, force_rates)


@inner
def set_tip_force(arrays, middle, known, course, forces, force_rates):
    """Set the sum of the tip loads and its rate behind the ``known`` other loads."""
    rows, offsets, switches = floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), integers_1(arrays, ix.SWITCH)
    layers, bevel = floats_2(arrays, ix.LAYER), floats_1(arrays, ix.BEVEL)
    modulus, time = 0.0, course[ix.TIME]
    for number in range(layers.shape[0] - 1, -1, -1):
        if course[ix.OWN_SIDE] >= layers[number, ix.LAYER_START] and course[ix.OWN_SIDE] < layers[number, ix.LAYER_END]:
            modulus = layers[number, ix.MODULUS]
    total, total_rate = 0.0, 0.0
    for tip in range(switches[ix.TIPS]):
        one = rows[row_at(rows, offsets, ix.LOAD_SIGNAL + known + 2 * tip, middle)]
        other = rows[row_at(rows, offsets, ix.LOAD_SIGNAL + known + 2 * tip + 1, middle)]
        scale = 1.0 if np.isnan(bevel[tip]) else bevel[tip] * modulus
        total += scale * value_of(one, time) * value_of(other, time)
        total_rate += scale * (rate_of(one, time) * value_of(other, time) + value_of(one, time) * rate_of(other, time))
    forces[switches[ix.GUIDES] + known], force_rates[known] = total, total_rate


@inner
def prepare_matrices(arrays, at, changed):
    """Form the matrices of an instant, and mark blocks that are others than before."""
    switches, numbers, layers = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_2(arrays, ix.LAYER)
    nodes, coef, quad, shape = (
        floats_1(arrays, ix.PIECE_NODES),
        floats_3(arrays, ix.COEFFICIENTS),
        floats_2(arrays, ix.RULE),
        floats_2(arrays, ix.SHAPE),
    )
    course, tissue, covered = (
        floats_2(arrays, ix.COURSES)[at],
        floats_5(arrays, ix.TISSUE_BLOCKS)[at],
        floats_3(arrays, ix.COVERED)[at],
    )
    if switches[ix.STRIDE]:
        units, fresh = floats_4(arrays, ix.UNIT), floats_2(arrays, ix.FRESH)
        cover_elements(course, nodes, coef, quad, units, switches, numbers, layers, tissue, covered, fresh, shape, changed)
        return
    if switches[ix.GIVEN]:
        if covered[0, 0] != course[ix.DEPTH] or covered[0, 1] != course[ix.TIME]:
            covered[0, 0], covered[0, 1], changed[0] = course[ix.DEPTH], course[ix.TIME], 1
            ask(integers_1(arrays, ix.ASKED)[0], at, ix.ASK_MATRICES)
        return
    sums = floats_4(arrays, ix.UNIT_SUMS)
    if switches[ix.FRAME] == ix.FIXED and not (covered[0, 0] == course[ix.DEPTH] and covered[0, 1] == course[ix.SIDE]):
        grow(course, nodes, coef, quad, sums, switches, numbers, shape, floats_5(arrays, ix.BEAM)[at, 0])
        if switches[ix.RESOLVES]:
            resolve(arrays, at)
    cover_functions(course, nodes, coef, quad, sums, switches, numbers, layers, tissue, covered, shape, changed)


@inner
def prepare_points(arrays, at):
    """Set the points of an instant; a model that is asked has set them with its matrices."""
    if integers_1(arrays, ix.SWITCH)[ix.GIVEN]:
        return
    set_points(
        floats_2(arrays, ix.COURSES)[at], floats_1(arrays, ix.PIECE_NODES), floats_3(arrays, ix.COEFFICIENTS),
        integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_1(arrays, ix.POSITION), floats_2(arrays, ix.SHAPE),
        floats_3(arrays, ix.POINT_ROWS)[at], floats_3(arrays, ix.POINT_RATES)[at], integers_2(arrays, ix.POINT_FIRST)[at],
        floats_3(arrays, ix.POINT_PLACES)[at], floats_3(arrays, ix.FLEXIBLE)[at], floats_3(arrays, ix.FLEXIBLE_RATE)[at],
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
    every = key[0] != h or key[5] != course[0, ix.STRETCH] or key[6] != course[1, ix.STRETCH]
    moved = key[1] != course[0, ix.SPEED] or key[2] != course[1, ix.SPEED]
    swollen = key[3] != course[0, ix.FACTOR] or key[4] != course[1, ix.FACTOR]
    every = every or (moved and switches[ix.FRAME] != 0)
    key[0] = h
    for s in range(2):
        key[1 + s], key[3 + s], key[5 + s] = course[s, ix.SPEED], course[s, ix.FACTOR], course[s, ix.STRETCH]
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
