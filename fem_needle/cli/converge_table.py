"""What `converge` shows: a row for each discretization in mm and s, and what it refers to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fem_needle.cli.short_path import short_path
from fem_needle.cli.tables import new_table, show

if TYPE_CHECKING:
    from fem_needle.convergence.rows import ConvergenceRow
    from fem_needle.convergence.study import ConvergenceStudy

COLUMNS = (
    "tip [mm]",
    "error",
    "shape error",
    "order",
    "order of 3 rows",
    "Richardson [mm]",
    "GCI",
    "asymptotic",
    "time [s]",
    "note",
)
_NAMES = {"elements": "elements", "modes": "modes", "time-step": "time step [s]"}


def show_study(study: ConvergenceStudy, folder: Path) -> None:
    """Print the table, what errors refer to, what was held fixed and where the files are."""
    table = new_table(study.scene.title, _NAMES[study.over], *COLUMNS)
    for row in study.rows:
        table.add_row(*_cells(row))
    show(table)
    typer.echo(f"reference: {study.reference}; tip {1e3 * study.reference_tip:.10g} mm")
    typer.echo(f"theory: {study.theory}")
    typer.echo(f"held fixed: {_held(study)}")
    typer.echo(f"files: {short_path(folder)}")


def _cells(row: ConvergenceRow) -> tuple[str, ...]:
    return (
        f"{row.value:g}",
        f"{1e3 * row.tip_deflection:.9f}",
        _text(row.error, ".2e"),
        _text(row.shape_error, ".2e"),
        _text(row.observed_order, ".3f"),
        _text(row.three_row_order, ".3f"),
        "" if row.richardson_tip is None else f"{1e3 * row.richardson_tip:.9f}",
        _text(row.grid_convergence_index, ".2e"),
        {None: "", True: "yes", False: "no"}[row.asymptotic],
        f"{row.solve_time:.3f}",
        row.note,
    )


def _text(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _held(study: ConvergenceStudy) -> str:
    shown = {"analysis": study.analysis} | study.held
    parts = [f"{name.replace('_', ' ')} {_shown(name, value)}" for name, value in shown.items()]
    if study.held_error is not None:
        finer = "half the time step changes" if study.over != "time-step" else "a model of twice the size changes"
        parts.append(f"{finer} the finest row by {study.held_error:.1e}")
    return ", ".join(parts)


def _shown(name: str, value: float | str) -> str:
    """Return a held value; a step in s."""
    unit = " s" if name.endswith("_step") else ""
    return f"{value:.4g}{unit}" if isinstance(value, float) else str(value)
