"""The report of a benchmark."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle.report.charts import Curve, Panel, panels_figure
from fem_needle.report.numbers import duration, instant, number
from fem_needle.report.parts import Chart, Grid
from fem_needle.report.study_parts import Columns, StudyParts, shortened
from fem_needle.scene import Scene


def benchmark_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, times and errors of a benchmark."""
    machine = ", ".join(f"{name} {number(value)}" for name, value in data["machine"].items())
    cases = " ".join(f"{one['name']}: {one['about']}, against {one['reference']}." for one in data["cases"])
    limits = " ".join(f"{name}: {text}." for name, text in data["limits"].items())
    paragraphs = [
        ("Study", f"Run time against error, {len(data['rows'])} rows, on {instant(data['date'])}, commit {data['commit']}."),
        ("Cases", cases),
        ("Machine", f"{machine}."),
    ]
    paragraphs += [("Limits", limits)] if limits else []
    skipped = [f"{name} was skipped: {reason}" for name, reason in data["skipped"].items()]
    grids = [grid for grid in (_rows(data), _goals(data), _scaling(data)) if grid is not None]
    charts = tuple(_chart(case, [row for row in data["rows"] if row["case"] == case["name"]]) for case in data["cases"])
    picture = "Error of the tip against time to solve, a panel for each case."
    scaling = {"benchmark-scaling.png": "Cost of a step and of a run over their sizes."}
    return StudyParts("Benchmark", tuple(paragraphs), tuple(grids), charts, picture, tuple(skipped), scaling, title="Benchmark")


def _rows(data: dict[str, Any]) -> Grid:
    rows = [
        (
            str(row["case"]), str(row["method"]), str(row["label"]), number(row["error"]), duration(row["median"]),
            f"{duration(row['lowest'])} to {duration(row['highest'])}", str(row["steps"] or ""), str(row["note"] or ""),
        )
        for row in data["rows"]
    ]  # fmt: skip
    headers = ("case", "method", "setting", "error of the tip", "time", "range", "steps", "note")
    return shortened("Methods", headers, rows, "benchmark.csv")


def _goals(data: dict[str, Any]) -> Grid | None:
    rows = tuple(
        (str(one["text"]), number(one["goal"]), number(one["measured"]), str(one["unit"]), number(one["met"]), str(one["note"]))
        for one in data["goals"]
    )
    return Grid("Goals", ("goal", "asked", "measured", "unit", "met", "note"), rows) if rows else None


def _scaling(data: dict[str, Any]) -> Grid | None:
    rows = [
        (str(one["over"]), str(one["method"]), number(one["size"]), duration(one["per_step"]), duration(one["total"]))
        for one in data["scaling"]
    ]
    return shortened("Scaling", ("over", "method", "size", "a step", "total"), rows, "benchmark.json") if rows else None


def _chart(case: dict[str, Any], rows: list[dict[str, Any]]) -> Chart:
    curves = []
    for method in dict.fromkeys(row["method"] for row in rows):
        mine = [row for row in rows if row["method"] == method]
        points = sorted((_positive(row["median"]), _positive(row["error"])) for row in mine)
        times, errors = np.array(points, dtype=float).T
        curves.append(Curve(str(method), times, errors, markers=True))
    figure = panels_figure([Panel("error of the tip", tuple(curves), logarithmic=True)], "time to solve [s]", logarithmic=True)
    about = f"Case {case['name']}, {case['about']}: error of the tip over the time to solve; errors of 0 have no point."
    return Chart(f"case-{case['name'].lower()}", about, about, figure)


def _positive(value: float | None) -> float:
    """Return a value, nan where a logarithmic axis has no place for it."""
    return value if value is not None and value > 0.0 else float("nan")
