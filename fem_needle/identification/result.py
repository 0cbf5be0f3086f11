"""Result of a fit: parameters with intervals, residuals, predictions; as plain data and as a table."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.display import Card, Shown, text
from fem_needle.identification.least_squares import LinearFit
from fem_needle.identification.predictions import MeasuredRow
from fem_needle.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """A fitted number of a scene.

    Attributes
    ----------
    path
        As for `Scene.with_value`.
    value, start
        Fitted, and in the scene before; SI.
    standard_error
        SI; of a logarithm times the value.
    interval
        95 %; SI.
    is_log
        Whether its logarithm was fitted.
    """

    path: str
    value: float
    start: float
    standard_error: float
    interval: tuple[float, float]
    is_log: bool


@dataclass(frozen=True)
class Whiteness:
    """Whether residuals in the order of the rows look like independent noise.

    Attributes
    ----------
    first_correlation
        Of neighbors, -1 to 1.
    p_value
        Of Ljung and Box's test of no correlation up to ``lags``: a small one says that the model misses something.
    lags
        How many.
    """

    first_correlation: float
    p_value: float
    lags: int


@dataclass(frozen=True)
class Prediction:
    """What the fit says of rows that were held back.

    Attributes
    ----------
    rows
        How many.
    rms, largest
        Root mean square and largest residual over the standard deviation of a measurement.
    inside
        Share inside the 95 % prediction band.
    """

    rows: int
    rms: float
    largest: float
    inside: float


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Shown):
    """Result of `identify`.

    Attributes
    ----------
    scene
        With the fitted values.
    parameters
        In the order given.
    measured, fitted
        All rows that were fitted (n,), SI; every data set's, one after the other.
    deviations
        Standard deviation of each row (n,), as given or 1, times ``linear.deviation``.
    linear
        The linear fit at the minimum, in the scale of the fit.
    condition
        Of the Jacobian in relative units: how much worse the worst combination of parameters is seen than the best.
    whiteness
        Of the residuals over their deviations.
    prediction
        Of the rows that were held back; None without.
    evaluations
        How often the model was asked.
    rows
        Where each row comes from.
    notes
        Sentences on what the data hold and the fit does not use.
    """

    scene: Scene
    parameters: tuple[Parameter, ...]
    measured: Array
    fitted: Array
    deviations: Array
    linear: LinearFit
    condition: float
    whiteness: Whiteness
    prediction: Prediction | None
    evaluations: int
    rows: tuple[MeasuredRow, ...]
    notes: tuple[str, ...] = ()

    def _card(self) -> Card:
        facts = (
            *((one.path, f"{one.value:.5g} ({one.interval[0]:.5g} to {one.interval[1]:.5g})") for one in self.parameters),
            ("rows", str(len(self.measured))),
            ("condition", text(self.condition, 3)),
            ("residuals like noise, p", text(self.whiteness.p_value, 2)),
        )
        columns: dict[str, list[Any]] = {
            "parameter": [one.path for one in self.parameters],
            "fitted [SI]": [one.value for one in self.parameters],
            "95 % from [SI]": [one.interval[0] for one in self.parameters],
            "95 % to [SI]": [one.interval[1] for one in self.parameters],
            "start [SI]": [one.start for one in self.parameters],
        }
        return Card("Identification", self.scene.title, facts, columns)

    @property
    def correlation(self) -> Array:
        """Between the parameters, (p, p)."""
        return self.linear.correlation

    @property
    def deviations_given(self) -> bool:
        """Whether the standard deviations were given, not found from the residuals."""
        return self.linear.degrees_of_freedom == inf

    @property
    def residuals(self) -> Array:
        """Measured minus fitted (n,), SI."""
        return self.measured - self.fitted

    def __getitem__(self, path: str) -> Parameter:
        """Return a parameter by its path."""
        return next(one for one in self.parameters if one.path == path)


def plain(found: Identification) -> dict[str, Any]:
    """Return the result as plain data, SI."""
    prediction = found.prediction
    return {
        "format": 1,
        "title": found.scene.title,
        "model": found.scene.model.kind,
        "parameters": [
            {
                "path": one.path,
                "value": one.value,
                "start": one.start,
                "standard_error": one.standard_error,
                "interval": list(one.interval),
                "scale": "log" if one.is_log else "linear",
            }
            for one in found.parameters
        ],
        "correlation": found.correlation.tolist(),
        "condition": found.condition,
        "rows": len(found.measured),
        "deviation": found.linear.deviation,
        "whiteness": vars(found.whiteness),
        "prediction": None if prediction is None else vars(prediction),
        "evaluations": found.evaluations,
        "notes": list(found.notes),
    }


def columns(found: Identification) -> dict[str, list[Any]]:
    """Return a table with a row for each measured one, SI, by headers with units; m or N as the row's column is."""
    return {
        "data": [row.source for row in found.rows],
        "column": [row.column for row in found.rows],
        "unit": [row.unit for row in found.rows],
        "depth [m]": [row.depth for row in found.rows],
        "time [s]": [row.time for row in found.rows],
        "measured [SI]": found.measured.tolist(),
        "fitted [SI]": found.fitted.tolist(),
        "residual [SI]": found.residuals.tolist(),
    }
