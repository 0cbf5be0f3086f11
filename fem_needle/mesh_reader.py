"""A program of its own that reads one mesh file with meshio: `python mesh_reader.py FILE`, see `fem_needle.mesh_file`.

It writes an ``.npz`` to stdout: ``points`` (n, dimensions), ``kinds`` of the cells, ``lines`` (m, 2). Where the file cannot be
read it writes the reason and exits with status 1. meshio's readers print, exit, and on damaged files may not return at all.
"""

from __future__ import annotations

import os
import re
import sys
import xml.etree.ElementTree as Xml
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

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
MARK = 1000  # bytes among which Gmsh's first mark is looked for
TWO_NODES = frozenset(
    f"{kind}{hybrid}"
    for kind in ("B21", "B23", "B31", "B33", "B31OS", "PIPE21", "PIPE31", "T2D2", "T3D2", "CONN2D2", "CONN3D2")
    for hybrid in ("", "H")
)
GENERATED = frozenset({"NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY", "INCLUDE"})
TYPE = re.compile(r",\s*TYPE\s*=\s*([^,\s]+)", re.IGNORECASE)
GMSH_VERSION = re.compile(rb"\$MeshFormat\s+([\d.]+)")
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
    mesh = read(path)
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


def read(path: Path) -> meshio.Mesh:
    """Return what meshio reads of a file, after mending what it does not know of Abaqus and Gmsh.

    Raises
    ------
    ValueError
        With what meshio printed where it gives up; besides what its readers raise.
    """
    ending, printed = path.suffix.lower(), StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(printed):
            if ending == ".inp":
                return meshio.read(StringIO(abaqus_text(path.read_text("utf-8-sig", "replace"))), file_format="abaqus")
            if ending == ".msh" and b"$" in path.read_bytes()[:MARK]:
                return _read_gmsh(path)
            return meshio.read(path)
    except SystemExit:
        said = printed.getvalue().partition("Error:")[0].split()
        if not said:
            raise
        raise ValueError(" ".join(said)) from None


def abaqus_text(text: str) -> str:
    """Return an Abaqus file with one block of nodes, and all beams and trusses of two nodes under a name that meshio knows.

    Raises
    ------
    ValueError
        If it has elements of another type, or makes nodes and elements from others: names them.
    """
    nodes: list[str] = []
    rest: list[str] = []
    block = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("*") and not line.startswith("**"):
            block = line.partition(",")[0].strip(" *").upper()
            if block in GENERATED:
                raise ValueError(f"*{block} in line {number} is not read: write every node and element")
        is_head = block == "ELEMENT" and line.startswith("*")
        (nodes if block == "NODE" else rest).append(_known_type(line, number) if is_head else line)
    data = [line for line in nodes if line.strip() and not line.startswith("*")]
    names = [line.partition(",")[0].strip() for line in data]
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise ValueError(f"node {twice} is there twice: several parts in one file are not read")
    return "\n".join(["*NODE", *data, *rest, ""])


def _known_type(line: str, number: int) -> str:
    """Return the line of an element block with a type that meshio knows."""
    match = TYPE.search(line)
    written = match[1].upper() if match else ""
    if match is None:
        return line
    if written not in TWO_NODES and written in meshio.abaqus._abaqus.abaqus_to_meshio_type:
        return line
    if written not in TWO_NODES:
        raise ValueError(f"elements of type {written} (line {number}) are not read; allowed {', '.join(sorted(TWO_NODES))}")
    return f"{line[: match.start(1)]}B31{line[match.end(1) :]}"


def _read_gmsh(path: Path) -> meshio.Mesh:
    """Return what a Gmsh file holds, blank lines and marks of an encoding before its first mark or not."""
    content = path.read_bytes()
    mended = gmsh_bytes(content)
    with TemporaryDirectory() as folder:  # meshio opens this format by its name
        copy = path if mended == content else Path(folder) / path.name
        if copy != path:
            copy.write_bytes(mended)
        try:
            return meshio.read(copy, file_format="gmsh")
        except (ValueError, IndexError, KeyError, TypeError) as error:
            version = GMSH_VERSION.search(mended)
            found = "" if version is None else version[1].decode()
            raise ValueError(f"what follows is not format {found} of Gmsh, as its header says: {error}") from None


def gmsh_bytes(content: bytes) -> bytes:
    """Return a Gmsh file from its first mark on.

    Raises
    ------
    ValueError
        If its format is one that is not read: names it.
    """
    start = content[content.index(b"$") :]
    if start.startswith((b"$NOD", b"$NOE")):
        raise ValueError("Gmsh's format 1 ($NOD) is not read; save it in format 2.2 or 4.1")
    match = GMSH_VERSION.search(start)
    version = match[1].decode() if match else None
    if version is None or not version.startswith(("2", "4")):
        found = "no $MeshFormat with a version" if version is None else f"format {version}"
        raise ValueError(f"{found} of Gmsh is not read; save it in format 2.2 or 4.1")
    return start


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
    if type(error) is ValueError and said:
        return said[0][:LONGEST_REASON]
    return f"{type(error).__name__}: {said[0][:LONGEST_REASON]}" if said else "it is truncated, damaged or of another format"


if __name__ == "__main__":
    sys.exit(main())
