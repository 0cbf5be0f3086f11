"""Weighted linear least squares with what it can tell, and filtering without delay.

Of y = X b + e with e independent, of variance s^2 / w_i (weights) or v_i (variances, or a whole covariance matrix V):

    b = (X^T V^-1 X)^-1 X^T V^-1 y,   cov b = s^2 (X^T V^-1 X)^-1,   s^2 = r^T V^-1 r / (n - p)

s = 1 where the variances are known. Intervals by Student's t with n - p degrees of freedom, or the normal distribution where
s is known (Draper and Smith, Applied Regression Analysis, 1998, chapters 5 and 9).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError

Array = NDArray[np.float64]

CONFIDENCE = 0.95
SMALLEST_SINGULAR_VALUE = 1.5e-8  # of the largest, columns scaled to length 1; its square, in X^T X, would be rounding
NULL_SHARE = 0.1  # a parameter belongs to the direction that data leave open if its component exceeds this
FILTER_ORDER = 4
FEWEST_SAMPLES = 15
PADDING = 6.0  # periods of the cut-off by which samples are mirrored through both end points: transients fall to a tenth in each


@dataclass(frozen=True)
class Estimate:
    """An estimated number.

    Attributes
    ----------
    value, standard_error
        In the same unit.
    degrees_of_freedom
        Of Student's t; infinite where the errors' variance was known.
    """

    value: float
    standard_error: float
    degrees_of_freedom: float = inf

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Return the interval that holds the true value with a confidence (0 to 1)."""
        reach = float(scipy.stats.t.ppf(0.5 + 0.5 * confidence, self.degrees_of_freedom)) * self.standard_error
        return self.value - reach, self.value + reach

    def p_value(self, supposed: float = 0.0) -> float:
        """Return the two-sided probability of an estimate this far from a supposed true value."""
        away = abs(self.value - supposed)
        ratio = away / self.standard_error if self.standard_error else (inf if away else 0.0)
        return float(2.0 * scipy.stats.t.sf(ratio, self.degrees_of_freedom))

    def scaled(self, factor: float) -> Estimate:
        """Return the estimate of a multiple."""
        return Estimate(factor * self.value, abs(factor) * self.standard_error, self.degrees_of_freedom)


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Result of `weighted_least_squares`.

    Attributes
    ----------
    names
        Of the parameters (p).
    values
        (p,).
    covariance
        Of the values, (p, p).
    degrees_of_freedom
        n - p; infinite where the variances were given.
    residuals
        y - X b (n,), in the unit of y.
    weighted_residuals
        The same divided by each error's relative standard deviation: of one size if the weights are right.
    leverage
        Diagonal of the hat matrix (n,), 0 to 1: how much a row determines its own prediction.
    deviation
        s: standard deviation of an error of weight 1, estimated from the residuals, also where the variances were given (there
        it should be about 1).
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    degrees_of_freedom: float
    residuals: Array
    weighted_residuals: Array
    leverage: Array
    deviation: float

    @property
    def standard_errors(self) -> Array:
        """Of the values, (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """Between the values, (p, p)."""
        errors = self.standard_errors
        return self.covariance / np.where(np.outer(errors, errors) > 0.0, np.outer(errors, errors), 1.0)

    def intervals(self, confidence: float = CONFIDENCE) -> Array:
        """Return lower and upper ends for each parameter, (p, 2)."""
        return np.array([self.estimate(name).interval(confidence) for name in self.names])

    def estimate(self, name: str) -> Estimate:
        """Return one parameter.

        Raises
        ------
        SceneError
            If there is none of this name.
        """
        if name not in self.names:
            raise SceneError(f"unknown parameter (got {name!r}; allowed {', '.join(self.names)})")
        return self.combination({name: 1.0})

    def combination(self, factors: Mapping[str, float]) -> Estimate:
        """Return the estimate of a sum of factors times parameters."""
        row = np.array([factors.get(name, 0.0) for name in self.names])
        return Estimate(float(row @ self.values), float(np.sqrt(row @ self.covariance @ row)), self.degrees_of_freedom)

    @property
    def studentized_residuals(self) -> Array:
        """Each residual over its standard deviation as estimated without its own row (n,); Student's t with n - p - 1 degrees.

        Infinite where all other rows fit exactly, nan of a row that alone determines a parameter.
        """
        return _studentized(self.weighted_residuals, self.leverage, len(self.values))

    def outliers(self, level: float = 0.05) -> tuple[int, ...]:
        """Return the rows (from 0) whose studentized residual is too large for chance at a level, by Bonferroni's bound."""
        rows = len(self.residuals)
        bound = float(scipy.stats.t.isf(0.5 * level / rows, rows - len(self.values) - 1))
        return tuple(int(row) for row in np.flatnonzero(np.abs(self.studentized_residuals) > bound))


