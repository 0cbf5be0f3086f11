"""The report of a convergence study."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle.report.charts import Curve, Panel, panels_figure
from fem_needle.report.numbers import MISSING, duration, number, quantity
from fem_needle.report.parts import Chart
from fem_needle.report.study_parts import Columns, StudyParts, shortened
from fem_needle.scene import Scene

HEADERS = ("tip [mm]", "error", "shape error", "order", "grid convergence index", "asymptotic", "time", "note")
NAMES = {"elements": "elements", "modes": "modes", "time-step": "time step [s]"}


def converge_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, rows and errors of a convergence study."""
    rows, over = data["rows"], str(data["over"])
    value = NAMES.get(over, over)
    error, order = number(data["error"]), number(data["observed_order"])
    told = f"The scene was computed {len(rows)} times with other {value.partition(' [')[0]}, analysis {data['analysis']}."
    found = f"The finest row has an error of {error}; the observed order is {order}."
    held = ", ".join(f"{name.replace('_', ' ')} {number(what)}" for name, what in data["held"].items())
    reference = f"{data['reference']}; its tip deflects by {quantity(data['reference_tip'], 'm', 8)}."
    paragraphs = (
        ("Study", f"{told} {found}"),
        ("Reference", reference[0].upper() + reference[1:]),
        ("Theory", f"Order {data['theory']}."),
        ("Held fixed", f"{held}."),
    )
    grid = shortened("Discretizations", (value, *HEADERS), [_row(row) for row in rows], "converge.csv")
    picture = "Error of the tip over the discretization, beside the order that theory expects."
    return StudyParts("Convergence study", paragraphs, (grid,), (_chart(rows, value),), picture)


def _row(row: dict[str, Any]) -> tuple[str, ...]:
    figures = (number(row[name]) for name in ("error", "shape_error", "observed_order", "grid_convergence_index"))
    tip = quantity(row["tip_deflection"], "m", 8).partition("\u00a0")[0]
    asymptotic = number(row["asymptotic"])
    cells = (number(row["value"]), tip, *figures, asymptotic, duration(row["solve_time"]), str(row["note"]))
    return tuple("" if cell == MISSING else cell for cell in cells)


def _chart(rows: list[dict[str, Any]], label: str) -> Chart:
    values = np.array([row["value"] for row in rows], dtype=float)
    names = {"error": "error of the tip", "shape_error": "error of the shape"}
    curves = tuple(
        Curve(name, values, _positive([row[key] for row in rows]), markers=True) for key, name in names.items()
    )
    figure = panels_figure([Panel("error, relative", curves, logarithmic=True)], label, logarithmic=True, ticks=values.tolist())
    finest = min((row["error"] for row in rows if row["error"] is not None), default=None)
    about = f"Errors over {label}, both axes logarithmic; the smallest error of the tip is {number(finest)}."
    return Chart("errors", "Errors of tip and shape against the reference.", about, figure)


def _positive(values: list[Any]) -> np.ndarray:
    """Return values with nan where a logarithmic axis has no place for them."""
    return np.array([value if value is not None and value > 0.0 else np.nan for value in values], dtype=float)
