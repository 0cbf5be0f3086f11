"""A run as a moving picture."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from fem_needle.figures.common import MILLIMETERS, SMALL, deflection_unit, name_figure, placed
from fem_needle.figures.scenery import PATH, draw_scenery, magnification, set_limits, told
from fem_needle.figures.tissue import figure_with_tissue
from fem_needle.pictures import COLORS, INK, new_figure, shared_style
from fem_needle.run_forces import lateral_forces
from fem_needle.trajectory import Trajectory

WIDTH, HEIGHT = 8.0, 4.0  # inches
RESOLUTION = 80  # dots per inch
AXES_WIDTH = 420.0  # points, about
MOST_FRAMES = 60
FRAMES_PER_SECOND = 12


def animated_gif(run: Trajectory) -> bytes:
    """Return the needle moving as a GIF that repeats: time, depth and magnification stand above it.

    Parameters
    ----------
    run
        Computed or loaded.

    Returns
    -------
    bytes
        At most 60 frames, equally spaced in time, shown for 5 s.
    """
    with shared_style(), TemporaryDirectory() as folder:
        figure = new_figure(WIDTH, HEIGHT)
        axes, strip = figure_with_tissue(figure)
        needle, title = _prepare(figure, axes, strip, run)
        path = Path(folder) / "animation.gif"
        writer = PillowWriter(fps=FRAMES_PER_SECOND)
        with writer.saving(figure, str(path), RESOLUTION):
            for row in frame_rows(run):
                _show(needle, strip, run, int(row), title)
                writer.grab_frame()
        return path.read_bytes()


def frame_rows(run: Trajectory) -> NDArray[np.intp]:
    """Return the samples that are shown: those next to equally spaced instants, the first and the last among them."""
    instants = np.linspace(run.time[0], run.time[-1], min(len(run.time), MOST_FRAMES))
    later = np.clip(np.searchsorted(run.time, instants), 0, len(run.time) - 1)
    earlier = np.maximum(later - 1, 0)
    nearer = np.where(instants - run.time[earlier] < run.time[later] - instants, earlier, later)
    return np.asarray(nearer, dtype=np.intp)


def _prepare(figure: Figure, axes: Axes, strip: Axes, run: Trajectory) -> tuple[list[Line2D], str]:
    """Draw what does not move, and fix the layout; return the needle's lines and what is said of the magnification."""
    set_limits(axes, run, np.unique(frame_rows(run)))
    draw_scenery(axes, strip, run, AXES_WIDTH)
    (needle,) = axes.plot([], [], color=COLORS[0], linewidth=2.4, label="needle", zorder=3)
    (tip,) = axes.plot([], [], marker="o", markersize=5, color=COLORS[0], linestyle="none", zorder=4)
    (way,) = axes.plot([], [], color=COLORS[2], linestyle=(0, (5, 2)), linewidth=1.4, label="way of the tip", zorder=2)
    lines = [needle, tip, way]
    point: dict[str, Any] = {"markersize": 7, "linestyle": "none", "zorder": 4}
    if run.scene.support.kind == "hub":
        lines += axes.plot([], [], marker="s", color=INK, label="hub", **point)
        for number, _ in enumerate(lateral_forces(run, 0)):
            lines += axes.plot([], [], marker="^", color=PATH, label="_" * bool(number) + "lateral force", **point)
    figure.legend(loc="outside right center", frameon=False, fontsize=SMALL + 0.5)
    name_figure(figure, run)
    strip.set_title("t = 0 s", loc="left")
    text = told(run, magnification(figure, axes, run))
    figure.set_layout_engine("none")
    return lines, text


def _show(lines: list[Line2D], strip: Axes, run: Trajectory, row: int, magnified: str) -> None:
    """Move the needle to a sample."""
    along, across = placed(run, row)
    needle, tip, way, *hub = lines
    needle.set_data(along, across)
    tip.set_data(along[-1:], across[-1:])
    way.set_data(MILLIMETERS * run.depth[: row + 1], deflection_unit(run)[0] * run.tip_deflection[: row + 1])
    if hub:
        hub[0].set_data(along[:1], across[:1])
    for marker, (y, force) in zip(hub[1:], lateral_forces(run, row), strict=True):
        place = MILLIMETERS * y
        acting = [place] if force else []
        marker.set_data(acting, np.interp(acting, along, across))
        marker.set_marker("^" if force > 0.0 else "v")
    digits = max(0, 2 - int(np.floor(np.log10(max(float(run.time[-1]), 1e-9)))))
    strip.set_title(f"t = {run.time[row]:.{digits}f} s, {MILLIMETERS * run.depth[row]:.1f} mm deep, {magnified}", loc="left")
