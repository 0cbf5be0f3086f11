"""The picture of a fit: data and model over depth or time, the residuals below them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fem_needle.identification.result import Identification
from fem_needle.pictures import COLORS, INK, MARKERS, new_figure, png_bytes, shared_style, write_title

Array = NDArray[np.float64]

WIDTH, HEIGHT = 5.0, 5.2  # inches; width of a column of panels
LEAST_WIDTH = 7.0
MILLIMETERS = 1e3
NAMES = {"m": "deflection [mm]", "N": "push [N]"}
BAND = "#c8c8c8"
MOST_NAMED = 8  # series in a legend


def identification_picture(found: Identification) -> bytes:
    """Return the picture of a fit as PNG: deflections in mm and pushes in N, the band of two standard deviations in gray."""
    units = [unit for unit in NAMES if any(row.unit == unit for row in found.rows)]
    with shared_style():
        figure = new_figure(max(LEAST_WIDTH, WIDTH * len(units)), HEIGHT)
        grid = figure.subplots(2, len(units), sharex="col", squeeze=False, height_ratios=(2.2, 1.0))
        for number, unit in enumerate(units):
            _draw(grid[0, number], grid[1, number], found, unit)
        write_title(figure, found.scene.title)
        return png_bytes(figure)


def _draw(above: Axes, below: Axes, found: Identification, unit: str) -> None:
    """Draw the series of one unit and their residuals."""
    scale = MILLIMETERS if unit == "m" else 1.0
    along, label = _abscissa(found, unit)
    for number, (name, unsorted) in enumerate(_series(found, unit)):
        rows = unsorted[np.argsort(along[unsorted], kind="stable")]
        color, marker = COLORS[number % len(COLORS)], MARKERS[number % len(MARKERS)]
        named = f"{name}, measured" if number < MOST_NAMED else None
        dots: dict[str, Any] = {"linestyle": "", "marker": marker, "color": color, "markersize": 4.5, "alpha": 0.75}
        above.plot(along[rows], scale * found.measured[rows], label=named, zorder=2, **dots)
        fitted = None if number else "fitted"
        above.plot(along[rows], scale * found.fitted[rows], color=INK, linewidth=1.3, label=fitted, zorder=3)
        reach = 2.0 * scale * found.deviations[rows]
        below.fill_between(along[rows], -reach, reach, color=BAND, linewidth=0.0, zorder=1)
        below.plot(along[rows], scale * found.residuals[rows], zorder=2, **dots)
    above.fill_between([], [], color=BAND, linewidth=0.0, label="residuals: two standard deviations")
    below.axhline(0.0, color=INK, linewidth=1.0, zorder=1.5)
    above.set_ylabel(NAMES[unit])
    below.set(xlabel=label, ylabel=f"residual [{'mm' if unit == 'm' else 'N'}]")
    above.legend(loc="best", fontsize=9)


def _abscissa(found: Identification, unit: str) -> tuple[Array, str]:
    """Return where the rows are drawn: over the depth, where it is known, and pushes over the time."""
    timed = all(row.time is not None for row in found.rows)
    deep = all(row.depth is not None for row in found.rows)
    if deep and not (unit == "N" and timed):
        return MILLIMETERS * np.array([row.depth for row in found.rows], dtype=float), "depth [mm]"
    return np.array([row.time for row in found.rows], dtype=float), "time [s]"


def _series(found: Identification, unit: str) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Yield name and rows of each column of each data set."""
    keys = [(row.source, row.column) for row in found.rows]
    several = len({source for source, _ in keys}) > 1
    for key in dict.fromkeys(key for key, row in zip(keys, found.rows, strict=True) if row.unit == unit):
        rows = np.array([number for number, one in enumerate(keys) if one == key], dtype=np.intp)
        column = key[1].replace("deflection_at_", "at mm ").replace("_", " ")
        yield f"{key[0]}: {column}" if several else column, rows
