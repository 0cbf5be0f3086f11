"""The command `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

FILE = "report.html"


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("report")(report)


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, or the folder of a study.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help=f"The page; by default {FILE} in that folder.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier report.")] = False,
) -> None:
    """Write a run or a study as one printable page that needs no network.

    Example: fem-needle report runs/thesis
    """
    from fem_needle.atomic_file import check_target
    from fem_needle.report import read_folder, write_report

    path = run / FILE if out is None else out
    page = read_folder(run)
    check_target(path, force=force)
    write_report(page, path)
    typer.echo(f"wrote {path}")
