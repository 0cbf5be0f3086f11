"""The path that the tip has cut, as the rest line r(y) of the tissue's springs: cubic pieces, and sums of their moments.

    H_i = sum over layers k integral r psi_i dy,  dH_i/dz = k r psi_i at the tip + integral k r psi_i' dx/dz dy,
    c = 1/2 sum k integral r^2

A piece of the line of shapes is a polynomial in y: with moments of r about any place its integral is exact. Moments of 2, 4, ...
pieces together are kept (a binary tree), so that a path of n pieces costs log n.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, integers_1
from fem_needle.dynamics.callback import ask
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import locate


@inner
def cubic_moments(cubic, a, b, out):
    """Set the integrals over a < x < b of a cubic in x times t^n, t = (x - a) / (b - a)."""
    span = b - a
    e0 = ((cubic[3] * a + cubic[2]) * a + cubic[1]) * a + cubic[0]
    e1 = ((3.0 * cubic[3] * a + 2.0 * cubic[2]) * a + cubic[1]) * span
    e2, e3 = (3.0 * cubic[3] * a + cubic[2]) * span * span, cubic[3] * span * span * span
    for n in range(len(out)):
        out[n] = span * (e0 / (n + 1) + e1 / (n + 2) + e2 / (n + 3) + e3 / (n + 4))


@inner
def shifted(moments, pascal, shift, scale, k):
    """Return the k-th moment in t' = shift + scale t of moments in t."""
    total, power = 0.0, 1.0
    for n in range(k, -1, -1):  # powers of the shift rise as those of t fall
        share = moments[n]
        for _ in range(n):
            share *= scale
        total += pascal[k, n] * power * share
        power *= shift
    return total


@inner
def squared(cubic, a, b):
    """Return the integral of the square of a cubic over a < x < b: seven terms, exact."""
    total = 0.0
    for i in range(4):
        for j in range(4):
            power = i + j + 1
            low, high = 1.0, 1.0
            for _ in range(power):
                low *= a
                high *= b
            total += cubic[i] * cubic[j] * (high - low) / power
    return total


@inner
def row_of_block(level, block):
    """Return where the moments of a block of 2^level pieces stand: the blocks of all levels, in the order of their middles."""
    return (block << (level + 1)) + (1 << level) - 1


@inner
def append_piece(end, cubic, count, edges, cubics, moments, squares, pascal):
    """Add a piece of the path and all blocks that it completes."""
    orders = moments.shape[1]
    span = end - edges[count]
    for i in range(4):
        cubics[count, i] = cubic[i]
    edges[count + 1] = end
    squares[count + 1] = squares[count] + squared(cubic, 0.0, span)
    cubic_moments(cubic, 0.0, span, moments[row_of_block(0, count)])
    level, block = 1, (count + 1) >> 1
    while (block << level) == count + 1 and block > 0:
        left, right = row_of_block(level - 1, 2 * block - 2), row_of_block(level - 1, 2 * block - 1)
        start, middle = edges[(block - 1) << level], edges[((2 * block - 1) << (level - 1))]
        whole = end - start
        target = moments[row_of_block(level, block - 1)]
        for k in range(orders):
            first = shifted(moments[left], pascal, 0.0, (middle - start) / whole, k)
            target[k] = first + shifted(moments[right], pascal, (middle - start) / whole, (end - middle) / whole, k)
        if block & 1:
            break
        level, block = level + 1, block >> 1


@inner
def add_moments(arrays, k, ya, yb, moments, piece, course, load, load_rate):
    """Add k integral r psi over ya < y < yb, inside one piece of the shapes, from the moments of r there."""
    nodes, coef, pascal = floats_1(arrays, ix.PIECE_NODES), floats_3(arrays, ix.COEFFICIENTS), floats_2(arrays, ix.PASCAL)
    switches, local = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.CUT_MOMENTS)[1]
    frame, depth, size = switches[ix.FRAME], course[ix.DEPTH], nodes[piece + 1] - nodes[piece]
    if frame == ix.MATERIAL:
        shift, scale = (ya + (floats_1(arrays, ix.NUMBER)[ix.LENGTH] - depth) - nodes[piece]) / size, (yb - ya) / size
    elif frame == ix.STRETCHED:
        shift, scale = (ya / depth - nodes[piece]) / size, (yb - ya) / (depth * size)
    else:
        shift, scale = (ya - nodes[piece]) / size, (yb - ya) / size
    orders, at = coef.shape[2], switches[ix.STRIDE] * piece
    for n in range(orders):
        local[n] = k * shifted(moments, pascal, shift, scale, n)
    for i in range(coef.shape[1]):
        total, slope = coef[piece, i, 0] * local[0], 0.0
        for n in range(1, orders):
            total += coef[piece, i, n] * local[n]
            moved = local[n - 1]
            if frame == ix.STRETCHED:
                moved = nodes[piece] * local[n - 1] + size * local[n]
            slope += n * coef[piece, i, n] * moved
        load[at + i] += total
        if frame == ix.MATERIAL:
            load_rate[at + i] -= slope / size
        elif frame == ix.STRETCHED:
            load_rate[at + i] -= slope / (size * depth)


