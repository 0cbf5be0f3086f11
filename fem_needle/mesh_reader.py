"""A program of its own that reads one mesh file with meshio: `python mesh_reader.py FILE`, see `fem_needle.mesh_file`.

It writes an ``.npz`` to stdout: ``points`` (n, dimensions), ``kinds`` of the cells, ``lines`` (m, 2). Where the file cannot be
read it writes the reason and exits with status 1. meshio's readers print, exit, and on damaged files may not return at all.
"""

from __future__ import annotations

import os
import sys
from io import BytesIO
from pathlib import Path

import meshio
import numpy as np

LONGEST_REASON = 120


def main() -> int:
    """Read the file that the first argument names and return the exit status."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what readers print is no part of the answer
    path = Path(sys.argv[1])
    try:
        content, status = contents(path), 0
    except (Exception, SystemExit) as error:
        content, status = reason(path, error).encode("utf-8", "replace"), 1
    with output:
        output.write(content)
    return status


def contents(path: Path) -> bytes:
    """Return the arrays of a file."""
    mesh = meshio.read(path)
    lines = [np.asarray(block.data) for block in mesh.cells if block.type == "line" and len(block.data)]
    memory = BytesIO()
    np.savez(
        memory,
        points=np.asarray(mesh.points, dtype=float),
        kinds=np.array([str(block.type) for block in mesh.cells], dtype=str),
        lines=np.concatenate(lines).astype(np.int64, casting="same_kind") if lines else np.zeros((0, 2), dtype=np.int64),
    )
    return memory.getvalue()


def reason(path: Path, error: BaseException) -> str:
    """Return in one line why a file cannot be read."""
    endings = ("".join(path.suffixes).lower(), path.suffix.lower())
    if not any(ending in meshio.extension_to_filetypes for ending in endings):
        return "no format that meshio reads has this ending"
    said = [] if isinstance(error, SystemExit) else str(error).strip().splitlines()
    return f"{type(error).__name__}: {said[0][:LONGEST_REASON]}" if said else "it is truncated, damaged or of another format"


if __name__ == "__main__":
    sys.exit(main())
