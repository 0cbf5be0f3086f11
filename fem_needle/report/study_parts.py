"""What each study adds to its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, pi
from typing import Any

from fem_needle.report.numbers import MISSING, PLAIN, number, with_unit
from fem_needle.report.parts import Chart, Grid

Columns = Mapping[str, Sequence[str]]

MOST_ROWS = 60  # of a table in a page


@dataclass(frozen=True, eq=False)
class StudyParts:
    """Words, tables and curves of a study.

    Attributes
    ----------
    kind
        What kind of study.
    paragraphs
        Topics and sentences.
    grids, charts
        Tables of figures; curves.
    warnings
        To be seen.
    picture
        What its picture shows.
    other_pictures
        Further pictures: file and what it shows.
    alarm
        What went wrong with the whole, or "".
    title
        In place of that of the scene.
    """

    kind: str
    paragraphs: tuple[tuple[str, str], ...]
    grids: tuple[Grid, ...]
    charts: tuple[Chart, ...]
    picture: str
    warnings: tuple[str, ...] = ()
    other_pictures: Mapping[str, str] = field(default_factory=dict)
    alarm: str = ""
    title: str = ""


def shortened(caption: str, headers: tuple[str, ...], rows: Sequence[tuple[str, ...]], file: str) -> Grid:
    """Return a table of the first rows without empty columns, with a note on what is left out."""
    kept = [index for index in range(len(headers)) if not rows or any(row[index] for row in rows)]
    headers, rows = tuple(headers[index] for index in kept), [tuple(row[index] for index in kept) for row in rows]
    left_out = len(rows) - MOST_ROWS
    note = f"and {left_out} more rows, in {file}" if left_out > 0 else ""
    return Grid(caption, headers, tuple(rows[:MOST_ROWS]), note)


def model_words(description: Mapping[str, Any]) -> str:
    """Return a model in words: kind, elements or modes, variant and basis."""
    parts = [str(description.get("model", description.get("label")))]
    if "elements" in description:
        degree = f" of degree {description['degree']}" if "degree" in description else ""
        parts.append(f"{description['elements']} element{'s' * (description['elements'] != 1)}{degree}")
    if "modes" in description:
        parts.append(f"{description['modes']} mode{'s' * (description['modes'] != 1)}")
    return ", ".join([*parts, *(f"{key} {description[key]}" for key in ("variant", "basis") if key in description)])


def hertz(value: float | None) -> str:
    """Return an angular frequency [rad/s] as a number of Hz."""
    return number(None if value is None else value / (2.0 * pi))


def share(value: float | None) -> str:
    """Return a share as a percentage, so that those of a column compare at a glance; "none" where it is missing or infinite."""
    if value is None or not isfinite(value):
        return MISSING
    percent = 100.0 * value
    return with_unit(number(percent, 2) if percent == 0.0 or abs(percent) >= PLAIN[0] else f"below {PLAIN[0]:g}", "%")
