"""Krylov's functions: the beam on a foundation carried from one end of a piece to the other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

LONGEST_STEP = 1.0
"""Largest (k / 4EI)^(1/4) h over which the series are meant to carry a state [1]."""

_TERMS = 8  # at LONGEST_STEP the terms fall as 4^n / (4n)!: the eighth is below 1e-30


def characteristic_number(relative_modulus: ArrayLike) -> NDArray[np.float64]:
    """Hetenyi's lambda = (k / 4EI)^(1/4).

    Parameters
    ----------
    relative_modulus
        Foundation modulus over bending stiffness, k / EI [1/m^4].

    Returns
    -------
    numpy.ndarray
        lambda [1/m], shape of the input.
    """
    return (np.asarray(relative_modulus, dtype=float) / 4.0) ** 0.25


def krylov_functions(relative_modulus: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
    """Krylov's functions Y_m(x) = sum_n (-k/EI)^n x^(4n+m) / (4n+m)!, m = 0..4.

    They solve Y'''' + (k/EI) Y = 0 for m < 4, with Y_m' = Y_(m-1) and Y_0' = -(k/EI) Y_3. The power series
    has no special case at k = 0 (cubic) and loses no digit as long as lambda x <= `LONGEST_STEP`.

    Parameters
    ----------
    relative_modulus
        k / EI [1/m^4], any shape.
    distance
        x [m], a shape that broadcasts with it.

    Returns
    -------
    numpy.ndarray
        Shape (5, ...), Y_m in m^m.

    Notes
    -----
    A. N. Krylov's functions as in Hetenyi, Beams on Elastic Foundation (1946), chapter III.
    """
    modulus, x = np.broadcast_arrays(np.asarray(relative_modulus, float), np.asarray(distance, float))
    quartic = -modulus * x**4
    functions = []
    for order in range(5):
        total = np.zeros_like(x)
        for n in reversed(range(_TERMS)):
            total = total * quartic + 1.0 / math.factorial(4 * n + order)
        functions.append(total * x**order)
    return np.stack(functions)


def transition_matrices(relative_modulus: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
    """Matrices that carry the state (w, w', w'', w''') over a distance.

    Parameters
    ----------
    relative_modulus, distance
        k / EI [1/m^4] and x [m], shapes that broadcast.

    Returns
    -------
    numpy.ndarray
        Shape (..., 4, 4).
    """
    y0, y1, y2, y3, _ = krylov_functions(relative_modulus, distance)
    k = np.asarray(relative_modulus, dtype=float)
    rows = [
        [y0, y1, y2, y3],
        [-k * y3, y0, y1, y2],
        [-k * y2, -k * y3, y0, y1],
        [-k * y1, -k * y2, -k * y3, y0],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def decaying_states(relative_modulus: ArrayLike, state: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
    """State at x of the solution that decays away from a point with known w and w'.

    w(x) = Re(C exp(-(1 + i) lambda x)), C = w(0) + i (w(0) + w'(0) / lambda): the two decaying solutions of a
    semi-infinite beam (Hetenyi 1946, section 11).

    Parameters
    ----------
    relative_modulus
        k / EI [1/m^4], shape (...).
    state
        State at x = 0, shape (..., 4); only w and w' are read.
    distance
        x >= 0 [m], shape (...).

    Returns
    -------
    numpy.ndarray
        (w, w', w'', w''') at x, shape (..., 4).
    """
    lam = characteristic_number(relative_modulus)
    start = np.asarray(state, dtype=float)
    amplitude = start[..., 0] + 1j * (start[..., 0] + start[..., 1] / lam)
    wave = amplitude * np.exp(-(1 + 1j) * lam * np.asarray(distance, dtype=float))
    return np.stack([((-(1 + 1j) * lam) ** n * wave).real for n in range(4)], axis=-1)
