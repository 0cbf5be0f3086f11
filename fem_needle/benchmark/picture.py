"""The picture of a benchmark: error against run time, both logarithmic, a panel for each case."""

from __future__ import annotations

from math import ceil
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fem_needle.benchmark.goals import TIMES_TO_ERROR
from fem_needle.benchmark.methods import EXACT, LIBRARY, OWN, RIVAL
from fem_needle.benchmark.result import Benchmark, Row
from fem_needle.pictures import COLORS, INK, new_figure, png_bytes, shared_style

PANEL_WIDTH, PANEL_HEIGHT = 3.9, 3.5  # inches
COLUMNS = 3
FLOOR = 1e-13  # smaller errors are drawn here
DASHES: dict[str, Any] = {OWN: "-", EXACT: (0, (5, 1.5, 1, 1.5)), LIBRARY: (0, (5, 2)), RIVAL: (0, (1.5, 1.5))}
SHAPES = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h", "d", "*", "1", "2", "3")
MILLISECONDS = 1e3


def benchmark_picture(study: Benchmark) -> bytes:
    """Return the picture as PNG: left and down is better; the goals are crosses."""
    names = list(dict.fromkeys(row.method for row in study.rows if row.median is not None))
    styles = {name: _style(study, name, index) for index, name in enumerate(names)}
    panels = len(study.cases) + 1
    columns = min(COLUMNS, panels)
    lines = ceil(panels / columns)
    with shared_style():
        figure = new_figure(PANEL_WIDTH * columns, PANEL_HEIGHT * lines)
        axes = [figure.add_subplot(lines, columns, number + 1) for number in range(panels)]
        for case, panel in zip(study.cases, axes, strict=False):
            _draw(panel, study, case.name, case.about, styles)
        _legend(axes[-1], styles)
        return png_bytes(figure)


def _style(study: Benchmark, name: str, index: int) -> dict[str, Any]:
    kind = next(row.kind for row in study.rows if row.method == name)
    color = COLORS[index % len(COLORS)]
    filled = color if kind in (OWN, EXACT) else "white"
    shape = {"marker": SHAPES[index % len(SHAPES)], "markersize": 6, "markerfacecolor": filled}
    return {"color": color, "linestyle": DASHES[kind], "linewidth": 1.4} | shape


def _draw(axes: Axes, study: Benchmark, name: str, about: str, styles: dict[str, dict[str, Any]]) -> None:
    """Draw the methods and the goals of one case."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for method, style in styles.items():
        for part in _parts([row for row in study.of_case(name) if row.method == method]):
            times = [MILLISECONDS * float(row.median or 0.0) for row in part]
            axes.plot(times, [max(float(row.error or 0.0), FLOOR) for row in part], **style)
    for goal in TIMES_TO_ERROR:
        if goal.case == name:
            axes.plot(MILLISECONDS * goal.time, goal.error, marker="x", markersize=9, markeredgewidth=2.2, color=INK, zorder=5)
    axes.set(xlabel="time to solve [ms]", ylabel="error of the tip [1]")
    axes.set_title(f"{name}: {about}", loc="left", fontsize=9)


def _parts(rows: list[Row]) -> list[list[Row]]:
    """Return the rows that have a time, those of one variant in one line."""
    parts: dict[str, list[Row]] = {}
    for row in rows:
        if row.median is not None and row.error is not None and row.error < float("inf"):
            parts.setdefault(row.setting.variant, []).append(row)
    return list(parts.values())


def _legend(axes: Axes, styles: dict[str, dict[str, Any]]) -> None:
    """Name the methods in a panel of their own."""
    lines = [Line2D([], [], label=name, **style) for name, style in styles.items()]
    lines.append(Line2D([], [], label="goal", marker="x", markersize=9, markeredgewidth=2.2, color=INK, linestyle="none"))
    axes.axis("off")
    title = "left and down is better\nerrors below 1e-13 are drawn at 1e-13"
    style: dict[str, Any] = {"frameon": False, "fontsize": 8, "title_fontsize": 8, "handlelength": 3.2, "labelspacing": 0.3}
    axes.legend(handles=lines, loc="center left", title=title, alignment="left", borderaxespad=0.0, **style)
