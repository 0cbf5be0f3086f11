"""Files that are either there whole or not at all."""

from __future__ import annotations

import json
import os
import re
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

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


def is_unfinished(path: Path) -> bool:
    """Return whether a file is what a killed process left of `write_atomically`."""
    return _UNFINISHED.fullmatch(path.name) is not None


def json_bytes(value: Any) -> bytes:
    """Return plain data as JSON; numbers that are not finite become null, which every reader knows."""
    return (json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8", "replace")


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
