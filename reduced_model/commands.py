"""Commands that this package adds to `fem-needle`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

WHERE = "Write the page here and its pictures into pictures/ beside it; else print the page."
Out = Annotated[Path | None, typer.Option("--out", metavar="FILE", help=WHERE)]
Quick = Annotated[bool, typer.Option("--quick", help="Only the sections at rest: seconds in place of minutes.")]


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("validate")(validate)
    application.command("experiments")(experiments)


def validate(out: Out = None, quick: Quick = False) -> None:
    """Compute where few modes hold and where not: the page docs/validation.md.

    Example: fem-needle validate --quick
    """
    from reduced_model.validation.page import page, sections, write_page

    _check(out)
    found = sections(quick=quick)
    if out is None:
        typer.echo(page(found, quick=quick), nl=False)
        return
    for path in write_page(out, found, quick=quick):
        typer.echo(f"wrote {path}")


def experiments(out: Out = None) -> None:
    """Repeat the thesis' control experiments and compare controllers: the page docs/steering.md; minutes.

    Example: fem-needle experiments --out steering.md
    """
    from reduced_model.steering.page import page, sections, write_page

    _check(out)
    found = sections()
    if out is None:
        typer.echo(page(found), nl=False)
        return
    for path in write_page(out, found):
        typer.echo(f"wrote {path}")


def _check(page: Path | None) -> None:
    """Refuse, before minutes of work, a page that cannot be written; one that is there is made anew."""
    from fem_needle.atomic_file import check_target

    if page is not None:
        check_target(page, force=True)
