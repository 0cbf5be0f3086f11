"""A plant's matrices, points and rates as arrays over many instants: what the compiled loop and its ledger work on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Kinds of matrices.
MASS, BENDING, TISSUE, CONVECTION, CENTRIFUGAL, DAMPING, DRAG, SLIP = range(8)
KINDS = 8
ABSENT, SUM = -2, -1  # in place of a constant's number


class Matrices(NamedTuple):
    """Matrices of the plant at T instants: a constant times a scale, or a sum of ranges of elements and of small blocks.

    Attributes
    ----------
    base_of
        Which constant a kind is a multiple of; -1: a sum; -2: absent (KINDS,).
    scale
        The multiple (T, KINDS).
    bases
        Constants, band storage (bases, 2 b + 1, n).
    local
        Their element matrices (bases, elements, m, m).
    stride
        Coordinates from one element's first to the next one's.
    range_kind, range_base, range_scale, range_first, range_stop
        Elements first <= e < stop of a base that a sum has (ranges,), (ranges,), (T, ranges) and twice (T, ranges).
    block_kind, block_first, block
        Blocks of a sum: kind (blocks,), first coordinate (T, blocks), entries (T, blocks, m, m).
    """

    base_of: Integers
    scale: Array
    bases: Array
    local: Array
    stride: int
    range_kind: Integers
    range_base: Integers
    range_scale: Array
    range_first: Integers
    range_stop: Integers
    block_kind: Integers
    block_first: Integers
    block: Array


class Rates(NamedTuple):
    """How the energies change with the depth, at T instants.

    q.(dK/dz) q = bending_share q.K q + sum row_scale (row.q)^2, of G with ``tissue_share`` and rows of its own;
    dT/dz = mass_share 1/2 q'.M q' + centrifugal_share 1/2 v^2 q.R q + 1/2 tip_mass (tip_row.q' + v tip_slope.q)^2.

    Attributes
    ----------
    bending_share, tissue_share, mass_share, centrifugal_share
        Logarithmic derivatives [1/m] (T,).
    first, rows, scale, is_tissue
        First coordinate (T, R), entries (T, R, m), factor (T, R) of the rows, and whether the swelling factor multiplies it (R,).
    tip_mass, tip_row, tip_slope
        Mass per length [kg/m], rows (T, n); a mass of 0 where there is no such term.
    """

    bending_share: Array
    tissue_share: Array
    mass_share: Array
    centrifugal_share: Array
    first: Integers
    rows: Array
    scale: Array
    is_tissue: NDArray[np.bool_]
    tip_mass: float
    tip_row: Array
    tip_slope: Array


class PointTable(NamedTuple):
    """Guides, lateral loads, the tip last, at T instants.

    Attributes
    ----------
    first, rows, row_rates
        First coordinate (T, p), N and dN/dz from there on (T, p, m).
    flexibility, flexibility_rate
        B and dB/dz (T, p, p).
    guides, guide_compliance, softest
        How many are guides, 1 / stiffness of each, and the compliance below which a rigid one is taken as at a node.
    """

    first: Integers
    rows: Array
    row_rates: Array
    flexibility: Array
    flexibility_rate: Array
    guides: int
    guide_compliance: Array
    softest: float


class OperatorTable(NamedTuple):
    """A plant at T depths."""

    matrices: Matrices
    rates: Rates
    points: PointTable
