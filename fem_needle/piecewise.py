"""Functions on a line as polynomials on pieces: what compiled code evaluates and integrates without asking a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Functions = Callable[[Array, int], Array]

FITTED_DEGREE = 12
FITTED_ERROR = 1e-13  # of the largest second derivative
POINTS = FITTED_DEGREE - 1  # at which second derivatives are interpolated
# Errors that stay above this and fall more slowly with the size of the parts are rounding, which more parts do not lower.
ROUNDING, ROUNDING_ORDER = FITTED_ERROR / 4, POINTS / 2


@dataclass(frozen=True, eq=False)
class PiecewisePolynomials:
    """Functions sum_k c_k x^k with x = (place - node) / (size of the piece) in 0..1.

    Attributes
    ----------
    nodes
        Rising ends of the pieces, shape (P + 1,): a length [m] or a fraction (1), as the shapes count places.
    coefficients
        c_k of the m functions that live on each piece, shape (P, m, degree + 1), in the functions' own units.
    stride
        Coordinates from one piece's first function to the next one's; 0 where all functions live on all pieces.
    """

    nodes: Array
    coefficients: Array
    stride: int


def fitted_polynomials(functions: Functions, breaks: Array) -> PiecewisePolynomials:
    """Return polynomials of degree 12 on equal parts of the intervals between breaks, no more parts than they need.

    Second derivatives are interpolated and integrated twice, because they are what polynomials miss most.

    Parameters
    ----------
    functions
        Called with places (n,) and the order of a derivative, 0 to 2; returns (m, n). Slopes are continuous.
    breaks
        Rising places (B,) between which the functions are smooth and turn once or so.

    Returns
    -------
    PiecewisePolynomials
        Second derivatives are right to 1e-13 of each function's largest one, or to the rounding of the functions.
    """
    nodes = np.append(_parts(breaks, _numbers_of_parts(functions, breaks))[1], breaks[-1])
    starts, sizes = nodes[:-1], np.diff(nodes)
    points, analysis, _, _ = _interpolation()
    curvatures = _sampled(functions, starts, sizes, points) * sizes[:, None] ** 2
    powers = np.arange(1, POINTS + 1)
    integrated = curvatures @ analysis.T @ _powers_of_chebyshev() / (powers * (powers + 1))
    ends = np.stack([functions(starts, 0), functions(starts, 1) * sizes], axis=-1)
    return PiecewisePolynomials(nodes, np.concatenate([ends, integrated], axis=-1).swapaxes(0, 1).copy(), 0)


def _numbers_of_parts(functions: Functions, breaks: Array) -> Integers:
    """Return into how many equal parts each interval (B - 1,) is to be divided."""
    numbers = np.ones(len(breaks) - 1, dtype=np.int64)
    points, _, _, _ = _interpolation()
    largest = np.max(np.abs(_sampled(functions, breaks[:-1], np.diff(breaks), points)), axis=(1, 2))
    errors = _errors(functions, breaks, numbers, largest)
    pending = errors > FITTED_ERROR
    while pending.any():
        # What polynomials miss falls as this power of the size, or a little more slowly: never too many parts.
        wanted = np.max(errors * pending, axis=0) / FITTED_ERROR
        tried = np.where(wanted > 1, np.floor(numbers * wanted ** (1 / POINTS)) + 1, 0).astype(np.int64)
        found = _errors(functions, breaks, tried, largest)
        expected = np.maximum(errors * (numbers / np.maximum(tried, 1)) ** ROUNDING_ORDER, ROUNDING)
        rounding = pending & (tried > 0) & (found > expected)
        divided = (tried > 0) & ~rounding.any(axis=0)  # elsewhere rounding has asked for too many
        numbers, errors = np.where(divided, tried, numbers), np.where(divided, found, errors)
        pending &= ~rounding & (errors > FITTED_ERROR)
    return numbers


def _errors(functions: Functions, breaks: Array, numbers: Integers, largest: Array) -> Array:
    """Return what is missing (m, B - 1) of second derivatives if the intervals are divided, as a part of the largest (m,)."""
    interval, starts, sizes = _parts(breaks, numbers)
    points, _, between, prediction = _interpolation()
    missing = _sampled(functions, starts, sizes, points) @ prediction.T - _sampled(functions, starts, sizes, between)
    result = np.zeros((len(numbers), len(largest)))
    np.maximum.at(result, interval, np.max(np.abs(missing), axis=2).T)
    return result.T / np.maximum(largest, np.finfo(float).tiny)[:, None]


def _parts(breaks: Array, numbers: Integers) -> tuple[Integers, Array, Array]:
    """Return interval, start and size (P,) of the parts into which the intervals are divided."""
    interval = np.repeat(np.arange(len(numbers)), numbers)
    part = np.arange(len(interval)) - (np.cumsum(numbers) - numbers)[interval]
    sizes = np.diff(breaks)[interval] / numbers[interval]
    return interval, breaks[interval] + part * sizes, sizes


def _sampled(functions: Functions, starts: Array, sizes: Array, points: Array) -> Array:
    """Return second derivatives (m, P, points) at points 0..1 of each part."""
    places = starts[:, None] + sizes[:, None] * points
    values = functions(places.ravel(), 2)
    return values.reshape(len(values), *places.shape)


@lru_cache
def _interpolation() -> tuple[Array, Array, Array, Array]:
    """Return Chebyshev's points in 0..1 and the matrix from values there to a series; places between them and the values there.

    None is an end, where a second derivative may jump. The places between are where interpolation misses most.
    """
    points = -np.cos((2 * np.arange(POINTS) + 1) * np.pi / (2 * POINTS))
    between = -np.cos(np.arange(1, POINTS) * np.pi / POINTS)
    analysis = np.asarray(chebyshev.chebvander(points, POINTS - 1).T * (2 / POINTS), dtype=float)
    analysis[0] /= 2
    prediction: Array = chebyshev.chebvander(between, POINTS - 1) @ analysis
    return (1 + points) / 2, analysis, (1 + between) / 2, prediction


@lru_cache
def _powers_of_chebyshev() -> Array:
    """Return the coefficients (series, power of x) of Chebyshev's polynomials of 2 x - 1: whole numbers, exact."""
    rows = np.zeros((POINTS, POINTS))
    rows[0, 0], rows[1, :2] = 1.0, (-1.0, 2.0)
    for order in range(2, POINTS):
        rows[order] = np.convolve((-2.0, 4.0), rows[order - 1])[:POINTS] - rows[order - 2]
    return rows
