"""The command `fem-needle`: thin; every command imports what it needs when it runs.

A command group is a module of this package with ``register(application)``;
list it in `GROUPS`. Another package adds commands with such a function as an
entry point of the group ``fem_needle.commands``.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module, metadata
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

import typer

from fem_needle.cli.waiting import compilations_shown
from fem_needle.errors import NeedleError, SceneError, SuspiciousValueWarning, no_memory

GROUPS = (
    "fem_needle.cli.scene_commands",
    "fem_needle.cli.run",
    "fem_needle.cli.steer",
    "fem_needle.cli.export",
    "fem_needle.cli.plot",
    "fem_needle.cli.view",
    "fem_needle.cli.report",
    "fem_needle.cli.converge",
    "fem_needle.cli.analyze",
    "fem_needle.cli.compare",
    "fem_needle.cli.identify",
    "fem_needle.cli.benchmark",
    "fem_needle.cli.stress",
    "fem_needle.cli.warm",
)
ENTRY_POINTS = "fem_needle.commands"

ENDING = ("SIGTERM", "SIGHUP")
WRONG_INPUT = 2
FAILED = 1


def main() -> None:
    """Run the command line; exit status 0 done, 2 wrong input, 1 failed."""
    warnings.simplefilter("ignore", SuspiciousValueWarning)  # the commands show them themselves
    _replace_unknown_letters()
    os.environ["MPLBACKEND"] = "agg"  # pictures are files; another one, or none of that name, would stop matplotlib's import
    try:
        _require_folder()
        with _ended_as_interrupted(), compilations_shown():
            build_application()()
    except SceneError as error:
        _stop(error.mistakes, WRONG_INPUT)
    except NeedleError as error:
        _stop((str(error),), FAILED)
    except MemoryError as error:
        _stop((no_memory(error),), FAILED)
    except OSError as error:  # a full disk, a folder that vanished: of what no command expects
        _stop((str(error),), FAILED)


def _replace_unknown_letters() -> None:
    """Let a terminal that does not know a letter (ASCII, cp1252) show another in its place: the work is done by then."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")


def _require_folder() -> None:
    """Refuse to begin in a folder that is gone, in which no path means anything.

    Raises
    ------
    SceneError
        That says so.
    """
    try:
        Path.cwd()
    except OSError:
        raise SceneError("the working folder: has been removed or cannot be read (enter another one with cd)") from None


@contextmanager
def _ended_as_interrupted() -> Iterator[None]:
    """Let whoever ends the program (SIGTERM) or closes its terminal (SIGHUP) interrupt it: what was computed is kept."""
    signals = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in signals}
    for number, handler in before.items():
        if handler == signal.SIG_DFL:  # one that is ignored, as under nohup, stays so
            signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def build_application() -> typer.Typer:
    """Return the application with all command groups."""
    application = typer.Typer(
        help="Flexible needles pushed into soft tissue.\n\nExample: fem-needle check thesis",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    application.callback()(_options)
    for group in GROUPS:
        import_module(group).register(application)
    for point in metadata.entry_points(group=ENTRY_POINTS):
        point.load()(application)
    return application


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fem-needle {metadata.version('fem-needle')}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Hold the options of the command itself."""


def _stop(messages: tuple[str, ...], status: int) -> None:
    """Write one line for each message on stderr and exit."""
    for message in messages:
        typer.echo(f"error: {message}", err=True)
    sys.exit(status)
