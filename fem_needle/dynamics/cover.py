"""Which part of which piece of the needle lies in which layer, and the tissue's matrices that follow.

    G = sum over layers k integral psi_i psi_j,  C with c,  D = integral c x^p psi_i psi_j',  E = integral c x^2p psi_i' psi_j'

over the part of the line that is in the layer. Whole pieces take their integrals; parts of pieces that an end cuts are
integrated by Gauss's rule, exactly. This is the only place where a foundation modulus meets a shape.
"""

from __future__ import annotations

from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.names import (
    BENDING,
    BENDING_STIFFNESS,
    CENTRIFUGAL,
    CONVECTED,
    CONVECTION,
    DAMPING,
    DEPTH,
    DRAG,
    FIXED,
    FRAME,
    LAYER_END,
    LAYER_START,
    LENGTH,
    MASS,
    MASS_PER_LENGTH,
    MATERIAL,
    MODULUS,
    SIDE,
    SLIP,
    STRETCH,
    STRETCHED,
    STRIDE,
    TIP_STIFFNESS,
    TISSUE,
    UNIT_BENDING,
    UNIT_DRAG,
    UNIT_MASS,
    UNIT_SLIP,
    VISCOSITY,
    VISCOUS,
)


@inner
def locate(nodes, x):
    """Return the piece that holds a place."""
    low, high = 0, len(nodes) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@inner
def place_of(y, depth, frame, length):
    """Return the place on the shapes of a point of the inserted part at y."""
    if frame == MATERIAL:
        return min(max(y + (length - depth), 0.0), length)
    if frame == STRETCHED:
        return min(max(y / depth, 0.0), 1.0)
    return min(max(y, 0.0), depth)


@inner
def tip_place(depth, frame, length):
    """Return the tip's place on the shapes."""
    if frame == MATERIAL:
        return length
    return 1.0 if frame == STRETCHED else depth


@inner
def place_rate(y, depth, frame):
    """Return how fast the place of a fixed y moves on the shapes with the depth."""
    if frame == MATERIAL:
        return -1.0
    return -y / (depth * depth) if frame == STRETCHED else 0.0


@inner
def shapes_at(coef, nodes, piece, x, out):
    """Set the shapes of a piece at a place, their slopes and their curvatures (3, m)."""
    size = nodes[piece + 1] - nodes[piece]
    place = min(max((x - nodes[piece]) / size, 0.0), 1.0)
    for i in range(coef.shape[1]):
        value, slope, bend = 0.0, 0.0, 0.0
        for power in range(coef.shape[2] - 1, -1, -1):
            bend = bend * place + slope
            slope = slope * place + value
            value = value * place + coef[piece, i, power]
        out[0, i], out[1, i], out[2, i] = value, slope / size, 2.0 * bend / (size * size)


@inner
def layer_ends(layer, course, frame, length):
    """Return where a layer that the tip has entered begins and ends on the shapes."""
    depth = course[DEPTH]
    last = tip_place(depth, frame, length)
    if course[SIDE] > layer[LAYER_END]:
        last = place_of(layer[LAYER_END], depth, frame, length)
    return place_of(layer[LAYER_START], depth, frame, length), last


@inner
def add_part(a, b, piece, k, c, power, coef, nodes, quad, shape, matrices):
    """Add the integrals over a part of a piece to its block's tissue matrices (4, m, m)."""
    m = coef.shape[1]
    for point in range(quad.shape[1]):
        x = a + (b - a) * quad[0, point]
        weight = (b - a) * quad[1, point]
        shapes_at(coef, nodes, piece, x, shape)
        moves = x if power else 1.0
        for i in range(m):
            share = weight * shape[0, i]
            for j in range(m):
                matrices[TISSUE, i, j] += k * share * shape[0, j]
        if c != 0.0:
            for i in range(m):
                share, slip = c * weight * shape[0, i], c * weight * moves * moves * shape[1, i]
                for j in range(m):
                    matrices[DAMPING, i, j] += share * shape[0, j]
                    matrices[DRAG, i, j] += share * moves * shape[1, j]
                    matrices[SLIP, i, j] += slip * shape[1, j]


@inner
def mark_pieces(course, nodes, switches, numbers, layers, fresh):
    """Set what each piece holds: the sum of k and of c of whole ones, and whether it is cut (P, 3)."""
    frame, pieces, viscous = switches[FRAME], len(nodes) - 1, switches[VISCOUS]
    for piece in range(pieces):
        fresh[piece, 0], fresh[piece, 1], fresh[piece, 2] = 0.0, 0.0, 0.0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[SIDE] > layer[LAYER_START]:
            continue
        start, end = layer_ends(layer, course, frame, numbers[LENGTH])
        for piece in range(locate(nodes, start), pieces):
            a, b = max(start, nodes[piece]), min(end, nodes[piece + 1])
            if a >= end:
                break
            if a == nodes[piece] and b == nodes[piece + 1]:
                fresh[piece, 0] += layer[MODULUS]
                fresh[piece, 1] += layer[VISCOSITY] * viscous
            elif b > a:
                fresh[piece, 2] = 1.0
    if numbers[TIP_STIFFNESS] != 0.0:
        fresh[pieces - 1, 2] = 1.0


@inner
def whole_block(k, c, units, matrices):
    """Set a block's tissue matrices to those of a piece that lies in tissue altogether."""
    m = units.shape[1]
    for i in range(m):
        for j in range(m):
            matrices[TISSUE, i, j] = k * units[UNIT_MASS, i, j]
            matrices[DAMPING, i, j] = c * units[UNIT_MASS, i, j]
            matrices[DRAG, i, j] = c * units[UNIT_DRAG, i, j]
            matrices[SLIP, i, j] = c * units[UNIT_SLIP, i, j]


