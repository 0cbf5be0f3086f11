"""The forces of a state: the rate of the momentum, P' = v S' q' + v^2 R q - (K + m G) q - C q' - v D q + m H + N' P.

This is the only place where they are added up: steps, equilibria, reactions and works take them from here.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.products import add_covered, add_product, add_transposed


@inner
def add_tissue_forces(course, tissue, covered, switches, q, rate, out):
    """Add - (m G q + C q' + v D q)."""
    stride, speed = switches[ix.STRIDE], course[ix.SPEED]
    add_covered(tissue, ix.TISSUE, covered, stride, -course[ix.FACTOR] * course[ix.STRETCH], q, out)
    if switches[ix.VISCOUS]:
        add_covered(tissue, ix.DAMPING, covered, stride, -course[ix.STRETCH], rate, out)
        if speed != 0.0:
            add_covered(tissue, ix.DRAG, covered, stride, speed, q, out)


@inner
def add_inertial_forces(course, constants, switches, q, rate, out):
    """Add v S' q' + v^2 R q."""
    speed, stride = course[ix.SPEED], switches[ix.STRIDE]
    if switches[ix.INERTIA] and switches[ix.CONVECTED] and speed != 0.0:
        add_transposed(constants, ix.CONVECTION, stride, speed, rate, out)
        add_product(constants, ix.CENTRIFUGAL, stride, speed * speed / course[ix.STRETCH], q, out)


@inner
def add_bending(course, constants, switches, q, out):
    """Add - K q of functions that live on the whole needle, of elements that of the bubbles alone: the sweep has the rest."""
    stretch, stride = course[ix.STRETCH], switches[ix.STRIDE]
    bend = 1.0 / (stretch * stretch * stretch)
    if stride == 0:
        add_product(constants, ix.BENDING, 0, -bend, q, out)
    elif constants.shape[2] == 5:
        for block in range(constants.shape[0]):
            out[stride * block + 2] -= bend * constants[block, ix.BENDING, 2, 2] * q[stride * block + 2]


@inner
def add_mistakes(errors, switches, q, rate, out):
    """Add - X q - Y q' of equations that were printed wrong."""
    if switches[ix.PRINTED]:
        for i in range(errors.shape[1]):
            for j in range(errors.shape[1]):
                out[i] -= errors[0, i, j] * q[j] + errors[1, i, j] * rate[j]


@inner
def add_momentum(scale, course, constants, switches, q, rate, out):
    """Add a multiple of P = M q' + v S q."""
    if switches[ix.INERTIA]:
        add_product(constants, ix.MASS, switches[ix.STRIDE], scale * course[ix.STRETCH], rate, out)
        if switches[ix.CONVECTED] and course[ix.SPEED] != 0.0:
            add_product(constants, ix.CONVECTION, switches[ix.STRIDE], scale * course[ix.SPEED], q, out)


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
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)
    beam, tissue = beams[beam_at(beams, at), 0], floats_5(arrays, ix.TISSUE_BLOCKS)[at, 0]
    covered, load = floats_3(arrays, ix.COVERED)[at, 0], floats_2(arrays, ix.PATH_LOAD)[at]
    rows, first, forces = (
        floats_3(arrays, ix.POINT_ROWS)[at],
        integers_2(arrays, ix.POINT_FIRST)[at],
        floats_2(arrays, ix.FORCES)[at],
    )
    stretch, speed = course[ix.STRETCH], course[ix.SPEED]
    bend, is_inside = 1.0 / (stretch * stretch * stretch), covered[0] != 0.0 or covered[1] != 0.0 or covered[2] != 0.0
    for c in range(2):
        total = course[ix.FACTOR] * load[c]
        for j in range(beam.shape[1]):
            total -= bend * beam[ix.BENDING, c, j] * q[j]
            if switches[ix.INERTIA] and switches[ix.CONVECTED]:
                total += speed * beam[ix.CONVECTION, j, c] * rate[j]
                total += speed * speed / stretch * beam[ix.CENTRIFUGAL, c, j] * q[j]
            if is_inside:
                total -= course[ix.FACTOR] * stretch * tissue[ix.TISSUE, c, j] * q[j]
                total -= stretch * tissue[ix.DAMPING, c, j] * rate[j] - speed * tissue[ix.DRAG, c, j] * q[j]
        out[c] = total
    for point in range(rows.shape[0]):
        for c in range(2):
            if first[point] == 0:
                out[c] += forces[point] * rows[point, c]
