"""Surfaces made of triangles, which every way of drawing understands."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Triangles = NDArray[np.int64]

AROUND = 12  # points around a tube
HEAD = 0.35  # of an arrow's length
HEAD_WIDTH = 3.0  # times the shaft's radius


@dataclass(frozen=True, eq=False)
class Surface:
    """Points [mm], shape (n, 3), and the triangles between them, shape (m, 3)."""

    points: Array
    triangles: Triangles


def together(surfaces: Iterable[Surface]) -> Surface:
    """Return several surfaces as one; empty without any."""
    found = list(surfaces)
    if not found:
        return Surface(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    starts = np.cumsum([0, *(len(surface.points) for surface in found[:-1])])
    triangles = [surface.triangles + start for surface, start in zip(found, starts, strict=True)]
    return Surface(np.concatenate([surface.points for surface in found]), np.concatenate(triangles))


def tube(line: Array, radii: Array | float) -> Surface:
    """Return a tube about a line of points (n, 3), its rings across the x axis, both ends closed."""
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack((np.zeros(AROUND), np.cos(angles), np.sin(angles)))
    sizes = np.broadcast_to(np.asarray(radii, dtype=float), (len(line),))
    points = (line[:, None, :] + sizes[:, None, None] * ring).reshape(-1, 3)
    return Surface(np.concatenate((points, line[[0, -1]])), _skin(len(line)))


def arrow(start: Array, way: Array, radius: float) -> Surface:
    """Return an arrow from a point (3,) along a vector (3,), its shaft of a radius."""
    length = float(np.linalg.norm(way))
    along = way / length
    across = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    turn = np.column_stack((along, across, np.cross(along, across)))
    neck = (1.0 - HEAD) * length
    line = np.zeros((4, 3))
    line[:, 0] = (0.0, neck, neck, length)
    body = tube(line, np.array([radius, radius, HEAD_WIDTH * radius, 0.0]))
    return Surface(start + body.points @ turn.T, body.triangles)


def box(start: float, end: float, half_width: float) -> Surface:
    """Return a block from x = start to x = end."""
    corners = np.array([[x, y, z] for x in (start, end) for y in (-half_width, half_width) for z in (-half_width, half_width)])
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = [half for a, b, c, d in sides for half in ((a, b, c), (a, c, d))]
    return Surface(corners, np.array(triangles, dtype=np.int64))


def plate(place: float, inner: float, outer: float) -> Surface:
    """Return a disc across the x axis with a hole in it."""
    angles = 2.0 * np.pi * np.arange(2 * AROUND) / (2 * AROUND)
    ring = np.column_stack((np.zeros_like(angles), np.cos(angles), np.sin(angles)))
    middle = np.array([place, 0.0, 0.0])
    return Surface(np.concatenate((middle + inner * ring, middle + outer * ring)), _between(0, len(angles), len(angles)))


def _skin(rings: int) -> Triangles:
    """Return the triangles of a tube with so many rings; the last two points are the middles of its ends."""
    sides = [_between(AROUND * ring, AROUND * (ring + 1), AROUND) for ring in range(rings - 1)]
    here, first, last = np.arange(AROUND), AROUND * rings, AROUND * (rings - 1)
    near = np.column_stack((np.full(AROUND, first), np.roll(here, -1), here))
    far = np.column_stack((np.full(AROUND, first + 1), last + here, last + np.roll(here, -1)))
    return np.concatenate((*sides, near, far))


def _between(one: int, other: int, count: int) -> Triangles:
    """Return the triangles between two rings of as many points, whose first points have these numbers."""
    here = np.arange(count)
    following = np.roll(here, -1)
    near = np.column_stack((one + here, one + following, other + here))
    far = np.column_stack((one + following, other + following, other + here))
    return np.concatenate((near, far))
