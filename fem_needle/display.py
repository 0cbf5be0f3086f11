"""Short texts and HTML tables of results: what a console and a notebook show of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import islice
from typing import Any

MOST_ROWS = 25  # of a table
LONGEST_TITLE = 60  # characters, in the short text
SHORT_FACTS = 5  # facts in the short text
SMALLEST_PUSH = 1e-5  # N
MILLIMETERS = 1e3
ROUNDING = 1e-12  # of the largest value of a kind: a smaller one is shown as 0


@dataclass(frozen=True)
class Card:
    """What is shown of a result.

    Attributes
    ----------
    kind
        Name of its class.
    title
        Of the scene, or "".
    facts
        Names and values with units; the first ones make the short text.
    columns
        A table by headers; columns of one length.
    """

    kind: str
    title: str
    facts: tuple[tuple[str, str], ...]
    columns: Mapping[str, Sequence[Any]] = field(default_factory=dict)

    def line(self) -> str:
        """Return one line: kind, title and the first facts."""
        title = " ".join(self.title.split())
        shown = title if len(title) <= LONGEST_TITLE else f"{title[: LONGEST_TITLE - 3]}..."
        head = f"{self.kind} {shown!r}" if shown else self.kind
        return f"{head}: {', '.join(f'{name} {value}' for name, value in self.facts[:SHORT_FACTS])}"

    def html(self) -> str:
        """Return HTML without scripts or anything from elsewhere; all texts are escaped."""
        title = f" {escape(self.title)}" if self.title else ""
        parts = [f"<div><p><strong>{escape(self.kind)}</strong>{title}</p>", _html_table((), self.facts)]
        if self.columns:
            parts.append(_html_table(tuple(self.columns), _first_rows(self.columns)))
            left_out = len(next(iter(self.columns.values()))) - MOST_ROWS
            if left_out > 0:
                parts.append(f"<p>and {left_out} more rows</p>")
        return "\n".join([*parts, "</div>"])


class Shown:
    """A result with a short text and an HTML form; a subclass says in ``_card`` what is shown."""

    def _card(self) -> Card:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._card().line()

    def __str__(self) -> str:
        return self._card().line()

    def _repr_html_(self) -> str:
        return self._card().html()


def text(value: Any, digits: int = 6) -> str:
    """Return a value as a text: numbers with so many digits, nothing for None, yes and no."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def in_millimeters(value: float | None, digits: int = 4) -> str:
    """Return a length [m] as a text in mm; nothing to say of None."""
    return "none" if value is None else f"{MILLIMETERS * value:.{digits}g} mm"


def without_rounding(value: float, largest: float) -> float:
    """Return a value, 0 where it is round-off beside the largest of its kind."""
    return 0.0 if abs(value) < ROUNDING * largest else value


def in_newtons(force: float) -> str:
    """Return a force with its unit; less than the hundredth of a millinewton, which nobody measures, is 0 N."""
    return f"{measurable(force):.4g} N"


def measurable(force: float) -> float:
    """Return a force [N], 0 where nobody could measure it."""
    return 0.0 if abs(force) < SMALLEST_PUSH else force


def columns_in_millimeters(columns: Mapping[str, Sequence[Any]]) -> dict[str, list[Any]]:
    """Return columns with those under headers that end in ``[m]`` in mm, without those that are empty."""
    result = {}
    for header, values in columns.items():
        if all(value is None or value == "" for value in values):
            continue
        if header.endswith("[m]"):
            result[f"{header[:-3]}[mm]"] = [None if value is None else MILLIMETERS * value for value in values]
        else:
            result[header] = list(values)
    return result


def _first_rows(columns: Mapping[str, Sequence[Any]]) -> Iterable[Sequence[Any]]:
    return islice(zip(*columns.values(), strict=True), MOST_ROWS)


def _html_table(headers: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    head = "".join(f"<th>{escape(header)}</th>" for header in headers)
    lines = [f"<thead><tr>{head}</tr></thead>"] if headers else []
    lines += ["<tr>" + "".join(_cell(value) for value in row) + "</tr>" for row in rows]
    return "\n".join(["<table>", *lines, "</table>"])


def _cell(value: Any) -> str:
    side = "right" if isinstance(value, int | float) and not isinstance(value, bool) else "left"
    return f'<td style="text-align: {side}">{escape(text(value))}</td>'
