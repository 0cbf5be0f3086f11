"""Systems of functions that live on the whole needle, on all coordinates or on the directions that nearly dependent ones resolve.

With directions Z (free coordinates, rank):   A^-1 b  ->  Z (Z' A Z)^-1 Z' b,   stages interleaved where there are two.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.dense import cholesky, factor_dense, solve_cholesky, solve_dense


@inner
def reduce_matrix(directions, rank, clamped, width, matrix, work, out):
    """Set Z' A Z (width rank, width rank) of a matrix (width n, width n)."""
    n = matrix.shape[0] // width
    for row in range(width * n):
        for r in range(rank):
            for s in range(width):
                total = 0.0
                for i in range(clamped, n):
                    total += matrix[row, width * i + s] * directions[i, r]
                work[row, width * r + s] = total
    for r in range(rank):
        for s in range(width):
            for column in range(width * rank):
                total = 0.0
                for i in range(clamped, n):
                    total += directions[i, r] * work[width * i + s, column]
                out[width * r + s, column] = total


@inner
def to_reduced(directions, rank, clamped, width, values, out):
    """Set Z' b."""
    for r in range(rank):
        for s in range(width):
            total = 0.0
            for i in range(clamped, len(values) // width):
                total += directions[i, r] * values[width * i + s]
            out[width * r + s] = total


@inner
def from_reduced(directions, rank, clamped, width, reduced, values):
    """Replace values by Z x, zeros at the clamp."""
    for i in range(len(values) // width):
        for s in range(width):
            total = 0.0
            if i >= clamped:
                for r in range(rank):
                    total += directions[i, r] * reduced[width * r + s]
            values[width * i + s] = total


@inner
def factor_functions(arrays, width, at):
    """Factor the system's matrix of an instant, or of a step, whose directions are those of its first stage."""
    clamped, rank = integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], integers_1(arrays, ix.RANKS)[at]
    matrix, factors = floats_3(arrays, ix.MATRICES)[0], floats_2(arrays, ix.FACTORS)
    if rank == 0:
        factor_dense(width * clamped, matrix, factors)
        return
    reduced = floats_2(arrays, ix.REDUCED)
    reduce_matrix(floats_3(arrays, ix.SUBSPACE)[at], rank, clamped, width, matrix, factors, reduced)
    size = width * rank
    for i in range(size):
        for j in range(size):
            factors[i, j] = reduced[i, j]
    factor_dense(0, reduced[:size, :size], factors[:size, :size])


@inner
def solve_functions(arrays, width, at, values):
    """Replace a right-hand side by the solution, with the factors of `factor_functions`."""
    clamped, rank = integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], integers_1(arrays, ix.RANKS)[at]
    factors = floats_2(arrays, ix.FACTORS)
    if rank == 0:
        solve_dense(width * clamped, factors, values)
        return
    directions, reduced, size = floats_3(arrays, ix.SUBSPACE)[at], floats_1(arrays, ix.REDUCED_VALUES), width * rank
    to_reduced(directions, rank, clamped, width, values, reduced)
    solve_dense(0, factors[:size, :size], reduced[:size])
    from_reduced(directions, rank, clamped, width, reduced, values)


@inner
def factor_mass(arrays, at):
    """Factor the mass matrix of an instant, of a model whose mass changes with the depth."""
    clamped, rank = integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], integers_1(arrays, ix.RANKS)[at]
    mass, factor = floats_5(arrays, ix.BEAM)[at, 0, ix.MASS], floats_2(arrays, ix.MASS_FACTOR)
    if rank == 0:
        cholesky(mass, 1.0, clamped, factor)
        return
    reduced, work = floats_2(arrays, ix.REDUCED), floats_2(arrays, ix.REDUCED_WORK)
    reduce_matrix(floats_3(arrays, ix.SUBSPACE)[at], rank, clamped, 1, mass, work, reduced)
    cholesky(reduced[:rank, :rank], 1.0, 0, factor[:rank, factor.shape[1] - rank :])


@inner
def solve_mass(arrays, at, values):
    """Replace values by M^-1 values for a stretch of 1, zeros at the clamp."""
    clamped, rank = integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], integers_1(arrays, ix.RANKS)[at]
    factor = floats_2(arrays, ix.MASS_FACTOR)
    if rank == 0:
        solve_cholesky(factor, clamped, values)
        return
    directions, reduced = floats_3(arrays, ix.SUBSPACE)[at], floats_1(arrays, ix.REDUCED_VALUES)
    to_reduced(directions, rank, clamped, 1, values, reduced)
    solve_cholesky(factor[:rank, factor.shape[1] - rank :], 0, reduced[:rank])
    from_reduced(directions, rank, clamped, 1, reduced, values)
