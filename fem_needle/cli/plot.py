"""The command `plot`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fem_needle.cli.export import RunArgument

Kinds = Annotated[
    list[str] | None,
    typer.Option("--kind", metavar="NAME", help="shapes, tip-path, courses, energies or waterfall; may be repeated."),
]
Formats = Annotated[list[str] | None, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf; may be repeated.")]
Depths = Annotated[
    list[str] | None, typer.Option("--depth", metavar="DEPTH", help="Depth of a shape, such as 50mm; may be repeated.")
]


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("plot")(plot)


def plot(
    run: RunArgument,
    kind: Kinds = None,
    form: Formats = None,
    depth: Depths = None,
    animate: Annotated[bool, typer.Option("--animate", help="Also animation.gif, the needle moving.")] = False,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="A folder; by default the run folder.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace earlier pictures.")] = False,
) -> None:
    """Draw a run: shapes, path of the tip, courses, energies, waterfall.

    Example: fem-needle plot runs/thesis --kind shapes --format pdf
    """
    from fem_needle.cli.settings import number
    from fem_needle.figures import KINDS, write_pictures
    from fem_needle.run_folder import load_run

    depths = [number("--depth", text, "m") for text in depth] if depth else None
    loaded, folder = load_run(run), run if out is None else out
    for path in write_pictures(
        loaded, folder, kind or KINDS, form or ("png",), depths=depths, animate=animate, force=force
    ):
        typer.echo(f"wrote {path}")
