"""What `benchmark` shows: a table for each case, the goals, the scaling; times in us, ms, s."""

from __future__ import annotations

from math import isinf
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from fem_needle.cli.short_path import short_path
from fem_needle.cli.tables import new_table, show

if TYPE_CHECKING:
    from fem_needle.benchmark.result import Benchmark, GoalRow, Row, ScalingRow

MILLI, MICRO, MEGA = 1e3, 1e6, 1e-6


def show_benchmark(study: Benchmark, folder: Path, kept: Path | None) -> None:
    """Print all tables, who could not take part, and where the files are."""
    for case in study.cases:
        _show_case(study, case.name, f"{case.name}: {case.about}")
        typer.echo(f"true tips of {case.name}: {case.reference}")
    if study.goals:
        _show_goals(study.goals)
    if study.scaling:
        _show_scaling(study.scaling)
    for name, reason in study.skipped:
        typer.echo(f"skipped: {name}: {reason}")
    for name, reason in study.limits:
        typer.echo(f"limited: {name}: {reason}")
    machine = study.machine or {}
    typer.echo(f"machine: {machine.get('processor')}, {machine.get('cores')} cores; commit {study.commit}")
    typer.echo(f"files: {short_path(folder)}")
    if kept is not None:
        typer.echo(f"kept: {short_path(kept)}")


def _show_case(study: Benchmark, name: str, title: str) -> None:
    """Print the rows of a case; the spread is the shortest and the longest time."""
    table = new_table(title, "method", "setting", "error", "time [ms]", "spread [ms]", "rounds", "step [us]", "whole answer [ms]")
    for row in study.of_case(name):
        table.add_row(row.method, row.setting.label, *_cells(row))
    show(table)


def _cells(row: Row) -> tuple[str, ...]:
    if row.median is None or row.lowest is None or row.highest is None:
        return row.note, "", "", "", "", ""
    spread = f"{MILLI * row.lowest:.4g} to {MILLI * row.highest:.4g}"
    step, whole = _scaled(row.per_step, MICRO), _scaled(row.whole, MILLI)
    return _error(row), f"{MILLI * row.median:.4g}", spread, str(row.rounds), step, whole


def _error(row: Row) -> str:
    if row.error is None or isinf(row.error):
        return "no number"
    return f"{row.error:.1e}"


def _scaled(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.4g}"


def _show_goals(goals: tuple[GoalRow, ...]) -> None:
    table = new_table("Goals", "", "goal", "asked", "measured", "unit", "met", "by")
    for row in goals:
        measured = "not measured" if row.measured is None else f"{row.measured:.3g}"
        met = "" if row.met is None else "yes" if row.met else "no"
        table.add_row(row.number, row.text, f"{row.goal:.4g}", measured, row.unit, met, row.note)
    show(table)


def _show_scaling(rows: tuple[ScalingRow, ...]) -> None:
    table = new_table("Scaling", "over", "size", "method", "step [us]", "run [s]", "memory [MB]", "")
    for row in rows:
        size = f"{row.size:g} s" if row.over == "duration" else f"{row.size:g}"
        cells = (_scaled(row.per_step, MICRO), _scaled(row.total, 1.0), _scaled(row.memory, MEGA))
        table.add_row(row.over, size, row.method, *cells, row.note)
    show(table)
