"""Collocation methods: two stages with a chosen spectral radius at infinite frequency, and Gauss methods.

The nodes are the zeros of P2(x) - alpha P1(x), shifted Legendre polynomials on 0..1, with alpha = (1 - rho)/(1 + rho). Then
R(infinity) = rho: rho = 1 is Gauss (order 4, no numerical damping, keeps quadratic invariants), rho = 0 is Radau IIA (order 3,
L-stable); every member is A-stable. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Collocation:
    """Coefficients of one method on a unit step.

    Attributes
    ----------
    nodes, weights
        c and b, shape (stages,).
    inverse
        A^-1, shape (stages, stages): slopes at the nodes of the polynomial through 0 at the start and given values at the nodes.
    end
        b A^-1: the polynomial's value at the end of the step from its values at the nodes.
    start_slope, end_slope
        Its derivative at the start and at the end, likewise.
    power_slopes
        Derivatives at the start and at the end (rows) of the polynomial through values at the start, the nodes and the end.
    """

    nodes: Array
    weights: Array
    inverse: Array
    end: Array
    start_slope: Array
    end_slope: Array
    power_slopes: Array


@lru_cache
def collocation(spectral_radius: float) -> Collocation:
    """Return the two-stage method with R(infinity) = ``spectral_radius``, 0 to 1."""
    alpha = (1 - spectral_radius) / (1 + spectral_radius)
    middle, half = (3 + alpha) / 6, np.sqrt((3 + alpha) ** 2 / 36 - (1 + alpha) / 6)
    return _with_nodes(np.array([middle - half, min(middle + half, 1.0)]))


@lru_cache
def gauss(count: int) -> Collocation:
    """Return the Gauss method with ``count`` nodes, of order 2 count."""
    return _with_nodes((np.polynomial.legendre.leggauss(count)[0] + 1) / 2)


def _with_nodes(nodes: Array) -> Collocation:
    """Return the collocation method with given nodes, from the powers 1, x, x^2, ... of its derivative's polynomial."""
    count = len(nodes)
    exponents = np.arange(count)
    lagrange = np.linalg.inv(np.vander(nodes, count, increasing=True))  # power coefficients of each Lagrange polynomial
    matrix = (nodes[:, None] ** (exponents + 1) / (exponents + 1)) @ lagrange
    weights = (1 / (exponents + 1)) @ lagrange
    inverse = np.linalg.inv(matrix)
    at_start, at_end = lagrange[0], lagrange.sum(axis=0)
    return Collocation(
        nodes=nodes,
        weights=weights,
        inverse=inverse,
        end=weights @ inverse,
        start_slope=at_start @ inverse,
        end_slope=at_end @ inverse,
        power_slopes=_slopes_through(nodes),
    )


def _slopes_through(nodes: Array) -> Array:
    """Return the end derivatives of the polynomial through 0, the nodes and 1; a node at 1 counts once."""
    places = np.unique(np.concatenate([[0.0], nodes, [1.0]]))
    count = len(places)
    powers = np.linalg.inv(np.vander(places, count, increasing=True))
    slopes = np.stack([powers[1], np.arange(count) @ powers])
    return slopes if count == len(nodes) + 2 else np.insert(slopes, count - 1, 0.0, axis=1)