def weighted_least_squares(
    matrix: ArrayLike,
    measured: ArrayLike,
    names: Sequence[str],
    *,
    weights: ArrayLike | None = None,
    variances: ArrayLike | None = None,
) -> LinearFit:
    """Fit y = X b by weighted least squares.

    Parameters
    ----------
    matrix
        X (n, p).
    measured
        y (n,).
    names
        Of the p parameters, for results and messages.
    weights
        Relative, (n,): 1 / variance up to a common factor, which the residuals tell. Default: all equal.
    variances
        Absolute, in place of weights: (n,) or a covariance matrix (n, n) of the errors; standard errors then follow from them
        alone, not from the residuals.

    Raises
    ------
    SceneError
        If sizes disagree, a number is not finite, a weight or variance not positive, n <= p, or the data do not determine the
        parameters; names those that they do not tell apart.
    """
    x, y = np.atleast_2d(np.asarray(matrix, dtype=float)), np.asarray(measured, dtype=float)
    _check_sizes(x, y, names)
    white_x, white_y = _whitened(x, y, weights, variances)
    left, singular, right = _decomposed(white_x, names)
    scales = np.linalg.norm(white_x, axis=0)
    values = (right.T / singular @ (left.T @ white_y)) / scales
    weighted, freedom = white_y - white_x @ values, len(y) - len(values)
    deviation = float(np.sqrt(weighted @ weighted / freedom))
    root = right.T / singular / scales[:, None]
    known = variances is not None
    covariance = root @ root.T * (1.0 if known else deviation**2)
    leverage = np.sum(left**2, axis=1)
    freedoms = inf if known else float(freedom)
    return LinearFit(tuple(names), values, covariance, freedoms, y - x @ values, weighted, leverage, deviation)


def zero_phase(values: ArrayLike, interval: float, cutoff: float) -> Array:
    """Return samples low-pass filtered forward and backward: no delay, half the power at the cut-off.

    A Butterworth filter runs once in each direction (Gustafsson, IEEE Transactions on Signal Processing 44, 1996). Errors of
    the result are correlated over about 1 / (2 cutoff): see `independent_stride`.

    Parameters
    ----------
    values
        Samples (n,) or (n, columns), time first.
    interval
        Time between two of them [s].
    cutoff
        [Hz], at which the magnitude of both passes together is 1 / sqrt(2).

    Raises
    ------
    SceneError
        If the cut-off is not between 0 and half the sampling frequency, or there are too few samples.
    """
    samples = np.asarray(values, dtype=float)
    limit = 0.5 / interval
    # Both passes together have the magnitude 1 / (1 + ratio^(2 m)): 1 / sqrt(2) where ratio^(2 m) = sqrt(2) - 1; tan warps.
    warped = np.tan(0.5 * np.pi * cutoff / limit) / (np.sqrt(2.0) - 1.0) ** (0.5 / FILTER_ORDER) if 0 < cutoff < limit else inf
    if not np.isfinite(warped):
        raise SceneError(f"cutoff: out of range (got {cutoff:g}; allowed above 0 and below {limit:g} Hz, half the sampling rate)")
    sections = scipy.signal.butter(FILTER_ORDER, 2.0 / np.pi * np.arctan(warped), output="sos")
    if len(samples) <= FEWEST_SAMPLES:
        raise SceneError(f"a filter needs more than {FEWEST_SAMPLES} samples (got {len(samples)})")
    padding = min(len(samples) - 1, max(FEWEST_SAMPLES, int(np.ceil(PADDING / (cutoff * interval)))))
    return np.asarray(scipy.signal.sosfiltfilt(sections, samples, axis=0, padlen=padding))


