"""Measured data: a CSV file whose header has a name and a unit for every column, ``time [s],depth [mm],push_force [N]``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.scene import units
from fem_needle.scene.csv_table import CsvTable, read_csv
from fem_needle.scene.spelling import known_name
from fem_needle.scene.table_file import FEWEST_ROWS, read_text
from fem_needle.trajectory import VARIABLES

Array = NDArray[np.float64]

MOST_COLUMNS = 1000
LONGEST_LINE, MOST_MISTAKES = 300, 50  # of a message
SPACING_TOLERANCE = 0.05  # of the mean interval: times written with few digits count as equally spaced, 30 Hz in whole ms

# SI units of the names that a run has too: whatever unit is written must have the same dimension.
KNOWN_UNITS: dict[str, str] = {"time": "s"} | {name: unit for name, (unit, _) in VARIABLES.items()}


@dataclass(frozen=True, eq=False)
class Measurements:
    """Columns of numbers.

    Attributes
    ----------
    columns
        Arrays (n,) in SI by name, in the order of the file.
    source
        The file's name, for messages.
    """

    columns: Mapping[str, Array]
    source: str = "data"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.columns)

    @property
    def size(self) -> int:
        """Number of rows n."""
        return len(next(iter(self.columns.values())))

    def __contains__(self, name: str) -> bool:
        """Return whether there is a column of this name."""
        return name in self.columns

    def __getitem__(self, name: str) -> Array:
        """Return a column (n,) in SI.

        Raises
        ------
        SceneError
            If there is none of this name.
        """
        if name not in self.columns:
            raise SceneError(f"{self.source}: has no column {name!r} (got {', '.join(self.names)})")
        return self.columns[name]

    def rows(self, chosen: NDArray[np.bool_] | slice) -> Measurements:
        """Return some of the rows."""
        return Measurements({name: column[chosen] for name, column in self.columns.items()}, self.source)


def read_measurements(path: str | Path, needed: Mapping[str, str] | None = None) -> Measurements:
    """Read a CSV file of measurements.

    Parameters
    ----------
    path
        The file, at most 50 MB; its header names the columns, each with its unit in brackets (``[1]``: a plain number).
    needed
        SI units by name of columns that must be there.

    Returns
    -------
    Measurements
        In SI. Times rise.

    Raises
    ------
    SceneError
        If the file is missing, huge or no CSV; a column has no, an unknown or a wrong unit, or comes twice; a cell is no finite
        number; a needed column is missing; times do not rise. Every mistake of the header is told at once.
    """
    source = Path(path).name
    try:
        table = read_csv(read_text(Path(path)))
        table = replace(table, names=tuple(known_name(name, KNOWN_UNITS | dict(needed or {})) for name in table.names))
        header = _header(table, source, needed or {})
        found = {
            name: np.array([unit.to_si(x) for x in table.numbers(index)]) for index, (name, unit) in enumerate(header.items())
        }
        if "time" in found:
            table.rising(found["time"].tolist())
    except ValueError as error:
        mistakes = error.mistakes if isinstance(error, SceneError) else (f"{source}: {error}",)
        raise SceneError([line[:LONGEST_LINE] for line in mistakes[:MOST_MISTAKES]]) from None
    return Measurements(found, source)


def sampling_interval(time: Array) -> float:
    """Return the time between two samples [s].

    Raises
    ------
    SceneError
        If the times (n,) are not equally spaced, to 5 % of the interval.
    """
    time = np.asarray(time, dtype=float)
    if time.ndim != 1 or time.size < FEWEST_ROWS:
        raise SceneError(f"time: needs at least {FEWEST_ROWS} samples (got {time.size})")
    interval = float(time[-1] - time[0]) / (time.size - 1)
    worst = float(np.max(np.abs(np.diff(time) - interval)))
    if not interval > 0.0 or worst > SPACING_TOLERANCE * interval:
        raise SceneError(
            f"time: must be equally spaced (got intervals that differ by {worst:g} s from their mean {interval:g} s; allowed "
            f"{SPACING_TOLERANCE:g} of it)"
        )
    return interval


def _header(table: CsvTable, source: str, needed: Mapping[str, str]) -> dict[str, units.Unit]:
    if len(table.rows) < FEWEST_ROWS:
        raise SceneError(f"{source}: needs a header and at least {FEWEST_ROWS} rows (got {len(table.rows)})")
    if len(table.names) > MOST_COLUMNS:
        raise SceneError(f"{source}: has {len(table.names)} columns (allowed at most {MOST_COLUMNS})")
    mistakes = table.header_mistakes() + table.missing(needed)
    found = {}
    for name, written in zip(table.names, table.units, strict=True):
        try:
            found[name] = _unit(name, written, (KNOWN_UNITS | dict(needed)).get(name))
        except ValueError as error:
            mistakes.append(f"column {name!r} {error}")
    if mistakes:
        raise SceneError([f"{source}: {line}" for line in mistakes])
    return found


def _unit(name: str, written: str | None, expected: str | None) -> units.Unit:
    if not written:
        raise ValueError(f"needs its unit in brackets, as in '{name} [{expected or 'mm'}]'; [1] for a plain number")
    unit = units.parse_unit(written)
    if expected is None:
        return unit
    wanted = units.parse_unit(expected)
    if unit.dimension != wanted.dimension:
        raise ValueError(f"is in {written!r} (allowed {units.dimension_name(wanted.dimension)}, such as {expected})")
    return unit
