"""Small dense systems: functions that live on the whole needle, the borders of guides."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics.compilation import inner


@inner
def factor_dense(first, matrix, factors):
    """Set LU factors of a matrix without its first rows and columns, no pivots; inverse pivots on the diagonal."""
    size = matrix.shape[0]
    for i in range(first, size):
        for j in range(first, size):
            factors[i, j] = matrix[i, j]
    for k in range(first, size):
        pivot = 1.0 / factors[k, k]
        factors[k, k] = pivot
        for i in range(k + 1, size):
            share = factors[i, k] * pivot
            factors[i, k] = share
            if share != 0.0:
                for j in range(k + 1, size):
                    factors[i, j] -= share * factors[k, j]


@inner
def solve_dense(first, factors, values):
    """Replace a right-hand side by the solution, zeros in front."""
    size = factors.shape[0]
    for i in range(first):
        values[i] = 0.0
    for i in range(first, size):
        total = values[i]
        for k in range(first, i):
            total -= factors[i, k] * values[k]
        values[i] = total
    for i in range(size - 1, first - 1, -1):
        total = values[i]
        for k in range(i + 1, size):
            total -= factors[i, k] * values[k]
        values[i] = total * factors[i, i]


@inner
def solve_small(matrix, values, size):
    """Replace a short right-hand side by the solution, with partial pivoting; the matrix is overwritten."""
    for i in range(size):
        best = i
        for k in range(i + 1, size):
            if np.abs(matrix[k, i]) > np.abs(matrix[best, i]):
                best = k
        values[i], values[best] = values[best], values[i]
        for j in range(size):
            matrix[i, j], matrix[best, j] = matrix[best, j], matrix[i, j]
        for k in range(i + 1, size):
            share = matrix[k, i] / matrix[i, i]
            values[k] -= share * values[i]
            for j in range(i, size):
                matrix[k, j] -= share * matrix[i, j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            values[i] -= matrix[i, j] * values[j]
        values[i] /= matrix[i, i]


@inner
def solve_cholesky(rows, clamped, values):
    """Replace values by M^-1 values, rows (n, w + 1) of the lower factor, inverse diagonal last; zeros at the clamp."""
    n, width = rows.shape[0], rows.shape[1] - 1
    for i in range(clamped):
        values[i] = 0.0
    for i in range(clamped, n):
        total, reach = values[i], min(width, i - clamped)
        for k in range(1, reach + 1):
            total -= rows[i, width - k] * values[i - k]
        values[i] = total * rows[i, width]
    for i in range(n - 1, clamped - 1, -1):
        values[i] *= rows[i, width]
        for k in range(1, min(width, i - clamped) + 1):
            values[i - k] -= rows[i, width - k] * values[i]


@inner
def cholesky(matrix, scale, clamped, rows):
    """Set the rows of the lower factor of scale M, without what is clamped, as `solve_cholesky` takes them."""
    n, width = rows.shape[0], rows.shape[1] - 1
    for i in range(clamped, n):
        for j in range(clamped, i + 1):
            total = scale * matrix[i, j]
            for k in range(clamped, j):
                total -= rows[i, width - i + k] * rows[j, width - j + k]
            if i == j:
                rows[i, width] = 1.0 / np.sqrt(total)
            else:
                rows[i, width - i + j] = total * rows[j, width]
