"""The waterfall of a run: deflection over arc length and time, as stacked curves and as a map."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.figures.common import LEAST_RANGE, MILLIMETERS, SMALL, deflection_unit, largest_deflection, moves, name_figure
from fem_needle.pictures import COLORS, INK, new_figure, shared_style
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

WIDTH, HEIGHT = 9.0, 5.2  # inches
CURVES = 24  # at most, stacked
MOST_CELLS = 400  # of the map, along each side
MOST_INTERFACES = 12  # that are drawn
OVERLAP = 2.5  # spacings of two curves that the largest deflection takes
NO_TIME = "#ececec"  # beside the map, where a white place would be a needle at rest
MAP = "RdBu_r"  # white at zero, told apart by color-blind readers


def waterfall(run: Trajectory) -> Figure:
    """Draw deflection over arc length and time: curves stacked by time, and a map with the place of the skin.

    Parameters
    ----------
    run
        Computed or loaded.

    Returns
    -------
    matplotlib.figure.Figure
        Arc length [mm] from the hub to the tip, time [s] upward, deflection [mm].
    """
    with shared_style():
        figure = new_figure(WIDTH, HEIGHT)
        left, right = figure.subplots(1, 2, sharex=True)
        largest = deflection_unit(run)[0] * largest_deflection(run)
        if largest <= LEAST_RANGE * deflection_unit(run)[0] * run.scene.needle.length:
            largest = 0.0
        low, high = _time_limits(run)
        _draw_curves(left, run, largest, high - low)
        _draw_map(figure, right, run, largest)
        for axes in (left, right):
            axes.set(xlim=(0.0, MILLIMETERS * run.arc_length[-1]), xlabel="arc length [mm], hub to tip")
            axes.set(ylim=left.get_ylim(), ylabel="time [s]")
            axes.set_yticks([tick for tick in axes.get_yticks() if low <= tick <= high])
        right.set_facecolor(NO_TIME)
        figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=SMALL + 0.5)
        name_figure(figure, run)
    return figure


def _time_limits(run: Trajectory) -> tuple[float, float]:
    start, end = float(run.time[0]), float(run.time[-1])
    return (start, end) if end > start else (start - 0.5, end + 0.5)


def _thinned(count: int, most: int) -> NDArray[np.intp]:
    """Return at most so many indices, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _draw_curves(axes: Axes, run: Trajectory, largest: float, duration: float) -> None:
    """Draw shapes, each on the line of its time; filled from below, so that the earlier ones stand in front."""
    rows, along = _thinned(len(run.time), CURVES), MILLIMETERS * run.arc_length
    unit, name = deflection_unit(run)
    stretch = OVERLAP * duration / max(len(rows), 8) / largest if largest else 0.0
    for order, row in enumerate(rows):
        base = float(run.time[row])
        curve = base + stretch * unit * run.station_deflection[row]
        front = 3.0 - 0.01 * order
        axes.plot(along[[0, -1]], [base, base], color="#c8c8c8", linewidth=0.5, zorder=1)
        axes.plot(along, curve, color=COLORS[0], linewidth=1.2, zorder=front)
    if moves(run):
        axes.plot(*_skin(run), color=INK, linestyle=(0, (5, 2)), linewidth=1.4, zorder=4)
    low, high = _time_limits(run)
    deflections = run.station_deflection[rows]
    shapes = run.time[rows, None] + stretch * unit * np.where(np.isfinite(deflections), deflections, 0.0)
    space = 0.02 * duration
    top, size = max(high, float(np.max(shapes))) + space, _round_number(largest) if stretch else 0.0
    axes.set_ylim(min(low, float(np.min(shapes))) - space, top + stretch * size + space * bool(stretch))
    count = len(run.time)
    axes.set_title("Stacked" if len(rows) == count else f"Stacked: {len(rows)} of {count} samples", loc="left")
    axes.grid(False)
    if stretch:
        _draw_scale(axes, f"{size:g} {name}", (top, top + stretch * size))


def _draw_scale(axes: Axes, size: str, ends: tuple[float, float]) -> None:
    """Say above the stacked curves how long a deflection is on them, by a bar between two times [s]."""
    transform = axes.get_yaxis_transform()
    bar: dict[str, Any] = {"arrowstyle": "|-|,widthA=0.25,widthB=0.25", "color": COLORS[1], "linewidth": 1.6}
    bar |= {"shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (0.04, ends[1]), (0.04, ends[0]), xycoords=transform, textcoords=transform, arrowprops=bar)
    axes.annotate(size, (0.07, sum(ends) / 2.0), xycoords=transform, va="center", fontsize=SMALL + 0.5)


def _round_number(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that does not exceed a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= value * (1.0 + 1e-9)))


def _draw_map(figure: Figure, axes: Axes, run: Trajectory, largest: float) -> None:
    rows, columns = _thinned(len(run.time), MOST_CELLS), _thinned(len(run.arc_length), MOST_CELLS)
    unit, name = deflection_unit(run)
    values = unit * run.station_deflection[np.ix_(rows, columns)]
    limit = largest or 1.0
    edges = (MILLIMETERS * _edges(run.arc_length[columns]), _edges(run.time[rows]))
    cells = axes.pcolormesh(*edges, values, cmap=MAP, vmin=-limit, vmax=limit, rasterized=True, zorder=1)
    if moves(run):
        axes.plot(*_skin(run), color=INK, linestyle=(0, (5, 2)), linewidth=1.4, label="skin", zorder=4)
        _draw_interfaces(axes, run)
    elif run.depth[0] > 0.0:
        place = MILLIMETERS * (run.scene.needle.length - float(run.depth[0]))
        axes.axvline(place, color=INK, linestyle=(0, (5, 2)), linewidth=1.4, label="skin", zorder=4)
    axes.grid(False)
    axes.set_title("Deflection, as a map" if largest else "Deflection, zero throughout", loc="left")
    figure.colorbar(cells, ax=axes, label=f"deflection [{name}]")


def _draw_interfaces(axes: Axes, run: Trajectory) -> None:
    """Draw where on the needle the layers begin, below the skin; of many layers nothing, for they would hide the map."""
    starts = sorted({layer.start for layer in run.scene.tissue.layers if layer.start > 0.0})
    for number, start in enumerate(starts if len(starts) <= MOST_INTERFACES else ()):
        place = MILLIMETERS * (run.scene.needle.length - run.depth + start)
        inside = np.where(run.depth >= start, place, np.nan)
        label = "_interface" if number else "interface of layers"
        if np.any(np.isfinite(inside)):
            axes.plot(inside, run.time, color=INK, linestyle=(0, (1.5, 1.5)), linewidth=1.2, label=label, zorder=4)


def _skin(run: Trajectory) -> tuple[Array, Array]:
    """Return the arc length [mm] at the skin over the time [s]."""
    return MILLIMETERS * (run.scene.needle.length - run.depth), run.time


def _edges(centers: Array) -> Array:
    """Return the edges of cells around their centers, (n + 1,); the first and last cell end at their centers."""
    if len(centers) == 1:
        return np.array([centers[0] - 0.5, centers[0] + 0.5])
    return np.concatenate([centers[:1], (centers[1:] + centers[:-1]) / 2.0, centers[-1:]])
