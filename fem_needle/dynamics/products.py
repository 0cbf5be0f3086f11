"""Products with matrices that are given block by block: A x and x.A y, blocks ``stride`` coordinates apart."""

from __future__ import annotations

from fem_needle.dynamics.compilation import inner


@inner
def add_product(matrices, kind, stride, scale, x, y):
    """Add scale A x to y; matrices (B, kinds, m, m)."""
    m = matrices.shape[2]
    for block in range(matrices.shape[0]):
        at, a = stride * block, matrices[block, kind]
        for i in range(m):
            total = 0.0
            for j in range(m):
                total += a[i, j] * x[at + j]
            y[at + i] += scale * total


@inner
def add_transposed(matrices, kind, stride, scale, x, y):
    """Add scale A^T x to y."""
    m = matrices.shape[2]
    for block in range(matrices.shape[0]):
        at, a = stride * block, matrices[block, kind]
        for i in range(m):
            share = scale * x[at + i]
            for j in range(m):
                y[at + j] += share * a[i, j]


@inner
def form_of(matrices, kind, stride, x, y):
    """Return x.A y."""
    m, total = matrices.shape[2], 0.0
    for block in range(matrices.shape[0]):
        at, a = stride * block, matrices[block, kind]
        for i in range(m):
            part = 0.0
            for j in range(m):
                part += a[i, j] * y[at + j]
            total += x[at + i] * part
    return total


@inner
def add_covered(tissue, kind, covered, stride, scale, x, y):
    """Add scale A x to y, of tissue matrices (B, 4, m, m): blocks that hold none are passed over."""
    m = tissue.shape[2]
    for block in range(tissue.shape[0]):
        if covered[block, 0] == 0.0 and covered[block, 1] == 0.0 and covered[block, 2] == 0.0:
            continue
        at, a = stride * block, tissue[block, kind]
        for i in range(m):
            total = 0.0
            for j in range(m):
                total += a[i, j] * x[at + j]
            y[at + i] += scale * total


@inner
def covered_form(tissue, kind, covered, stride, x, y):
    """Return x.A y of tissue matrices."""
    m, total = tissue.shape[2], 0.0
    for block in range(tissue.shape[0]):
        if covered[block, 0] == 0.0 and covered[block, 1] == 0.0 and covered[block, 2] == 0.0:
            continue
        at, a = stride * block, tissue[block, kind]
        for i in range(m):
            part = 0.0
            for j in range(m):
                part += a[i, j] * y[at + j]
            total += x[at + i] * part
    return total


@inner
def bending_form(constants, stride, degree, stiffness, nodes, q):
    """Return EI integral w''^2 in places' units: of elements from angles beside the chord, which lose n^2 roundings, not n^4."""
    if stride == 0:
        return form_of(constants, 1, 0, q, q)
    total = 0.0
    for element in range(len(nodes) - 1):
        at, size = stride * element, nodes[element + 1] - nodes[element]
        chord = (q[at + stride] - q[at]) / size
        first, second = q[at + 1] - chord, q[at + stride + 1] - chord
        total += 4.0 * stiffness / size * (first * first + first * second + second * second)
        if degree == 4:
            total += 204.8 * stiffness / (size * size * size) * q[at + 2] * q[at + 2]
    return total
