"""Gauss-Legendre points and weights on 0..1."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@lru_cache
def gauss_rule(count: int) -> tuple[Array, Array]:
    """Return points and weights on 0..1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return (points + 1) / 2, weights / 2
