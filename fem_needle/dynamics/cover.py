"""Which part of which piece of the needle lies in which layer, and the tissue's matrices that follow.

    G = sum over layers k integral psi_i psi_j,  C with c,  D = integral c x^p psi_i psi_j',  E = integral c x^2p psi_i' psi_j'

over the part of the line that is in the layer. Whole pieces take their integrals; parts of pieces that an end cuts are
integrated by Gauss's rule, exactly. This is the only place where a foundation modulus meets a shape.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.compilation import inner


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
    if frame == ix.MATERIAL:
        return min(max(y + (length - depth), 0.0), length)
    if frame == ix.STRETCHED:
        return min(max(y / depth, 0.0), 1.0)
    return min(max(y, 0.0), depth)


@inner
def tip_place(depth, frame, length):
    """Return the tip's place on the shapes."""
    if frame == ix.MATERIAL:
        return length
    return 1.0 if frame == ix.STRETCHED else depth


@inner
def place_rate(y, depth, frame):
    """Return how fast the place of a fixed y moves on the shapes with the depth."""
    if frame == ix.MATERIAL:
        return -1.0
    return -y / (depth * depth) if frame == ix.STRETCHED else 0.0


@inner
def values_at(coef, nodes, piece, x, out):
    """Set the shapes of a piece at a place, out[0] (m,)."""
    place = min(max((x - nodes[piece]) / (nodes[piece + 1] - nodes[piece]), 0.0), 1.0)
    for i in range(coef.shape[1]):
        value = 0.0
        for power in range(coef.shape[2] - 1, -1, -1):
            value = value * place + coef[piece, i, power]
        out[0, i] = value


@inner
def slopes_at(coef, nodes, piece, x, out):
    """Set the shapes of a piece at a place, and their slopes, out[:2] (2, m)."""
    size = nodes[piece + 1] - nodes[piece]
    place = min(max((x - nodes[piece]) / size, 0.0), 1.0)
    for i in range(coef.shape[1]):
        value, slope = 0.0, 0.0
        for power in range(coef.shape[2] - 1, -1, -1):
            slope = slope * place + value
            value = value * place + coef[piece, i, power]
        out[0, i], out[1, i] = value, slope / size


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
    depth = course[ix.DEPTH]
    last = tip_place(depth, frame, length)
    if course[ix.SIDE] > layer[ix.LAYER_END]:
        last = place_of(layer[ix.LAYER_END], depth, frame, length)
    return place_of(layer[ix.LAYER_START], depth, frame, length), last


@inner
def add_part(a, b, piece, k, c, power, coef, nodes, quad, shape, matrices):
    """Add the integrals over a part of a piece to its block's tissue matrices (4, m, m)."""
    m = coef.shape[1]
    for point in range(quad.shape[1]):
        x = a + (b - a) * quad[0, point]
        weight = (b - a) * quad[1, point]
        if c == 0.0:
            values_at(coef, nodes, piece, x, shape)
        else:
            slopes_at(coef, nodes, piece, x, shape)
        moves = x if power else 1.0
        for i in range(m):
            share = weight * shape[0, i]
            for j in range(m):
                matrices[ix.TISSUE, i, j] += k * share * shape[0, j]
        if c != 0.0:
            for i in range(m):
                share, slip = c * weight * shape[0, i], c * weight * moves * moves * shape[1, i]
                for j in range(m):
                    matrices[ix.DAMPING, i, j] += share * shape[0, j]
                    matrices[ix.DRAG, i, j] += share * moves * shape[1, j]
                    matrices[ix.SLIP, i, j] += slip * shape[1, j]


