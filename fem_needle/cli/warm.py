"""The command `warm`."""

from __future__ import annotations

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("warm")(warm)


def warm() -> None:
    """Compile what runs need, once on a machine: for images and continuous integration; else the first runs do it.

    Example: fem-needle warm
    """
    from fem_needle.dynamics.warming import warm as prepare_all

    for done in prepare_all():
        typer.echo(done.line())
