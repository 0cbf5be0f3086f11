"""Matrices over many instants (`fem_needle.tables.Matrices`) at work: products, forms, solutions for all instants at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fem_needle import banded
from fem_needle.tables import ABSENT, MASS, Matrices

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LegMatrices:
    """The matrices of a leg; ``at`` are always indices of instants, of which vectors have a row each."""

    matrices: Matrices

    def has(self, kind: int) -> bool:
        """Return whether the plant has a kind of matrix."""
        return bool(self.matrices.base_of[kind] != ABSENT)

    @cached_property
    def _sparse(self) -> list[sparse.csr_array]:
        """The bases, ready for products."""
        rows, size = self.matrices.bases.shape[1:]
        offsets = rows // 2 - np.arange(rows)
        # A diagonal above the main one is counted from its own column in both storages.
        return [sparse.dia_array((base, offsets), shape=(size, size)).tocsr() for base in self.matrices.bases]

    def product(self, kind: int, at: Indices, vectors: Array, *, transposed: bool = False) -> Array:
        """Return A x, or A^T x, zeros where the kind is absent."""
        if not self.has(kind):
            return np.zeros_like(vectors)
        base = self.matrices.base_of[kind]
        if base >= 0:
            matrix = self._sparse[base].T if transposed else self._sparse[base]
            return (matrix @ vectors.T).T * self.matrices.scale[at, kind][:, None]
        bands, result = self.bands(kind, at), np.zeros_like(vectors)
        rows, size = bands.shape[1:]
        for row in range(rows):
            shift = row - rows // 2
            first, stop = max(0, -shift), min(size, size - shift)
            if stop > first:
                columns, lines = slice(first, stop), slice(first + shift, stop + shift)
                target, source = (columns, lines) if transposed else (lines, columns)
                result[:, target] += bands[:, row, columns] * vectors[:, source]
        return result

    def form(self, kind: int, at: Indices, left: Array, right: Array) -> Array:
        """Return left . A right, zeros where the kind is absent."""
        if not self.has(kind):
            return np.zeros(len(at))
        return np.asarray(np.einsum("ti,ti->t", left, self.product(kind, at, right)))

    def bands(self, kind: int, at: Indices) -> Array:
        """Return a kind in band storage (instants, 2 b + 1, n)."""
        matrices, base = self.matrices, self.matrices.base_of[kind]
        if base >= 0:
            return matrices.bases[base] * matrices.scale[at, kind][:, None, None]
        rows, size = matrices.bases.shape[1:]
        result = np.zeros((len(at), rows, size))
        for number in np.flatnonzero(matrices.range_kind == kind):
            self._add_range(int(number), at, result)
        everywhere, count = np.arange(len(at)), matrices.block.shape[2]
        for number in np.flatnonzero(matrices.block_kind == kind):
            first = matrices.block_first[at, number]
            for row in range(count):
                for column in range(count):
                    result[everywhere, rows // 2 + row - column, first + column] += matrices.block[at, number, row, column]
        return result

    def _add_range(self, number: int, at: Indices, result: Array) -> None:
        matrices = self.matrices
        local, stride = matrices.local[matrices.range_base[number]], matrices.stride
        elements, count, _ = local.shape
        inside = np.arange(elements) >= matrices.range_first[at, number][:, None]
        inside &= np.arange(elements) < matrices.range_stop[at, number][:, None]
        factors = inside * matrices.range_scale[at, number][:, None]
        for row in range(count):
            for column in range(count):
                stop = column + stride * (elements - 1) + 1
                result[:, result.shape[1] // 2 + row - column, column:stop:stride] += factors * local[:, row, column]

    def solve_mass(self, at: Indices, clamped: int, right: Array) -> Array:
        """Return M^-1 b of the coordinates that are not clamped."""
        base = self.matrices.base_of[MASS]
        if base >= 0:
            return self._mass_factors(clamped).solve(right.T).T / self.matrices.scale[at, MASS][:, None]
        bands = self.bands(MASS, at)
        rows, size = bands.shape[1:]
        dense = np.zeros((len(at), size, size))
        for column in range(size):
            first, stop = max(0, column - rows // 2), min(size, column + rows // 2 + 1)
            dense[:, first:stop, column] = bands[:, rows // 2 + first - column : rows // 2 + stop - column, column]
        return np.asarray(np.linalg.solve(dense[:, clamped:, clamped:], right[:, :, None])[:, :, 0])

    def _mass_factors(self, clamped: int) -> banded.Factorization:
        base = self.matrices.bases[self.matrices.base_of[MASS]]
        return banded.Factorization(banded.trailing(np.asfortranarray(base), clamped))


def without(matrices: Matrices, kinds: Sequence[int]) -> Matrices:
    """Return matrices of a plant that lacks some kinds."""
    base_of = matrices.base_of.copy()
    base_of[list(kinds)] = ABSENT
    return matrices._replace(base_of=base_of)
