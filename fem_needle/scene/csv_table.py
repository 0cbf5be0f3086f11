"""Tables in CSV texts: one reader for the columns of a scene and for measurements.

Columns are separated by commas, semicolons or tabs, whichever the header has; its cells are names, each with a unit in brackets
or without: ``time [s],speed [mm/s]``. Rows are counted as an editor counts lines.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise, takewhile

from fem_needle.scene import units

MOST_CELLS = 3_000_000
LARGEST_NUMBER = 1e30  # squares of it must not overflow
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}

_HEADER = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?\s*")
_LINES = re.compile(r"\r\n|\n|\r")  # str.splitlines knows more ends of lines than editors do
_QUOTED = re.compile(r'"[^"]*"')
_ONLY_NUMBERS = re.compile(r'[\d.,;+\-eE"_\s]*\d[\d.,;+\-eE"_\s]*')
_WITH_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")

_Lines = list[tuple[int, str]]


@dataclass(frozen=True, eq=False)
class CsvTable:
    """The cells below a header.

    Attributes
    ----------
    names, units
        Of the columns; None: no unit in brackets.
    rows
        Cells, as many in each row as names.
    lines
        Number of each row in the file, from 1, blank lines counted.
    comma_mistake
        Why a comma in a number is not read as a decimal comma; None: it is.
    """

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    rows: Sequence[Sequence[str]]
    lines: Sequence[int]
    comma_mistake: str | None

    def header_mistakes(self) -> list[str]:
        """Return what is wrong with the names: none, or one that comes twice."""
        missing = [number for number, name in enumerate(self.names, start=1) if not name]
        mistakes = [f"column {number} has no name in the header" for number in missing]
        twice = [name for name in dict.fromkeys(self.names) if name and self.names.count(name) > 1]
        return mistakes + [f"column {name!r} comes twice" for name in twice]

    def missing(self, needed: Mapping[str, str | None]) -> list[str]:
        """Return the mistakes of columns, SI units by name, that are not there, each with the nearest one that is."""
        mistakes = []
        for name, unit in needed.items():
            if name not in self.names:
                close = get_close_matches(name, self.names, n=1, cutoff=0.5)
                meant = f"; did you mean {name!r} by {close[0][:40]!r}? A unit is in square brackets" if close else ""
                found = f"needs a column {name!r}{'' if unit is None else f' [{unit}]'} (got {', '.join(self.names)}"
                mistakes.append(f"{found[:200]}){meant}")
        return mistakes

    def numbers(self, index: int) -> list[float]:
        """Return the numbers of a column.

        Raises
        ------
        ValueError
            If a cell is no finite number; says where and what to do.
        """
        found = [self._number(row[index]) for row in self.rows]
        for number, line, row in zip(found, self.lines, self.rows, strict=True):
            if number is None or not abs(number) <= LARGEST_NUMBER:
                what = _cell_mistake(row[index], number, self.comma_mistake)
                raise ValueError(f"row {line} column {index + 1} ({self.names[index]!r}) {what}")
        return [number for number in found if number is not None]

    def rising(self, times: Sequence[float]) -> None:
        """Refuse times, one for each row, that do not rise.

        Raises
        ------
        ValueError
            At the first row.
        """
        for (earlier, later), line in zip(pairwise(times), self.lines[1:], strict=True):
            if not later > earlier:
                raise ValueError(f"times must rise (row {line} does not: got {later:.12g} s after {earlier:.12g} s)")

    def _number(self, cell: str) -> float | None:
        if "," in cell and self.comma_mistake is None and _WITH_COMMA.fullmatch(cell):
            cell = cell.replace(",", ".")
        if "_" in cell or not cell.isascii():  # both are numbers for Python
            return None
        try:
            return float(cell)
        except ValueError:
            return None


def read_csv(text: str) -> CsvTable:
    """Return the table of a CSV text.

    Raises
    ------
    ValueError
        If there is no header, a row has other cells than it, or there are more cells than fit into memory.
    """
    lines, separator = _without_separator_line([one for one in enumerate(_LINES.split(text), start=1) if one[1].strip()])
    head, body = _header_and_body(lines)
    separator = separator or _separator(head[1])
    cells = text.count(separator) + text.count("\n") + 1
    if cells > MOST_CELLS:  # each takes some 100 bytes
        raise ValueError(f"has {cells} cells (allowed up to {MOST_CELLS})")
    header = [split_header(cell) for cell in _cells(*head, separator)]
    rows = [_cells(line, row, separator) for line, row in body]
    for (line, written), row in zip(body, rows, strict=True):
        if len(row) != len(header):
            raise ValueError(_length_mistake(line, written, row, [name for name, _ in header], separator))
    names, found = zip(*header, strict=True)
    return CsvTable(names, found, rows, [line for line, _ in body], _comma_mistake(rows))


def split_header(cell: str) -> tuple[str, str | None]:
    """Return name and unit of a column from its header; None without brackets."""
    match = _HEADER.fullmatch(cell)
    return (match[1], match[2]) if match else (cell.strip(), None)


def _without_separator_line(lines: _Lines) -> tuple[_Lines, str | None]:
    """Return the lines below one as spreadsheets write it, ``sep=;``, and the separator that it names."""
    first = lines[0][1].strip() if lines else ""
    if first.startswith("sep=") and first[4:] in SEPARATORS:
        return lines[1:], first[4:]
    return lines, None


def _header_and_body(lines: _Lines) -> tuple[tuple[int, str], _Lines]:
    """Return the header and the rows: above them are comments, of which the last is the header where no other follows."""
    comments = list(takewhile(lambda line: _is_comment(line[1]), lines))
    rest = lines[len(comments) :]
    if comments and rest and _ONLY_NUMBERS.fullmatch(rest[0][1]):
        line, written = comments[-1]
        return (line, written.strip()[1:]), rest
    if not rest:
        raise ValueError("needs a header and rows (got none)")
    if _ONLY_NUMBERS.fullmatch(rest[0][1]):
        raise ValueError(f"row {rest[0][0]} is no header (got {rest[0][1][:40]!r}); name the columns above it: time [s],...")
    return rest[0], rest[1:]


def _is_comment(line: str) -> bool:
    """Return whether a line begins with a mark: a semicolon is one where it separates nothing."""
    bare = line.strip()
    return bare[0] in "#%" or (bare[0] == ";" and ";" not in bare[1:] and _separator(bare[1:]) in bare[1:])


def _separator(header: str) -> str:
    bare = _QUOTED.sub("", header)
    return next((mark for mark in SEPARATORS if mark in bare), ",")


def _cells(line: int, written: str, separator: str) -> list[str]:
    if '"' not in written:
        return [cell.strip() for cell in written.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([written], delimiter=separator, skipinitialspace=True, strict=True))]
    except csv.Error as error:
        raise ValueError(f"row {line} is no CSV: {error} (got {written[:40]!r}); a quotation ends where it begins") from None


def _length_mistake(line: int, written: str, row: Sequence[str], names: Sequence[str], separator: str) -> str:
    """Return where a row misses cells, or has too many, and why it may."""
    counts = f"the row has {len(row)} cell{'s' * (len(row) != 1)}, the header {len(names)} separated by {SEPARATORS[separator]}"
    others = [SEPARATORS[mark] for mark in SEPARATORS if mark != separator and mark in written]
    advice = f"; separate rows and header alike (the row has {others[0]})" if others else ""
    if written.strip()[0] in "#%":
        return f"row {line} is a comment (got {written[:40]!r}); comments are read above the header alone"
    if len(row) < len(names):
        return f"row {line} column {len(row) + 1} ({names[len(row)]!r}) is missing: {counts}{advice}"
    if separator == "," and not others:
        advice = "; decimal commas are read where semicolons or tabs separate the columns"
    return f"row {line} column {len(names) + 1} has more cells than the header: {counts}{advice}"


def _comma_mistake(rows: Sequence[Sequence[str]]) -> str | None:
    """Return why commas in numbers may be something else than decimal commas."""
    commas = [cell for row in rows for cell in row if "," in cell and _WITH_COMMA.fullmatch(cell)]
    if not commas:
        return None
    if any(_WITH_POINT.fullmatch(cell) for row in rows for cell in row if "." in cell):
        return "has a comma where other cells have decimal points: write all numbers with points"
    if all(_THOUSANDS.fullmatch(cell) for cell in commas):
        return "has a comma that may be a decimal comma or separate thousands: write a decimal point, or no comma"
    return None


def _cell_mistake(cell: str, number: float | None, comma_mistake: str | None) -> str:
    if not cell:
        return "is empty; every cell needs a number"
    got = f"(got {cell[:40]!r})"
    if number is not None:
        return f"is not finite {got}: allowed up to {LARGEST_NUMBER:g}"
    if "_" in cell:
        return f"is not a number {got}: write digits without underscores"
    if "," in cell:
        commas = comma_mistake if comma_mistake and _WITH_COMMA.fullmatch(cell) else "write 1234.5, without separated thousands"
        return f"is not a number {got}: {commas}"
    if " " in cell and _ONLY_NUMBERS.fullmatch(cell):
        return f"is not a number {got}: separate columns by commas, semicolons or tabs"
    return f"is not a number {got}{_unit_advice(cell)}"


def _unit_advice(cell: str) -> str:
    try:
        units.parse_unit(cell)
    except ValueError:
        return ""
    return ": a unit belongs into the header, behind its name, in brackets"
