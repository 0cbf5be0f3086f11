"""Curves for the browser: panels above each other that share an axis, in the colors of the pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from textwrap import shorten
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from fem_needle.pictures import COLORS, INK, crowded

Array = NDArray[np.float64]

PANEL, MARGINS = 230, 130  # pixels: height of a panel, and of what stands above and below all
GAP = 0.24  # between panels, of one: for the legend
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
SYMBOLS = ("circle", "square", "triangle-up", "diamond", "triangle-down", "cross")
LEGEND_GAP = 2  # pixels, between a panel and its legend
MOST_POINTS = 2000  # of a curve in a page
GRID = "#d8d8d8"
LONGEST_NAME = 40  # characters, in a legend


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve.

    Attributes
    ----------
    name
        In the legend.
    x, y
        Shape (n,) each; nan leaves a hole.
    markers
        Whether points are marked; they always are where there is one point only.
    line
        Whether points are joined.
    """

    name: str
    x: Array
    y: Array
    markers: bool = False
    line: bool = True


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves that share both axes.

    Attributes
    ----------
    label
        Of the vertical axis, with the unit.
    curves
        In the order of their colors.
    logarithmic
        Whether the vertical axis is.
    """

    label: str
    curves: tuple[Curve, ...]
    logarithmic: bool = False


def panels_figure(
    panels: Sequence[Panel], label: str, *, logarithmic: bool = False, ticks: Sequence[float] | None = None
) -> go.Figure:
    """Return panels above each other over a common axis.

    Parameters
    ----------
    panels
        From above.
    label
        Of the horizontal axis, with the unit.
    logarithmic
        Whether the horizontal axis is.
    ticks
        Places on it that are labeled; by default round ones.
    """
    figure, count = go.Figure(), len(panels)
    height = 1.0 / (count + GAP * (count - 1))
    for index, panel in enumerate(panels):
        number = "" if index == 0 else str(index + 1)
        top = 1.0 - index * height * (1.0 + GAP)
        for place, curve in enumerate(panel.curves):
            figure.add_trace(_trace(curve, place, number))
        kind = "log" if panel.logarithmic else "linear"
        axis = {"title": {"text": escape(panel.label)}, "domain": [max(top - height, 0.0), top], "type": kind}
        figure.update_layout({f"yaxis{number}": axis | _AXIS | _powers(logarithmic=panel.logarithmic)})
        figure.update_layout({f"legend{number}": _LEGEND | {"y": min(top + LEGEND_GAP / (PANEL * count), 1.0)}})
    last = "" if count == 1 else str(count)
    kind = "log" if logarithmic else "linear"
    across = {"title": {"text": escape(label)}, "type": kind, "anchor": f"y{last}"} | _AXIS | _powers(logarithmic=logarithmic)
    if ticks is not None:
        across |= {"tickvals": list(ticks), "ticktext": [f"{tick:g}" for tick in ticks]}
    figure.update_layout(xaxis=across, height=PANEL * count + MARGINS, **_LAYOUT)
    return figure


_AXIS: dict[str, Any] = {"gridcolor": GRID, "zerolinecolor": INK, "linecolor": INK, "showline": True, "automargin": True}
_LAYOUT: dict[str, Any] = {
    "font": {"color": INK, "size": 13, "family": "system-ui, sans-serif"},
    "plot_bgcolor": "white",
    "paper_bgcolor": "white",
    "margin": {"l": 10, "r": 40, "t": 20, "b": 10},  # at the right for the toolbar, which would cover what is above a panel
    "showlegend": True,
    "hovermode": "closest",
    "dragmode": "zoom",
    "modebar": {"remove": ["select2d", "lasso2d"], "orientation": "v"},
}

_LEGEND: dict[str, Any] = {"orientation": "h", "yanchor": "bottom", "x": 0.0, "bgcolor": "rgba(0,0,0,0)", "font": {"size": 12}}


def _powers(*, logarithmic: bool) -> dict[str, Any]:
    return {"exponentformat": "power", "dtick": 1} if logarithmic else {"exponentformat": "power"}


def _trace(curve: Curve, place: int, number: str) -> go.Scatter:
    chosen = thinned(len(curve.x))
    marked = curve.markers or len(curve.x) == 1
    mode = "+".join(part for part, wanted in (("lines", curve.line), ("markers", marked)) if wanted)
    color, thin = COLORS[place % len(COLORS)], crowded(curve.y)
    return go.Scatter(
        x=curve.x[chosen], y=curve.y[chosen], mode=mode, name=escape(shorten(curve.name, LONGEST_NAME, placeholder=" ...")),
        line={"color": color, "width": 1 if thin else 2, "dash": "solid" if thin else DASHES[place % len(DASHES)]},
        marker={"color": color, "size": 8, "symbol": SYMBOLS[place % len(SYMBOLS)]},
        xaxis="x", yaxis=f"y{number}", legend=f"legend{number}", connectgaps=False,
    )  # fmt: skip


def thinned(count: int, most: int = MOST_POINTS) -> NDArray[np.intp]:
    """Return the numbers of at most ``most`` points spread over ``count``, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def column(columns: Mapping[str, Sequence[str]], name: str) -> Array:
    """Return a column of texts as numbers, nan where a cell is empty or no number."""
    return np.array([_number(text) for text in columns[name]], dtype=float)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
