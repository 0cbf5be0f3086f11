"""What `identify` shows: a row for each parameter in mm, N, s, and what speaks for or against the fit."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fem_needle.cli.short_path import short_path
from fem_needle.cli.tables import new_table, show
from fem_needle.identification.static_model import numbered
from fem_needle.scene.listing import entries
from fem_needle.scene.units import display_unit, parse_unit

if TYPE_CHECKING:
    from fem_needle.identification.result import Identification, Prediction, Whiteness
    from fem_needle.scene import Scene

COLUMNS = ("fitted", "95 % interval", "start", "unit")
SUSPICIOUS = 0.05  # p-value of the residuals' whiteness


def unit_of(scene: Scene, path: str) -> str:
    """Return the SI unit of a number of a scene, "1" where there is none."""
    wanted = numbered(scene, path)
    return next((quantity.unit for key, _, quantity in entries(scene) if key == wanted and quantity is not None), "1")


def show_identification(found: Identification, folder: Path) -> None:
    """Print the table, then rows, noise, correlations, condition, whiteness, prediction and where the files are."""
    table = new_table(found.scene.title, "parameter", *COLUMNS)
    for one in found.parameters:
        unit = unit_of(found.scene, one.path)
        shown = display_unit(unit)
        size = parse_unit(shown).size / parse_unit(unit).size
        low, high = (f"{end / size:.5g}" for end in one.interval)
        table.add_row(one.path, f"{one.value / size:.5g}", f"{low} to {high}", f"{one.start / size:.5g}", shown)
    show(table)
    for line in _lines(found):
        typer.echo(line)
    typer.echo(f"files: {short_path(folder)}")


def _lines(found: Identification) -> list[str]:
    lines = [f"rows: {len(found.measured)} fitted, the model was computed {found.evaluations} times"]
    lines += [f"note: {note}" for note in found.notes]
    lines.append(f"noise: {_noise(found)}")
    pairs = combinations(range(len(found.parameters)), 2)
    paths = [one.path for one in found.parameters]
    lines += [f"correlation: {found.correlation[i, j]:+.3f} of {paths[i]} with {paths[j]}" for i, j in pairs]
    lines.append(f"condition: {found.condition:.3g} (the worst seen combination of relative changes against the best)")
    lines.append(f"residuals: {_whiteness(found.whiteness)}")
    lines.append(f"prediction: {_prediction(found.prediction)}")
    return lines


def _noise(found: Identification) -> str:
    """Return the standard deviation found, or how the residuals compare with those given."""
    if found.deviations_given:
        return f"residuals are {found.linear.deviation:.3g} times as large as the standard deviations given"
    unit = found.rows[0].unit  # of all rows
    size = parse_unit(display_unit(unit)).size / parse_unit(unit).size
    return f"standard deviation {found.linear.deviation / size:.3g} {display_unit(unit)}, from the residuals"


def _whiteness(found: Whiteness) -> str:
    figures = f"p = {found.p_value:.2g}, neighbors correlate by {found.first_correlation:+.2f}"
    if found.p_value < SUSPICIOUS:
        return f"not random ({figures}): the model misses something, and the intervals are too narrow"
    return f"like random noise ({figures})"


def _prediction(found: Prediction | None) -> str:
    if found is None:
        return "nothing was held back (--hold-back 0.25 tests the fit on rows that it has not seen)"
    inside = f"{100 * found.inside:.3g} % inside the 95 % band"
    return f"{found.rows} rows held back, {inside}, residuals {found.rms:.2f} standard deviations (largest {found.largest:.2f})"