@inner
def mark_pieces(course, nodes, switches, numbers, layers, fresh):
    """Set what each piece holds: the sum of k and of c of whole ones, and whether it is cut (P, 3)."""
    frame, pieces, viscous = switches[ix.FRAME], len(nodes) - 1, switches[ix.VISCOUS]
    for piece in range(pieces):
        fresh[piece, 0], fresh[piece, 1], fresh[piece, 2] = 0.0, 0.0, 0.0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[ix.SIDE] > layer[ix.LAYER_START]:
            continue
        start, end = layer_ends(layer, course, frame, numbers[ix.LENGTH])
        for piece in range(locate(nodes, start), pieces):
            a, b = max(start, nodes[piece]), min(end, nodes[piece + 1])
            if a >= end:
                break
            if a == nodes[piece] and b == nodes[piece + 1]:
                fresh[piece, 0] += layer[ix.MODULUS]
                fresh[piece, 1] += layer[ix.VISCOSITY] * viscous
            elif b > a:
                fresh[piece, 2] = 1.0
    if numbers[ix.TIP_STIFFNESS] != 0.0:
        fresh[pieces - 1, 2] = 1.0


@inner
def whole_block(k, c, units, matrices):
    """Set a block's tissue matrices to those of a piece that lies in tissue altogether."""
    m = units.shape[1]
    for i in range(m):
        for j in range(m):
            matrices[ix.TISSUE, i, j] = k * units[ix.UNIT_MASS, i, j]
            matrices[ix.DAMPING, i, j] = c * units[ix.UNIT_MASS, i, j]
            matrices[ix.DRAG, i, j] = c * units[ix.UNIT_DRAG, i, j]
            matrices[ix.SLIP, i, j] = c * units[ix.UNIT_SLIP, i, j]


@inner
def add_parts(course, nodes, coef, quad, switches, numbers, layers, shape, matrices):
    """Add the parts of cut elements, and a spring at the tip, to the elements' tissue matrices (B, 4, m, m)."""
    frame, pieces = switches[ix.FRAME], len(nodes) - 1
    power = 1 if frame == ix.STRETCHED else 0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[ix.SIDE] > layer[ix.LAYER_START]:
            continue
        k, c = layer[ix.MODULUS], layer[ix.VISCOSITY] * switches[ix.VISCOUS]
        start, end = layer_ends(layer, course, frame, numbers[ix.LENGTH])
        for piece in range(locate(nodes, start), pieces):
            a, b = max(start, nodes[piece]), min(end, nodes[piece + 1])
            if a >= end:
                break
            if b > a and not (a == nodes[piece] and b == nodes[piece + 1]):
                add_part(a, b, piece, k, c, power, coef, nodes, quad, shape, matrices[piece])
    add_tip_spring(course, nodes, coef, switches, numbers, shape, matrices)


