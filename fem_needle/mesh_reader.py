"""A program of its own that reads one mesh file with meshio: `python mesh_reader.py FILE`, see `fem_needle.mesh_file`.

It writes an ``.npz`` to stdout: ``points`` (n, dimensions), ``kinds`` of the cells, ``lines`` (m, 2). Where the file cannot be
read it writes the reason and exits with status 1. meshio's readers print, exit, and on damaged files may not return at all.
"""

from __future__ import annotations

import os
import sys
import xml.etree.ElementTree as Xml
from io import BytesIO
from pathlib import Path

import meshio
import numpy as np

from fem_needle.hdf5_guard import check_hdf5

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

LONGEST_REASON = 120
MOST_MEMORY = 2_000_000_000  # bytes that reading may take: a small compressed file may promise any size
MOST_POINTS = 2_000_002
HDF5 = (".h5m", ".hmf", ".cgns", ".med", ".e", ".exo", ".ex2")
XDMF = (".xdmf", ".xmf")
XML = (*XDMF, ".vtu", ".xml", ".svg")
NETCDF_3 = b"CDF"


def main() -> int:
    """Read the file that the first argument names and return the exit status."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what readers print is no part of the answer
    path = Path(sys.argv[1])
    if resource is not None:
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    try:
        content, status = contents(path), 0
    except (Exception, SystemExit) as error:
        content, status = reason(path, error).encode("utf-8", "replace"), 1
    with output:
        output.write(content)
    return status


def contents(path: Path) -> bytes:
    """Return the arrays of a file.

    Raises
    ------
    ValueError
        If it leads to other files, or holds too many points; besides what meshio raises.
    """
    check_references(path)
    mesh = meshio.read(path)
    if len(mesh.points) > MOST_POINTS:
        raise ValueError(f"it holds {len(mesh.points)} points (allowed up to {MOST_POINTS})")
    lines = [np.asarray(block.data) for block in mesh.cells if block.type == "line" and len(block.data)]
    memory = BytesIO()
    np.savez(
        memory,
        points=np.asarray(mesh.points, dtype=float),
        kinds=np.array([str(block.type) for block in mesh.cells], dtype=str),
        lines=np.concatenate(lines).astype(np.int64, casting="same_kind") if lines else np.zeros((0, 2), dtype=np.int64),
    )
    return memory.getvalue()


def check_references(path: Path) -> None:
    """Refuse a file whose reader would open files outside its folder, or unfold entities.

    Raises
    ------
    ValueError
        If it names one, or is too large unpacked.
    """
    ending = path.suffix.lower()
    if ending in XML and b"<!ENTITY" in path.read_bytes():
        raise ValueError("it defines entities, which are not read")
    if ending in XDMF:
        for item in Xml.parse(path).iter("DataItem"):
            if item.get("Format", "XML").upper() != "XML":
                _check_item(path, (item.text or "").strip())
    elif ending in HDF5 and path.read_bytes()[:3] != NETCDF_3:
        check_hdf5(path)


def _check_item(path: Path, text: str) -> None:
    """Check the file that an item of an XDMF file names, ``file.h5:/data`` or a file of plain numbers."""
    name = text.split(":", maxsplit=1)[0]
    inside = path.parent.resolve()
    target = (inside / name).resolve()
    if not name or Path(name).is_absolute() or not target.is_relative_to(inside):
        raise ValueError(f"it names {name[:40]!r}, which is not inside its folder")
    if ":" in text:
        check_hdf5(target)


def reason(path: Path, error: BaseException) -> str:
    """Return in one line why a file cannot be read."""
    endings = ("".join(path.suffixes).lower(), path.suffix.lower())
    if not any(ending in meshio.extension_to_filetypes for ending in endings):
        return "no format that meshio reads has this ending"
    if isinstance(error, MemoryError):
        return f"it takes more than {MOST_MEMORY / 1e9:g} GB to read"
    said = [] if isinstance(error, SystemExit) else str(error).strip().splitlines()
    return f"{type(error).__name__}: {said[0][:LONGEST_REASON]}" if said else "it is truncated, damaged or of another format"


if __name__ == "__main__":
    sys.exit(main())
