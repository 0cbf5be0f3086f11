"""The command `stress`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.errors import NeedleError, SceneError

if TYPE_CHECKING:
    from fem_needle.stress import StressTable

NAME = "stress"


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(stress)


def stress(
    long: Annotated[bool, typer.Option("--long", help="10 000 random scenes a model, 1e7 steps: an hour.")] = False,
    scenes: Annotated[int | None, typer.Option(metavar="N", help="Random scenes of each model; by default 500.")] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Of the first random scene; the others follow.")] = 0,
    processes: Annotated[int | None, typer.Option(metavar="N", help="At once; by default one for each core.")] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the table as a page, Markdown.")] = None,
) -> None:
    """Run scenes over ranges far beyond needles and count what must not happen; fails if anything does.

    Example: fem-needle stress --scenes 20
    """
    for name, value, least in (("--scenes", scenes, 0), ("--seed", seed, 0), ("--processes", processes, 1)):
        if value is not None and value < least:
            raise SceneError(f"{name}: too few (got {value}; allowed from {least} on)")
    from fem_needle.atomic_file import check_target, write_file
    from fem_needle.cli.tables import new_table, show
    from fem_needle.progress_bar import ProgressBar
    from fem_needle.stress import stress as put_through

    if out is not None:
        check_target(out, force=True)
    bar = ProgressBar("scenes under stress")
    try:
        table = put_through(scenes, seed, long=long, processes=processes, progress=bar.progress)
    finally:
        bar.stop()
    shown = new_table("", "case", "range", "runs", "announced", "failures", "worst figure")
    for row in table.rows:
        shown.add_row(*row.cells())
    show(shown)
    if out is not None:
        write_file(out, table.page().encode())
    _fail(table)


def _fail(table: StressTable) -> None:
    if table.failures:
        raise NeedleError("\n".join([f"{table.failures} failures", *table.shown_failures()]))
