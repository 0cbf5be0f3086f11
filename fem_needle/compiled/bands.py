"""Band matrices for compiled code: products and factors without a temporary array.

``band[b + i - j, j] = A[i, j]`` as in `fem_needle.banded`, but diagonal by diagonal in memory, along which products run.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# Sums may be reordered; NaN and infinity keep their meaning, by which a failed step is found.
_ARITHMETIC: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
# Without counting references, which costs more than the arithmetic: compiled code allocates nothing. Every line takes some 10 ms
# to compile, which a user waits for once: what can be done for many steps at once is left to numpy.
INNER = _ARITHMETIC | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
EXACT = INNER | {"fastmath": False}  # sums of matrices are rounded as numpy rounds them, so that both loops have the same
ENTRANCE = _ARITHMETIC | {"_nrt": False, "no_cfunc_wrapper": True, "cache": True, "nogil": True}


@njit(**INNER)
def add_product(band, scale, vector, result):
    """Add ``scale A x`` to a vector."""
    rows, size = band.shape
    for row in range(rows):
        shift = row - rows // 2
        first, count = max(0, -shift), size - abs(shift)
        if count > 0:
            diagonal = band[row, first : first + count]
            source, target = vector[first : first + count], result[first + shift : first + shift + count]
            for index in range(count):
                target[index] += scale * diagonal[index] * source[index]


@njit(**INNER)
def factor(rows, width):
    """Replace a matrix by its LU factors without pivoting; returns False where a pivot vanishes.

    Row i holds A[i, i - width .. i + width]. Step matrices are quasi-definite up to a scaling of the stages: they need no pivots
    (Vanderbei, Symmetric quasidefinite matrices, SIAM J. Optimization 5, 1995).
    """
    size = rows.shape[0]
    for i in range(size):
        pivot = rows[i, width]
        if not (np.abs(pivot) > 0.0 and np.isfinite(pivot)):
            return False
        inverse = 1.0 / pivot
        rows[i, width] = inverse
        right = rows[i, width + 1 :]
        for k in range(1, min(width, size - 1 - i) + 1):
            share = rows[i + k, width - k] * inverse
            rows[i + k, width - k] = share
            if share != 0.0:
                below = rows[i + k, width - k + 1 :]
                for j in range(width):
                    below[j] -= share * right[j]
    return True


@njit(**INNER)
def solve(rows, width, vector):
    """Replace a right-hand side by the solution, with the factors of `factor`."""
    size = rows.shape[0]
    for i in range(size):
        reach, total = min(width, i), vector[i]
        left, known = rows[i, width - reach : width], vector[i - reach : i]
        for k in range(reach):
            total -= left[k] * known[k]
        vector[i] = total
    for i in range(size - 1, -1, -1):
        reach, total = min(width, size - 1 - i), vector[i]
        right, known = rows[i, width + 1 : width + 1 + reach], vector[i + 1 : i + 1 + reach]
        for k in range(reach):
            total -= right[k] * known[k]
        vector[i] = total * rows[i, width]


@njit(**INNER)
def solve_dense(matrix, vector):
    """Replace a short right-hand side by the solution, Gauss with partial pivoting; the matrix is overwritten."""
    size = len(vector)
    for i in range(size):
        best = i
        for k in range(i + 1, size):
            if np.abs(matrix[k, i]) > np.abs(matrix[best, i]):
                best = k
        vector[i], vector[best] = vector[best], vector[i]
        for j in range(size):
            matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
        for k in range(i + 1, size):
            share = matrix[k, i] / matrix[i, i]
            vector[k] -= share * vector[i]
            for j in range(i, size):
                matrix[k, j] -= share * matrix[i, j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            vector[i] -= matrix[i, j] * vector[j]
        vector[i] /= matrix[i, i]
