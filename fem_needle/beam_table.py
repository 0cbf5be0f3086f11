"""A needle's matrices, points and rates over many depths at once (`fem_needle.tables`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem_needle.beam_matrices import Beam
from fem_needle.foundation import Foundation
from fem_needle.foundation_terms import foundation_rate_rows, foundation_terms
from fem_needle.table_terms import matrices_of, rate_rows_of
from fem_needle.tables import Integers, Matrices, Rates

Array = NDArray[np.float64]


def matrix_table(beam: Beam, foundation: Foundation, depths: Array) -> Matrices:
    """Return the matrices at depths [m] (T,)."""
    shapes = foundation.shapes
    terms = [*beam.terms(depths), *foundation_terms(foundation, depths)]
    return matrices_of(terms, len(depths), shapes.half_bandwidth, shapes.size, shapes.stride)


def rate_table(beam: Beam, foundation: Foundation, depths: Array) -> Rates:
    """Return how the energies change with the depth, at depths [m] (T,)."""
    rates = beam.rates(depths)
    frame = foundation.frame
    # A spring at the tip, in place of layers, is not stretched.
    share = (0.0 if foundation.tip_stiffness else frame.stretch_rate) / (frame.stretch(depths) + 0.0 * depths)
    rows = [*rates.rows, *foundation_rate_rows(foundation, depths)]
    first, entries, scale, is_tissue = rate_rows_of(rows, len(depths), 1)
    return Rates(
        rates.bending_share,
        share,
        rates.mass_share,
        rates.centrifugal_share,
        first,
        entries,
        scale,
        is_tissue,
        rates.tip_mass,
        np.ascontiguousarray(rates.tip_row),
        np.ascontiguousarray(rates.tip_slope),
    )


def point_rows(
    foundation: Foundation, positions: tuple[float, ...], turns: bool, depths: Array
) -> tuple[Integers, Array, Array]:
    """Return first coordinates (T, p), rows and their rates by depth (T, p, m) of guides and loads, a torque, and the tip."""
    frame, shapes, found = foundation.frame, foundation.shapes, []
    for y in [*(np.full_like(depths, position) for position in positions), depths]:
        places, moves = frame.places_of(y, depths)
        first, rows = shapes.rows(places)
        found.append((first, rows, moves[:, None] * shapes.rows(places, 1)[1]))
    if turns:
        torque = np.zeros_like(found[-1][1])
        torque[:, 1] = 1.0
        found.insert(-1, (np.zeros(len(depths), dtype=np.int64), torque, np.zeros_like(torque)))
    first, rows, rates = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    return np.ascontiguousarray(first), np.ascontiguousarray(rows), np.ascontiguousarray(rates)
