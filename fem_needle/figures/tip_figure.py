"""The way of the tip through the tissue; of a needle that is held, its way in time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_needle.figures.common import (
    ABOVE,
    LEAST_RANGE,
    MILLIMETERS,
    SMALL,
    deflection_unit,
    limits_of,
    lone_marker,
    mark_end,
    moves,
    name_figure,
    set_time_limits,
)
from fem_needle.figures.scenery import PATH, draw_target, magnification, told
from fem_needle.figures.tissue import draw_tissue, figure_with_tissue
from fem_needle.pictures import COLORS, INK, new_figure, shared_style
from fem_needle.trajectory import Trajectory

WIDTH, HEIGHT = 9.0, 4.6  # inches
AXES_WIDTH = 480.0  # points, about
SPACE = 0.05  # of the way, before and behind it


def tip_path(run: Trajectory) -> Figure:
    """Draw the tip's deflection [mm] over its place [mm]; of a needle that is held, over the time [s].

    Parameters
    ----------
    run
        Computed or loaded.

    Returns
    -------
    matplotlib.figure.Figure
        With the layers, the path that was cut where the tissue rests on it, and of a loop the target and what was measured.
    """
    with shared_style():
        figure = new_figure(WIDTH, HEIGHT)
        if moves(run) or len(run.time) == 1:
            _draw_way(figure, run)
        else:
            _draw_course(figure, run)
        name_figure(figure, run)
    return figure


def _draw_way(figure: Figure, run: Trajectory) -> None:
    axes, strip = figure_with_tissue(figure)
    unit, name = deflection_unit(run)
    place, tip = MILLIMETERS * run.depth, unit * run.tip_deflection
    ends = [*place, *([MILLIMETERS * run.scene.target.depth] if run.scene.target.depth is not None else [])]
    space = SPACE * (max(ends) - min(ends) if moves(run) else MILLIMETERS * run.scene.needle.length)
    axes.set_xlim(min(ends) - space, max(ends) + space)
    _set_height(axes, run)
    draw_tissue(axes, strip, run.scene, AXES_WIDTH)
    axes.axhline(0.0, color=INK, linewidth=0.8, linestyle=(0, (6, 4)), zorder=1)
    if len(run.path_position):
        cut: dict[str, Any] = {"color": PATH, "linestyle": (0, (1.5, 1.5)), "linewidth": 2.6, "zorder": 2.5}
        axes.plot(MILLIMETERS * run.path_position, unit * run.path_deflection, label="rest line that it cut", **cut)
    _draw_measured(axes, run, place)
    axes.plot(place, tip, color=COLORS[0], zorder=3, label="tip")
    dot: dict[str, Any] = {"marker": "o", "markersize": 6, "markeredgecolor": INK, "linestyle": "none", "zorder": 4}
    axes.plot(place[:1], tip[:1], color="white", label="start", **dot)
    axes.plot(place[-1:], tip[-1:], color=INK, label="end", **dot)
    mark_end(axes, place, tip, run)
    draw_target(axes, run)
    axes.set(xlabel="place of the tip along the insertion axis y [mm], 0 at the skin", ylabel=f"tip deflection [{name}]")
    figure.legend(loc="outside right center", frameon=False, fontsize=SMALL + 0.5)
    strip.set_title("Path of the tip, deflections magnified 0 times", loc="left")
    strip.set_title(f"Path of the tip, {told(run, magnification(figure, axes, run))}", loc="left")


def _draw_course(figure: Figure, run: Trajectory) -> None:
    axes = figure.subplots()
    unit, name = deflection_unit(run)
    tip = unit * run.tip_deflection
    set_time_limits(axes, run.time)
    _set_height(axes, run)
    axes.axhline(0.0, color=INK, linewidth=0.8, linestyle=(0, (6, 4)), zorder=1)
    _draw_measured(axes, run, run.time)
    axes.plot(run.time, tip, color=COLORS[0], zorder=3, label="tip", **lone_marker(run))
    mark_end(axes, run.time, tip, run)
    axes.set(xlabel="time [s]", ylabel=f"tip deflection [{name}]")
    axes.set_title(f"Tip, held {MILLIMETERS * run.depth[0]:.4g} mm deep", loc="left")
    if any(signal.startswith("measurement_tip") for signal in run.signals):
        axes.legend(ncols=2, fontsize=SMALL + 0.5, **ABOVE)


def _draw_measured(axes: Axes, run: Trajectory, along: Any) -> None:
    """Draw dots where a new image of the tip was known."""
    readings = run.signals.get("measurement_tip_deflection")
    if readings is not None:
        new = np.flatnonzero(np.isfinite(readings) & (np.diff(readings, prepend=np.nan) != 0.0))
        style: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 5, "color": COLORS[1], "zorder": 2}
        axes.plot(along[new], deflection_unit(run)[0] * readings[new], label="latest measurement", **style)


def _set_height(axes: Axes, run: Trajectory) -> None:
    shown = [run.tip_deflection, run.path_deflection, np.array([run.scene.target.lateral])]
    shown.append(run.signals.get("measurement_tip_deflection", np.zeros(0)))
    unit, _ = deflection_unit(run)
    axes.set_ylim(*limits_of(unit * np.concatenate(shown), LEAST_RANGE * unit * run.scene.needle.length))
