"""An independent solution of the cases M and M2: polynomials of the stretched coordinate, Gauss collocation in time.

Nothing here uses the finite elements, the modes or the integrators of the program. With w = sum_j q_j(t) psi_j(y / z), chi_j =
(1 - x) psi_j' and z' = v,

    rho A [z q'' + v (1 + S - S^T) q' + (v' S - v^2 / z R) q] + EI / z^3 B q + k z q = F psi(1)
    int psi_i psi_j = 1_ij,  S = int psi_i chi_j,  R = int chi_i chi_j,  B = int psi_i'' psi_j''  over 0..1
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

FUNCTIONS = 14
STEPS_PER_RADIAN = 4.0  # of the lowest vibration at each depth
FEWEST_STEPS = 10  # between two times
LOWEST = 3.516  # (beta_1)^2 of a clamped-free beam


@dataclass(frozen=True)
class GrowingBeam:
    """An undamped needle clamped at the skin of homogeneous tissue and pushed in at a constant speed.

    Attributes
    ----------
    bending_stiffness
        EI [N m^2].
    mass_per_length
        rho A [kg/m].
    foundation_modulus
        k [N/m^2].
    first_depth
        Depth at t = 0 [m].
    speed
        v [m/s].
    tip_force
        F(t) [N] of a time [s].
    """

    bending_stiffness: float
    mass_per_length: float
    foundation_modulus: float
    first_depth: float
    speed: float
    tip_force: Callable[[float], float]


@dataclass(frozen=True)
class Functions:
    """Integrals over orthonormal functions of x on 0..1, clamped at 0; `tip` their values at 1."""

    transport: Array
    convective: Array
    bending: Array
    tip: Array


def functions(values: Array, first: Array, second: Array, weights: Array, tip: Array) -> Functions:
    """Return the integrals of functions that are orthonormal under the weights.

    Parameters
    ----------
    values, first, second
        Functions and derivatives at points, shape (points, functions).
    weights
        Of the integration over 0..1 times 1 and times (1 - x), shape (2, points).
    tip
        Values at 1.
    """
    weight, away = weights
    return Functions(
        values.T @ (away[:, None] * first),
        first.T @ ((away**2 / weight)[:, None] * first),
        second.T @ (weight[:, None] * second),
        tip,
    )


def clamped_polynomials(count: int) -> Functions:
    """Return x^2 times polynomials, made orthonormal by a QR factorization at Gauss points."""
    nodes, weights = np.polynomial.legendre.leggauss(count + 4)
    x, weight = (nodes + 1) / 2, weights / 2
    square = Legendre([1 / 3, 1 / 2, 1 / 6], domain=[0, 1])  # x^2
    bare = [square * Legendre.basis(degree, domain=[0, 1]) for degree in range(count)]
    values, first, second = (np.array([f.deriv(n)(x) if n else f(x) for f in bare]).T for n in range(3))
    triangle = np.linalg.qr(np.sqrt(weight)[:, None] * values, mode="r")
    back = np.linalg.inv(triangle)
    tip = np.array([f(1.0) for f in bare]) @ back
    return functions(values @ back, first @ back, second @ back, np.array([weight, weight * (1 - x)]), tip)


def spectral_tips(beam: GrowingBeam, times: Array, count: int = FUNCTIONS, steps_per_radian: float = STEPS_PER_RADIAN) -> Array:
    """Return tip deflections [m] at times [s] from 0, starting in equilibrium with the rate of the moving equilibrium.

    Parameters
    ----------
    beam
        What moves.
    times
        Rising, the first 0, shape (nt,).
    count
        Number of functions.
    steps_per_radian
        Of the lowest vibration, which a start from rest in a moving equilibrium leaves behind; three-stage Gauss, order 6.
    """
    shapes = clamped_polynomials(count)
    position, rate = equilibrium_start(beam, shapes)
    tips = [shapes.tip @ position]
    for start, end in pairwise(times.tolist()):
        steps = max(FEWEST_STEPS, int(np.ceil((end - start) * steps_per_radian * _lowest_frequency(beam, start))))
        length = (end - start) / steps
        for number in range(steps):
            position, rate = _step(beam, shapes, start + number * length, length, position, rate)
        tips.append(shapes.tip @ position)
    return np.array(tips)


def acceleration_terms(beam: GrowingBeam, shapes: Functions, time: float) -> tuple[Array, Array, Array]:
    """Return X, Y, f of q'' = f - X q - Y q' at a time [s]."""
    depth, mass, one = beam.first_depth + beam.speed * time, beam.mass_per_length, np.eye(len(shapes.tip))
    ratio = beam.speed / depth
    stiffness = beam.bending_stiffness / (mass * depth**4) * shapes.bending + beam.foundation_modulus / mass * one
    swept = ratio * (one + shapes.transport - shapes.transport.T)
    return stiffness - ratio**2 * shapes.convective, swept, beam.tip_force(time) / (mass * depth) * shapes.tip


