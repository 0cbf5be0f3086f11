"""Where point forces act: guides, lateral loads, a torque, the tip last; and the kinks that they bend inside an element.

w(points) = N q + B P,   B_ij = e^3 / EI g(a_i, a_j) for points in one element of length e, else 0     (docs/theory.md)
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import locate, place_of, place_rate, shapes_at, tip_place

BUBBLE_ENERGY = 204.8  # integral of the square of the second derivative of 16 x^2 (1 - x)^2


@inner
def kink(first, second, degree):
    """Return g: the deflection at one place of a unit element under a unit force at another, beyond its shapes."""
    x, a = min(first, second), max(first, second)
    value = (1.0 - a) ** 2 * x * x * (3.0 * a - x - 2.0 * a * x) / 6.0
    if degree == 4:
        bubbles = x * (1.0 - x) * a * (1.0 - a)
        value -= 256.0 * bubbles * bubbles / BUBBLE_ENERGY
    return value


@inner
def kink_rate(first, second, degree):
    """Return how g changes when both places move together, per unit place."""
    x, a = min(first, second), max(first, second)
    by_x = (1.0 - a) ** 2 * x * (2.0 * a - x - 2.0 * a * x) / 2.0
    by_a = x * x * (1.0 - a) * ((1.0 - a) * (3.0 - 2.0 * x) - 2.0 * (3.0 * a - x - 2.0 * a * x)) / 6.0
    rate = by_x + by_a
    if degree == 4:
        moved = (1.0 - 2.0 * x) * a * (1.0 - a) + (1.0 - 2.0 * a) * x * (1.0 - x)
        rate -= 512.0 * x * (1.0 - x) * a * (1.0 - a) * moved / BUBBLE_ENERGY
    return rate


@inner
def set_points(course, nodes, coef, switches, numbers, positions, shape, rows, rates, first, places, flexible, flexible_rate):
    """Set rows N and dN/dz (p, m), first coordinates, B and dB/dz (p, p) at an instant."""
    frame, length, depth, count = switches[ix.FRAME], numbers[ix.LENGTH], course[ix.DEPTH], switches[ix.POINTS]
    m, stride = coef.shape[1], switches[ix.STRIDE]
    ahead = count - 1 - switches[ix.TURNS]  # guides and lateral loads
    for point in range(count):
        if point == ahead and switches[ix.TURNS]:
            first[point], places[point, 0] = 0, -1.0
            for i in range(m):
                rows[point, i], rates[point, i] = 0.0, 0.0
            rows[point, 1] = 1.0
            continue
        x, moves = tip_place(depth, frame, length), 1.0 if frame == ix.FIXED else 0.0
        if point < ahead:
            x, moves = place_of(positions[point], depth, frame, length), place_rate(positions[point], depth, frame)
        piece = locate(nodes, x)
        shapes_at(coef, nodes, piece, x, shape)
        first[point], places[point, 0] = stride * piece, piece
        places[point, 1] = (x - nodes[piece]) / (nodes[piece + 1] - nodes[piece])
        for i in range(m):
            rows[point, i], rates[point, i] = shape[0, i], moves * shape[1, i]
    if stride and frame == ix.MATERIAL and ahead > 0:
        set_kinks(ahead, nodes, switches[ix.DEGREE], numbers[ix.BENDING_STIFFNESS], places, flexible, flexible_rate)


@inner
def set_kinks(ahead, nodes, degree, stiffness, places, flexible, flexible_rate):
    """Set B and dB/dz of the points in front of the tip, which move backward through the elements."""
    for one in range(ahead):
        piece = int(places[one, 0])
        size = nodes[piece + 1] - nodes[piece]
        scale = size * size * size / stiffness
        for other in range(ahead):
            flexible[one, other], flexible_rate[one, other] = 0.0, 0.0
            if places[one, 0] == places[other, 0]:
                a, b = places[one, 1], places[other, 1]
                flexible[one, other] = scale * kink(a, b, degree)
                flexible_rate[one, other] = -scale / size * kink_rate(a, b, degree)


@inner
def along(row, first, q):
    """Return row . q."""
    total = 0.0
    for i in range(len(row)):
        total += row[i] * q[first + i]
    return total


@inner
def deflection_at(point, rows, first, flexible, q, forces):
    """Return N q + B P at a point."""
    total = along(rows[point], first[point], q)
    for other in range(len(forces)):
        if flexible[point, other] != 0.0:
            total += flexible[point, other] * forces[other]
    return total


@inner
def finite(values):
    """Return whether the sum of values is finite."""
    total = 0.0
    for i in range(len(values)):
        total += values[i]
    return np.isfinite(total)
