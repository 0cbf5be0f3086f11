"""Shapes of the needle at several depths, in the tissue's layers."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.errors import SceneError
from fem_needle.figures.common import MILLIMETERS, SAME_DEPTH, SMALL, mark_end, moves, name_figure, placed
from fem_needle.figures.scenery import draw_forces, draw_scenery, magnification, set_limits, told
from fem_needle.figures.tissue import figure_with_tissue
from fem_needle.pictures import DASHES, INK, new_figure, shared_style
from fem_needle.trajectory import Trajectory

WIDTH, HEIGHT = 9.0, 4.8  # inches
AXES_WIDTH = 470.0  # points, about
SHOWN = 5  # shapes, where no depths are given
MISSED = 1.05  # how many times as large as those shown a deflection is that is shown as well
DARKEST, BRIGHTEST = 0.0, 0.85  # of the map viridis: its yellow is too bright for a line


def shapes(run: Trajectory, depths: Sequence[float] | None = None) -> Figure:
    """Draw the needle at several depths; positive deflections up, the insertion to the right.

    Parameters
    ----------
    run
        Computed or loaded.
    depths
        z [m], each shown at the sample next to it, the first time; default: five over the range and that of the largest
        deflection where it exceeds them, or of a needle that is held five instants.

    Returns
    -------
    matplotlib.figure.Figure
        In mm; the title says by how much deflections are magnified.

    Raises
    ------
    SceneError
        If a depth is none that the run has.
    """
    rows = _default_rows(run) if depths is None else _rows_at(run, depths)
    with shared_style():
        figure = new_figure(WIDTH, HEIGHT)
        axes, strip = figure_with_tissue(figure)
        set_limits(axes, run, rows)
        draw_scenery(axes, strip, run, AXES_WIDTH)
        _draw_needles(axes, run, rows)
        figure.legend(loc="outside right center", frameon=False, fontsize=SMALL + 0.5)
        name_figure(figure, run)
        strip.set_title("Shapes, deflections magnified 0 times", loc="left")
        strip.set_title(f"Shapes, {told(run, magnification(figure, axes, run))}", loc="left")
    return figure


def _default_rows(run: Trajectory) -> NDArray[np.intp]:
    """Return samples spread over the depth, or of a held needle over the time, the last one among them."""
    if not moves(run):
        return np.unique(np.linspace(0, len(run.time) - 1, SHOWN).astype(np.intp))
    wanted = np.linspace(float(np.min(run.depth)), float(np.max(run.depth)), SHOWN)
    rows = [_row_at(run, depth) for depth in wanted]
    rows += [len(run.time) - 1] if run.depth[-1] < wanted[-2] else []
    sizes = np.max(np.abs(np.nan_to_num(run.station_deflection)), axis=1)
    most = int(np.argmax(sizes))
    return np.unique([*rows, most] if sizes[most] > MISSED * np.max(sizes[rows]) else rows)


def _row_at(run: Trajectory, depth: float) -> int:
    return int(np.argmin(np.abs(run.depth - depth)))


def _rows_at(run: Trajectory, depths: Sequence[float]) -> NDArray[np.intp]:
    """Return the samples next to the depths [m]."""
    low, high = float(np.min(run.depth)), float(np.max(run.depth))
    slack = SAME_DEPTH * run.scene.needle.length
    for depth in depths:
        if not low - slack <= depth <= high + slack:
            allowed = f"{MILLIMETERS * low:.6g} to {MILLIMETERS * high:.6g} mm, the depths of the run"
            raise SceneError(f"depths: is not a depth of the run (got {MILLIMETERS * depth:.6g} mm; allowed {allowed})")
    if not len(depths):
        raise SceneError("depths: got none; allowed one or more, m")
    return np.array(sorted({_row_at(run, depth) for depth in depths}), dtype=np.intp)


def _draw_needles(axes: Axes, run: Trajectory, rows: NDArray[np.intp]) -> None:
    colors = mpl.colormaps["viridis"](np.linspace(DARKEST, BRIGHTEST, len(rows)))
    for number, (row, color) in enumerate(zip(rows, colors, strict=True)):
        along, across = placed(run, int(row))
        axes.plot(along, across, color=color, linestyle=DASHES[number % len(DASHES)], label=_label(run, int(row)), zorder=3)
        axes.plot(along[-1:], across[-1:], marker="o", markersize=4, color=color, linestyle="none", zorder=3.5)
        if run.scene.support.kind == "hub":
            hub = {"marker": "s", "markersize": 6, "color": color, "markeredgecolor": INK, "linestyle": "none", "zorder": 3.5}
            axes.plot(along[:1], across[:1], label="hub" if number == len(rows) - 1 else "_hub", **hub)
    named = False
    for row in rows:
        named |= draw_forces(axes, run, int(row), "_" * named + "lateral force")
    mark_end(axes, *placed(run, len(run.time) - 1), run)


def _label(run: Trajectory, row: int) -> str:
    """Return depth, and time where the depth alone does not tell the sample."""
    depth, time = f"{MILLIMETERS * run.depth[row]:.4g} mm deep", f"{run.time[row]:.3g} s"
    if not moves(run):
        return f"at {time}" if len(run.time) > 1 else depth
    return depth if bool(np.all(np.diff(run.depth) >= 0.0)) else f"{depth}, {time}"
