"""Columns of a CSV file as tables in time.

The header names the columns, each with a unit in brackets or without (SI):
``time [s],speed [mm/s]``.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

from fem_needle.scene import units

FILE_KEYS = ("file", "column")
LARGEST_FILE = 50_000_000  # bytes
MOST_CELLS = 3_000_000

_HEADER = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?\s*")


def read_table(file: str, column: str, folder: Path | None) -> dict[str, Any]:
    """Return ``time``, ``value`` and ``unit`` of one column, as a scene writes them.

    Parameters
    ----------
    file
        Path inside ``folder``.
    column
        Name in the header, without its unit.
    folder
        The scene's folder; None where a scene has none.

    Raises
    ------
    ValueError
        If the file is outside the folder, missing, no text, or lacks numbers.
    """
    try:
        rows = csv_rows(read_text(inside_folder(file, folder)))
    except csv.Error as error:
        raise ValueError(f"{file!r} is no CSV: {error}") from None
    except ValueError as error:
        raise ValueError(f"{file!r} {error}") from None
    if len(rows) < 3:
        raise ValueError(f"{file!r} needs a header and at least two rows")
    header = [split_header(cell) for cell in rows[0]]
    names = [name for name, _ in header]
    for wanted in ("time", column):
        if names.count(wanted) != 1:
            raise ValueError(f"{file!r} needs one column {wanted!r} (got {', '.join(names)})"[:300])
    written = header[names.index("time")][1] or "s"
    time_unit = units.parse_unit(written)
    if time_unit.dimension != units.parse_unit("s").dimension:
        raise ValueError(f"{file!r} has times in {written!r} (allowed a time, as s)")
    times = column_numbers(rows, names.index("time"), file)
    result: dict[str, Any] = {
        "time": [time_unit.to_si(time) for time in times],
        "value": column_numbers(rows, names.index(column), file),
    }
    unit = header[names.index(column)][1]
    return result if unit is None else result | {"unit": unit}


def read_text(path: Path) -> str:
    """Return the text of a file that a user named.

    Raises
    ------
    ValueError
        If it is missing, no plain file, huge, empty, or not UTF-8 text.
    """
    if not path.is_file():
        raise ValueError(f"{path.name!r} is not a file" if path.exists() else f"{path.name!r} does not exist")
    if path.stat().st_size > LARGEST_FILE:
        raise ValueError(f"{path.name!r} is larger than {LARGEST_FILE / 1e6:g} MB")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path.name!r} is not UTF-8 text") from None
    except OSError as error:
        raise ValueError(f"{path.name!r} cannot be read: {error.strerror}") from None
    if "\0" in text:
        raise ValueError(f"{path.name!r} is not text")
    if not text.strip():
        raise ValueError(f"{path.name!r} is empty")
    return text


def csv_rows(text: str) -> list[list[str]]:
    """Return the rows of a CSV text that are not empty.

    Raises
    ------
    ValueError
        If it has more cells than fit into memory, each of which takes some 100 bytes.
    csv.Error
        If it is no CSV.
    """
    cells = text.count(",") + text.count("\n") + 1
    if cells > MOST_CELLS:
        raise ValueError(f"has {cells} cells (allowed up to {MOST_CELLS})")
    return [row for row in csv.reader(text.splitlines()) if row]


def inside_folder(file: str, folder: Path | None) -> Path:
    """Return the path of a file that a scene names.

    Raises
    ------
    ValueError
        If it is not inside the scene's folder, or there is none.
    """
    if folder is None:
        raise ValueError(f"{file!r} needs a scene in a folder; write time and value instead")
    written = Path(file)
    if "\0" in file or written.is_absolute() or ".." in written.parts:
        raise ValueError(f"{file!r} must lie inside the scene's folder")
    path = (folder / written).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise ValueError(f"{file!r} must lie inside the scene's folder")
    return path


def split_header(cell: str) -> tuple[str, str | None]:
    """Return name and unit of a column from its header; None without brackets."""
    match = _HEADER.fullmatch(cell)
    return (match[1], match[2]) if match else (cell.strip(), None)


def column_numbers(rows: list[list[str]], index: int, file: str) -> list[float]:
    """Return the numbers of a column below the header.

    Raises
    ------
    ValueError
        If a cell is missing or no number; says where.
    """
    numbers = []
    for line, row in enumerate(rows[1:], start=2):
        try:
            numbers.append(float(row[index]))
        except (ValueError, IndexError):
            found = row[index] if index < len(row) else "nothing"
            place = f"{file!r} row {line} column {index + 1}"
            raise ValueError(f"{place} is not a number (got {found[:40]!r})") from None
    return numbers
