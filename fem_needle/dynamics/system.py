"""The matrices of an equilibrium and of a time step, block by block.

Equilibrium: K + m G. Step, with the increments x_s of the coordinates at both stages, A^-1 of the method and the step's length h:

    sum_o [ sum_j A^-1_sj A^-1_jo / h^2 M_j + A^-1_so / h (C_s - v_s S_s' + v_o S_o) + delta_so (K + m G + v D - v^2 R)_s ] x_o

Bending of elements is left to `fem_needle.dynamics.sweep`, but for the bubble's.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.compilation import inner


@inner
def fill_rest(block, course, constants, tissue, switches, matrix):
    """Set a block's K + m G (m, m)."""
    m, stretch = constants.shape[2], course[ix.STRETCH]
    bend, support = 1.0 / (stretch * stretch * stretch), course[ix.FACTOR] * stretch
    for i in range(m):
        for j in range(m):
            matrix[i, j] = support * tissue[block, ix.TISSUE, i, j]
            if switches[ix.STRIDE] == 0:
                matrix[i, j] += bend * constants[block, ix.BENDING, i, j]
    if switches[ix.STRIDE] and m == 5:
        matrix[2, 2] += bend * constants[block, ix.BENDING, 2, 2]


@inner
def fill_step(block, h, inverse, course, first, second, tissue, is_covered, switches, matrix):
    """Set a block's matrix (2 m, 2 m) of a step; ``first``, ``second``: the beam's matrices (B, 4, m, m) at the nodes."""
    m, full = first.shape[2], switches[ix.STRIDE] == 0
    for s in range(2):
        for o in range(2):
            mass0 = inverse[s, 0] * inverse[0, o] / (h * h) * course[0, ix.STRETCH] * switches[ix.INERTIA]
            mass1 = inverse[s, 1] * inverse[1, o] / (h * h) * course[1, ix.STRETCH] * switches[ix.INERTIA]
            slope = inverse[s, o] / h
            for i in range(m):
                for j in range(m):
                    value = mass0 * first[block, ix.MASS, i, j] + mass1 * second[block, ix.MASS, i, j]
                    matrix[2 * i + 1 - s, 2 * j + 1 - o] = value
            if is_covered:
                add_tissue(m, s, o, slope, course[s], tissue[s, block], matrix)
    if switches[ix.CONVECTED] and switches[ix.INERTIA]:
        add_convection(m, h, inverse, course, first[block], second[block], matrix)
    for s in range(2):
        beam, stretch = first if s == 0 else second, course[s, ix.STRETCH]
        bend = 1.0 / (stretch * stretch * stretch)
        if full:
            for i in range(m):
                for j in range(m):
                    matrix[2 * i + 1 - s, 2 * j + 1 - s] += bend * beam[block, ix.BENDING, i, j]
        elif m == 5:
            matrix[5 - s, 5 - s] += bend * beam[block, ix.BENDING, 2, 2]


@inner
def add_tissue(m, s, o, slope, course, tissue, matrix):
    """Add C over the step's length and, on the diagonal, m G + v D."""
    damping = slope * course[ix.STRETCH]
    for i in range(m):
        for j in range(m):
            value = damping * tissue[ix.DAMPING, i, j]
            if s == o:
                value += (
                    course[ix.FACTOR] * course[ix.STRETCH] * tissue[ix.TISSUE, i, j] - course[ix.SPEED] * tissue[ix.DRAG, i, j]
                )
            matrix[2 * i + 1 - s, 2 * j + 1 - o] += value


@inner
def add_convection(m, h, inverse, course, first, second, matrix):
    """Add v S, - v S' and, on the diagonal, - v^2 R."""
    for s in range(2):
        own, speed = first if s == 0 else second, course[s, ix.SPEED]
        spin = speed * speed / course[s, ix.STRETCH]
        for o in range(2):
            other, slope, ride = first if o == 0 else second, inverse[s, o] / h, course[o, ix.SPEED]
            for i in range(m):
                for j in range(m):
                    value = slope * (ride * other[ix.CONVECTION, i, j] - speed * own[ix.CONVECTION, j, i])
                    if s == o:
                        value -= spin * own[ix.CENTRIFUGAL, i, j]
                    matrix[2 * i + 1 - s, 2 * j + 1 - o] += value


@inner
def set_gaps(width, nodes, stride, known, gaps):
    """Set c = u_2 - T u_1 of the known coordinates (width, n) of every element (B, 2 width)."""
    for element in range(len(nodes) - 1):
        at, e = stride * element, nodes[element + 1] - nodes[element]
        for s in range(width):
            q = known[s]
            gaps[element, width - 1 - s] = q[at + stride] - q[at] - e * q[at + 1]
            gaps[element, 2 * width - 1 - s] = q[at + stride + 1] - q[at + 1]
