"""Fit numbers of a scene to measured tips, pushes and shapes: values with intervals, and what speaks for or against them.

The sum of squared residuals over their standard deviations is minimized by a trust-region method (scipy), parameters that must
be positive in their logarithm. At the minimum the model is linearized, and the linear fit of its residuals gives errors and
correlations; intervals are Student's t in the scale of the fit (Draper and Smith, Applied Regression Analysis, 1998, chapter 24).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import exp, inf, log

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.data_columns import data_notes, refuse_misspelled
from fem_needle.identification.least_squares import CONFIDENCE, LinearFit, weighted_least_squares
from fem_needle.identification.measurements import Measurements
from fem_needle.identification.predictions import AtRest, Predictor, predictor_of
from fem_needle.identification.result import Identification, Parameter, Prediction, Whiteness
from fem_needle.identification.static_model import value_at
from fem_needle.scene import Scene
from fem_needle.threads import one_thread

Array = NDArray[np.float64]

SIGNED = ("force", "hub_deflection", "hub_angle")  # last keys of what may be negative
WORST_CONDITION = 1e7  # of the Jacobian in relative units: beyond it rounding of the model decides
MOST_LAGS = 10


@one_thread
def identify(
    scene: Scene,
    parameters: Sequence[str],
    measured: Measurements | Sequence[Measurements],
    model: str | None = None,
    *,
    deviations: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    linear: Sequence[str] = (),
    held_back: float = 0.0,
) -> Identification:
    """Fit numbers of a scene to measurements.

    Parameters
    ----------
    scene
        Where the fit starts; its ``[numerics]`` say how it is computed.
    parameters
        Paths of numbers, as for `Scene.with_value`.
    measured
        One or several data sets. Columns that are fitted: ``tip_deflection``, ``push_force``, and ``deflection_at_<mm>`` for
        the deflection at an arc length in mm from the hub. Where each was measured: ``depth`` for a needle at rest, ``time`` for
        a run of the scene.
    model
        ``"fem"`` or ``"assumed-modes"``; default: the scene's.
    deviations
        Standard deviation of a row by column, SI; default: one for all rows, found from the residuals. With several kinds of
        columns they must be given.
    bounds
        Lowest and highest value by path, SI.
    linear
        Paths whose logarithm is not to be fitted although they are positive.
    held_back
        Share of the rows, those at the end of each data set, that are predicted instead of fitted.

    Raises
    ------
    SceneError
        If a path, a column or a bound is impossible, or the data cannot tell the parameters apart: names them.
    ComputationError
        If the model fails on the way.
    """
    scene = scene if model is None else scene.with_value("model.kind", model)
    sets = [measured] if isinstance(measured, Measurements) else list(measured)
    scales = _Scales.of(scene, parameters, bounds or {}, linear)
    refuse_misspelled(sets)
    fitted, kept = zip(*(_split(one, held_back) for one in sets), strict=True)
    predictor = predictor_of(scene, fitted, parameters, deviations or {})
    found = _fitted(scene, predictor, scales, _held(scene, kept, parameters, deviations or {}))
    return replace(found, notes=data_notes(scene, sets, at_rest=isinstance(predictor, AtRest)))


def _split(data: Measurements, share: float) -> tuple[Measurements, Measurements]:
    if not 0.0 <= share < 1.0:
        raise SceneError(f"held_back: out of range (got {share:g}; allowed 0 to below 1)")
    first = data.size - round(share * data.size)
    if share > 0.0 and first == data.size:
        raise SceneError(f"held_back: holds back no row of {data.source} (got {share:g} of {data.size}; 0 to fit all rows)")
    return data.rows(slice(0, first)), data.rows(slice(first, None))


def _held(
    scene: Scene, kept: Sequence[Measurements], parameters: Sequence[str], deviations: Mapping[str, float]
) -> Predictor | None:
    return predictor_of(scene, kept, parameters, deviations) if any(one.size for one in kept) else None


@dataclass(frozen=True, eq=False)
class _Scales:
    """Between values of parameters [SI] and the numbers that are fitted."""

    paths: tuple[str, ...]
    start: Array
    is_log: tuple[bool, ...]
    lowest: Array
    highest: Array

    @classmethod
    def of(
        cls, scene: Scene, paths: Sequence[str], bounds: Mapping[str, tuple[float, float]], linear: Sequence[str]
    ) -> _Scales:
        """Return the scales of parameters by path."""
        if not paths or len(set(paths)) < len(paths):
            raise SceneError(f"parameters: one or more different paths (got {', '.join(paths) or 'none'})")
        for path in {*bounds, *linear} - set(paths):
            raise SceneError(f"{path}: is not among the parameters (allowed {', '.join(paths)})")
        start = [value_at(scene, path) for path in paths]
        logs = tuple(
            value > 0.0 and path.split(".")[-1] not in SIGNED and path not in linear
            for path, value in zip(paths, start, strict=True)
        )
        ends = [bounds.get(path, (0.0 if is_log else -inf, inf)) for path, is_log in zip(paths, logs, strict=True)]
        for path, value, (low, high) in zip(paths, start, ends, strict=True):
            if not low < high or not low <= value <= high:
                raise SceneError(f"{path}: starts outside its bounds (got {value:g}; allowed {low:g} to {high:g})")
        scaled = [
            [_to(end, is_log) for end in pair] for pair, is_log in zip(ends, logs, strict=True)
        ]
        return cls(tuple(paths), np.array(start), logs, *np.array(scaled).T)

    def scaled(self, values: Array) -> Array:
        """Return what is fitted."""
        return np.array([_to(float(value), is_log) for value, is_log in zip(values, self.is_log, strict=True)])

    def values(self, scaled: Array) -> Array:
        """Return the values."""
        return np.array([exp(one) if is_log else float(one) for one, is_log in zip(scaled, self.is_log, strict=True)])

    def slopes(self, values: Array) -> Array:
        """Return d(value) / d(what is fitted)."""
        return np.where(self.is_log, values, 1.0)


def _to(value: float, is_log: bool) -> float:
    if not is_log:
        return value
    return log(value) if 0.0 < value < inf else (-inf if value <= 0.0 else inf)


@dataclass(eq=False)
class _Asked:
    """The model in the scale of the fit, in units of the deviations; keeps its last answer."""

    predictor: Predictor
    scales: _Scales
    count: int = 0
    known: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)

    def at(self, scaled: Array) -> tuple[Array, Array]:
        """Return what the model says (n,) and its Jacobian (n, p), both over the deviations."""
        key = scaled.tobytes()
        if key not in self.known:
            self.count += 1
            self.known.clear()
            values, deviations = self.scales.values(scaled), self.predictor.deviations
            answers, slopes = self.predictor.answers(values)
            self.known[key] = answers / deviations, slopes * self.scales.slopes(values) / deviations[:, None]
        return self.known[key]


def _fitted(scene: Scene, predictor: Predictor, scales: _Scales, held: Predictor | None) -> Identification:
    asked, measured = _Asked(predictor, scales), predictor.measured / predictor.deviations
    begin = scales.scaled(scales.start)
    _linearized(scales, asked.at(begin)[1], measured, known=predictor.is_absolute)
    found = scipy.optimize.least_squares(
        lambda scaled: asked.at(scaled)[0] - measured,
        begin,
        jac=lambda scaled: asked.at(scaled)[1],
        bounds=(scales.lowest, scales.highest),
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-14,
    )
    return _result(scene, asked, found.x, held)


def _result(scene: Scene, asked: _Asked, scaled: Array, held: Predictor | None) -> Identification:
    """Return what is known at the minimum."""
    predictor, scales = asked.predictor, asked.scales
    answers, white = asked.at(scaled)
    residuals = predictor.measured / predictor.deviations - answers
    # The linear model at the minimum: residuals as they are, values as they were found.
    linear = _linearized(scales, white, residuals + white @ scaled, known=predictor.is_absolute)
    values = scales.values(scaled)
    return Identification(
        scene.with_values(dict(zip(scales.paths, values.tolist(), strict=True))),
        _parameters(scales, scaled, linear),
        predictor.measured,
        answers * predictor.deviations,
        predictor.deviations * (1.0 if predictor.is_absolute else linear.deviation),
        linear,
        _condition(white * _relative(scales, values)),
        whiteness(residuals),
        None if held is None else _predicted(held, scales, scaled, linear),
        asked.count,
        predictor.rows,
    )


def _relative(scales: _Scales, values: Array) -> Array:
    """Return by what a column of the Jacobian is multiplied for a relative change of its parameter."""
    return np.where(scales.is_log, 1.0, np.where(values == 0.0, 1.0, np.abs(values)))


def _condition(matrix: Array) -> float:
    singular = np.linalg.svd(matrix, compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else inf


def _linearized(scales: _Scales, white: Array, right: Array, *, known: bool) -> LinearFit:
    """Return the linear fit of a Jacobian, with ``known`` deviations or not; refuses one whose columns data do not tell apart."""
    lengths = np.linalg.norm(white, axis=0)
    if np.all(lengths > 0.0):
        _, singular, directions = np.linalg.svd(white / lengths, full_matrices=False)
        if singular[-1] * WORST_CONDITION < singular[0]:
            together = [path for path, share in zip(scales.paths, directions[-1], strict=True) if abs(share) > 0.1]
            raise SceneError(
                f"parameters: the data do not tell {' and '.join(together)} apart (condition {singular[0] / singular[-1]:.1e}, "
                f"allowed {WORST_CONDITION:.0e}): only a combination of them enters; hold one, or measure a force as well"
            )
    return weighted_least_squares(white, right, scales.paths, variances=np.ones_like(right) if known else None)


def _parameters(scales: _Scales, scaled: Array, linear: LinearFit) -> tuple[Parameter, ...]:
    found = []
    for number, path in enumerate(scales.paths):
        estimate, is_log = linear.estimate(path), scales.is_log[number]
        ends = estimate.interval(CONFIDENCE)
        value = exp(scaled[number]) if is_log else float(scaled[number])
        low, high = (exp(ends[0]), exp(ends[1])) if is_log else ends
        error = estimate.standard_error * (value if is_log else 1.0)
        found.append(Parameter(path, value, float(scales.start[number]), error, (low, high), is_log))
    return tuple(found)


def whiteness(residuals: Array) -> Whiteness:
    """Test residuals (n,) in their order for correlation (Ljung and Box, Biometrika 65, 1978)."""
    centered = residuals - np.mean(residuals)
    count, total = len(centered), float(centered @ centered)
    lags = max(1, min(MOST_LAGS, count // 5))
    if total == 0.0:
        return Whiteness(0.0, 1.0, lags)
    shares = [float(centered[lag:] @ centered[:-lag]) / total for lag in range(1, lags + 1)]
    statistic = count * (count + 2) * sum(share**2 / (count - lag) for lag, share in enumerate(shares, start=1))
    return Whiteness(shares[0], float(scipy.stats.chi2.sf(statistic, lags)), lags)


def _predicted(held: Predictor, scales: _Scales, scaled: Array, linear: LinearFit) -> Prediction:
    """Return how rows that were held back lie to the fit: the band has the noise of a row and the error of the parameters."""
    values = scales.values(scaled)
    answers, slopes = held.answers(values)
    white = slopes * scales.slopes(values) / held.deviations[:, None]
    noise = 1.0 if held.is_absolute else linear.deviation
    away = (held.measured - answers) / held.deviations / noise
    spread = np.sqrt(1.0 + np.einsum("ni,ij,nj->n", white, linear.covariance, white) / noise**2)
    reach = float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, linear.degrees_of_freedom))
    inside = float(np.mean(np.abs(away) <= reach * spread))
    return Prediction(len(away), float(np.sqrt(np.mean(away**2))), float(np.max(np.abs(away))), inside)
