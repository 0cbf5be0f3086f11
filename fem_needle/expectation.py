"""What runs with ever shorter steps let expect: the error of the last one, and the step that an allowed error needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts are loaded where they are used

FIRST = 0.75  # of the method's order: what is hoped for before one is observed
SMALLEST_ORDER = 0.5
SAFETY = 1.25  # of an error that follows from an observed order
PROVEN = 2.5  # ratio of steps over which an observed order is trusted
RATIOS = (1e-3, 2.0)  # of steps, between which the one that is needed is looked for


@dataclass(frozen=True)
class Expectation:
    """What the differences of runs with ever shorter steps let expect of the last one: an error high x^order + low x^slowest.

    x is the ratio of a step to the last one; the error is that of the tip, relative to the largest tip deflection.

    Attributes
    ----------
    high, order
        Part that falls with the order of the method.
    low, slowest
        Part that falls slowly: vibrations that the steps do not resolve.
    bound
        On the error of the last run, by which it is accepted: what the differences show, where ``error`` is what they let hope.
    """

    high: float
    order: float
    low: float = 0.0
    slowest: float = 1.0
    bound: float = 0.0

    def error(self, ratio: float = 1.0) -> float:
        """Return the error with a step of a ratio to the last one."""
        return self.high * ratio**self.order + self.low * ratio**self.slowest

    def ratio(self, allowed: float) -> float:
        """Return the ratio of the step that keeps an allowed error, within bounds."""
        if self.error(RATIOS[0]) >= allowed:
            return RATIOS[0]
        if self.error(RATIOS[1]) <= allowed:
            return RATIOS[1]
        return float(scipy.optimize.brentq(lambda ratio: self.error(ratio) - allowed, *RATIOS))


def expectation(steps: list[float], differences: list[float], order: float, *, resolved: bool = True) -> Expectation:
    """Return what is to be expected of the last of at least two runs, with a factor of `SAFETY`.

    The last two differences are those of C h^p + D h with non-negative C and D, p the order of the method; where they fall more
    slowly than with order 1, those of one term of the order that they have. One difference proves no order, and none proves it
    over more than a ratio of steps of `PROVEN`: slow parts hide behind the error of the run before.

    Parameters
    ----------
    steps
        Falling [s].
    differences
        Of successive runs, one less, relative to the largest tip deflection.
    order
        Of the method.
    resolved
        Whether the steps of the last run but one resolve the slowest vibration that matters. Where not, the runs differ by what
        the vibration does, whose phase is arbitrary in both: the difference counts in full, and no order.
    """
    if not resolved:
        return replace(expectation(steps, differences, order), bound=SAFETY * differences[-1])
    last, ratio = SAFETY * differences[-1], steps[-2] / steps[-1]
    if len(differences) < 2:
        hoped = FIRST * order
        return Expectation(last / (ratio**hoped - 1.0), hoped, bound=last)
    first, before = SAFETY * differences[-2], steps[-3] / steps[-1]
    parts = [[before**p - ratio**p for p in (order, 1.0)], [ratio**p - 1.0 for p in (order, 1.0)]]
    high, low = np.linalg.solve(parts, [first, last])
    proven = last / (min(ratio, PROVEN) ** order - 1.0)
    if low <= 0.0:
        return Expectation(last / (ratio**order - 1.0), order, bound=proven)
    if high >= 0.0:
        return Expectation(float(high), order, float(low), bound=max(float(high + low), proven))
    slowest = SMALLEST_ORDER
    if _quotient(before, ratio, slowest) < first / last:
        slowest = float(scipy.optimize.brentq(lambda p: _quotient(before, ratio, p) - first / last, slowest, 1.0))
    slow = last / (ratio**slowest - 1.0)
    return Expectation(0.0, order, slow, slowest, bound=max(slow, proven))


def _quotient(before: float, ratio: float, order: float) -> float:
    return (before**order - ratio**order) / (ratio**order - 1.0)
