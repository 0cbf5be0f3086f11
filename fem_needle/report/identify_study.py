"""The report of an identification."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from fem_needle.closed_loop.units import shown_unit
from fem_needle.identification.static_model import numbered
from fem_needle.report.charts import Curve, Panel, column, panels_figure
from fem_needle.report.numbers import number, ratio, unit_text
from fem_needle.report.parts import Chart, Grid
from fem_needle.report.study_parts import Columns, StudyParts
from fem_needle.scene import Scene
from fem_needle.scene.listing import entries

SUSPICIOUS = 0.05  # p-value of the residuals' whiteness


def identify_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, fitted values and residuals of an identification."""
    files = ", ".join(dict.fromkeys(columns["data"]))
    told = f"{len(data['parameters'])} numbers of the scene were fitted to {data['rows']} rows of {files}."
    paragraphs = [
        ("Study", f"{told} The model, {data['model']}, was computed {data['evaluations']} times."),
        ("Residuals", _whiteness(data["whiteness"])),
        ("Condition", f"{number(data['condition'])}: the worst seen combination of relative changes against the best."),
        ("Prediction", _prediction(data.get("prediction"))),
        *(("Data", f"{note}.") for note in data.get("notes", ())),
    ]
    likely = data["whiteness"].get("p_value")
    warnings = ("The residuals are not random: the model misses something, and the intervals are too narrow.",)
    suspicious = likely is not None and likely < SUSPICIOUS
    picture = "Data and fit, and the residuals with a band of two standard deviations."
    grids = (_parameters(data, scene), *_correlations(data))
    charts = _charts(columns)
    return StudyParts("Identification", tuple(paragraphs), grids, charts, picture, warnings if suspicious else ())


def _whiteness(found: dict[str, Any]) -> str:
    figures = f"p = {number(found.get('p_value'), 2)}, neighbors correlate by {number(found.get('first_correlation'), 2)}"
    return f"Like random noise where p is above {SUSPICIOUS}: {figures}."


def _prediction(found: dict[str, Any] | None) -> str:
    if not found:
        return "No rows were held back to test the fit."
    return f"{found['rows']} rows were held back, {ratio(found['inside'])} of them lie inside the 95 % band."


def _parameters(data: dict[str, Any], scene: Scene) -> Grid:
    units = {path: kind.unit for path, _, kind in entries(scene) if kind is not None}
    rows = []
    for one in data["parameters"]:
        size, shown = shown_unit(units.get(numbered(scene, one["path"]), "1"))
        low, high = (number(None if end is None else end / size) for end in one["interval"])
        value, start = (number(None if one[key] is None else one[key] / size) for key in ("value", "start"))
        rows.append((one["path"], value, f"{low} to {high}", start, unit_text(shown)))
    return Grid("Fitted values", ("key of the scene file", "fitted", "95 % interval", "start", "unit"), tuple(rows))


def _correlations(data: dict[str, Any]) -> tuple[Grid, ...]:
    paths = [one["path"] for one in data["parameters"]]
    pairs = combinations(range(len(paths)), 2)
    rows = tuple((paths[i], paths[j], number(data["correlation"][i][j], 3)) for i, j in pairs)
    return (Grid("Correlation of the fitted values", ("one", "other", "correlation"), rows),) if rows else ()


def _charts(columns: Columns) -> tuple[Chart, ...]:
    """Return data, fit and residuals for each column of the data."""
    depth, time = column(columns, "depth [m]"), column(columns, "time [s]")
    still = bool(np.all(np.isfinite(depth)))
    across, label = (1e3 * depth, "depth [mm]") if still else (time, "time [s]")
    charts = []
    for number_of, name in enumerate(dict.fromkeys(columns["column"]), start=1):
        chosen = np.array([text == name for text in columns["column"]], dtype=bool)
        size, unit = shown_unit(next(text for text, mine in zip(columns["unit"], chosen, strict=True) if mine))
        measured, fitted, residual = (
            column(columns, f"{key} [SI]")[chosen] / size for key in ("measured", "fitted", "residual")
        )
        order, words = np.argsort(across[chosen], kind="stable"), name.replace("_", " ")
        x = across[chosen][order]
        panels = (
            Panel(f"{words} [{unit}]", (Curve("fitted", x, fitted[order]), Curve("measured", x, measured[order], True, False))),
            Panel(f"residual [{unit}]", (Curve("residual", x, residual[order], True, False),)),
        )
        about = f"Measured and fitted {words} over {label}; the largest residual is {_largest(residual * size, unit, size)}."
        charts.append(Chart(f"fit-{number_of}", about, about, panels_figure(panels, label)))
    return tuple(charts)


def _largest(residual: np.ndarray, unit: str, size: float) -> str:
    return f"{number(float(np.nanmax(np.abs(residual), initial=0.0)) / size)} {unit_text(unit)}"
