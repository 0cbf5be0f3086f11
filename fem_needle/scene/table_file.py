"""Files inside a scene's folder, and columns of a CSV file as tables in time; a column without a unit is in SI."""

from __future__ import annotations

import codecs
from dataclasses import replace
from pathlib import Path
from typing import Any

from fem_needle.scene import units
from fem_needle.scene.csv_table import CsvTable, read_csv
from fem_needle.scene.spelling import known_name

FILE_KEYS = ("file", "column")
LARGEST_FILE = 50_000_000  # bytes
FEWEST_ROWS = 2

_WIDE = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


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
        return _column(read_csv(read_text(inside_folder(file, folder))), column)
    except ValueError as error:
        raise ValueError(f"{file!r} {error}") from None


def _column(table: CsvTable, column: str) -> dict[str, Any]:
    """Return one column of a table over its times."""
    table = replace(table, names=tuple(known_name(name, ("time", column)) for name in table.names))
    mistakes = table.header_mistakes() + table.missing({"time": "s", column: None})
    if mistakes:
        raise ValueError("; ".join(mistakes))
    if len(table.rows) < FEWEST_ROWS:
        raise ValueError(f"needs a header and at least {FEWEST_ROWS} rows (got {len(table.rows)})")
    time, value = table.names.index("time"), table.names.index(column)
    written = table.units[time] or "s"
    time_unit = units.parse_unit(written)
    if time_unit.dimension != units.parse_unit("s").dimension:
        raise ValueError(f"has times in {written!r} (allowed a time, as s)")
    times = [time_unit.to_si(number) for number in table.numbers(time)]
    table.rising(times)
    result: dict[str, Any] = {"time": times, "value": table.numbers(value)}
    return result if table.units[value] is None else result | {"unit": table.units[value]}


def read_text(path: Path) -> str:
    """Return the text of a file that a user named.

    Raises
    ------
    ValueError
        If it is missing, no plain file, huge, empty, or not text in UTF-8, or UTF-16 with its byte order mark.
    """
    if not path.is_file():
        raise ValueError(f"{path.name!r} is not a file" if path.exists() else f"{path.name!r} does not exist")
    if path.stat().st_size > LARGEST_FILE:
        raise ValueError(f"{path.name!r} is larger than {LARGEST_FILE / 1e6:g} MB")
    try:
        content = path.read_bytes()
        text = content.decode("utf-16" if content.startswith(_WIDE) else "utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path.name!r} is not UTF-8 text; save it as UTF-8") from None
    except OSError as error:
        raise ValueError(f"{path.name!r} cannot be read: {error.strerror}") from None
    if "\0" in text:
        raise ValueError(f"{path.name!r} is not text; save it as text in UTF-8")
    if not text.strip():
        raise ValueError(f"{path.name!r} is empty")
    return text


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
