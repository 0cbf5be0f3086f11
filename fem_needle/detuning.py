"""What a mesh does to vibrations that it has to follow for long: their frequencies are wrong, and phases drift apart.

A vibration of frequency omega and unit size that is followed with omega + d is wrong by at most min(2, |d| T) after a time T; one
that decays by exp(-r t) by |d| / (e r) at most, whenever that is. Of a needle that is struck or let go the vibrations are taken
to be as large as 1 / omega^2.
"""

from __future__ import annotations

from math import e

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fem_needle.choices import instants, likely_duration
from fem_needle.free_response import frozen_matrices
from fem_needle.plant import Plant

Array = NDArray[np.float64]

OPPOSITE = 2.0  # of its size: what a vibration is wrong by at most


def detuning(plant: Plant, finer: Plant) -> float:
    """Return how wrong free vibrations become on a mesh over the run, relative to the slowest one, as seen from a finer mesh."""
    duration = likely_duration(plant.scene)
    wrong, sizes = [], []
    for time, depth in instants(plant):
        coarse, _ = _vibrations(plant, depth, time)
        fine, decays = _vibrations(finer, depth, time)
        count = min(len(coarse), len(fine))
        lasting = 1.0 / np.maximum(e * decays[:count], 1.0 / duration)
        wrong.append(np.abs(coarse[:count] - fine[:count]) * lasting)
        sizes.append((fine[0] / fine[:count]) ** 2)
    count = min(len(row) for row in wrong)
    drift = np.mean([row[:count] for row in wrong], axis=0)
    return float(np.max([row[:count] for row in sizes], axis=0) @ np.minimum(drift, OPPOSITE))


def _vibrations(plant: Plant, depth: float, time: float) -> tuple[Array, Array]:
    """Return natural frequencies [rad/s] and rates of decay [1/s] at a frozen depth."""
    mass, damping, stiffness, _ = frozen_matrices(plant, depth, time)
    squares, vectors = eigh(stiffness, mass)
    return np.sqrt(np.maximum(squares, 0.0)), 0.5 * np.sum(vectors * (damping @ vectors), axis=0)