@inner
def add_history(arrays, k, ya, yb, piece, course, load, load_rate):
    """Add what the pieces of the path between ya and yb, inside one piece of the shapes, add to H and dH/dz."""
    edges, cubics, kept = floats_1(arrays, ix.PATH_EDGES), floats_2(arrays, ix.PATH_CUBICS), floats_2(arrays, ix.PATH_MOMENTS)
    count, moments = integers_1(arrays, ix.PATH_COUNT)[0], floats_2(arrays, ix.CUT_MOMENTS)[0]
    first, last = locate(edges[: count + 1], ya), locate(edges[: count + 1], yb)
    if first == last:
        cubic_moments(cubics[first], ya - edges[first], yb - edges[first], moments)
        add_moments(arrays, k, ya, yb, moments, piece, course, load, load_rate)
        return
    if ya > edges[first]:
        stop = edges[first + 1]
        cubic_moments(cubics[first], ya - edges[first], stop - edges[first], moments)
        add_moments(arrays, k, ya, stop, moments, piece, course, load, load_rate)
        first += 1
    if yb > edges[last]:
        cubic_moments(cubics[last], 0.0, yb - edges[last], moments)
        add_moments(arrays, k, edges[last], yb, moments, piece, course, load, load_rate)
    level = 0
    while first < last:
        if first & 1:
            known = kept[row_of_block(level, first)]
            add_moments(arrays, k, edges[first << level], edges[(first + 1) << level], known, piece, course, load, load_rate)
            first += 1
        if last & 1:
            last -= 1
            known = kept[row_of_block(level, last)]
            add_moments(arrays, k, edges[last << level], edges[(last + 1) << level], known, piece, course, load, load_rate)
        first, last, level = first >> 1, last >> 1, level + 1


@inner
def axis_place(node, depth, frame, length):
    """Return y of a node of the shapes."""
    if frame == ix.MATERIAL:
        return node - (length - depth)
    return node * depth if frame == ix.STRETCHED else node


@inner
def add_rest(arrays, is_history, start, stop, cubic, course, load, load_rate):
    """Add H and dH/dz of the path over start < y < stop, up to the tip: its history, or one cubic about ``start``."""
    switches, layers, nodes = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.LAYER), floats_1(arrays, ix.PIECE_NODES)
    moments, length = floats_2(arrays, ix.CUT_MOMENTS)[0], floats_1(arrays, ix.NUMBER)[ix.LENGTH]
    frame, depth, pieces = switches[ix.FRAME], course[ix.DEPTH], len(nodes) - 1
    for number in range(layers.shape[0]):
        layer, k = layers[number], layers[number, ix.MODULUS]
        if k == 0.0 or not course[ix.SIDE] > layer[ix.LAYER_START]:
            continue
        low, high = max(layer[ix.LAYER_START], start), min(layer[ix.LAYER_END], stop, depth)
        if high <= low:
            continue
        place = low + (length - depth) if frame == ix.MATERIAL else (low / depth if frame == ix.STRETCHED else low)
        for piece in range(locate(nodes, place), pieces):
            ya = max(low, axis_place(nodes[piece], depth, frame, length))
            yb = high if piece == pieces - 1 else min(high, axis_place(nodes[piece + 1], depth, frame, length))
            if ya >= high:
                break
            if yb <= ya:
                continue
            if is_history:
                add_history(arrays, k, ya, yb, piece, course, load, load_rate)
            else:
                cubic_moments(cubic, ya - start, yb - start, moments)
                add_moments(arrays, k, ya, yb, moments, piece, course, load, load_rate)


@inner
def add_answer(arrays, load, load_rate):
    """Add what a model that was asked has answered to H and dH/dz."""
    answer = floats_2(arrays, ix.ANSWERED_LOAD)
    for i in range(len(load)):
        load[i] += answer[0, i]
        load_rate[i] += answer[1, i]


@inner
def set_history(arrays, at):
    """Set H and dH/dz of the path behind a step at an instant."""
    edges, cubics, count = floats_1(arrays, ix.PATH_EDGES), floats_2(arrays, ix.PATH_CUBICS), integers_1(arrays, ix.PATH_COUNT)[0]
    load, load_rate = floats_2(arrays, ix.PATH_LOAD)[at], floats_2(arrays, ix.PATH_LOAD_RATE)[at]
    load[:] = 0.0
    load_rate[:] = 0.0
    if count > 0 and integers_1(arrays, ix.SWITCH)[ix.GIVEN]:
        ask(integers_1(arrays, ix.ASKED)[0], at, ix.ASK_HISTORY)
        add_answer(arrays, load, load_rate)
    elif count > 0:
        add_rest(arrays, count > 0, edges[0], edges[count], cubics[0], floats_2(arrays, ix.COURSES)[at], load, load_rate)


