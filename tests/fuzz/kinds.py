"""What is fuzzed: each kind takes bytes, and may refuse them with a `SceneError` or an exit status, and nothing else."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from io import BytesIO, StringIO
from pathlib import Path

import numpy as np

from fem_needle import cli, mesh_reader
from fem_needle.checks import suspicious
from fem_needle.errors import NeedleError, SceneError
from fem_needle.identification.measurements import read_measurements
from fem_needle.mesh_file import _check_kinds, _positions
from fem_needle.scene.table_file import read_table
from fem_needle.scene_file import load_scene, parse_scene, scene_text

CORPUS = Path(__file__).parent / "corpus"
FORMAT_1 = Path(__file__).parents[1] / "faults" / "format_1"
SECONDS = 10.0  # that one input may take
HARMLESS = ("check", "scenes", "schema", "new", "--version", "--help")


class TooSlowError(BaseException):
    """An input took too long."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Break off what takes too long; in the main thread of a process only."""

    def stop(number, frame):
        raise TooSlowError(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def scene(content: bytes) -> None:
    """A scene file: what loads is written, loaded again and equal."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("speed.csv", "needle.vtu"):
            shutil.copy(FORMAT_1 / "scene" / name, folder)
        path = Path(folder) / "scene.toml"
        path.write_bytes(content)
        try:
            loaded = load_scene(path)
        except SceneError as error:
            told(error)
            return
    suspicious(loaded)
    if parse_scene(scene_text(loaded)) != loaded:
        raise AssertionError("a scene that is written does not load as itself")


def told(error: SceneError) -> None:
    """Check what an error says: something, in lines that can be read."""
    text = str(error)
    if not text or any(len(line) > 2000 for line in error.mistakes):
        raise AssertionError(f"an error of {len(text)} characters")


def mesh(content: bytes) -> None:
    """A mesh file; the first line is its ending. Read in this process, which the time limit guards."""
    ending, _, rest = content.partition(b"\n")
    name = ending.decode("ascii", "replace").strip()
    if name not in {"vtu", "vtk", "msh", "xdmf", "inp", "mesh", "obj"}:
        name = "vtu"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"needle.{name}"
        path.write_bytes(rest)
        try:
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
                arrays = mesh_reader.contents(path)
        except (Exception, SystemExit) as error:  # of meshio, whose process would say no more than this
            if len(mesh_reader.reason(path, error)) > 300:
                raise AssertionError("a reason that is too long") from error
            return
    _judged(arrays)


def _judged(arrays: bytes) -> None:
    with np.load(BytesIO(arrays)) as found:
        points, kinds, lines = found["points"], found["kinds"].tolist(), found["lines"]
    try:
        _check_kinds(points, kinds, lines)
        nodes = _positions(points, lines)
    except SceneError as error:
        told(error)
        return
    if not (np.all(np.diff(nodes) > 0.0) and nodes[0] == 0.0):
        raise AssertionError("a mesh was taken that is none")


def csv(content: bytes) -> None:
    """A table of a scene, and measurements."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        path.write_bytes(content)
        with suppress(ValueError):
            read_table("table.csv", "speed", Path(folder))
        try:
            read_measurements(path)
        except SceneError as error:
            told(error)


def command(content: bytes) -> None:
    """A command line, one argument for each line, in a folder that goes; a run is never begun: its tolerance is refused."""
    arguments = [line for line in content.decode("utf-8", "replace").split("\n") if line][:20]
    if not arguments or arguments[0] not in (*HARMLESS, "run"):
        arguments = ["check", *arguments]
    if arguments[0] == "new":
        arguments = [argument for argument in arguments if "/" not in argument]
    if arguments[0] == "run":
        arguments += ["--tolerance", "-1"]
    before = sys.argv
    with tempfile.TemporaryDirectory() as folder, inside(folder), redirect_stdout(StringIO()), redirect_stderr(StringIO()) as err:
        sys.argv = ["fem-needle", *arguments]
        try:
            cli.main()
        except SystemExit as ended:
            if ended.code not in {None, 0, 1, 2} or "Traceback" in err.getvalue():
                raise AssertionError(f"exit status {ended.code}") from ended
        finally:
            sys.argv = before


@contextmanager
def inside(folder: str) -> Iterator[None]:
    """Work in a folder with a scene, so that a command line can write nothing elsewhere by a relative path."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


KINDS: dict[str, Callable[[bytes], None]] = {"scene": scene, "mesh": mesh, "csv": csv, "command": command}


def check(kind: str, content: bytes) -> None:
    """Give an input to its kind; raise what must not be."""
    with warnings.catch_warnings(), time_limit(SECONDS):
        warnings.simplefilter("ignore")
        try:
            KINDS[kind](content)
        except NeedleError as error:
            raise AssertionError(f"{type(error).__name__} where a SceneError belongs: {error}") from error


def corpus(kind: str) -> list[Path]:
    """Return the inputs of a kind that are kept."""
    return sorted(path for path in (CORPUS / kind).iterdir() if path.is_file())
