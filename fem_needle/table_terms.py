"""Terms of a plant's matrices over many depths, and how they become the arrays of `fem_needle.tables`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.tables import ABSENT, KINDS, SUM, Matrices

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Multiple:
    """A constant band matrix times a number at each instant (T,): all that there is of its kind."""

    kind: int
    band: Array
    scale: Array


@dataclass(frozen=True, eq=False)
class Range:
    """Whole elements first <= e < stop (T,) of a constant, times a number at each instant (T,); local: (elements, m, m)."""

    kind: int
    band: Array
    local: Array
    scale: Array
    first: Integers
    stop: Integers


@dataclass(frozen=True, eq=False)
class Block:
    """Small dense blocks (T, m, m) whose upper left corners are at the coordinates ``first`` (T,)."""

    kind: int
    first: Integers
    entries: Array


Term = Multiple | Range | Block


@dataclass(frozen=True, eq=False)
class RateRow:
    """A row (T, m) from a coordinate (T,) on, of which scale (row.q)^2 is part of q.(dK/dz) q, or of q.(dG/dz) q."""

    first: Integers
    row: Array
    scale: Array
    is_tissue: bool


def matrices_of(terms: Iterable[Term], instants: int, half_bandwidth: int, size: int, stride: int) -> Matrices:
    """Collect terms; shapes of what is absent are empty."""
    terms = tuple(terms)
    multiples = [term for term in terms if isinstance(term, Multiple)]
    ranges = [term for term in terms if isinstance(term, Range)]
    blocks = [term for term in terms if isinstance(term, Block)]
    base_of, scale = np.full(KINDS, ABSENT), np.zeros((instants, KINDS))
    for kind in [*(term.kind for term in ranges), *(term.kind for term in blocks)]:
        base_of[kind] = SUM
    for number, multiple in enumerate(multiples):
        base_of[multiple.kind] = number
        scale[:, multiple.kind] = multiple.scale
    bases = [*(term.band for term in multiples), *(term.band for term in ranges)]
    local = np.zeros((len(bases), 1, 1, 1))
    if ranges:
        local = np.zeros((len(bases), *ranges[0].local.shape))
        local[len(multiples) :] = [term.local for term in ranges]
    count = blocks[0].entries.shape[1] if blocks else 1
    return Matrices(
        base_of,
        scale,
        np.array(bases).reshape(len(bases), 2 * half_bandwidth + 1, size),
        local,
        stride,
        np.array([term.kind for term in ranges], dtype=np.int64),
        len(multiples) + np.arange(len(ranges)),
        _columns([term.scale for term in ranges], instants),
        _columns([term.first for term in ranges], instants, np.int64),
        _columns([term.stop for term in ranges], instants, np.int64),
        np.array([term.kind for term in blocks], dtype=np.int64),
        _columns([term.first for term in blocks], instants, np.int64),
        np.ascontiguousarray(np.stack([term.entries for term in blocks], axis=1))
        if blocks
        else np.zeros((instants, 0, count, count)),
    )


def _columns(values: Sequence[NDArray], instants: int, kind: type = np.float64) -> NDArray:
    """Return one column for each of several arrays over the instants."""
    return np.ascontiguousarray(np.stack(values, axis=1).astype(kind)) if values else np.zeros((instants, 0), dtype=kind)


def rate_rows_of(rows: Iterable[RateRow], instants: int, count: int) -> tuple[Integers, Array, Array, NDArray[np.bool_]]:
    """Return first coordinates (T, R), rows (T, R, m), scales (T, R), and whether each belongs to the tissue (R,)."""
    rows = tuple(rows)
    entries = np.ascontiguousarray(np.stack([row.row for row in rows], axis=1)) if rows else np.zeros((instants, 0, count))
    return (
        _columns([row.first for row in rows], instants, np.int64),
        entries,
        _columns([row.scale for row in rows], instants),
        np.array([row.is_tissue for row in rows], dtype=np.bool_),
    )
