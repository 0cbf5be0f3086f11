"""Directions that nearly dependent functions tell apart: full-length modes on the short part of them that is inserted.

    Z = D V Lambda^-1/2,   D K D = V Lambda V' with D = diag(K)^-1/2,   kept where lambda_j (z_j' M z_j) is not lost in rounding

Every column of Z has unit bending energy. Derivation: docs/theory.md, "Assumed modes".
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_2, floats_3, floats_5, integers_1
from fem_needle.dynamics.compilation import inner

RESOLUTION = 1e-12  # rounding leaves the mass of what is kept right to 2e-4: below the usual tolerance
ROUNDED = 1e-15  # of the largest eigenvalue: what is below is nothing but rounding
MOST_SWEEPS = 30
DIAGONAL = 1e-32  # of the squares of the entries: what is left beside the diagonal
SMALLEST = 2.2250738585072014e-308


@inner
def rotate(matrix, vectors, p, q, n):
    """Make the entry (p, q) of a symmetric matrix vanish by a rotation, which the vectors' columns take part in."""
    if matrix[p, q] == 0.0:
        return
    ratio = (matrix[q, q] - matrix[p, p]) / (2.0 * matrix[p, q])
    tangent = np.copysign(1.0, ratio) / (np.abs(ratio) + np.sqrt(1.0 + ratio * ratio))
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for i in range(n):
        first, second = matrix[i, p], matrix[i, q]
        matrix[i, p], matrix[i, q] = cosine * first - sine * second, sine * first + cosine * second
        first, second = vectors[i, p], vectors[i, q]
        vectors[i, p], vectors[i, q] = cosine * first - sine * second, sine * first + cosine * second
    for i in range(n):
        first, second = matrix[p, i], matrix[q, i]
        matrix[p, i], matrix[q, i] = cosine * first - sine * second, sine * first + cosine * second
    matrix[p, q], matrix[q, p] = 0.0, 0.0


@inner
def diagonalize(matrix, vectors, n):
    """Set eigenvectors as columns, eigenvalues on the diagonal of a symmetric matrix (Jacobi's rotations)."""
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(MOST_SWEEPS):
        beside, total = 0.0, 0.0
        for i in range(n):
            for j in range(n):
                square = matrix[i, j] * matrix[i, j]
                total += square
                if i != j:
                    beside += square
        if beside <= DIAGONAL * total:
            return
        for p in range(n - 1):
            for q in range(p + 1, n):
                rotate(matrix, vectors, p, q, n)


@inner
def direction_mass(mass, clamped, directions, column, n):
    """Return z' M z of a column of directions."""
    total = 0.0
    for i in range(n):
        for j in range(n):
            total += directions[clamped + i, column] * mass[clamped + i, clamped + j] * directions[clamped + j, column]
    return total


@inner
def resolve(arrays, at):
    """Set the directions of an instant (``SUBSPACE``) and how many there are (``RANKS``), from its bending and mass."""
    beam, clamped = floats_5(arrays, ix.BEAM)[at, 0], integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED]
    bending, mass, directions = beam[ix.BENDING], beam[ix.MASS], floats_3(arrays, ix.SUBSPACE)[at]
    scaled, vectors, n = floats_2(arrays, ix.REDUCED), floats_2(arrays, ix.REDUCED_WORK), bending.shape[0] - clamped
    for i in range(n):
        for j in range(n):
            scale = np.sqrt(bending[clamped + i, clamped + i] * bending[clamped + j, clamped + j])
            scaled[i, j] = bending[clamped + i, clamped + j] / scale
    diagonalize(scaled, vectors, n)
    largest = 0
    for j in range(n):
        scaled[j, j] = max(scaled[j, j], SMALLEST)
        if scaled[j, j] > scaled[largest, largest]:
            largest = j
        for i in range(n):
            directions[clamped + i, j] = vectors[i, j] / np.sqrt(bending[clamped + i, clamped + i] * scaled[j, j])
    enough = RESOLUTION * scaled[largest, largest] * direction_mass(mass, clamped, directions, largest, n)
    rank = 0
    for j in range(n):
        is_known = scaled[j, j] > ROUNDED * scaled[largest, largest]
        if is_known and scaled[j, j] * direction_mass(mass, clamped, directions, j, n) > enough:
            for i in range(n):
                directions[clamped + i, rank] = directions[clamped + i, j]
            rank += 1
    integers_1(arrays, ix.RANKS)[at] = rank
