"""scipy's solvers on the equations of few modes of the inserted part."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import Functions, GrowingBeam, acceleration_terms, equilibrium_start, functions
from fem_needle.benchmark.methods import LIBRARY, Method, Setting, Solve
from fem_needle.benchmark.reference import growing_beam
from fem_needle.exact import clamped_free_roots

Array = NDArray[np.float64]

POINTS_PER_MODE = 12
MODES_OF_SHAPE = 20  # to find the tip force of a given deflection: the rest of the sum is below 1e-5
RADAU, DOP853 = "Radau", "DOP853"


def mode_functions(count: int) -> Functions:
    """Return the integrals of the first clamped-free modes over 0..1, orthonormal, in a form without cancellation."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS_PER_MODE * count + 8)
    x, weight = (nodes + 1) / 2, weights / 2
    values, first, second = (_modes(x, count, derivative) for derivative in range(3))
    return functions(values, first, second, np.array([weight, weight * (1 - x)]), _modes(np.ones(1), count, 0)[0])


def _modes(x: Array, count: int, derivative: int) -> Array:
    """Return cosh - cos - s (sinh - sin) of beta x, or a derivative, shape (points, modes)."""
    beta = clamped_free_roots(count)
    decay, sine, cosine = np.exp(-beta), np.sin(beta), np.cos(beta)
    lower = 1 - decay**2 + 2 * decay * sine
    ratio = (1 + decay**2 + 2 * decay * cosine) / lower  # s
    growing = (sine - cosine - decay) / lower * np.exp(np.multiply.outer(x - 1, beta))
    falling = 0.5 * (1 + ratio) * np.exp(-np.multiply.outer(x, beta))
    turn = np.multiply.outer(x, beta) + derivative * np.pi / 2
    result: Array = beta**derivative * (growing + (-1) ** derivative * falling - np.cos(turn) + ratio * np.sin(turn))
    return result


class ModalSystem(Method):
    """Few modes, given to `scipy.integrate.solve_ivp` as a user would."""

    name = "scipy on modes"
    kind = LIBRARY
    limited = "explicit steps of less than 0.03 ms on M and M2: two modes only"

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Return modes, solver and its relative tolerance."""
        if case.name == "D":
            pairs = [(DOP853, 2, 1e-4), (DOP853, 5, 1e-6), (DOP853, 10, 1e-8), (RADAU, 2, 1e-4), (RADAU, 5, 1e-6)]
            return tuple(Setting(modes=n, tolerance=rtol, variant=name) for name, n, rtol in pairs)
        if case.name in ("M", "M2"):
            implicit = tuple(Setting(modes=n, tolerance=rtol, variant=RADAU) for n, rtol in ((2, 1e-3), (2, 1e-6), (4, 1e-6)))
            return (*implicit, Setting(modes=2, tolerance=1e-6, variant=DOP853))
        return ()

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the call of the solver; the modes are prepared."""
        beam, shapes = growing_beam(case.scene), mode_functions(setting.modes or 1)
        position, rate = equilibrium_start(beam, shapes)
        if case.scene.initial.tip_deflection:
            position = _released(beam, shapes, case.scene.initial.tip_deflection)
        return lambda: _solved(beam, shapes, np.concatenate((position, rate)), case.times, setting)


def _released(beam: GrowingBeam, shapes: Functions, tip: float) -> Array:
    """Return the coordinates of the exact shape under a tip force that puts the tip at a deflection [m]."""
    many = mode_functions(MODES_OF_SHAPE)
    compliance = float(np.sum(many.tip**2 / _stiffnesses(beam, many)))
    return tip / compliance * shapes.tip / _stiffnesses(beam, shapes)


def _stiffnesses(beam: GrowingBeam, shapes: Functions) -> Array:
    """Return the stiffness of each mode in the first depth [N/m]; off the diagonal there is nothing."""
    depth = beam.first_depth
    result: Array = beam.bending_stiffness / depth**3 * np.diag(shapes.bending) + beam.foundation_modulus * depth
    return result


def _solved(beam: GrowingBeam, shapes: Functions, start: Array, times: Array, setting: Setting) -> Array:
    size = len(shapes.tip)

    def matrix(time: float, state: Array) -> Array:
        restoring, swept, _ = acceleration_terms(beam, shapes, time)
        return np.block([[np.zeros((size, size)), np.eye(size)], [-restoring, -swept]])

    def slope(time: float, state: Array) -> Array:
        restoring, swept, force = acceleration_terms(beam, shapes, time)
        position, rate = state[:size], state[size:]
        return np.concatenate((rate, force - restoring @ position - swept @ rate))

    options: dict[str, Any] = {"jac": matrix} if setting.variant == RADAU else {}
    rtol = setting.tolerance or 1e-3
    scale = np.concatenate((np.full(size, abs(start[0])), np.full(size, np.sqrt(_fastest(beam, shapes)) * abs(start[0]))))
    done = solve_ivp(slope, (times[0], times[-1]), start, setting.variant, times, rtol=rtol, atol=rtol * scale, **options)
    result: Array = shapes.tip @ done.y[:size]
    return result


def _fastest(beam: GrowingBeam, shapes: Functions) -> float:
    """Return the square of the lowest natural frequency at the first depth [rad^2/s^2]."""
    return float(acceleration_terms(beam, shapes, 0.0)[0][0, 0])
