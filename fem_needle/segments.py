"""Which part of the needle is in which layer: the one place that knows surface, interfaces and tip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign

from fem_needle.scene import Layer

ROUNDINGS = 1e-12  # of a depth: what a landing on an interface may miss it by


@dataclass(frozen=True)
class Segment:
    """The part of a needle inside one layer.

    Attributes
    ----------
    layer
        Index of the layer.
    start, end
        Position along the insertion axis y [m], ``start < end``.
    ends_at_tip
        Whether the needle's tip is the end; else the layer's far side is.
    """

    layer: int
    start: float
    end: float
    ends_at_tip: bool


def inserted_segments(layers: Sequence[Layer], depth: float) -> tuple[Segment, ...]:
    """Return the segments of a needle whose tip is at y = ``depth`` [m], in the order of the layers."""
    return tuple(
        Segment(index, layer.start, min(layer.far_side, depth), depth <= layer.far_side)
        for index, layer in enumerate(layers)
        if depth > layer.start
    )


def one_sided(layers: Sequence[Layer], depth: float, toward: float) -> float:
    """Return the depth [m], moved off an interface by a few roundings toward the side that a step comes from or goes to.

    Rates by depth jump there: a layer that begins or ends has none yet, or none any more, on the other side.
    """
    slack = ROUNDINGS * max(abs(depth), abs(toward))
    if depth == toward or all(abs(depth - level) > slack for level in interfaces(layers)):
        return depth
    return depth + copysign(min(2 * slack, abs(toward - depth)), toward - depth)


def tip_layer(layers: Sequence[Layer], depth: float) -> int | None:
    """Return the layer that holds the tip, the deeper one at an interface, None in empty space."""
    for index, layer in enumerate(layers):
        if layer.holds(depth):
            return index
    return None


def interfaces(layers: Sequence[Layer]) -> tuple[float, ...]:
    """Return every y [m] at which a layer starts or ends, rising, each once."""
    ends = {layer.far_side for layer in layers} - {float("inf")}
    return tuple(sorted({layer.start for layer in layers} | ends))
