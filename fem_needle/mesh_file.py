"""Line meshes of needles: node positions, from a file of any format that meshio reads.

A file is in meters, in double precision. The coordinate rises from the hub to the tip and is 0 at one of them; the order of
nodes and cells does not matter.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# meshio runs in a process of its own: its readers print, exit, and on damaged files may not return (docs/decisions).
READER = Path(__file__).with_name("mesh_reader.py")
SECONDS = 10.0  # that it may take, besides
BYTES_PER_SECOND = 1e6
LARGEST_FILE = 200_000_000  # bytes
MAXIMUM_ELEMENTS = 1_000_000
SAME = 1e-12  # of the length: rounding, also of formats that write decimals
ROUNDING = 1e-9  # of the length: straightness, ends, and the distance at which two nodes are one


def read_mesh(path: str | Path) -> Array:
    """Return the positions of the nodes along the needle [m], from the hub, 0, to the tip, rising.

    Parameters
    ----------
    path
        A mesh of line cells (and vertex cells, which are ignored): one open line without branches, straight along one axis.

    Raises
    ------
    SceneError
        If the file is missing or broken, or holds another mesh.
    """
    path = Path(path)
    try:
        _check_file(path)
        points, kinds, lines = _contents(path)
        _check_kinds(points, kinds, lines)
        return _positions(points, lines)
    except SceneError as error:
        raise SceneError(f"{path.name or str(path)!r} {error}") from None


def mesh_positions(mesh: str | Path | ArrayLike) -> Array:
    """Return the node positions [m] of a file, or a list of them, checked.

    Raises
    ------
    SceneError
        As `read_mesh` and `checked_positions`.
    """
    try:
        return read_mesh(mesh) if isinstance(mesh, str | Path) else checked_positions(mesh)
    except SceneError as error:
        raise SceneError(f"mesh: {error}") from None


def checked_positions(positions: Any) -> Array:
    """Return node positions [m] as an array, checked: at least two, from 0 on, rising.

    Raises
    ------
    SceneError
        If they are no nodes of a needle.
    """
    try:
        nodes = np.array(positions, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise SceneError("is not a list of numbers (allowed node positions in m)") from None
    if nodes.ndim != 1 or not 2 <= nodes.size <= MAXIMUM_ELEMENTS + 1:
        raise SceneError(f"got {nodes.size} node positions; allowed 2 to {MAXIMUM_ELEMENTS + 1} in one list")
    if not np.all(np.isfinite(nodes)):
        raise SceneError("holds a position that is not finite")
    steps = np.diff(nodes)
    where = int(np.argmin(steps))
    if steps[where] <= ROUNDING * np.ptp(nodes):
        raise SceneError(
            f"has node positions that do not rise (got {nodes[where]:.12g}, then {nodes[where + 1]:.12g}; "
            f"allowed steps above {ROUNDING:g} of the length)"
        )
    if abs(nodes[0]) > ROUNDING * np.ptp(nodes):
        raise SceneError(f"has its first node at {nodes[0]:.12g} m (allowed 0, the hub)")
    nodes[0] = 0.0
    return nodes


def length_mistake(positions: Sequence[float] | Array, length: float) -> str | None:
    """Return what is wrong with a mesh that ends elsewhere than a needle of that length [m], or None."""
    end = float(positions[-1])
    if abs(end - length) <= ROUNDING * length:
        return None
    allowed = f"got {end:.12g} m; allowed {length:.12g} m, the needle's length, within {ROUNDING:g} of it"
    hint = ""
    if abs(end - 1e3 * length) <= 1e-6 * end:
        hint = "; it looks like mm: a mesh is in m"
    elif abs(end - length) <= 1e-6 * length:
        hint = "; it looks like single precision: write the points in double precision"
    return f"the mesh does not end at the tip ({allowed}){hint}"


def needle_nodes(positions: Array, length: float, span: float) -> Array:
    """Return the nodes of a needle, shape (elements + 1,), from 0 to ``span``: the length [m], or 1 for fractions of it.

    Elements that are equal to rounding become equal: one rounding step of a node moves a tip by 1e-10 of it already.

    Raises
    ------
    SceneError
        If the mesh is not as long as the needle.
    """
    mistake = length_mistake(positions, length)
    if mistake:
        raise SceneError(f"mesh: {mistake}")
    nodes, equal = positions * (span / length), np.linspace(0.0, span, len(positions))
    if np.all(np.abs(nodes - equal) <= SAME * span):
        return equal
    nodes[-1] = span
    return nodes


def _contents(path: Path) -> tuple[Array, list[str], Integers]:
    """Return points (n, dimensions), kinds of the cells and lines (m, 2) of a file, whatever its reader does."""
    limit = SECONDS + path.stat().st_size / BYTES_PER_SECOND
    command = [sys.executable, "-P", str(READER), str(path.resolve())]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
    surroundings["OPENBLAS_NUM_THREADS"] = "1"  # each thread would take of the memory that the reader may have
    try:
        done = subprocess.run(
            command, env=surroundings, stdin=subprocess.DEVNULL, capture_output=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        raise SceneError(f"cannot be read as a mesh: its reader did not end within {limit:.3g} s; it is damaged") from None
    if done.returncode != 0:
        reason = done.stdout.decode("utf-8", "replace") or f"its reader broke off (status {done.returncode})"
        raise SceneError(f"cannot be read as a mesh: {reason}")
    try:
        with np.load(BytesIO(done.stdout)) as arrays:
            return arrays["points"], arrays["kinds"].tolist(), arrays["lines"]
    except (ValueError, OSError, KeyError, EOFError) as error:
        raise SceneError(f"cannot be read as a mesh: no answer from its reader ({error})") from None


def _check_file(path: Path) -> None:
    try:
        exists, size = path.exists(), path.stat().st_size if path.is_file() else None
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot be read: {error}") from None
    if size is None:
        raise SceneError("is not a file" if exists else "does not exist")
    if not 0 < size <= LARGEST_FILE:
        raise SceneError("is empty" if size == 0 else f"is larger than {LARGEST_FILE / 1e6:g} MB")


def _check_kinds(points: Array, kinds: list[str], lines: Integers) -> None:
    """Refuse a mesh of anything but lines, and one of too many."""
    others = sorted(set(kinds) - {"line", "vertex"})
    if others:
        raise SceneError(f"holds {', '.join(others)} cells (a needle's mesh has two-node lines only)")
    if points.ndim != 2 or len(lines) == 0:
        raise SceneError("holds no line cells")
    if lines.ndim != 2 or lines.shape[1] != 2:
        raise SceneError("holds lines that do not have two nodes each")
    if len(lines) > MAXIMUM_ELEMENTS:
        raise SceneError(f"holds {len(lines)} lines (allowed up to {MAXIMUM_ELEMENTS})")


def _positions(points: Array, lines: Integers) -> Array:
    """Return the positions of the nodes of one straight line, from the hub on."""
    _check_chain(points, lines)
    along = _coordinate(points)
    order = np.argsort(along, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    ends = np.sort(rank[lines], axis=1)
    ends = ends[np.argsort(ends[:, 0])]
    nodes = along[order]
    close = np.flatnonzero(np.diff(nodes) <= ROUNDING * np.ptp(nodes))
    if close.size:
        raise SceneError(f"has two nodes at one place, {nodes[close[0]]:.12g}")
    expected = np.arange(order.size - 1)
    if len(ends) != expected.size or np.any(ends != np.column_stack((expected, expected + 1))):
        raise SceneError("is not one line from end to end: it has a gap, runs back on itself, or repeats a line")
    if min(abs(nodes[0]), abs(nodes[-1])) > ROUNDING * np.ptp(nodes):
        allowed = "allowed 0, the hub, to the length, or minus the length to 0, the tip"
        raise SceneError(f"runs from {nodes[0]:.12g} to {nodes[-1]:.12g} ({allowed})")
    return checked_positions(nodes - nodes[0])


def _check_chain(points: Array, lines: Integers) -> None:
    """Refuse nodes that are missing, unused or not finite, and lines that branch or close."""
    if lines.min() < 0 or lines.max() >= len(points):
        raise SceneError(f"has lines to points that it does not hold (got {lines.max()}; allowed 0 to {len(points) - 1})")
    if not np.all(np.isfinite(points)):
        raise SceneError("holds a point that is not finite")
    uses = np.bincount(lines.ravel(), minlength=len(points))
    if np.any(uses == 0):
        raise SceneError(f"holds {np.count_nonzero(uses == 0)} points that belong to no line")
    if np.any(uses > 2):
        raise SceneError(f"branches: {uses.max()} lines meet at {_place(points[int(np.argmax(uses))])}")
    if not np.any(uses == 1):
        raise SceneError("is a closed line without ends")


def _coordinate(points: Array) -> Array:
    """Return the coordinate along the axis that the points lie on."""
    spans = np.ptp(points, axis=0)
    axis = int(np.argmax(spans))
    across = np.delete(spans, axis)
    if spans[axis] == 0.0 or np.any(across > ROUNDING * spans[axis]):
        extent = " x ".join(f"{span:g}" for span in spans)
        raise SceneError(f"is not straight along one axis (its extent is {extent})")
    return points[:, axis]


def _place(point: Array) -> str:
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
