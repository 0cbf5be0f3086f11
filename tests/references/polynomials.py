"""Clamped polynomials on [0, 1]: x^2 times Jacobi polynomials, orthonormal."""

import numpy as np


def clamped_polynomials(x, count):
    """Return psi_j(x) = sqrt(2 j + 5) x^2 P_j^(0,4)(2 x - 1) and two derivatives.

    int_0^1 psi_i psi_j dx = delta_ij, psi_j(0) = psi_j'(0) = 0, psi_j(1) = sqrt(2 j + 5). They span all
    polynomials of degree up to ``count`` + 1 that are clamped at 0. x may be complex (derivatives by complex steps).

    Parameters
    ----------
    x
        Points, any shape.
    count
        Number of polynomials.

    Returns
    -------
    numpy.ndarray
        Shape (3, ..., count): values, first and second derivatives.
    """
    x = np.asarray(x)
    t = 2.0 * x - 1.0
    jacobi = [np.stack([np.ones_like(t), 0.0 * t, 0.0 * t]), np.stack([3.0 * t - 2.0, 3.0 + 0.0 * t, 0.0 * t])]
    for n in range(2, count):
        lead = 2.0 * n * (n + 4) * (2 * n + 2)
        slope, shift = (2 * n + 3) * (2 * n + 4) * (2 * n + 2) / lead, -16.0 * (2 * n + 3) / lead
        behind = 2.0 * (n - 1) * (n + 3) * (2 * n + 4) / lead
        one, two = jacobi[-1], jacobi[-2]
        value = (slope * t + shift) * one[0] - behind * two[0]
        first = (slope * t + shift) * one[1] + slope * one[0] - behind * two[1]
        second = (slope * t + shift) * one[2] + 2.0 * slope * one[1] - behind * two[2]
        jacobi.append(np.stack([value, first, second]))
    p, dp, ddp = np.moveaxis(np.array(jacobi[:count]), 0, -1)
    x = x[..., None]
    scale = np.sqrt(2.0 * np.arange(count) + 5.0)
    value = x**2 * p
    first = 2.0 * x * p + 2.0 * x**2 * dp
    second = 2.0 * p + 8.0 * x * dp + 4.0 * x**2 * ddp
    return np.stack([value * scale, first * scale, second * scale])
