"""Clamped-free modes of a beam, accurate at every point and for every mode.

    phi_i(x) = [cosh b x - cos b x - s (sinh b x - sin b x)] / sqrt(L),   integral_0^L phi_i phi_j = delta_ij

with b = B_i / L, cos B cosh B = -1 and s = (cosh B + cos B) / (sinh B + sin B). The textbook form loses all digits from about the
tenth mode on. With 1 - s = 2 (sin B - cos B - exp(-B)) exp(-B) / (1 + 2 sin B exp(-B) - exp(-2 B)) the growing exponential is
exp(-b (L - x)) times a number near one, and nothing cancels; near the clamp the differences are summed as series.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import factorial

import numpy as np
from numpy.typing import NDArray

from fem_needle.exact import clamped_free_roots

Array = NDArray[np.float64]

MOST_MODES = 200
SERIES_LIMIT = 1.0  # of b x: below it sinh - sin and its like are summed as series
_SERIES_TERMS = 5  # of sinh t - sin t = 2 sum t^(4k+3) / (4k+3)!, to rounding for t < 1


@dataclass(frozen=True, eq=False)
class ClampedFreeModes:
    """The first modes of a beam that is clamped at 0 and free at its length.

    Attributes
    ----------
    length
        L [m], or 1 for the fraction of a length.
    count
        How many modes.
    roots, slope_ratios
        B_i and s_i (1), shape (count,).
    """

    length: float
    count: int
    roots: Array = field(init=False)
    slope_ratios: Array = field(init=False)
    _growth: Array = field(init=False)

    def __post_init__(self) -> None:
        roots = np.asarray(clamped_free_roots(self.count), dtype=float)
        small, sine, cosine = np.exp(-roots), np.sin(roots), np.cos(roots)
        object.__setattr__(self, "roots", roots)
        # (1 - s) exp(B), of order one.
        growth = 2 * (sine - cosine - small) / (1 + 2 * sine * small - small**2)
        object.__setattr__(self, "_growth", growth)
        object.__setattr__(self, "slope_ratios", 1 - growth * small)

    @property
    def wavenumbers(self) -> Array:
        """B_i / L [1/m], shape (count,)."""
        return self.roots / self.length

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return phi_i, or a derivative by position, at positions 0..L.

        Parameters
        ----------
        positions
            x, shape (n,).
        derivative
            Order, 0 or more.

        Returns
        -------
        Array
            Shape (count, n), in units of length^(-1/2 - derivative); the error is below 1e-13 of the largest value times the
            number of waves.
        """
        places = np.atleast_1d(np.asarray(positions, dtype=float)) / self.length
        arguments = self.roots[:, None] * places
        values = self._far(arguments, places, derivative)
        if derivative < 2:
            near = arguments < SERIES_LIMIT
            if near.any():
                ratios = np.broadcast_to(self.slope_ratios[:, None], arguments.shape)[near]
                values[near] = _near(arguments[near], ratios, derivative)
        scale = self.wavenumbers**derivative / np.sqrt(self.length)
        return np.asarray(values * scale[:, None], dtype=float)

    def _far(self, arguments: Array, places: Array, derivative: int) -> Array:
        """Return the derivative by b x from exponentials that do not overflow."""
        ratios, sign = self.slope_ratios[:, None], (-1.0) ** derivative
        growing = 0.5 * self._growth[:, None] * np.exp(-self.roots[:, None] * (1 - places))
        falling = 0.5 * sign * (1 + ratios) * np.exp(-arguments)
        sine, cosine = np.sin(arguments), np.cos(arguments)
        # derivatives of cos t - s sin t, order by order
        waves = (cosine - ratios * sine, -sine - ratios * cosine)[derivative % 2]
        return np.asarray(growing + falling - waves * (-1.0) ** (derivative // 2), dtype=float)


def _near(arguments: Array, ratios: Array, derivative: int) -> Array:
    """Return value (0) or slope (1) by b x near the clamp, where nothing but small numbers is left."""
    difference = 2 * (np.sinh(arguments / 2) ** 2 + np.sin(arguments / 2) ** 2)  # cosh - cos
    if derivative == 1:
        return np.asarray(np.sinh(arguments) + np.sin(arguments) - ratios * difference, dtype=float)
    quartic, odd = arguments**4, np.zeros_like(arguments)  # sinh - sin, by Horner's rule
    for k in reversed(range(_SERIES_TERMS)):
        odd = odd * quartic + 2 / factorial(4 * k + 3)
    return np.asarray(difference - ratios * odd * arguments**3, dtype=float)
