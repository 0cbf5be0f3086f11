"""Polynomials on pieces, evaluated and integrated in the plainest way."""

import numpy as np
from numpy.polynomial import polynomial


def rows(found, size, places, derivative=0):
    """All coordinates' functions (size, places), or a derivative."""
    result = np.zeros((size, len(places)))
    pieces = np.clip(np.searchsorted(found.nodes, places, side="right") - 1, 0, len(found.nodes) - 2)
    for column, (piece, place) in enumerate(zip(pieces, places, strict=True)):
        length = found.nodes[piece + 1] - found.nodes[piece]
        coefficients = polynomial.polyder(found.coefficients[piece].T, derivative)
        values = polynomial.polyval((place - found.nodes[piece]) / length, coefficients) / length**derivative
        first = found.stride * piece
        result[first : first + len(values), column] = values
    return result


def mass(found, size):
    """Integrals (size, size) of products of two functions over the whole line, power by power."""
    powers = np.arange(found.coefficients.shape[2])
    products = 1 / (powers[:, None] + powers + 1)
    result = np.zeros((size, size))
    for piece, (coefficients, length) in enumerate(zip(found.coefficients, np.diff(found.nodes), strict=True)):
        here = slice(found.stride * piece, found.stride * piece + len(coefficients))
        result[here, here] += length * coefficients @ products @ coefficients.T
    return result


def misses(found, shapes, derivative=0, places=300):
    """What the polynomials miss of each function at random places, as a part of its largest value there (size,)."""
    line = found.nodes[0] + (found.nodes[-1] - found.nodes[0]) * np.random.default_rng(derivative).uniform(size=places)
    expected = np.array([shapes.row(float(place), derivative) for place in line]).T
    largest = np.max(np.abs(expected), axis=1)
    missing = np.max(np.abs(rows(found, len(expected), line, derivative) - expected), axis=1)
    return missing / np.where(largest > 0, largest, 1.0)


def mass_misses(found, dense):
    """What the integrals of products miss, as a part of what the two functions amount to."""
    norms = np.sqrt(np.diag(dense))
    return np.abs(mass(found, len(dense)) - dense) / np.outer(norms, norms)
