"""Values in time: value + slope x + curve x^2 + wave, x = time - start of the row; a wave may be the integral of a sinusoid."""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.compilation import inner


@inner
def row_at(rows, offsets, number, time):
    """Return the row of a signal that holds at a time."""
    low, high = offsets[number], offsets[number + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if rows[middle, ix.ROW_START] <= time:
            low = middle
        else:
            high = middle
    return low


@inner
def value_of(row, time):
    """Return the value."""
    x = time - row[ix.ROW_START]
    value = row[ix.ROW_VALUE] + x * (row[ix.ROW_SLOPE] + x * row[ix.ROW_CURVE])
    if row[ix.ROW_AMPLITUDE] != 0.0:
        omega = row[ix.ROW_OMEGA]
        if row[ix.ROW_SUMMED] == 0.0:
            value += row[ix.ROW_AMPLITUDE] * np.sin(omega * time + row[ix.ROW_PHASE])
        else:  # a difference of cosines as a product: nothing cancels
            half = np.sin(0.5 * omega * x) * np.sin(omega * (row[ix.ROW_START] + 0.5 * x) + row[ix.ROW_PHASE])
            value += 2.0 * row[ix.ROW_AMPLITUDE] / omega * half
    return value


@inner
def rate_of(row, time):
    """Return the first derivative."""
    rate = row[ix.ROW_SLOPE] + 2.0 * row[ix.ROW_CURVE] * (time - row[ix.ROW_START])
    if row[ix.ROW_AMPLITUDE] != 0.0:
        angle = row[ix.ROW_OMEGA] * time + row[ix.ROW_PHASE]
        if row[ix.ROW_SUMMED] == 0.0:
            rate += row[ix.ROW_AMPLITUDE] * row[ix.ROW_OMEGA] * np.cos(angle)
        else:
            rate += row[ix.ROW_AMPLITUDE] * np.sin(angle)
    return rate


@inner
def curvature_of(row, time):
    """Return the second derivative."""
    curvature = 2.0 * row[ix.ROW_CURVE]
    if row[ix.ROW_AMPLITUDE] != 0.0:
        angle = row[ix.ROW_OMEGA] * time + row[ix.ROW_PHASE]
        if row[ix.ROW_SUMMED] == 0.0:
            curvature -= row[ix.ROW_AMPLITUDE] * row[ix.ROW_OMEGA] ** 2 * np.sin(angle)
        else:
            curvature += row[ix.ROW_AMPLITUDE] * row[ix.ROW_OMEGA] * np.cos(angle)
    return curvature
