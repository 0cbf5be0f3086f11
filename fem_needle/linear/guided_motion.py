"""What guides make of small motions: rigid ones take a coordinate, elastic ones and a model's own flexibility add stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from fem_needle.linear.small_motion import SmallMotion

Array = NDArray[np.float64]

RIGID = 1e-8  # of the needle's own compliance at the guides: what is less flexible holds rigidly


@dataclass(frozen=True, eq=False)
class Guided:
    """Guides at an operating point.

    Attributes
    ----------
    constraints
        Rows that vanish on every possible motion xi = (z, q), shape (rigid, 1 + size).
    reactions, reactions_to_forces
        Changes of the guides' forces with xi and with the other point forces, shapes (guides, 1 + size), (guides, others);
        without those of rigid directions, which do no work.
    """

    constraints: Array
    reactions: Array
    reactions_to_forces: Array


def guided(motion: SmallMotion, clamped: int) -> Guided:
    """Split the guides into rigid directions and springs.

    With W = B + 1 / stiffness at the guides, N xi + W R + B F = 0. Directions in which W is below `RIGID` of the needle's own
    compliance are constraints; the others are springs of flexibility W.

    Parameters
    ----------
    motion
        Equations with the guides' rows.
    clamped
        How many leading coordinates are prescribed.
    """
    points, guides, size = motion.points, motion.points.guides, motion.rows.shape[1]
    if not guides:
        return Guided(np.zeros((0, size)), np.zeros((0, size)), np.zeros((0, len(points.rows))))
    rows = motion.rows[:guides]
    free = 1 + clamped
    basis = np.eye(size - free) if motion.subspace is None else motion.subspace
    reached = rows[:, free:] @ basis
    own = reached @ np.linalg.solve(basis.T @ motion.stiffness[free:, free:] @ basis, reached.T)
    flexibility = points.flexibility[:guides, :guides] + np.diag(points.guide_compliance)
    values, vectors = np.linalg.eigh(flexibility)
    soft = values > RIGID * float(np.max(np.diag(own)))
    springs = (vectors[:, soft] / values[soft]) @ vectors[:, soft].T
    return Guided(vectors[:, ~soft].T @ rows, -springs @ rows, -springs @ points.flexibility[:guides, guides:])


@dataclass(frozen=True, eq=False)
class Coordinates:
    """xi = free @ x + given @ a: independent coordinates x, prescribed ones a, constraints obeyed.

    Attributes
    ----------
    free, given
        Shapes (1 + size, states / 2) and (1 + size, clamped).
    """

    free: Array
    given: Array


def independent_coordinates(
    constraints: Array, clamped: int, *, moves: bool, subspace: Array | None = None
) -> Coordinates:
    """Return coordinates that obey clamp, rigid guides and a subspace; the depth is the first where it moves."""
    size = constraints.shape[1]
    first = 1 + clamped
    directions = np.eye(size - first) if subspace is None else subspace
    held = constraints[:, first:] @ directions
    basis = directions @ null_space(held) if len(held) else directions
    inverse = directions @ np.linalg.pinv(held) if len(held) else np.zeros((size - first, 0))
    free = np.zeros((size, moves + basis.shape[1]))
    free[first:, moves:] = basis
    if moves:
        free[0, 0] = 1.0
        free[first:, 0] = -inverse @ constraints[:, 0]
    given = np.zeros((size, clamped))
    given[1:first] = np.eye(clamped)
    given[first:] = -inverse @ constraints[:, 1:first]
    return Coordinates(free, given)
