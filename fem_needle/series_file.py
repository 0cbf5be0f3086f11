"""`series.nc`: netCDF-4 that netCDF4, h5py, xarray and MATLAB open. SI; every variable with `units` and `long_name`."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
from numpy.typing import NDArray

from fem_needle.hdf5_guard import check_hdf5
from fem_needle.scene.steering import signal_description
from fem_needle.trajectory import VARIABLES, Trajectory

Array = NDArray[np.float64]

# Besides those of `VARIABLES`, which are over time: dimensions, unit, meaning.
COORDINATES = {
    "time": (("time",), "s", "time since the start of the run"),
    "arc_length": (("arc_length",), "m", "station along the needle from the hub, 0, to the tip"),
    "guide": (("guide",), "m", "position y of the guide; negative before the surface"),
    "load": (("load",), "m", "position y of the lateral load; negative before the surface"),
    "path_position": (("path_position",), "m", "y of the path that the tip has cut, at the end of the run"),
}
FIELDS = {
    "deflection": (("time", "arc_length"), "m", "lateral displacement of the needle"),
    "bending_moment": (("time", "arc_length"), "N m", "EI times the curvature, from equilibrium"),
    "shear_force": (("time", "arc_length"), "N", "derivative of the bending moment; a force F at the tip gives -F there"),
    "curvature": (("time", "arc_length"), "1/m", "curvature of the needle, positive where the moment is"),
    "bending_stress": (("time", "arc_length"), "Pa", "E r times the curvature; positive: stretched where deflection is negative"),
    "guide_force": (("time", "guide"), "N", "lateral force of the guide on the needle"),
    "lateral_force": (("time", "load"), "N", "lateral load on the needle"),
    "path_deflection": (("path_position",), "m", "rest line of the tissue there"),
}

SECTION = ("bending_moment", "shear_force", "curvature", "bending_stress")  # along the needle
STATION = "station"  # of a measured shape, equally spaced from hub to tip


def described_values(run: Trajectory) -> dict[str, tuple[tuple[str, ...], str, str, Array]]:
    """Return dimensions, unit, meaning and values of everything that the series of a run hold, by name, in their order.

    There is no stress where the scene gives no section.
    """
    guides = np.array([guide.position for guide in run.scene.support.guides], dtype=float)
    values = {
        "time": run.time,
        "arc_length": run.arc_length,
        "guide": guides,
        "load": np.array([load.position for load in run.scene.lateral_loads], dtype=float),
        **run.series,
        "deflection": run.station_deflection,
        "guide_force": run.guide_force,
        "lateral_force": run.lateral_force,
        **{name: getattr(run, name) for name in SECTION},
        "path_position": run.path_position,
        "path_deflection": run.path_deflection,
    }
    described = COORDINATES | {name: (("time",), *about) for name, about in VARIABLES.items()} | FIELDS
    given = {name: about for name, about in described.items() if values[name] is not None}
    found = {name: (*about, np.asarray(values[name], dtype=float)) for name, about in given.items()}
    for name, signal in run.signals.items():
        dimensions = ("time",) if signal.ndim == 1 else ("time", STATION)
        found[name] = (dimensions, *signal_description(name), signal)
    return found


def along_needle(run: Trajectory) -> list[str]:
    """Return the names of what a run has at every station over the time."""
    return [name for name, (dimensions, *_) in described_values(run).items() if dimensions == ("time", "arc_length")]


def series_bytes(run: Trajectory) -> bytes:
    """Return the file of a run.

    Built in memory: a full disk then meets one plain write instead of a half-written HDF5 file.
    """
    described, memory = described_values(run), BytesIO()
    with h5netcdf.File(memory, "w") as file:
        file.attrs.update({"title": run.scene.title, "Conventions": "CF-1.8", "format": 1})
        file.dimensions = {name: described[name][3].size for name in COORDINATES} | _stations(run)
        for name, (dimensions, unit, meaning, values) in described.items():
            _add(file, name, dimensions, values, {"units": unit, "long_name": meaning})
    return memory.getvalue()


def _stations(run: Trajectory) -> dict[str, int]:
    """Return the number of stations of a measured shape, if there is one."""
    counts = [signal.shape[1] for signal in run.signals.values() if signal.ndim > 1]
    return {STATION: counts[0]} if counts else {}


def _add(file: Any, name: str, dimensions: tuple[str, ...], values: Array, attributes: dict[str, str]) -> None:
    packing: dict[str, Any] = {"compression": "gzip", "compression_opts": 4, "shuffle": True} if values.size else {}
    variable = file.create_variable(name, dimensions, "f8", data=values, fillvalue=None, **packing)
    variable.attrs.update(attributes)


def read_series(path: Path) -> dict[str, Array]:
    """Return every variable of a file by name.

    Raises
    ------
    OSError
        If there is no such file, it is damaged or not netCDF-4, leads to other files or is too large.
    """
    # With h5py: h5netcdf leaves a traceback on stderr where it cannot open a file.
    try:
        check_hdf5(path)
        with h5py.File(path, "r") as file:
            return {name: np.asarray(item[...], dtype=float) for name, item in file.items() if isinstance(item, h5py.Dataset)}
    except (KeyError, RuntimeError, TypeError, ValueError) as error:
        raise OSError(f"series.nc is damaged: {error}") from None
