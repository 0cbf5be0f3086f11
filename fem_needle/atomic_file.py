"""Files that are either there whole or not at all."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from fem_needle.errors import ComputationError, SceneError

_UNFINISHED = re.compile(r"\..+\.\d+\.tmp")


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file beside its place and move it there; an old one stays until then, also on a full disk.

    Parameters
    ----------
    path
        Where; its folder exists.
    content
        What.

    Raises
    ------
    OSError
        If it cannot be written; nothing is left behind, except by a process that is killed: `is_unfinished` tells such a file.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def check_target(target: Path, *, force: bool) -> None:
    """Refuse to overwrite a folder or, without ``force``, a file, and places that cannot be.

    Raises
    ------
    SceneError
        That says why.
    """
    try:
        exists, is_folder = target.exists(), target.is_dir()
    except (OSError, ValueError) as error:
        raise SceneError(f"{target}: cannot be written: {error}") from None
    if is_folder:
        raise SceneError(f"{target}: cannot be written: it is a folder")
    check_place(target)
    if exists and not force:
        raise SceneError(f"{target}: exists already; --force (force=True) replaces it")


def check_place(target: Path) -> None:
    """Refuse what cannot be made for want of a folder that holds it; missing folders can be made.

    Raises
    ------
    SceneError
        That says which folder is none, or cannot be written.
    """
    try:
        holder = next((folder for folder in target.absolute().parents if folder.exists()), None)
    except (OSError, ValueError) as error:
        raise SceneError(f"{target}: cannot be written: {error}") from None
    if holder is None or not holder.is_dir():
        raise SceneError(f"{target}: cannot be written: {holder or target.parent} is no folder (name another place)")
    if not os.access(holder, os.W_OK | os.X_OK):
        raise SceneError(f"{target}: cannot be written: {holder} is read-only for this user (name another place)")


@contextmanager
def writing(target: Path) -> Iterator[None]:
    """Make the folder that a file goes to; what cannot be written inside the context is a failure that names the file.

    Raises
    ------
    ComputationError
        In place of any error of the system.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise ComputationError(f"{target}: cannot be written: {error.strerror or error}") from error


def write_file(target: Path, content: bytes) -> None:
    """Write one file as a whole, and its folder where it is missing.

    Raises
    ------
    ComputationError
        If it cannot be written.
    """
    with writing(target):
        write_atomically(target, content)


def is_unfinished(path: Path) -> bool:
    """Return whether a file is what a killed process left of `write_atomically`."""
    return _UNFINISHED.fullmatch(path.name) is not None


def json_bytes(value: Any, *, escaped: bool = False) -> bytes:
    """Return plain data as JSON, in ASCII if ``escaped``; numbers that are not finite become null, which every reader knows."""
    return (json.dumps(_plain(value), indent=2, ensure_ascii=escaped, allow_nan=False) + "\n").encode("utf-8", "replace")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)
