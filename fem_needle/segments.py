"""Which part of the needle is in which layer: the one place that knows surface, interfaces and tip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import Layer

Array = NDArray[np.float64]

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
    return float(all_one_sided(layers, np.array([depth]), np.array([toward]))[0])


def all_one_sided(layers: Sequence[Layer], depths: Array, toward: Array) -> Array:
    """Return the same for many depths [m] (T,)."""
    slack = ROUNDINGS * np.maximum(np.abs(depths), np.abs(toward))
    near = np.zeros(depths.shape, dtype=bool)
    for level in interfaces(layers):
        near |= np.abs(depths - level) <= slack
    return np.where(near, depths + np.copysign(np.minimum(2 * slack, np.abs(toward - depths)), toward - depths), depths)


def tip_layer(layers: Sequence[Layer], depth: float) -> int | None:
    """Return the layer that holds the tip, the deeper one at an interface, None in empty space."""
    for index, layer in enumerate(layers):
        if layer.holds(depth):
            return index
    return None


def tip_values(layers: Sequence[Layer], depths: Array, value: Callable[[Layer], float]) -> Array:
    """Return a value of the layer that holds each of many tips y = ``depths`` [m] (T,), as `tip_layer`; 0 in empty space."""
    result = np.zeros_like(depths)
    for layer in reversed(layers):
        result = np.where((depths >= layer.start) & (depths < layer.far_side), value(layer), result)
    return result


def one_layer_holds(layers: Sequence[Layer], deepest: float) -> bool:
    """Return whether there is one layer, and a needle whose tip gets down to ``deepest`` [m] never leaves it."""
    return len(layers) == 1 and layers[0].start <= 0.0 and deepest <= layers[0].far_side


def interfaces(layers: Sequence[Layer]) -> tuple[float, ...]:
    """Return every y [m] at which a layer starts or ends, rising, each once."""
    ends = {layer.far_side for layer in layers} - {float("inf")}
    return tuple(sorted({layer.start for layer in layers} | ends))
