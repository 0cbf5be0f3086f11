"""What a report consists of: frozen values that the template lays out."""

from __future__ import annotations

from dataclasses import dataclass

import plotly.graph_objects as go


@dataclass(frozen=True)
class Grid:
    """A table.

    Attributes
    ----------
    caption
        Above it.
    headers
        Of the columns.
    rows
        A text for each column; the first one names the row.
    note
        Below it, such as how many rows were left out.
    """

    caption: str
    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture that does not move.

    Attributes
    ----------
    caption
        Below it.
    alternative
        What it shows, for readers who do not see it.
    content
        A PNG.
    """

    caption: str
    alternative: str
    content: bytes


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves that can be zoomed and read with the mouse, and the picture that stands for them on paper.

    Attributes
    ----------
    name
        Of the element in the page, letters and hyphens.
    caption
        Below it.
    alternative
        What it shows, for readers who do not see it.
    figure
        The curves; with frames there is a slider over them.
    picture
        For paper, and where scripts do not run; None: one elsewhere in the report does.
    moments
        What the slider says of each frame.
    first
        The frame that is shown first.
    """

    name: str
    caption: str
    alternative: str
    figure: go.Figure
    picture: Picture | None = None
    moments: tuple[str, ...] = ()
    first: int = 0


@dataclass(frozen=True, eq=False)
class Section:
    """A part of a report with a heading.

    Attributes
    ----------
    name
        Of the element in the page, letters and hyphens.
    title
        The heading.
    paragraphs
        Sentences, each with a short topic or "".
    warnings
        To be seen first.
    grids, charts, pictures
        In this order.
    new_page
        Whether it begins a page on paper.
    """

    name: str
    title: str
    paragraphs: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()
    grids: tuple[Grid, ...] = ()
    charts: tuple[Chart, ...] = ()
    pictures: tuple[Picture, ...] = ()
    new_page: bool = False


@dataclass(frozen=True, eq=False)
class Page:
    """A report.

    Attributes
    ----------
    title
        Of the scene, or of what was done.
    subject
        What it is, with the date.
    alarm
        What went wrong with the whole, or "".
    sections
        In order.
    """

    title: str
    subject: str
    alarm: str
    sections: tuple[Section, ...]
