"""Vibrations of a needle at a frozen depth: small dense eigenproblems, for estimates and cosines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space

from fem_needle import banded
from fem_needle.plant import Plant

Array = NDArray[np.float64]



def frozen_matrices(plant: Plant, depth: float, time: float) -> tuple[Array, Array, Array, Array]:
    """Return mass, damping, stiffness and the tip's row at a frozen depth, for coordinates that obey clamp and guides."""
    operators, points, clamped = plant.operators(depth, time), plant.points(depth), plant.prescribed
    rigid = [index for index in range(points.guides) if points.guide_compliance[index] == 0.0]
    basis = np.eye(plant.size - clamped) if operators.subspace is None else operators.subspace
    if rigid:
        basis = basis @ null_space(points.rows[rigid, clamped:] @ basis)

    def reduced(band: Array | None) -> Array:
        if band is None:
            return np.zeros((basis.shape[1], basis.shape[1]))
        return basis.T @ banded.to_dense(banded.trailing(band, clamped)) @ basis

    stiffness = reduced(operators.stiffness)
    for index in set(range(points.guides)) - set(rigid):
        row = points.rows[index, clamped:] @ basis
        stiffness = stiffness + np.outer(row, row) / points.guide_compliance[index]
    return reduced(operators.mass), reduced(operators.damping), stiffness, basis.T


def vibrations(mass: Array, stiffness: Array) -> tuple[Array, Array]:
    """Return omega^2, rising, and the shapes of unit mass of mass phi = (1 / omega^2) stiffness phi, stiffness positive.

    The slow ones keep all their digits this way round; stiffness phi = omega^2 mass phi loses eps of the largest omega^2.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the stiffness is not positive.
    """
    inverse, shapes = eigh(mass, stiffness)
    inverse, shapes = inverse[::-1], shapes[:, ::-1]
    return 1.0 / inverse, shapes / np.sqrt(inverse)


def natural_frequencies(plant: Plant, depth: float, time: float = 0.0) -> Array:
    """Return the undamped natural frequencies at a frozen depth [rad/s], rising."""
    mass, _, stiffness, _ = frozen_matrices(plant, depth, time)
    return np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0.0))
