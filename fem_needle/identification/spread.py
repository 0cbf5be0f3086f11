"""Mean and standard deviation of repeated estimates, with intervals of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import ArrayLike

from fem_needle.errors import SceneError
from fem_needle.identification.least_squares import CONFIDENCE, Estimate


@dataclass(frozen=True)
class Spread:
    """What repetitions of one experiment say.

    Attributes
    ----------
    mean
        With the standard error s / sqrt(n).
    deviation
        s, of the sample.
    """

    mean: Estimate
    deviation: float

    def deviation_interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Return the interval of the true standard deviation: (n - 1) s^2 / sigma^2 is chi-squared for normal errors."""
        freedom = self.mean.degrees_of_freedom
        tail = 0.5 * (1.0 - confidence)
        high, low = scipy.stats.chi2.isf([1.0 - tail, tail], freedom)
        return self.deviation * float(np.sqrt(freedom / low)), self.deviation * float(np.sqrt(freedom / high))


def spread(values: ArrayLike) -> Spread:
    """Return mean and standard deviation of repetitions (n,).

    Parameters
    ----------
    values
        (n,), in any unit; at least two.

    Raises
    ------
    SceneError
        If there are fewer than two.
    """
    numbers = np.asarray(values, dtype=float)
    if numbers.ndim != 1 or numbers.size < 2:
        raise SceneError(f"a standard deviation needs at least 2 repetitions (got {numbers.size})")
    deviation = float(np.std(numbers, ddof=1))
    mean = Estimate(float(np.mean(numbers)), deviation / float(np.sqrt(numbers.size)), numbers.size - 1.0)
    return Spread(mean, deviation)