def _lowest_frequency(beam: GrowingBeam, time: float) -> float:
    """Return about the lowest natural frequency at a time [rad/s]."""
    depth = beam.first_depth + beam.speed * time
    return float(np.sqrt((beam.bending_stiffness * (LOWEST / depth**2) ** 2 + beam.foundation_modulus) / beam.mass_per_length))


def equilibrium_start(beam: GrowingBeam, shapes: Functions) -> tuple[Array, Array]:
    """Return q and q' of the equilibrium at t = 0 that moves with the depth under a constant load."""
    depth, one = beam.first_depth, np.eye(len(shapes.tip))
    bending, modulus = beam.bending_stiffness * shapes.bending, beam.foundation_modulus
    stiffness = bending / depth**3 + modulus * depth * one
    position = np.asarray(np.linalg.solve(stiffness, beam.tip_force(0.0) * shapes.tip), dtype=np.float64)
    slope = np.linalg.solve(stiffness, (3 / depth**4 * bending - modulus * one) @ position)
    rate = np.asarray(beam.speed * slope, dtype=np.float64)
    return position, rate


_ROOT = float(np.sqrt(15.0))
_NODES: Array = np.array([0.5 - _ROOT / 10, 0.5, 0.5 + _ROOT / 10])
_WEIGHTS: Array = np.array([5 / 18, 4 / 9, 5 / 18])
_STAGES: Array = np.array(
    [
        [5 / 36, 2 / 9 - _ROOT / 15, 5 / 36 - _ROOT / 30],
        [5 / 36 + _ROOT / 24, 2 / 9, 5 / 36 - _ROOT / 24],
        [5 / 36 + _ROOT / 30, 2 / 9 + _ROOT / 15, 5 / 36],
    ]
)
_TWICE: Array = _STAGES @ _STAGES


def _step(beam: GrowingBeam, shapes: Functions, time: float, length: float, position: Array, rate: Array) -> tuple[Array, Array]:
    """Return q and q' after one step; the unknowns are q'' at the stages."""
    size = len(position)
    matrix, right = np.eye(3 * size), np.empty(3 * size)
    for stage in range(3):
        restoring, swept, force = acceleration_terms(beam, shapes, time + _NODES[stage] * length)
        rows = slice(stage * size, (stage + 1) * size)
        right[rows] = force - restoring @ (position + _NODES[stage] * length * rate) - swept @ rate
        for other in range(3):
            columns = slice(other * size, (other + 1) * size)
            matrix[rows, columns] += length**2 * _TWICE[stage, other] * restoring + length * _STAGES[stage, other] * swept
    pull = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64).reshape(3, size)
    moved: Array = position + length * rate + length**2 * (_WEIGHTS @ _STAGES) @ pull
    faster: Array = rate + length * (_WEIGHTS @ pull)
    return moved, faster
