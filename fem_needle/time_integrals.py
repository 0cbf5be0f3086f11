"""Integrals of time functions beyond the first."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.scene import TimeFunction

POINTS = 6  # Gauss points on a piece: exact for tables, close to it for sinusoids that the samples resolve
PIECES = 8  # between two marks


def twice_integrated(function: TimeFunction, times: Sequence[float]) -> NDArray[np.float64]:
    """Return the double integral over time, from rest at ``times[0]`` = 0, at rising times [s]."""
    marks = np.array(sorted({*times, *(t for t in function.breakpoints if times[0] < t < times[-1])}))
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    total, found = 0.0, {float(marks[0]): 0.0}
    for start, end in pairwise(marks.tolist()):
        for low, high in pairwise(np.linspace(start, end, PIECES + 1).tolist()):
            nodes = low + 0.5 * (high - low) * (places + 1)
            total += 0.5 * (high - low) * float(weights @ function.integral(nodes))
        found[end] = total
    return np.array([found[time] for time in times])
