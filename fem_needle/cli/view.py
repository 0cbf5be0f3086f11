"""The command `view`."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli.export import RunArgument
from fem_needle.errors import SceneError

if TYPE_CHECKING:
    from fem_needle.view import Arrangement

PICTURE = "view.png"
AUTO = "auto"


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("view")(view)


def view(
    run: RunArgument,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a page with a slider over time.")] = None,
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a picture, PNG, and open no window.")] = None,
    time: Annotated[str | None, typer.Option(metavar="TIME", help="Sample to show; by default the last.")] = None,
    magnification: Annotated[float | None, typer.Option(metavar="X", help="Of deflections; by default a round number.")] = None,
    renderer: Annotated[str, typer.Option(metavar="NAME", help="Of the picture: auto, vtk or matplotlib.")] = AUTO,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier file.")] = False,
) -> None:
    """Show a run in three dimensions: a window, a picture, or a page for any browser.

    Without a display and without options: RUN/view.png.

    Example: fem-needle view runs/thesis --html thesis.html
    """
    from fem_needle.atomic_file import check_target
    from fem_needle.cli.settings import number
    from fem_needle.run_folder import load_run
    from fem_needle.view import arrangement

    windowed = html is None and picture is None and _has_display()
    if html is None and picture is None and not windowed:
        picture = run / PICTURE
        typer.echo("note: no display that answers, so a picture in place of a window", err=True)
    if picture is not None and picture.suffix.lower() != ".png":
        raise SceneError(f"--picture: is no PNG file by its name (got {picture.name!r}; allowed a name that ends in .png)")
    if picture is None and renderer != AUTO:
        raise SceneError(f"--renderer: has no effect without --picture (got {renderer!r})")
    for path in (html, picture):
        if path is not None:
            check_target(path, force=force)
    arranged = arrangement(load_run(run), magnification)
    row = arranged.row(None if time is None else number("--time", time, "s"))
    if windowed:
        from fem_needle.view.by_vtk import show

        show(arranged, row)
    if html is not None:
        _write_page(arranged, row, html)
    if picture is not None:
        _write_picture(arranged, row, picture, renderer)


def _has_display() -> bool:
    """Return whether a window would open: VTK, which only talks to X, says nothing where the display does not answer."""
    if sys.platform in {"win32", "darwin"}:
        return True
    return bool(os.environ.get("DISPLAY")) and _answers()


def _answers() -> bool:
    try:
        library = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False  # VTK needs it, too
    library.XOpenDisplay.restype = ctypes.c_void_p
    display = library.XOpenDisplay(None)
    if display:
        library.XCloseDisplay(ctypes.c_void_p(display))
    return bool(display)


def _write_page(arranged: Arrangement, row: int, path: Path) -> None:
    from fem_needle.view.html import write_html

    count = write_html(arranged, path, row)
    typer.echo(f"wrote {path}: {count} of {len(arranged.run.time)} samples; {arranged.note}")


def _write_picture(arranged: Arrangement, row: int, path: Path, renderer: str) -> None:
    from fem_needle.view import Renderer, write_picture

    names = [kind.value for kind in Renderer]
    if renderer not in names:
        raise SceneError(f"--renderer: is not a choice (got {renderer!r}; allowed {', '.join(names)})")
    drawer = write_picture(arranged, row, path, Renderer(renderer))
    typer.echo(f"wrote {path}: {arranged.note}")
    if drawer is Renderer.MATPLOTLIB and renderer == AUTO:
        typer.echo("note: VTK found no GL here, so matplotlib drew it", err=True)
