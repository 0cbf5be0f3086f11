"""The picture of the scaling: a step and memory over the elements, a run over its duration, a step over everything else."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator

from fem_needle.benchmark.result import ScalingRow
from fem_needle.pictures import COLORS, MARKERS, new_figure, png_bytes, shared_style

WIDTH, HEIGHT = 11.0, 7.0  # inches
UNITS = {"per_step": 1e6, "total": 1.0, "memory": 1e-6}
LABELS = {"per_step": "time of a step [us]", "total": "time of the run [s]", "memory": "most memory [MB]"}


def scaling_picture(rows: tuple[ScalingRow, ...]) -> bytes:
    """Return the picture as PNG."""
    with shared_style():
        figure = new_figure(WIDTH, HEIGHT)
        ((left, middle), (right, others)) = figure.subplots(2, 2)
        _draw(left, rows, "elements", "per_step")
        _draw(middle, rows, "elements", "memory")
        _draw(right, rows, "duration", "total")
        _draw_others(others, rows)
        left.set_title("M: time of a step", loc="left")
        middle.set_title("M: memory", loc="left")
        right.set_title("M, 40 elements: time of the run", loc="left")
        others.set_title("8 elements: time of a step", loc="left")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
        return png_bytes(figure)


def _draw_others(axes: Axes, rows: tuple[ScalingRow, ...]) -> None:
    """Draw a step over layers, pieces, points and runs."""
    names = [over for over in dict.fromkeys(row.over for row in rows) if over not in {"elements", "duration"}]
    for index, over in enumerate(names):
        chosen = [row for row in rows if row.over == over and row.per_step is not None]
        style: dict[str, Any] = {"color": COLORS[index + 2], "marker": MARKERS[index + 2], "label": over}
        axes.plot([row.size for row in chosen], [UNITS["per_step"] * (row.per_step or 0.0) for row in chosen], **style)
    axes.set(xlabel="layers, pieces, points, runs", ylabel=LABELS["per_step"], xscale="log", ylim=(0.0, None))
    if names:
        axes.legend(frameon=False)


def _draw(axes: Axes, rows: tuple[ScalingRow, ...], over: str, name: str) -> None:
    """Draw one figure of all methods."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for index, method in enumerate(dict.fromkeys(row.method for row in rows)):
        chosen = [row for row in rows if row.over == over and row.method == method and getattr(row, name) is not None]
        style: dict[str, Any] = {"color": COLORS[index], "marker": MARKERS[index], "label": method}
        axes.plot([row.size for row in chosen], [UNITS[name] * getattr(row, name) for row in chosen], **style)
    axes.set(xlabel="elements" if over == "elements" else "duration [s]", ylabel=LABELS[name])
    if over == "duration":
        axes.set_xticks(sorted({row.size for row in rows if row.over == over}))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda size, _: f"{size:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
