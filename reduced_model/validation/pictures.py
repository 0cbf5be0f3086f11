"""Pictures of the page: curves in panels, in the style that all pictures share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from fem_needle.pictures import COLORS, INK, new_figure, png_bytes, shared_style

Array = NDArray[np.float64]
Style = Callable[[Axes], None]

HEIGHT = 3.9  # inches
WIDTHS = {1: 7.0, 2: 9.5, 3: 11.0}  # inches, by the number of panels
FLOOR, CEILING = 1e-5, 5.0  # shares between which errors are drawn
DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), "-.", (0, (8, 2, 2, 2, 2, 2)), ":")


@dataclass(frozen=True, eq=False)
class Curve:
    """A named line; without a line where ``marker`` is given."""

    label: str
    across: Array
    values: Array
    marker: str = ""


@dataclass(frozen=True, eq=False)
class Panel:
    """Axes with a title, the name of what runs across, and lines."""

    title: str
    across: str
    curves: tuple[Curve, ...]


def error_picture(
    label: str, panels: Sequence[Panel], limits: Sequence[float] = (0.01,), further: Style | None = None
) -> bytes:
    """Return panels of |errors| (1) on one logarithmic axis in percent, with dotted lines at the limits (1)."""
    largest = max(float(np.nanmax(np.abs(curve.values))) for panel in panels for curve in panel.curves)

    def style(axes: Axes) -> None:
        axes.set_yscale("log")
        axes.set_ylim(100.0 * FLOOR, 150.0 * min(largest, CEILING))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        for limit in limits:
            axes.axhline(100.0 * limit, color=INK, linewidth=0.9, linestyle=":")
        if further is not None:
            further(axes)

    scaled = [
        Panel(panel.title, panel.across, tuple(_in_percent(curve) for curve in panel.curves)) for panel in panels
    ]
    return curve_picture(label, scaled, style)


def curve_picture(label: str, panels: Sequence[Panel], style: Style | None = None) -> bytes:
    """Return panels of curves side by side, with one legend below."""
    with shared_style():
        figure = new_figure(WIDTHS[len(panels)], HEIGHT)
        grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        names: dict[str, int] = {}
        for panel in panels:
            for curve in panel.curves:
                names.setdefault(curve.label, len(names))
        for axes, panel in zip(grid, panels, strict=True):
            _draw(axes, panel, names)
            if style is not None:
                style(axes)
        grid[0].set_ylabel(label)
        handles = {text: line for axes in grid for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
        columns = min(len(handles), 4 if len(panels) > 1 else 3)
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns, fontsize=9)
        return png_bytes(figure)


def _in_percent(curve: Curve) -> Curve:
    return Curve(curve.label, curve.across, 100.0 * np.maximum(np.abs(curve.values), 0.1 * FLOOR), curve.marker)


def _draw(axes: Axes, panel: Panel, names: dict[str, int]) -> None:
    for curve in panel.curves:
        number = names[curve.label] % len(COLORS)
        line = {"linestyle": "none", "marker": curve.marker, "markersize": 5} if curve.marker else {"linestyle": DASHES[number]}
        axes.plot(curve.across, curve.values, color=COLORS[number], label=curve.label, **line)
    axes.set(title=panel.title, xlabel=panel.across)
