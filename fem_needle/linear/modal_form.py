"""A linear model in its own vibrations: states with a meaning, well scaled, and as few of them as are wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import ComputationError, SceneError
from fem_needle.free_response import vibrations
from fem_needle.linear.model import LinearModel, SecondOrder, Signal

Array = NDArray[np.float64]

AXIAL = ("depth", "base_angle")  # coordinates that stay what they are


def modal(model: LinearModel, modes: int | None = None) -> LinearModel:
    """Return the model in coordinates of the undamped lateral vibrations at a held depth.

    x = Phi eta + (dx/dz) z with Phi.mass.Phi = 1, Phi.stiffness.Phi = omega^2 and the equilibria's dx/dz replaces the model's own
    coordinates; depth and base angle stay. Without ``modes`` nothing is lost; otherwise the faster vibrations are left
    out, with what they add to gains and, by damping, to each other. The needle still follows the depth as its equilibria do.

    Parameters
    ----------
    model
        Any linear model.
    modes
        How many vibrations, the slowest ones; None: all.

    Raises
    ------
    SceneError
        If there are not so many.
    ComputationError
        If the lateral stiffness is not positive.
    """
    half = len(model.states) // 2
    lateral = np.array([signal.name not in AXIAL for signal in model.states[:half]])
    count = int(np.sum(lateral))
    kept = count if modes is None else modes
    if not 1 <= kept <= count:
        raise SceneError(f"modes: out of range (got {kept}; allowed 1 to {count})")
    parts = model.second_order
    squares, shapes = _vibrations(parts, lateral)
    axial = np.flatnonzero(~lateral)
    before = int(np.sum(axial == 0))  # the depth comes first, the base last
    basis = np.zeros((half, len(axial) + kept))
    basis[np.ix_(lateral, np.arange(before, before + kept))] = shapes[:, :kept]
    for number, index in enumerate(axial):
        column = number if number < before else number + kept
        basis[index, column] = 1.0
        basis[lateral, column] = -np.linalg.solve(parts.stiffness[np.ix_(lateral, lateral)], parts.stiffness[lateral, index])
    small = _projected(parts, basis, slice(before, before + kept), squares[:kept])
    names = [model.states[index] for index in axial]
    positions = (*names[:before], *(Signal(f"mode_{one}", "kg^0.5 m") for one in range(1, kept + 1)), *names[before:])
    rates = tuple(
        Signal("speed" if one.name == "depth" else f"{one.name}_rate", f"{one.unit}/s") for one in positions
    )
    system = small.state_space()
    return LinearModel(*system, (*positions, *rates), model.inputs, model.outputs, model.operating_point, small)


def _vibrations(parts: SecondOrder, lateral: Array) -> tuple[Array, Array]:
    """Return omega^2, rising, and the shapes of unit mass, their tips at positive deflections.

    Raises
    ------
    ComputationError
        If the stiffness is not positive.
    """
    mass, stiffness = (_symmetric(matrix[np.ix_(lateral, lateral)]) for matrix in (parts.mass, parts.stiffness))
    try:
        squares, shapes = vibrations(mass, stiffness)
    except np.linalg.LinAlgError:
        raise ComputationError("the lateral stiffness is not positive: the needle has no vibrations there") from None
    return squares, shapes * np.where(parts.rows[0, lateral] @ shapes < 0.0, -1.0, 1.0)


def lateral_frequencies(model: LinearModel) -> Array:
    """Return the undamped natural frequencies of the lateral motion at a held depth [rad/s], rising."""
    half = len(model.states) // 2
    lateral = np.array([signal.name not in AXIAL for signal in model.states[:half]])
    return np.asarray(np.sqrt(_vibrations(model.second_order, lateral)[0]))


def _symmetric(matrix: Array) -> Array:
    return np.asarray(0.5 * (matrix + matrix.T), dtype=float)


def _projected(parts: SecondOrder, basis: Array, block: slice, squares: Array) -> SecondOrder:
    """Project; what is diagonal by construction is set, for a product would round it by the fastest vibration."""
    stiffness = basis.T @ parts.stiffness @ basis
    half = basis[:, block].T @ (0.5 * (parts.stiffness - parts.stiffness.T)) @ basis[:, block]
    stiffness[block, block] = np.diag(squares) + half
    mass = basis.T @ parts.mass @ basis
    mass[block, block] = np.eye(len(squares))
    first, second, third = (basis.T @ force for force in parts.forces)
    return replace(
        parts,
        mass=mass,
        damping=basis.T @ parts.damping @ basis,
        stiffness=stiffness,
        forces=(first, second, third),
        rows=parts.rows @ basis,
    )
