"""A run as CSV: a column for each variable over time, and the deflection at every station.

Headers are those that a scene reads as well: ``tip_deflection [m]``. Numbers keep all their digits.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fem_needle.series_file import STATION, described_values
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]


def series_csv(run: Trajectory) -> bytes:
    """Return `series.csv`: time, every variable over time, and a numbered column for each guide or station of the others."""
    columns: dict[str, Array] = {}
    for name, (dimensions, unit, _, values) in described_values(run).items():
        if dimensions == ("time",):
            columns[f"{name} [{unit}]"] = values
        elif dimensions in {("time", "guide"), ("time", STATION)}:
            columns |= {f"{name}_{number} [{unit}]": column for number, column in enumerate(values.T, start=1)}
    return _csv(columns, np.column_stack(list(columns.values())))


def deflection_csv(run: Trajectory) -> bytes:
    """Return `deflection.csv`: a row for each time and a column for each station, whose header is its arc length [m]."""
    header = ["time [s]", *(f"{station:.12g} [m]" for station in run.arc_length.tolist())]
    return _csv(header, np.column_stack((run.time, run.station_deflection)))


def _csv(header: Iterable[str], table: Array) -> bytes:
    lines = [",".join(header), *(",".join(map(repr, row)) for row in table.tolist())]
    return ("\n".join(lines) + "\n").encode("utf-8")
