"""Values in time: value + slope x + curve x^2 + wave, x = time - start of the row; a wave may be the integral of a sinusoid."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.names import (
    ROW_AMPLITUDE,
    ROW_CURVE,
    ROW_OMEGA,
    ROW_PHASE,
    ROW_SLOPE,
    ROW_START,
    ROW_SUMMED,
    ROW_VALUE,
)


@inner
def row_at(rows, offsets, number, time):
    """Return the row of a signal that holds at a time."""
    low, high = offsets[number], offsets[number + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if rows[middle, ROW_START] <= time:
            low = middle
        else:
            high = middle
    return low


@inner
def value_of(row, time):
    """Return the value."""
    x = time - row[ROW_START]
    value = row[ROW_VALUE] + x * (row[ROW_SLOPE] + x * row[ROW_CURVE])
    if row[ROW_AMPLITUDE] != 0.0:
        omega = row[ROW_OMEGA]
        if row[ROW_SUMMED] == 0.0:
            value += row[ROW_AMPLITUDE] * np.sin(omega * time + row[ROW_PHASE])
        else:  # a difference of cosines as a product: nothing cancels
            half = np.sin(0.5 * omega * x) * np.sin(omega * (row[ROW_START] + 0.5 * x) + row[ROW_PHASE])
            value += 2.0 * row[ROW_AMPLITUDE] / omega * half
    return value


@inner
def rate_of(row, time):
    """Return the first derivative."""
    rate = row[ROW_SLOPE] + 2.0 * row[ROW_CURVE] * (time - row[ROW_START])
    if row[ROW_AMPLITUDE] != 0.0:
        angle = row[ROW_OMEGA] * time + row[ROW_PHASE]
        if row[ROW_SUMMED] == 0.0:
            rate += row[ROW_AMPLITUDE] * row[ROW_OMEGA] * np.cos(angle)
        else:
            rate += row[ROW_AMPLITUDE] * np.sin(angle)
    return rate


@inner
def curvature_of(row, time):
    """Return the second derivative."""
    curvature = 2.0 * row[ROW_CURVE]
    if row[ROW_AMPLITUDE] != 0.0:
        angle = row[ROW_OMEGA] * time + row[ROW_PHASE]
        if row[ROW_SUMMED] == 0.0:
            curvature -= row[ROW_AMPLITUDE] * row[ROW_OMEGA] ** 2 * np.sin(angle)
        else:
            curvature += row[ROW_AMPLITUDE] * row[ROW_OMEGA] * np.cos(angle)
    return curvature
