"""A run as one VTKHDF file in time: the needle of every sample, for ParaView 5.12 and later (VTK 9.3).

Layout: VTKHDF 2.0, PolyData with the group Steps (VTK's documentation, "VTKHDF format specification"). Arrays of all steps lie
one after the other; the offsets of a step say where its part begins. The one polyline is stored once.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from fem_needle.trajectory import Trajectory
from fem_needle.vtk_export import frames_of_run, needle_arrays, needle_positions

Values = NDArray[Any]

VERSION = (2, 0)
CELLS = ("Vertices", "Lines", "Polygons", "Strips")


def vtkhdf_file(run: Trajectory) -> bytes:
    """Return the file: points and arrays are those of the frames `needle/*.vtp`."""
    frames, stations = frames_of_run(run), run.arc_length
    x = np.concatenate([needle_positions(run.scene, frame.depth, stations) for frame in frames])
    arrays = [needle_arrays(run.scene, frame, stations) for frame in frames]
    memory = BytesIO()
    with h5py.File(memory, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = VERSION
        root.attrs.create("Type", np.bytes_("PolyData"))
        _add_polyline(root, len(frames), stations.size)
        _add(root, "Points", np.column_stack((x, np.zeros((x.size, 2)))))
        for name in arrays[0]:
            _add(root.require_group("PointData"), name, np.concatenate([step[name] for step in arrays]))
        _add_steps(root, run.time, stations.size, tuple(arrays[0]))
    return memory.getvalue()


def _add(group: h5py.Group, name: str, values: Values) -> None:
    group.create_dataset(name, data=values, compression="gzip", shuffle=True, chunks=True)


def _add_polyline(root: h5py.Group, steps: int, points: int) -> None:
    """Add the cells, the same for every step: one line through all points."""
    root["NumberOfPoints"] = np.full(steps, points, dtype=np.int64)
    for kind in CELLS:
        count = 1 if kind == "Lines" else 0
        cells = root.create_group(kind)
        cells["Connectivity"] = np.arange(count * points, dtype=np.int64)
        cells["Offsets"] = np.array([0, points][: count + 1], dtype=np.int64)
        cells["NumberOfCells"] = np.full(steps, count, dtype=np.int64)
        cells["NumberOfConnectivityIds"] = np.full(steps, count * points, dtype=np.int64)


def _add_steps(root: h5py.Group, times: NDArray[np.float64], points: int, names: tuple[str, ...]) -> None:
    """Add times [s] and offsets of every step."""
    steps, offsets = root.create_group("Steps"), points * np.arange(times.size, dtype=np.int64)
    steps.attrs["NSteps"] = np.int64(times.size)
    steps["Values"] = times
    steps["PartOffsets"] = np.arange(times.size, dtype=np.int64)
    steps["NumberOfParts"] = np.ones(times.size, dtype=np.int64)
    steps["PointOffsets"] = offsets
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((times.size, len(CELLS)), dtype=np.int64)
    for name in names:
        steps.require_group("PointDataOffsets")[name] = offsets
