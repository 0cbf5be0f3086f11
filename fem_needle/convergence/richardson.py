"""Observed order, Richardson extrapolation and grid convergence index of a sequence that converges.

Grids are numbered from coarse to fine, r = h_coarse / h_fine > 1 is the refinement ratio of two neighbors. Sources: P. J. Roache,
J. Fluids Eng. 116 (1994) 405; I. Celik et al., J. Fluids Eng. 130 (2008) 078001; ASME V&V 20-2009, section 2-4.
"""

from __future__ import annotations

from math import expm1, inf, isfinite, log

from scipy.optimize import brentq

SAFETY_FACTOR = 1.25  # of the grid convergence index, for three grids and more
_ORDERS = (-20.0, 30.0)  # where an order is looked for
_SMALLEST = 1e-6  # an order nearer to 0 is taken as its limit


def order_from_errors(coarse: float, fine: float, ratio: float) -> float | None:
    """Return p of e = C h^p from two errors: p = ln(e_coarse / e_fine) / ln r; None where an error is 0.

    Parameters
    ----------
    coarse, fine
        Magnitudes of the errors, any unit.
    ratio
        h_coarse / h_fine > 1.
    """
    if coarse <= 0.0 or fine <= 0.0:
        return None
    return log(coarse / fine) / log(ratio)


def order_from_differences(coarse: float, fine: float, coarse_ratio: float, fine_ratio: float) -> float | None:
    """Return p of f_h = f + C h^p from the differences of three grids, also where the refinement ratios differ.

    With the quotient of the differences Q = (f_2 - f_1) / (f_3 - f_2), grid 3 the finest, p solves

        Q = r_fine^p (r_coarse^p - s) / (r_fine^p - s),      s = sign(Q),

    which is the implicit equation of Celik et al. A negative Q is an error that changes its sign from grid to grid,
    f_h = f + C (-1)^grid h^p.

    Parameters
    ----------
    coarse
        f_2 - f_1: middle minus coarse grid.
    fine
        f_3 - f_2: fine minus middle grid.
    coarse_ratio, fine_ratio
        h_1 / h_2 and h_2 / h_3, above 1.

    Returns
    -------
    float or None
        Negative where the sequence diverges; None where no order gives the differences.
    """
    if coarse == 0.0 or fine == 0.0 or not isfinite(coarse / fine):
        return None
    quotient, sign = abs(coarse / fine), 1.0 if coarse / fine > 0.0 else -1.0

    def miss(order: float) -> float:
        return _log_quotient(order, coarse_ratio, fine_ratio, sign) - log(quotient)

    low, high = _ORDERS
    if miss(low) > 0.0 or miss(high) < 0.0:
        return None
    return float(brentq(miss, low, high, xtol=1e-12))


def _log_quotient(order: float, coarse_ratio: float, fine_ratio: float, sign: float) -> float:
    """Return the logarithm of what Q is for an order; it rises with the order."""
    coarse, fine = order * log(coarse_ratio), order * log(fine_ratio)
    if sign < 0.0:
        return fine + log(2.0 + expm1(coarse)) - log(2.0 + expm1(fine))
    if abs(order) < _SMALLEST:  # both differences of powers vanish; their quotient does not
        return fine + log(log(coarse_ratio) / log(fine_ratio))
    return fine + log(expm1(coarse) / expm1(fine))


def correction_factor(order: float, ratio: float, *, oscillates: bool = False) -> float:
    """Return c of the Richardson value f = f_fine + c (f_fine - f_coarse), c = 1 / (s r^p - 1), s = -1 where it oscillates.

    Parameters
    ----------
    order
        p > 0.
    ratio
        h_coarse / h_fine > 1.
    oscillates
        Whether the error changes its sign from grid to grid.
    """
    return 1.0 / ((-1.0 if oscillates else 1.0) * ratio**order - 1.0)


def grid_convergence_index(difference: float, order: float, ratio: float) -> float:
    """Return the index of the fine grid, 1.25 e / (r^p - 1), e the relative difference of two grids; infinite for p <= 0.

    That of the coarse grid is r^p times as large.

    Parameters
    ----------
    difference
        |f_fine - f_coarse| / |f_fine|.
    order
        p.
    ratio
        h_coarse / h_fine > 1.
    """
    return SAFETY_FACTOR * difference / (ratio**order - 1.0) if order > 0.0 else inf
