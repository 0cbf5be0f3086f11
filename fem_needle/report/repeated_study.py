"""The report of many runs of a closed loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle.report.charts import Curve, Panel, panels_figure
from fem_needle.report.numbers import MISSING, millimeters, number, quantity
from fem_needle.report.parts import Chart
from fem_needle.report.study_parts import Columns, StudyParts, shortened
from fem_needle.scene import Scene
from fem_needle.scene.signals import INPUT_UNITS

MILLI = 1e3
MOST_TICKS = 10
HEADERS = ("error at the target", "time there", "largest tip", "modulus factor", "entry angle", "speed factor", "end")


def repeated_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, errors and draws of many runs of a loop."""
    rows = data["rows"]
    counts = f"{data['arrived']} arrived, {data['failed']} failed, {data['missed']} missed the target's depth"
    errors = f"Errors of the tip at the target: mean {millimeters(data['mean'])}, standard deviation "
    errors += f"{millimeters(data['standard_deviation'])}, largest {millimeters(data['largest_error'])}."
    told = f"The loop was run {len(rows)} times with other tissue and noise, of {data['asked']} asked for: {counts}."
    paragraphs = (("Study", f"{told} {errors}"), ("Scatter", _scatter(data["scatter"])))
    failures = [row for row in rows if row.get("failure")]
    warnings = tuple(f"repetition {row['repetition']}: {row['failure']}" for row in failures)
    inputs = [name for name in INPUT_UNITS if any(name in (row.get("largest_command") or {}) for row in rows)]
    headers = ("repetition", *HEADERS, *(f"largest {name.replace('_', ' ')}" for name in inputs))
    grid = shortened("Repetitions", headers, [_row(row, inputs) for row in rows], "steer.csv")
    alarm = "" if len(rows) == data["asked"] else f"The study was interrupted: {len(rows)} of {data['asked']} repetitions."
    picture = "All tips and their mean, and the distribution of the errors at the target."
    return StudyParts("Repeated closed loop", paragraphs, (grid,), (_chart(rows),), picture, warnings, alarm=alarm)


def _scatter(scatter: dict[str, Any]) -> str:
    units = {"modulus": "1", "entry_angle": "rad", "speed": "1"}
    parts = [f"{name.replace('_', ' ')} {quantity(value, units.get(name, '1'))}" for name, value in scatter.items()]
    return f"Standard deviations of what differs: {', '.join(parts)}."


def _row(row: dict[str, Any], inputs: list[str]) -> tuple[str, ...]:
    largest = row.get("largest_command") or {}
    cells = (
        str(row["repetition"]), millimeters(row["target_error"]), quantity(row["target_time"], "s"),
        millimeters(row["max_abs_tip_deflection"]), number(row["modulus_factor"]), quantity(row["entry_angle"], "rad"),
        number(row["speed_factor"]), str(row["stop_reason"]),
        *(quantity(largest.get(name), INPUT_UNITS[name]) for name in inputs),
    )  # fmt: skip
    return tuple("" if cell == MISSING else cell for cell in cells)


def _ticks(count: int) -> list[float]:
    """Return some whole numbers from 1 to a count."""
    return [float(number) for number in range(1, count + 1, max(1, count // MOST_TICKS))]


def _chart(rows: list[dict[str, Any]]) -> Chart:
    numbers = np.array([row["repetition"] for row in rows], dtype=float)
    errors = np.array([np.nan if row["target_error"] is None else MILLI * row["target_error"] for row in rows], dtype=float)
    curve = Curve("error at the target", numbers, errors, markers=True, line=False)
    figure = panels_figure([Panel("error [mm]", (curve,))], "repetition", ticks=_ticks(len(rows)))
    about = f"Error of the tip at the target of each of {len(rows)} repetitions; those that did not arrive have no point."
    return Chart("errors", about, about, figure)