@inner
def add_tip_spring(course, nodes, coef, switches, numbers, shape, matrices):
    """Add a spring at the tip to the tissue's matrix of its block."""
    if numbers[ix.TIP_STIFFNESS] == 0.0:
        return
    tip = tip_place(course[ix.DEPTH], switches[ix.FRAME], numbers[ix.LENGTH])
    piece, k = locate(nodes, tip), numbers[ix.TIP_STIFFNESS] / course[ix.STRETCH]  # the spring itself is not stretched
    values_at(coef, nodes, piece, tip, shape)
    block = piece if switches[ix.STRIDE] else 0
    for i in range(coef.shape[1]):
        for j in range(coef.shape[1]):
            matrices[block, ix.TISSUE, i, j] += k * shape[0, i] * shape[0, j]


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
def add_sums(piece, factor, sums, kind, matrix):
    """Add the integrals of all pieces before one, from the sums up to each node (P + 1, 4, m, m)."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] += factor * sums[piece, kind, i, j]


@inner
def add_up_to(x, k, c, frame, nodes, coef, quad, sums, shape, matrices):
    """Add k and c times the integrals from the start of the line to a place to the tissue matrices (4, n, n)."""
    piece = locate(nodes, x)
    ends = x >= nodes[piece + 1]  # by rounding also beyond the last node
    if ends:
        piece += 1
    add_sums(piece, k, sums, ix.UNIT_MASS, matrices[ix.TISSUE])
    if c != 0.0:
        add_sums(piece, c, sums, ix.UNIT_MASS, matrices[ix.DAMPING])
        add_sums(piece, c, sums, ix.UNIT_DRAG, matrices[ix.DRAG])
        add_sums(piece, c, sums, ix.UNIT_SLIP, matrices[ix.SLIP])
    if not ends and x > nodes[piece]:
        add_part(nodes[piece], x, piece, k, c, 1 if frame == ix.STRETCHED else 0, coef, nodes, quad, shape, matrices)


@inner
def cover_functions(course, nodes, coef, quad, sums, switches, numbers, layers, matrices, covered, shape, changed):
    """Form the tissue matrices (1, 4, n, n) of functions that live on all pieces: what k and c jump by at each end of a layer."""
    frame = switches[ix.FRAME]
    if covered[0, 0] == course[ix.DEPTH] and covered[0, 1] == course[ix.SIDE]:
        return
    changed[0] = 1
    covered[0, 0], covered[0, 1] = course[ix.DEPTH], course[ix.SIDE]
    matrices[0, :, :, :] = 0.0
    behind, k, c = 0.0, 0.0, 0.0  # the end of the layer before
    for number in range(layers.shape[0]):
        layer = layers[number]
        if not course[ix.SIDE] > layer[ix.LAYER_START]:
            continue
        start, end = layer_ends(layer, course, frame, numbers[ix.LENGTH])
        if behind != start:
            add_up_to(behind, k, c, frame, nodes, coef, quad, sums, shape, matrices[0])
            k, c = 0.0, 0.0
        next_k, next_c = layer[ix.MODULUS], layer[ix.VISCOSITY] * switches[ix.VISCOUS]
        add_up_to(start, k - next_k, c - next_c, frame, nodes, coef, quad, sums, shape, matrices[0])
        behind, k, c = end, next_k, next_c
    add_up_to(behind, k, c, frame, nodes, coef, quad, sums, shape, matrices[0])
    add_tip_spring(course, nodes, coef, switches, numbers, shape, matrices)
    if frame == ix.FIXED:  # its shapes rest with the tissue
        matrices[0, ix.DRAG :, :, :] = 0.0


@inner
def grow(course, nodes, coef, quad, sums, switches, numbers, shape, matrices):
    """Form the beam's own matrices M, K, S, R (4, n, n) of functions of y that the needle grows along, 0 <= y <= depth."""
    depth, rho, bending = course[ix.DEPTH], numbers[ix.MASS_PER_LENGTH], numbers[ix.BENDING_STIFFNESS]
    piece, convected = locate(nodes, depth), 1.0 if switches[ix.CONVECTED] else 0.0
    matrices[:, :, :] = 0.0
    add_sums(piece, rho, sums, ix.UNIT_MASS, matrices[ix.MASS])
    add_sums(piece, bending, sums, ix.UNIT_BENDING, matrices[ix.BENDING])
    add_sums(piece, rho * convected, sums, ix.UNIT_DRAG, matrices[ix.CONVECTION])
    add_sums(piece, rho * convected, sums, ix.UNIT_SLIP, matrices[ix.CENTRIFUGAL])
    size, m = depth - nodes[piece], coef.shape[1]
    for point in range(quad.shape[1]):
        weight = size * quad[1, point]
        shapes_at(coef, nodes, piece, nodes[piece] + size * quad[0, point], shape)
        for i in range(m):
            value, slope, bend = rho * weight * shape[0, i], rho * weight * shape[1, i], bending * weight * shape[2, i]
            for j in range(m):
                matrices[ix.MASS, i, j] += value * shape[0, j]
                matrices[ix.BENDING, i, j] += bend * shape[2, j]
                matrices[ix.CONVECTION, i, j] += convected * value * shape[1, j]
                matrices[ix.CENTRIFUGAL, i, j] += convected * slope * shape[1, j]
