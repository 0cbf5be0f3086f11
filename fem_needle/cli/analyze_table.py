"""What `analyze` shows: mm, N, s, Hz, degrees."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fem_needle.cli.tables import new_table, show

if TYPE_CHECKING:
    from fem_needle.analysis.study import Analysis, DepthAnalysis, Verdict

MILLIMETERS = 1e3
FREQUENCIES = 2  # shown of each depth
# By the unit of the input: unit of a gain of the tip, and how many of it 1 m per SI unit is.
GAINS = {"N": ("mm/N", 1e3), "m": ("mm/mm", 1.0), "rad": ("mm/deg", 1e3 * pi / 180.0), "N m": ("mm/(N mm)", 1.0)}


def show_analysis(analysis: Analysis, folder: Path) -> None:
    """Print a column for each depth, where gains change sign, and where the files are."""
    table = new_table(analysis.plant.scene.title, "Depth", *(f"{MILLIMETERS * depth:.4g} mm" for depth in analysis.depths))
    for row in _rows(analysis):
        table.add_row(*row)
    show(table)
    for change in analysis.curve.sign_changes:
        way = "with" if change.sign_beyond > 0 else "against"
        typer.echo(f"beyond {MILLIMETERS * change.depth:.5g} mm the tip goes {way} {change.input.replace('_', ' ')}")
    typer.echo("vibrations: damped, overdamped ones left out; the picture and the CSV file have the undamped frequencies")
    slow = len(analysis.points[0].slow.states)
    typer.echo(f"controllable, observable: of {slow} states, the slowest vibrations; last the weakest singular value")
    typer.echo(f"folder: {folder}")


def _rows(analysis: Analysis) -> list[list[str]]:
    points = analysis.points
    rows = []
    for number in range(FREQUENCIES):
        rows.append([f"vibration {number + 1}", *(_vibration(point, number) for point in points)])
    for signal in analysis.curve.inputs:
        unit, factor = GAINS[signal.unit]
        name = f"tip by {signal.name.replace('_', ' ')}, {unit}"
        rows.append([name, *(f"{factor * point.gains[signal.name]:.4g}" for point in points)])
    for index, verdict in enumerate(points[0].verdicts):
        way = "from" if verdict.question == "observable" else "by"
        names = ", ".join(name.replace("_", " ") for name in verdict.signals)
        several = len(verdict.signals) > 1
        who = f"all {'outputs' if way == 'from' else 'inputs'}" if several else names
        rows.append([f"{verdict.question} {way} {who}", *(_answer(point.verdicts[index]) for point in points)])
    return rows


def _vibration(point: DepthAnalysis, number: int) -> str:
    model = point.model
    if number >= len(model.natural_frequencies):
        return "-"
    return f"{model.natural_frequencies[number] / (2 * pi):.4g} Hz, damping {model.damping_ratios[number]:.2g}"


def _answer(verdict: Verdict) -> str:
    return f"{'yes' if verdict.holds else 'no'}, {verdict.dimension} of {verdict.full}, {verdict.smallest:.0e}"
