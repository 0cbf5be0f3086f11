"""The forces of a state: the rate of the momentum, P' = v S' q' + v^2 R q - (K + m G) q - C q' - v D q + m H + N' P.

This is the only place where they are added up: steps, equilibria, reactions and works take them from here.
"""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.names import (
    BEAM,
    BENDING,
    CENTRIFUGAL,
    CONVECTED,
    CONVECTION,
    COURSES,
    COVERED,
    DAMPING,
    DRAG,
    FACTOR,
    FORCES,
    INERTIA,
    MASS,
    PATH_LOAD,
    POINT_FIRST,
    POINT_ROWS,
    PRINTED,
    SPEED,
    STRETCH,
    STRIDE,
    SWITCH,
    TISSUE,
    TISSUE_BLOCKS,
    VISCOUS,
)
from fem_needle.dynamics.products import add_covered, add_product, add_transposed


@inner
def add_tissue_forces(course, tissue, covered, switches, q, rate, out):
    """Add - (m G q + C q' + v D q)."""
    stride, speed = switches[STRIDE], course[SPEED]
    add_covered(tissue, TISSUE, covered, stride, -course[FACTOR] * course[STRETCH], q, out)
    if switches[VISCOUS]:
        add_covered(tissue, DAMPING, covered, stride, -course[STRETCH], rate, out)
        if speed != 0.0:
            add_covered(tissue, DRAG, covered, stride, speed, q, out)


@inner
def add_inertial_forces(course, constants, switches, q, rate, out):
    """Add v S' q' + v^2 R q."""
    speed, stride = course[SPEED], switches[STRIDE]
    if switches[INERTIA] and switches[CONVECTED] and speed != 0.0:
        add_transposed(constants, CONVECTION, stride, speed, rate, out)
        add_product(constants, CENTRIFUGAL, stride, speed * speed / course[STRETCH], q, out)


@inner
def add_bending(course, constants, switches, q, out):
    """Add - K q of functions that live on the whole needle, of elements that of the bubbles alone: the sweep has the rest."""
    stretch, stride = course[STRETCH], switches[STRIDE]
    bend = 1.0 / (stretch * stretch * stretch)
    if stride == 0:
        add_product(constants, BENDING, 0, -bend, q, out)
    elif constants.shape[2] == 5:
        for block in range(constants.shape[0]):
            out[stride * block + 2] -= bend * constants[block, BENDING, 2, 2] * q[stride * block + 2]


@inner
def add_mistakes(errors, switches, q, rate, out):
    """Add - X q - Y q' of equations that were printed wrong."""
    if switches[PRINTED]:
        for i in range(errors.shape[1]):
            for j in range(errors.shape[1]):
                out[i] -= errors[0, i, j] * q[j] + errors[1, i, j] * rate[j]


@inner
def add_momentum(scale, course, constants, switches, q, rate, out):
    """Add a multiple of P = M q' + v S q."""
    if switches[INERTIA]:
        add_product(constants, MASS, switches[STRIDE], scale * course[STRETCH], rate, out)
        if switches[CONVECTED] and course[SPEED] != 0.0:
            add_product(constants, CONVECTION, switches[STRIDE], scale * course[SPEED], q, out)


@inner
def add_point_forces(begin, rows, first, forces, out):
    """Add N' P of the points from ``begin`` on."""
    for point in range(begin, rows.shape[0]):
        if forces[point] != 0.0:
            for i in range(rows.shape[1]):
                out[first[point] + i] += forces[point] * rows[point, i]


@inner
def clamp_forces(arrays, at, q, rate, out):
    """Set the first two rows of P' at an instant, which the first block alone reaches; out (2,)."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_5(arrays, BEAM)
    beam, tissue = beams[beam_at(beams, at), 0], floats_5(arrays, TISSUE_BLOCKS)[at, 0]
    covered, load = floats_3(arrays, COVERED)[at, 0], floats_2(arrays, PATH_LOAD)[at]
    rows, first, forces = floats_3(arrays, POINT_ROWS)[at], integers_2(arrays, POINT_FIRST)[at], floats_2(arrays, FORCES)[at]
    stretch, speed = course[STRETCH], course[SPEED]
    bend, is_inside = 1.0 / (stretch * stretch * stretch), covered[0] != 0.0 or covered[1] != 0.0 or covered[2] != 0.0
    for c in range(2):
        total = course[FACTOR] * load[c]
        for j in range(beam.shape[1]):
            total -= bend * beam[BENDING, c, j] * q[j]
            if switches[INERTIA] and switches[CONVECTED]:
                total += speed * beam[CONVECTION, j, c] * rate[j]
                total += speed * speed / stretch * beam[CENTRIFUGAL, c, j] * q[j]
            if is_inside:
                total -= course[FACTOR] * stretch * tissue[TISSUE, c, j] * q[j]
                total -= stretch * tissue[DAMPING, c, j] * rate[j] - speed * tissue[DRAG, c, j] * q[j]
        out[c] = total
    for point in range(rows.shape[0]):
        for c in range(2):
            if first[point] == 0:
                out[c] += forces[point] * rows[point, c]