def independent_stride(interval: float, cutoff: float) -> int:
    """Return every how many-th filtered sample is about independent: one in 1 / (2 cutoff), Nyquist's interval."""
    return max(1, int(np.ceil(0.5 / (cutoff * interval) - 1e-9)))


def _check_sizes(x: Array, y: Array, names: Sequence[str]) -> None:
    if x.shape != (len(y), len(names)):
        raise SceneError(f"the matrix has shape {x.shape} (allowed {len(y)} rows, a column for each of {', '.join(names)})")
    if len(y) <= len(names):
        few = f"{len(y)} rows do not determine {len(names)} parameters and their errors (allowed {len(names) + 1} or more)"
        raise SceneError(few)
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(y))):
        raise SceneError("data must be finite numbers")


def _whitened(x: Array, y: Array, weights: ArrayLike | None, variances: ArrayLike | None) -> tuple[Array, Array]:
    if weights is not None and variances is not None:
        raise SceneError("weights and variances exclude each other")
    if weights is None and variances is None:
        return x, y
    given = np.asarray(weights if variances is None else variances, dtype=float)
    what = "weights" if variances is None else "variances"
    if what == "variances" and given.shape == (len(y), len(y)):
        return _whitened_by_matrix(x, y, given)
    if given.shape != y.shape or not np.all(np.isfinite(given) & (given > 0.0)):
        raise SceneError(f"{what}: needs {len(y)} positive numbers (got {np.array2string(given, threshold=6)})")
    factors = np.sqrt(given if what == "weights" else 1.0 / given)
    return x * factors[:, None], y * factors


def _whitened_by_matrix(x: Array, y: Array, covariance: Array) -> tuple[Array, Array]:
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise SceneError("variances: a covariance matrix must be positive definite") from None
    if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=0.0):
        raise SceneError("variances: a covariance matrix must be symmetric")
    both = scipy.linalg.solve_triangular(root, np.column_stack((x, y)), lower=True)
    return both[:, :-1], both[:, -1]


def _decomposed(x: Array, names: Sequence[str]) -> tuple[Array, Array, Array]:
    """Return the singular value decomposition of the columns scaled to length 1."""
    lengths = np.linalg.norm(x, axis=0)
    absent = [name for name, length in zip(names, lengths, strict=True) if length == 0.0]
    if absent:
        raise SceneError(f"the data say nothing of {', '.join(absent)}")
    left, singular, right = np.linalg.svd(x / lengths, full_matrices=False)
    missing = right[singular < SMALLEST_SINGULAR_VALUE * singular[0]]
    if len(missing):
        shares = np.max(np.abs(missing), axis=0)
        open_ones = [name for name, share in zip(names, shares, strict=True) if share > NULL_SHARE]
        raise SceneError(f"the data do not tell {' and '.join(open_ones)} apart (measure more, or hold one of them)")
    return left, singular, right


def _studentized(weighted: Array, leverage: Array, parameters: int) -> Array:
    total, freedom = float(weighted @ weighted), len(weighted) - parameters
    if freedom < 2:  # nothing is left to estimate the deviation from
        return np.full(len(weighted), np.nan)
    own = np.maximum(1.0 - leverage, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        without = np.maximum(total - weighted**2 / own, 0.0) / (freedom - 1)
        return np.asarray(weighted / np.sqrt(without * own))
