"""Square banded matrices: LAPACK's general band storage and the few operations that the plants need.

A matrix ``A`` of half-bandwidth ``b`` and size ``n`` is an array ``band`` of shape ``(2 b + 1, n)``, Fortran order, with
``band[b + i - j, j] = A[i, j]``. A dense matrix is the case ``b = n - 1``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dgbmv
from scipy.linalg.lapack import dgbtrf, dgbtrs

Array = NDArray[np.float64]


class SingularMatrixError(ArithmeticError):
    """The factorization met a zero pivot or a number that is not finite."""


def zeros(size: int, half_bandwidth: int) -> Array:
    """Return a zero matrix in band storage."""
    return np.zeros((2 * half_bandwidth + 1, size), order="F")


def half_bandwidth(band: Array) -> int:
    """Return the half-bandwidth of a band array."""
    return band.shape[0] // 2


def add_local(band: Array, first: int, local: Array) -> None:
    """Add a small dense block whose upper left corner is ``A[first, first]``, in place."""
    middle = half_bandwidth(band)
    count = local.shape[0]
    for column in range(count):
        top = middle - column
        band[top : top + count, first + column] += local[:, column]


def from_elements(local: Array, stride: int) -> Array:
    """Assemble element matrices ``(elements, m, m)`` whose first coordinates are ``stride`` apart."""
    elements, count, _ = local.shape
    band = zeros(stride * (elements - 1) + count, count - 1)
    for row in range(count):
        for column in range(count):
            stop = column + stride * (elements - 1) + 1
            band[count - 1 + row - column, column:stop:stride] += local[:, row, column]
    return band


def add_square(band: Array, row: Array, factor: float) -> None:
    """Add ``factor row row^T`` in place; what differs from zero in the row must fit the band."""
    places = np.flatnonzero(row)
    if len(places):
        part = row[places[0] : places[-1] + 1]
        add_local(band, int(places[0]), np.outer(factor * part, part))


def from_dense(matrix: Array) -> Array:
    """Return the band storage of a dense matrix, every diagonal kept."""
    size = matrix.shape[0]
    band = zeros(size, size - 1)
    _dense_view(band)[...] = matrix
    return band


def to_dense(band: Array) -> Array:
    """Return the dense matrix of a band array; a view, not to be written to, where the band is as wide as the matrix."""
    size, middle = band.shape[1], half_bandwidth(band)
    if middle == size - 1 and band.flags.f_contiguous:
        return _dense_view(band)
    dense = np.zeros((size, size))
    for column in range(size):
        first, last = max(0, column - middle), min(size, column + middle + 1)
        dense[first:last, column] = band[middle + first - column : middle + last - column, column]
    return dense


def _dense_view(band: Array) -> Array:
    """Return a full matrix inside its band storage: A[i, j] lies at offset b + i + 2 b j in memory."""
    size, middle = band.shape[1], half_bandwidth(band)
    flat = band.ravel(order="K")
    return np.ndarray((size, size), flat.dtype, flat, middle * flat.itemsize, (flat.itemsize, 2 * middle * flat.itemsize))


def multiply(band: Array, vector: Array) -> Array:
    """Return ``A @ vector``."""
    middle, size = half_bandwidth(band), band.shape[1]
    if size <= 2 * middle:  # the BLAS wrapper refuses a band wider than the matrix
        return to_dense(band) @ vector
    return dgbmv(size, size, middle, middle, 1.0, band, vector)


def multiply_transposed(band: Array, vector: Array) -> Array:
    """Return ``A.T @ vector``."""
    middle, size = half_bandwidth(band), band.shape[1]
    if size <= 2 * middle:
        return vector @ to_dense(band)
    return dgbmv(size, size, middle, middle, 1.0, band, vector, trans=1)


def transpose(band: Array) -> Array:
    """Return the band storage of ``A.T``."""
    middle, size = half_bandwidth(band), band.shape[1]
    result = np.zeros_like(band)
    for offset in range(-middle, middle + 1):
        count = size - abs(offset)
        if count > 0:
            source, target = max(0, -offset), max(0, offset)
            result[middle - offset, target : target + count] = band[middle + offset, source : source + count]
    return result


def trailing(band: Array, dropped: int) -> Array:
    """Return the matrix without its first ``dropped`` rows and columns."""
    if dropped == 0:
        return band
    middle = half_bandwidth(band)
    part = band[:, dropped:].copy(order="F")
    for column in range(min(middle, part.shape[1])):
        part[: middle - column, column] = 0.0
    return part


def leading_rows(band: Array, rows: int) -> Array:
    """Return the first rows as a dense matrix, as many columns as they reach."""
    middle, size = half_bandwidth(band), band.shape[1]
    columns = np.arange(min(middle + max(rows, 1), size))
    result = np.zeros((rows, len(columns)))
    for row in range(rows):
        reached = columns[: row + middle + 1]
        result[row, : len(reached)] = band[middle + row - reached, reached]
    return result


class Factorization:
    """LU factors of a banded matrix with partial pivoting (LAPACK ``dgbtrf``).

    Raises
    ------
    SingularMatrixError
        If a pivot is zero or the matrix is not finite.
    """

    def __init__(self, band: Array) -> None:
        self._middle = half_bandwidth(band)
        storage = np.zeros((3 * self._middle + 1, band.shape[1]), order="F")
        storage[self._middle :] = band
        self._factors, self._pivots, info = dgbtrf(storage, self._middle, self._middle, overwrite_ab=1)
        if info != 0:
            raise SingularMatrixError("the matrix is singular")

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side ``(n,)`` or several ``(n, m)``."""
        solution, _ = dgbtrs(self._factors, self._middle, self._middle, right, self._pivots)
        if not np.all(np.isfinite(solution)):
            raise SingularMatrixError("the solution is not finite")
        return solution


class RestrictedFactorization:
    """A matrix seen from a subspace: solves V^T A V y = V^T b and returns x = V y.

    For coordinates that are nearly dependent: directions outside the columns V (size, rank) are left at zero.

    Raises
    ------
    SingularMatrixError
        If the restricted matrix is singular or not finite.
    """

    def __init__(self, band: Array, columns: Array) -> None:
        self._columns = columns
        self._factorization = Factorization(from_dense(columns.T @ to_dense(band) @ columns))

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side ``(n,)`` or several ``(n, m)``."""
        return np.asarray(self._columns @ self._factorization.solve(self._columns.T @ right), dtype=float)


def factorize(band: Array, columns: Array | None = None) -> Factorization | RestrictedFactorization:
    """Factor a matrix, restricted to a subspace where columns are given."""
    return Factorization(band) if columns is None else RestrictedFactorization(band, columns)
