"""Rounding to pixels and to a resolution."""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rounded(value: float, step: float) -> float:
    """Return the multiple of ``step`` nearest to a finite value: step floor(value / step + 1/2).

    Halves go up, to the larger number, also below zero: a pixel that begins half a step below its middle belongs to it, one
    that ends half a step above does not. A step of 0 changes nothing.
    """
    return floor(value / step + 0.5) * step if step else float(value)


def rounded_array(values: Array, step: float) -> Array:
    """Return `rounded` of each value of an array."""
    return np.asarray(np.floor(values / step + 0.5) * step, dtype=np.float64) if step else values
