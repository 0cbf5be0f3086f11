"""The report of an analysis of linear models."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle.report.charts import Curve, Panel, column, panels_figure
from fem_needle.report.numbers import millimeters, number, quantity, with_unit
from fem_needle.report.parts import Chart, Grid
from fem_needle.report.study_parts import Columns, StudyParts, hertz, model_words
from fem_needle.scene import Scene

MILLI, DEGREE = 1e3, np.pi / 180.0
# By the unit of the input: unit of a gain of the tip, and how many of it 1 m per SI unit is.
GAINS = {"N": ("mm/N", MILLI), "m": ("mm/mm", 1.0), "rad": ("mm/deg", MILLI * DEGREE), "N m": ("mm/(N mm)", 1.0)}
FREQUENCIES = 3
DAMPED = "Vibrations are those of the damped poles, overdamped ones left out; curves over the depth are undamped frequencies."


def analyze_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, gains and frequencies of an analysis."""
    time, speed = quantity(data["time"], "s"), quantity(data["speed"], "m/s")
    axial = "depth and speed are states" if data["axial"] == "free" else "the depth is given"
    told = f"Linear models of {model_words(data)} at {len(data['depths'])} depths, at {time} and {speed}; {axial}."
    paragraphs = (("Study", told), ("Signs", _signs(data)))
    picture = "Static gains of the tip and undamped natural frequencies over the depth."
    warnings = tuple(str(text) for text in data.get("warnings", ()))
    grids = (_states(data), _verdicts(data))
    return StudyParts("Analysis for control", paragraphs, grids, _charts(columns), picture, warnings)


def _signs(data: dict[str, Any]) -> str:
    sentences = []
    for change in data["sign_changes"]:
        way = "with" if change["sign_beyond"] > 0 else "against"
        sentences.append(f"Beyond {millimeters(change['depth'])} the tip goes {way} the {change['input'].replace('_', ' ')}.")
    return " ".join(sentences) or "No gain changes its sign over the depths."


def _states(data: dict[str, Any]) -> Grid:
    """Return frequencies and gains, a column for each depth."""
    points, units = data["depths"], {one["name"]: one["unit"] for one in [*data["inputs"], *data["outputs"]]}
    rows = [("tip deflection", *(millimeters(point["tip_deflection"]) for point in points))]
    for index in range(FREQUENCIES):
        cells = (_vibration(point, index) for point in points)
        rows.append((f"vibration {index + 1}", *cells))
    for name in points[0]["static_gains"] if points else ():
        unit, factor = GAINS[units.get(name, "m")]
        gains = (point["static_gains"].get(name) for point in points)
        rows.append((f"tip by {name.replace('_', ' ')} [{unit}]", *(number(None if g is None else factor * g) for g in gains)))
    return Grid("At each depth", ("", *(millimeters(point["depth"]) for point in points)), tuple(rows), DAMPED)


def _vibration(point: dict[str, Any], index: int) -> str:
    if index >= len(point["natural_frequencies"]):
        return ""
    damping = number(point["damping_ratios"][index], 2)
    return f"{with_unit(hertz(point['natural_frequencies'][index]), 'Hz')}, damping {damping}"


def _verdicts(data: dict[str, Any]) -> Grid:
    points = data["depths"]
    rows = []
    for index, verdict in enumerate(points[0]["verdicts"] if points else ()):
        way = "from" if verdict["question"] == "observable" else "by"
        several = "all outputs" if way == "from" else "all inputs"
        who = several if len(verdict["signals"]) > 1 else verdict["signals"][0].replace("_", " ")
        cells = (_answer(point["verdicts"][index]) for point in points)
        rows.append((f"{verdict['question']} {way} {who}", *cells))
    headers = ("", *(millimeters(point["depth"]) for point in points))
    return Grid("Controllable and observable, of the slowest vibrations", headers, tuple(rows))


def _answer(verdict: dict[str, Any]) -> str:
    return f"{number(verdict['holds'])}, {verdict['dimension']} of {verdict['full']}"


def _charts(columns: Columns) -> tuple[Chart, ...]:
    depth, panels = MILLI * column(columns, "depth [m]"), []
    groups: dict[tuple[str, float], list[Curve]] = {}
    for header in columns:
        if " / " in header:
            name = header.partition(" / ")[2].partition(" [")[0]
            unit = header.rpartition("/(")[2].rstrip(")]")
            shown, factor = GAINS[unit]
            curve = Curve(f"by {name.replace('_', ' ')}", depth, factor * column(columns, header))
            groups.setdefault((shown, factor), []).append(curve)
    panels += [Panel(f"tip gain [{unit}]", tuple(curves)) for (unit, _), curves in groups.items()]
    frequencies = [header for header in columns if header.startswith("natural_frequency")]
    curves = tuple(
        Curve(f"undamped frequency {index}", depth, column(columns, header) / (2.0 * np.pi))
        for index, header in enumerate(frequencies, start=1)
    )
    if curves:
        panels.append(Panel("undamped frequency [Hz]", curves))
    about = "Static gains of the tip by each input and the lowest undamped natural frequencies over the depth."
    return (Chart("gains", about, about, panels_figure(panels, "depth [mm]")),) if panels else ()
