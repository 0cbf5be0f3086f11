"""The reference element: cubic Hermite shapes, with a bubble of degree four on top by default.

Local coordinates are (deflection, slope) at the first node, the bubble's amplitude (degree 4 only), (deflection, slope) at the
second node. The bubble ``16 x^2 (1 - x)^2`` vanishes at both ends with its slope, so that the cubic shapes are the
usual ones. Why a bubble: docs/decisions/0002-quartic-elements.md.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEPT = Path(__file__).with_name("reference.json")
BUBBLE_ENERGY = 204.8  # integral of (second derivative of 16 x^2 (1 - x)^2)^2 over the unit element

# Rows: coefficients of 1, x, x^2, x^3, x^4 on the unit element, slopes by x.
_COEFFICIENTS = np.array(
    [
        [1.0, 0.0, -3.0, 2.0, 0.0],
        [0.0, 1.0, -2.0, 1.0, 0.0],
        [0.0, 0.0, 16.0, -32.0, 16.0],
        [0.0, 0.0, 3.0, -2.0, 0.0],
        [0.0, 0.0, -1.0, 1.0, 0.0],
    ]
)


@dataclass(frozen=True)
class ReferenceElement:
    """Matrices on the unit element, assembled once with scikit-fem (`fem_needle.elements.assembly`).

    Attributes
    ----------
    degree
        Polynomial degree, 3 or 4.
    bending
        Integral of psi_i'' psi_j''.
    mass, drag, slip
        Integrals of x^p psi_i psi_j (p = 0), x^p psi_i psi_j' (p = 0, 1) and x^p psi_i' psi_j' (p = 0, 1, 2), first axis p.
    """

    degree: int
    bending: Array
    mass: Array
    drag: Array
    slip: Array

    @property
    def stride(self) -> int:
        """Coordinates from one element's first to the next one's."""
        return self.degree - 1

    @property
    def count(self) -> int:
        """Coordinates of one element."""
        return self.degree + 1

    def unit_shapes(self, place: Array | float, derivative: int = 0) -> Array:
        """Return the shapes (count, ...) of an element of unit length, or a derivative, at places 0..1."""
        coefficients = _derivative_coefficients(self.degree, derivative)
        x = np.asarray(place, dtype=float)
        powers = np.ones((coefficients.shape[1], *x.shape))
        for exponent in range(1, len(powers)):
            powers[exponent] = powers[exponent - 1] * x
        return np.tensordot(coefficients, powers, axes=1)

    def slope_scale(self, length: Array | float) -> Array:
        """Return the factor (count, ...) that turns unit-element slopes into slopes by position."""
        size = np.asarray(length, dtype=float)
        one = np.ones_like(size)
        middle = [one] if self.degree == 4 else []
        return np.stack([one, size, *middle, one, size])


@lru_cache
def _derivative_coefficients(degree: int, derivative: int) -> Array:
    rows = _COEFFICIENTS if degree == 4 else _COEFFICIENTS[[0, 1, 3, 4]]
    return np.ascontiguousarray(polynomial.polyder(rows, derivative, axis=1) if derivative else rows)


@lru_cache
def reference_element(degree: int) -> ReferenceElement:
    """Return the element of degree 3 or 4, with the matrices that are kept."""
    kept = json.loads(KEPT.read_text(encoding="utf-8"))[str(degree)]
    return ReferenceElement(degree, **{name: np.array(values) for name, values in kept.items()})
