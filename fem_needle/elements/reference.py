"""The reference element: cubic Hermite shapes, with a bubble of degree four on top by default.

Local coordinates are (deflection, slope) at the first node, the bubble's amplitude (degree 4 only), (deflection, slope) at the
second node. The bubble ``16 x^2 (1 - x)^2`` vanishes at both ends with its slope, so that the cubic shapes are the
usual ones. Why a bubble: docs/decisions/0002-quartic-elements.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import skfem
from numpy.polynomial import polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


class HermiteWithBubble(skfem.ElementLineHermite):
    """Hermite line element with one interior coordinate: how far the middle stands off the cubic."""

    interior_dofs = 1
    maxdeg = 4
    dofnames = ["u", "u_x", "bubble"]  # noqa: RUF012 (scikit-fem's interface)
    doflocs = np.array([[0.0], [0.0], [1.0], [1.0], [0.5]])

    def gdof(self, F, w, i):  # type: ignore[no-untyped-def]
        """Evaluate coordinate ``i`` of a function given with its derivatives."""
        if i < 4:
            return super().gdof(F, w, i)
        (left,), (right,) = w["v"][0], w["v"][1]
        middle = 0.5 * (F[()](left) + F[()](right)) + (right - left) / 8 * (F[(0,)](left) - F[(0,)](right))
        return F[()](0.5 * (left + right)) - middle


@dataclass(frozen=True)
class ReferenceElement:
    """Matrices on the unit element, assembled once with scikit-fem.

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
    """Assemble the reference matrices of degree 3 or 4 with scikit-fem.

    The unit cell alone is assembled: scikit-fem's global Vandermonde matrices lose digits as cells get small.
    """
    element = skfem.ElementLineHermite() if degree == 3 else HermiteWithBubble()
    basis = skfem.Basis(skfem.MeshLine(np.array([0.0, 1.0])), element, intorder=2 * degree + 2)
    order = np.array([0, 1, 2, 3] if degree == 3 else [0, 1, 4, 2, 3])

    def assembled(integrand: object) -> Array:
        dense = skfem.BilinearForm(integrand).assemble(basis).toarray()
        return dense[np.ix_(order, order)]

    return ReferenceElement(
        degree,
        # Exact multiples of 0.2: the last digit, times (elements)^4, is an error of the tip.
        bending=np.round(assembled(lambda u, v, w: u.hess[0, 0] * v.hess[0, 0]), 9) + 0.0,
        mass=assembled(lambda u, v, w: u * v),
        drag=np.stack([assembled(lambda u, v, w, p=p: w.x[0] ** p * u.grad[0] * v) for p in (0, 1)]),
        slip=np.stack([assembled(lambda u, v, w, p=p: w.x[0] ** p * u.grad[0] * v.grad[0]) for p in (0, 1, 2)]),
    )
