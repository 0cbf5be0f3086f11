"""The tissue's matrices over many depths at once (equations: `fem_needle.foundation`)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fem_needle.foundation import Foundation
from fem_needle.scene import Layer
from fem_needle.segments import one_layer_holds
from fem_needle.shapes import IntervalIntegrals
from fem_needle.table_terms import Block, Multiple, RateRow, Term
from fem_needle.tables import DAMPING, DRAG, SLIP, TISSUE

Array = NDArray[np.float64]
Kind = tuple[int, IntervalIntegrals, Array, Array]  # kind, integrals, factor of each layer, scale at each depth


def is_one_layer(foundation: Foundation, depths: Array) -> bool:
    """Return whether one layer holds the whole inserted part at all depths, on shapes that stretch with it: no cut elements."""
    stretched = bool(foundation.frame.stretch_rate) and not foundation.tip_stiffness
    return stretched and one_layer_holds(foundation.layers, float(np.max(depths)))


def foundation_terms(foundation: Foundation, depths: Array) -> Iterator[Term]:
    """Yield G, and C, D, E of a viscous tissue, for a stiffness factor of 1, at depths [m] (T,)."""
    kinds = _kinds(foundation, depths)
    if is_one_layer(foundation, depths):
        for kind, integrals, factors, scale in kinds:
            yield Multiple(kind, integrals.band, factors[0] * scale)
        return
    for number, layer in enumerate(foundation.layers):
        starts, ends, inside = _ends(foundation, layer, depths)
        for kind, integrals, factors, scale in kinds:
            if factors[number]:
                yield from integrals.terms(kind, starts, ends, factors[number] * scale * inside)
    if foundation.tip_stiffness:
        first, rows = foundation.shapes.rows(foundation.frame.places_of(depths, depths)[0])
        yield Block(TISSUE, first, foundation.tip_stiffness * rows[:, :, None] * rows[:, None, :])


def _kinds(foundation: Foundation, depths: Array) -> list[Kind]:
    stretch = foundation.frame.stretch(depths) + 0.0 * depths
    moduli = np.array([layer.foundation_modulus for layer in foundation.layers])
    kinds = [(TISSUE, foundation.mass, moduli, stretch)] if np.any(moduli) else []
    if not foundation.is_damped:
        return kinds
    viscosities = np.array([layer.damping for layer in foundation.layers])
    kinds.append((DAMPING, foundation.mass, viscosities, stretch))
    if foundation.frame.power is not None:
        kinds.append((DRAG, foundation.drag, viscosities, -np.ones_like(depths)))
        kinds.append((SLIP, foundation.slip, viscosities, 1.0 / stretch))
    return kinds


def _ends(foundation: Foundation, layer: Layer, depths: Array) -> tuple[Array, Array, Array]:
    """Return where a layer's part of the needle starts and ends on the shapes, and whether there is any (T,)."""
    inside = (depths > layer.start).astype(float)
    starts, _ = foundation.frame.places_of(layer.start, depths)
    ends, _ = foundation.frame.places_of(np.minimum(layer.far_side, depths), depths)
    return starts, np.maximum(starts, ends), inside


def foundation_rate_rows(foundation: Foundation, depths: Array) -> Iterator[RateRow]:
    """Yield what the moving ends of the layers' parts, and a spring at the tip, add to q.(dG/dz) q."""
    if is_one_layer(foundation, depths):
        return
    for layer in foundation.layers:
        inside = (depths > layer.start) * layer.foundation_modulus * foundation.frame.stretch(depths)
        for y, sign in ((np.minimum(layer.far_side, depths), 1.0), (np.full_like(depths, layer.start), -1.0)):
            places, moves = foundation.frame.places_of(y, depths)
            scale = sign * inside * moves
            if np.any(scale):
                yield RateRow(*foundation.shapes.rows(places), scale, is_tissue=True)
    places, moved = foundation.frame.places_of(depths, depths)
    if foundation.tip_stiffness and np.any(moved):
        first, rows = foundation.shapes.rows(places)
        slopes = foundation.shapes.rows(places, 1)[1] * depths[:, None]
        # 2 (row.q)(slope.q) as a difference of squares.
        share = 0.5 * foundation.tip_stiffness * moved / depths
        yield RateRow(first, rows + slopes, share, is_tissue=True)
        yield RateRow(first, rows - slopes, -share, is_tissue=True)