@inner
def add_parts(course, nodes, coef, quad, switches, numbers, layers, shape, matrices):
    """Add the parts of cut pieces, and a spring at the tip, to the blocks' tissue matrices (B, 4, m, m)."""
    frame, pieces, stride = switches[FRAME], len(nodes) - 1, switches[STRIDE]
    power = 1 if frame == STRETCHED else 0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[SIDE] > layer[LAYER_START]:
            continue
        k, c = layer[MODULUS], layer[VISCOSITY] * switches[VISCOUS]
        start, end = layer_ends(layer, course, frame, numbers[LENGTH])
        for piece in range(locate(nodes, start), pieces):
            a, b = max(start, nodes[piece]), min(end, nodes[piece + 1])
            if a >= end:
                break
            if b > a and not (a == nodes[piece] and b == nodes[piece + 1]):
                block = piece if stride else 0
                add_part(a, b, piece, k, c, power, coef, nodes, quad, shape, matrices[block])
    if numbers[TIP_STIFFNESS] != 0.0:
        tip = tip_place(course[DEPTH], frame, numbers[LENGTH])
        piece, k = locate(nodes, tip), numbers[TIP_STIFFNESS] / course[STRETCH]  # the spring itself is not stretched
        shapes_at(coef, nodes, piece, tip, shape)
        block = piece if stride else 0
        for i in range(coef.shape[1]):
            for j in range(coef.shape[1]):
                matrices[block, TISSUE, i, j] += k * shape[0, i] * shape[0, j]


@inner
def cover_elements(course, nodes, coef, quad, units, switches, numbers, layers, matrices, covered, fresh, shape, changed):
    """Form the tissue matrices of elements (B, 4, m, m) where they differ from those formed before, and mark these."""
    mark_pieces(course, nodes, switches, numbers, layers, fresh)
    for piece in range(len(nodes) - 1):
        old, new = covered[piece], fresh[piece]
        if new[2] != 0.0 or old[2] != 0.0 or old[0] != new[0] or old[1] != new[1]:
            changed[piece] = 1
            whole_block(new[0], new[1], units[piece], matrices[piece])
            old[0], old[1], old[2] = new[0], new[1], new[2]
    add_parts(course, nodes, coef, quad, switches, numbers, layers, shape, matrices)


@inner
def add_sums(first, last, factor, sums, kind, matrix):
    """Add the integrals of whole pieces, first <= piece < last, from the sums up to each node (P + 1, 4, m, m)."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] += factor * (sums[last, kind, i, j] - sums[first, kind, i, j])


@inner
def cover_functions(course, nodes, coef, quad, sums, switches, numbers, layers, matrices, covered, shape, changed):
    """Form the tissue matrices (1, 4, n, n) of functions that live on all pieces."""
    frame, pieces = switches[FRAME], len(nodes) - 1
    if covered[0, 0] == course[DEPTH] and covered[0, 1] == course[SIDE]:
        return
    changed[0] = 1
    covered[0, 0], covered[0, 1] = course[DEPTH], course[SIDE]
    matrices[0, :, :, :] = 0.0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[SIDE] > layer[LAYER_START]:
            continue
        start, end = layer_ends(layer, course, frame, numbers[LENGTH])
        first, last = locate(nodes, start), locate(nodes, end)
        first += 1 if nodes[first] < start else 0
        last += 1 if last + 1 == pieces and nodes[pieces] <= end else 0
        if last > first:
            c = layer[VISCOSITY] * switches[VISCOUS]
            add_sums(first, last, layer[MODULUS], sums, UNIT_MASS, matrices[0, TISSUE])
            if c != 0.0:
                add_sums(first, last, c, sums, UNIT_MASS, matrices[0, DAMPING])
                add_sums(first, last, c, sums, UNIT_DRAG, matrices[0, DRAG])
                add_sums(first, last, c, sums, UNIT_SLIP, matrices[0, SLIP])
    add_parts(course, nodes, coef, quad, switches, numbers, layers, shape, matrices)
    if frame == FIXED:  # its shapes rest with the tissue
        matrices[0, DRAG:, :, :] = 0.0


@inner
def grow(course, nodes, coef, quad, sums, switches, numbers, shape, matrices):
    """Form the beam's own matrices M, K, S, R (4, n, n) of functions of y that the needle grows along, 0 <= y <= depth."""
    depth, rho, bending = course[DEPTH], numbers[MASS_PER_LENGTH], numbers[BENDING_STIFFNESS]
    piece, convected = locate(nodes, depth), 1.0 if switches[CONVECTED] else 0.0
    matrices[:, :, :] = 0.0
    add_sums(0, piece, rho, sums, UNIT_MASS, matrices[MASS])
    add_sums(0, piece, bending, sums, UNIT_BENDING, matrices[BENDING])
    add_sums(0, piece, rho * convected, sums, UNIT_DRAG, matrices[CONVECTION])
    add_sums(0, piece, rho * convected, sums, UNIT_SLIP, matrices[CENTRIFUGAL])
    size, m = depth - nodes[piece], coef.shape[1]
    for point in range(quad.shape[1]):
        weight = size * quad[1, point]
        shapes_at(coef, nodes, piece, nodes[piece] + size * quad[0, point], shape)
        for i in range(m):
            value, slope, bend = rho * weight * shape[0, i], rho * weight * shape[1, i], bending * weight * shape[2, i]
            for j in range(m):
                matrices[MASS, i, j] += value * shape[0, j]
                matrices[BENDING, i, j] += bend * shape[2, j]
                matrices[CONVECTION, i, j] += convected * value * shape[1, j]
                matrices[CENTRIFUGAL, i, j] += convected * slope * shape[1, j]