@inner
def add_fresh(arrays, at, cubic, load, load_rate):
    """Add what a cubic about the deepest point, the piece that is being cut, adds to H and dH/dz."""
    course, deepest = floats_2(arrays, ix.COURSES)[at], floats_1(arrays, ix.AXIAL_STATE)[ix.DEEPEST]
    if course[ix.OWN_DEPTH] > deepest and integers_1(arrays, ix.SWITCH)[ix.GIVEN]:
        for i in range(4):
            floats_1(arrays, ix.ANSWERED)[i] = cubic[i]
        ask(integers_1(arrays, ix.ASKED)[0], at, ix.ASK_FRESH)
        add_answer(arrays, load, load_rate)
    elif course[ix.OWN_DEPTH] > deepest:
        add_rest(arrays, course[ix.OWN_DEPTH] < deepest, deepest, course[ix.DEPTH], cubic, course, load, load_rate)


@inner
def path_value(y, count, edges, cubics):
    """Return r at y, 0 in front of the path."""
    if count == 0 or y < edges[0]:
        return 0.0
    piece = locate(edges[: count + 1], y)
    x = y - edges[piece]
    return ((cubics[piece, 3] * x + cubics[piece, 2]) * x + cubics[piece, 1]) * x + cubics[piece, 0]


@inner
def path_square(low, high, count, edges, cubics, squares):
    """Return the integral of r^2 over low < y < high, inside the path."""
    first, last = locate(edges[: count + 1], low), locate(edges[: count + 1], high)
    if first == last:
        return squared(cubics[first], low - edges[first], high - edges[first])
    total = squares[last] - squares[first + 1] + squared(cubics[last], 0.0, high - edges[last])
    return total + squared(cubics[first], low - edges[first], edges[first + 1] - edges[first])


@inner
def rest_constant(course, count, edges, cubics, squares, layers):
    """Return c = 1/2 sum k integral r^2 up to the tip."""
    total = 0.0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if count > 0 and layer[ix.MODULUS] != 0.0 and course[ix.SIDE] > layer[ix.LAYER_START]:
            low = max(layer[ix.LAYER_START], edges[0])
            high = min(layer[ix.LAYER_END], course[ix.DEPTH], edges[count])
            if high > low:
                total += 0.5 * layer[ix.MODULUS] * path_square(low, high, count, edges, cubics, squares)
    return total


@inner
def add_tip_rest(rest, course, layers, row, first, load_rate):
    """Add k r psi at the tip, whose row of the shapes is given, to dH/dz; returns dc/dz = 1/2 k r^2 there."""
    total = 0.0
    for number in range(layers.shape[0]):
        layer = layers[number]
        if course[ix.SIDE] > layer[ix.LAYER_START] and course[ix.SIDE] <= layer[ix.LAYER_END]:
            total += 0.5 * layer[ix.MODULUS] * rest * rest
            for i in range(len(row)):
                load_rate[first + i] += layer[ix.MODULUS] * rest * row[i]
    return total


@inner
def parabola(d1, d2, which, cubic):
    """Set the parabola in x that is 1 at 0 (which 0), d1 (1) or d2 (2) and 0 at the others."""
    if which == 0:
        cubic[0], cubic[1], cubic[2] = 1.0, -(d1 + d2) / (d1 * d2), 1.0 / (d1 * d2)
    elif which == 1:
        scale = 1.0 / (d1 * (d1 - d2))
        cubic[0], cubic[1], cubic[2] = 0.0, -d2 * scale, scale
    else:
        scale = 1.0 / (d2 * (d2 - d1))
        cubic[0], cubic[1], cubic[2] = 0.0, -d1 * scale, scale
    cubic[3] = 0.0


@inner
def through_four(d1, d2, d3, w0, w1, w2, w3, cubic):
    """Set the cubic through four values at 0, d1, d2, d3, the parabola through three where d3 is d2."""
    s1, s2 = (w1 - w0) / d1, (w2 - w0) / d2
    second = (s2 - s1) / (d2 - d1)
    a1, third = s1 - second * d1, 0.0
    if d3 > d2 * (1.0 + 1e-12):
        third = (w3 - (w0 + d3 * (a1 + d3 * second))) / (d3 * (d3 - d1) * (d3 - d2))
    cubic[0], cubic[1], cubic[2], cubic[3] = w0, a1 + third * d1 * d2, second - third * (d1 + d2), third
