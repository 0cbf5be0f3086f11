"""From a computation to a run folder and a table, also where it fails or is interrupted."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from fem_needle.cli.run_options import RUNS
from fem_needle.cli.short_path import short_path
from fem_needle.errors import ComputationError, NeedleError, no_memory

if TYPE_CHECKING:
    from pathlib import Path

    from fem_needle.progress_bar import ProgressBar
    from fem_needle.run_folder import RunFolderWriter
    from fem_needle.scene import Scene
    from fem_needle.trajectory import Trajectory

Row = tuple[str, str]


def warned(scene: Scene) -> tuple[str, ...]:
    """Show what is suspicious in a scene and return it."""
    from fem_needle.checks import suspicious

    messages = suspicious(scene)
    for message in messages:
        typer.echo(f"warning: {message}", err=True)
    return messages


def finished(compute: Callable[[], Trajectory], writer: RunFolderWriter, bar: ProgressBar, *, quiet: bool) -> Trajectory:
    """Compute a run and write its folder.

    Raises
    ------
    typer.Exit
        If it failed or was interrupted; what was computed is in the folder by then.
    """
    try:
        run = compute()
        if run.summary["stop_reason"] == "interrupted":
            _stop(writer, run, "interrupted", _interrupted(run), quiet=quiet)
        return writer.finish(run)
    except KeyboardInterrupt:
        _stop(writer, None, "interrupted", "interrupted", quiet=quiet)
    except ComputationError as error:
        _stop(writer, error.partial, "failed", str(error), quiet=quiet)
    except MemoryError as error:
        _stop(writer, None, "failed", no_memory(error), quiet=quiet)
    finally:
        bar.stop()


def _interrupted(run: Trajectory) -> str:
    return f"interrupted at time {run.time[-1]:g} s, depth {run.depth[-1]:g} m"


def _stop(writer: RunFolderWriter, run: Trajectory | None, reason: str, message: str, *, quiet: bool) -> NoReturn:
    """Save what was computed and end with a message that says where it is.

    Raises
    ------
    typer.Exit
        Always.
    """
    try:
        summary = writer.break_off(run, reason)
    except NeedleError as error:
        message = f"{message}; {error}"
        summary = {"stop_reason": reason, "folder": str(writer.folder)}
    kept = "" if writer.folder is None else f"; what was computed is in {short_path(writer.folder)}"
    typer.echo(f"error: {message}{kept}", err=True)
    if quiet and writer.folder is not None:
        print_json(summary)
    raise typer.Exit(1)


def print_json(data: dict[str, Any]) -> None:
    """Print plain data as JSON; letters that the output does not know are escaped, so that it stays JSON."""
    from fem_needle.atomic_file import json_bytes

    text = json_bytes(data).decode()
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except (UnicodeEncodeError, LookupError):
        text = json_bytes(data, escaped=True).decode()
    typer.echo(text, nl=False)


def show_rows(title: str, rows: Iterable[Row]) -> None:
    """Print a table of names and values."""
    from fem_needle.cli.tables import new_table, show

    table = new_table(title, "", "")
    table.show_header = False
    for row in rows:
        table.add_row(*row)
    show(table)


def shown_folder(writer: RunFolderWriter) -> Path:
    """Return the folder of a run as a user sees it."""
    return short_path(writer.folder or RUNS)


def explain(explanation: Sequence[Row], *, to_stderr: bool) -> None:
    """Say what each row of a table means."""
    for name, meaning in explanation:
        typer.echo(f"{name}: {meaning}", err=to_stderr)
