"""The command `export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fem_needle.errors import SceneError

RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")]


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("export")(export)


def export(
    run: RunArgument,
    kind: Annotated[str, typer.Option("--format", metavar="FORMAT", help="pvd, vtkhdf, csv or mat.")],
    out: Annotated[
        Path | None, typer.Option(metavar="PATH", help="A folder, or FILE.mat, FILE.vtkhdf; by default the run folder.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier export.")] = False,
) -> None:
    """Write a run for ParaView, spreadsheets or MATLAB.

    Example: fem-needle export runs/thesis --format csv
    """
    from fem_needle.export import FORMATS, export_run
    from fem_needle.run_folder import load_run

    if kind not in FORMATS:
        raise SceneError(f"--format: is not a choice (got {kind!r}; allowed {', '.join(FORMATS)})")
    for path in export_run(load_run(run), kind, run if out is None else out, force=force):
        typer.echo(f"wrote {path}")
