"""What a point force does inside an element beyond the element's own shapes.

Clamp an element at both ends and push at place a: it takes the shape h^3/EI g(x, a), whose third derivative jumps at a. In the
bending energy this shape is orthogonal to the cubic shapes; what it shares with the bubble is taken off. Adding force times the
rest of it to the deflection keeps a point force exact wherever it lies, and costs no coordinate: a point at a node adds
nothing. Source: Green's function of the clamped-clamped beam (docs/theory.md, section "Point forces").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem_needle.elements.reference import BUBBLE_ENERGY

Array = NDArray[np.float64]


def kink(place: Array | float, force_place: Array | float, degree: int, derivative: int = 0) -> Array:
    """Return the shape g (1), or a derivative by place, at places 0..1 of an element pushed at ``force_place``, one or each."""
    x = np.asarray(place, dtype=float)
    left = _left_part(x, force_place, derivative)
    right = (-1) ** derivative * _left_part(1 - x, 1 - force_place, derivative)
    shape = np.where(x <= force_place, left, right)
    if degree == 4:
        shape = shape - _bubble(x, derivative) * _bubble(np.asarray(force_place), 0) / BUBBLE_ENERGY
    return shape


def kink_compliance(first: Array, second: Array, degree: int) -> Array:
    """Return g(first, second), the deflection (1) at one place under a unit force at another."""
    x, a = np.minimum(first, second), np.maximum(first, second)
    compliance = (1 - a) ** 2 * x**2 * (3 * a - x - 2 * a * x) / 6
    if degree == 4:
        compliance -= 256 * (x * (1 - x) * a * (1 - a)) ** 2 / BUBBLE_ENERGY
    return np.asarray(compliance)


def kink_shift_rate(first: Array, second: Array, degree: int) -> Array:
    """Return how g(first, second) changes when both places move together, per unit place."""
    x, a = np.minimum(first, second), np.maximum(first, second)
    by_x = (1 - a) ** 2 * x * (2 * a - x - 2 * a * x) / 2
    by_a = x**2 * (1 - a) * ((1 - a) * (3 - 2 * x) - 2 * (3 * a - x - 2 * a * x)) / 6
    rate = by_x + by_a
    if degree == 4:
        moved = (1 - 2 * x) * a * (1 - a) + (1 - 2 * a) * x * (1 - x)
        rate -= 512 * x * (1 - x) * a * (1 - a) * moved / BUBBLE_ENERGY
    return np.asarray(rate)


def _left_part(x: Array, a: Array | float, derivative: int) -> Array:
    """Derivatives of (1 - a)^2 x^2 (3 a - x - 2 a x) / 6, valid for x <= a."""
    factor = (1 - a) ** 2
    if derivative == 0:
        return factor * x**2 * (3 * a - x - 2 * a * x) / 6
    if derivative == 1:
        return factor * x * (2 * a - x - 2 * a * x) / 2
    if derivative == 2:
        return factor * (a - x - 2 * a * x)
    return factor * (-1 - 2 * a) * np.ones_like(x)


def _bubble(x: Array, derivative: int) -> Array:
    if derivative == 0:
        return 16 * x**2 * (1 - x) ** 2
    if derivative == 1:
        return 32 * x * (1 - x) * (1 - 2 * x)
    if derivative == 2:
        return 32 * (1 - 6 * x + 6 * x**2)
    return 192 * (2 * x - 1)
