"""Matrices of the tissue: the layers integrated exactly over the parts of the elements that they hold.

G(z) = sum_i k_i F_i(z), with the unit matrices F_i = integral of psi psi over layer i: the only place where a foundation
modulus is multiplied, so that dG/dk_i = F_i.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.frames import Frame
from fem_needle.gauss import gauss_rule
from fem_needle.path import CutPath
from fem_needle.plant import RestTerms, no_rest_terms
from fem_needle.scene import Layer
from fem_needle.segments import Segment, inserted_segments
from fem_needle.shapes import IntervalIntegrals, Kind, Shapes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Foundation:
    """Layers on shapes.

    Attributes
    ----------
    layers
        The tissue's layers.
    shapes, frame
        The functions w is made of, and where y lies on them.
    tip_stiffness
        Spring that travels with the tip [N/m].
    mass, drag, slip
        Derived: the integrals of the shapes' products; the last two of a viscous tissue past which the shapes move.
    """

    layers: tuple[Layer, ...]
    shapes: Shapes
    frame: Frame
    tip_stiffness: float = 0.0
    mass: IntervalIntegrals = field(init=False)
    drag: IntervalIntegrals = field(init=False)
    slip: IntervalIntegrals = field(init=False)

    def __post_init__(self) -> None:
        kinds: tuple[Kind, ...] = ("mass", "drag", "slip") if self.is_damped and self.frame.power is not None else ("mass",)
        for kind in kinds:
            object.__setattr__(self, kind, self.shapes.interval_integrals(kind, self.frame.power or 0))

    @property
    def is_damped(self) -> bool:
        """Whether any layer has viscosity."""
        return any(layer.damping > 0 for layer in self.layers)

    def unit_stiffness(self, layer: int, depth: float) -> Array:
        """Return F_i(z) [m] of one layer, band storage: the derivative of the tissue matrix by that layer's modulus."""
        unit = tuple(1.0 if index == layer else 0.0 for index in range(len(self.layers)))
        return self._sum(self.mass, unit, depth, self.frame.stretch(depth))

    def stiffness(self, depth: float) -> Array:
        """Return G(z) = sum k_i F_i(z)."""
        moduli = tuple(layer.foundation_modulus for layer in self.layers)
        band = self._sum(self.mass, moduli, depth, self.frame.stretch(depth))
        if self.tip_stiffness:
            banded.add_square(band, self._tip_row(depth), self.tip_stiffness)
        return band

    def _tip_row(self, depth: float, derivative: int = 0) -> Array:
        return self.shapes.row(self.frame.position(depth, depth), derivative)

    def stiffness_rate_product(self, coordinates: Array, depth: float) -> Array:
        """Return dG/dz q: what the moving ends of the segments add, and the stretch."""
        frame = self.frame
        result = self._tip_rate_product(coordinates, depth)
        if frame.stretch_rate:
            moduli = tuple(layer.foundation_modulus for layer in self.layers)
            layers = self._sum(self.mass, moduli, depth, frame.stretch_rate)
            result += banded.multiply(layers, coordinates)
        for segment in inserted_segments(self.layers, depth):
            modulus = self.layers[segment.layer].foundation_modulus * frame.stretch(depth)
            for y, sign in ((segment.end, 1.0), (segment.start, -1.0)):
                rate = sign * modulus * frame.position_rate(y, depth)
                if rate:
                    row = self.shapes.row(frame.position(y, depth))
                    result += rate * (row @ coordinates) * row
        return result

    def _tip_rate_product(self, coordinates: Array, depth: float) -> Array:
        """Return k_t d(psi psi)/dz q of the spring at the tip, which moves along shapes that do not move with it."""
        moved = self.frame.position_rate(depth, depth)
        if not (self.tip_stiffness and moved):
            return np.zeros(self.shapes.size)
        row, slope = self._tip_row(depth), self._tip_row(depth, 1)
        return self.tip_stiffness * moved * (slope * (row @ coordinates) + row * (slope @ coordinates))

    def rest_terms(self, path: CutPath, depth: float, lower: float, upper: float) -> RestTerms:
        """Integrate the rest line exactly over lower <= y < upper.

        Split at nodes, layers and the path's own pieces, Gauss points on each part. With r at fixed y and x(y; z) the
        place on the mesh, dH/dz = k r psi at the tip + integral k r psi' dx/dz dy; the tip counts where it lies in the range.
        """
        total = no_rest_terms(self.shapes.size)
        for segment in inserted_segments(self.layers, depth):
            modulus = self.layers[segment.layer].foundation_modulus
            start, end = max(segment.start, path.edges[0], lower), min(segment.end, upper)
            if modulus and end > start:
                total = total + self._path_between(path, depth, modulus, start, end)
            if modulus and segment.ends_at_tip and lower <= depth < upper:
                tip = float(path.value(np.array(depth)))
                row = self.shapes.row(self.frame.position(depth, depth))
                zero = np.zeros(self.shapes.size)
                total = total + RestTerms(zero, modulus * tip * row, 0.0, 0.5 * modulus * tip**2)
        return total

    def _path_between(self, path: CutPath, depth: float, modulus: float, start: float, end: float) -> RestTerms:
        y, weights = self._gauss_points(start, end, path.edges, depth)
        rest = path.value(y)
        force = modulus * weights * rest
        x, moves = self.frame.positions(y, depth)
        load, rate = self.shapes.weighted_sum(x, force), self.shapes.weighted_sum(x, force * moves, 1)
        return RestTerms(load, rate, 0.5 * float(force @ rest), 0.0)

    def _gauss_points(
        self, start: float, end: float, edges: Array, depth: float
    ) -> tuple[Array, Array]:
        """Return points [m] and weights over y from start to end, split at nodes and at the path's edges."""
        nodes = self.frame.axis_positions(self.shapes.breaks, depth)
        cuts = np.unique(np.concatenate([[start, end], nodes, edges]))
        cuts = cuts[(cuts >= start) & (cuts <= end)]
        points, weights = gauss_rule(self.shapes.quadrature_points)
        sizes = np.diff(cuts)[:, None]
        return (cuts[:-1, None] + sizes * points).ravel(), (sizes * weights).ravel()

    def damping(self, depth: float) -> tuple[Array | None, Array | None, Array | None]:
        """Return C, D, E of the viscosity on dw/dt at fixed y, or Nones without viscosity."""
        if not self.is_damped:
            return None, None, None
        viscosities = tuple(layer.damping for layer in self.layers)
        stretch = self.frame.stretch(depth)
        resisting = self._sum(self.mass, viscosities, depth, stretch)
        if self.frame.power is None:
            return resisting, None, None
        return (
            resisting,
            self._sum(self.drag, viscosities, depth, -1.0),
            self._sum(self.slip, viscosities, depth, 1.0 / stretch),
        )

    def _sum(
        self, integrals: IntervalIntegrals, factors: tuple[float, ...], depth: float, scale: float
    ) -> Array:
        band = banded.zeros(self.shapes.size, self.shapes.half_bandwidth)
        for segment in inserted_segments(self.layers, depth):
            factor = factors[segment.layer]
            if factor:
                integrals.add(*self._ends(segment, depth), factor * scale, band)
        return band

    def _ends(self, segment: Segment, depth: float) -> tuple[float, float]:
        return self.frame.position(segment.start, depth), self.frame.position(segment.end, depth)
