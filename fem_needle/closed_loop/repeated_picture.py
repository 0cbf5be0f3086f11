"""The picture of a loop that was repeated: all tips and their mean, and how the errors at the target are distributed."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fem_needle.closed_loop.picture import MILLIMETERS, SEEN, TIP, WANTED
from fem_needle.closed_loop.repeated import RepeatedLoop, Repetition
from fem_needle.pictures import INK, new_figure, png_bytes, shared_style, write_title

Array = NDArray[np.float64]

WIDTH, HEIGHT = 10.0, 4.6  # inches
PATH_WIDTH = 0.7
STATIONS = 400  # of the mean
MOST_BINS = 24
ROOM = 0.15  # beside the complete tips, of their range, where one that failed leaves the picture
DASHES = (0, (5, 2))
TARGET: dict[str, Any] = {
    "marker": "D",
    "markersize": 9,
    "color": WANTED,
    "markeredgecolor": INK,
    "linestyle": "none",
    "zorder": 5,
}
BROKEN: dict[str, Any] = {"color": SEEN, "linewidth": PATH_WIDTH, "linestyle": "-"}


def repeated_picture(study: RepeatedLoop) -> bytes:
    """Return tips over the depth, or over the time where some depth does not rise, and the errors at the target, as PNG."""
    with shared_style():
        figure = new_figure(WIDTH, HEIGHT)
        tips, errors = figure.subplots(1, 2, width_ratios=(3, 2))
        _draw_tips(tips, study)
        _draw_errors(errors, study)
        handles, labels = tips.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
        write_title(figure, study.scene.title)
        return png_bytes(figure)


def _draw_tips(panel: Axes, study: RepeatedLoop) -> None:
    drawn = [one for one in study.repetitions if one.time.size]
    complete = [one for one in drawn if one.is_complete]
    over_depth = all(bool(np.all(np.diff(one.depth) > 0.0)) for one in drawn)
    lateral = MILLIMETERS * study.scene.target.lateral
    panel.axhline(lateral, color=WANTED, linestyle=DASHES, linewidth=1.4, label="wanted")
    for number, one in enumerate(complete):
        label = "_tip" if number else "tip, a line for each repetition"
        panel.plot(_along(one, over_depth), MILLIMETERS * one.tip_deflection, color=TIP, linewidth=PATH_WIDTH, label=label)
    broken = [one for one in drawn if not one.is_complete]
    for number, one in enumerate(broken):
        label = "_broken" if number else "broken off"
        panel.plot(_along(one, over_depth), MILLIMETERS * one.tip_deflection, label=label, marker="X", markevery=[-1], **BROKEN)
    if len(complete) > 1:
        stations, mean = mean_path([(_along(one, over_depth), one.tip_deflection) for one in complete])
        panel.plot(stations, MILLIMETERS * mean, color=INK, linewidth=2.4, label="mean", zorder=4)
    depth = study.scene.target.depth
    if depth is not None and over_depth:
        panel.plot(MILLIMETERS * depth, lateral, label="target", **TARGET)
    _keep_to_complete(panel, complete, lateral)
    panel.set(xlabel="depth [mm]" if over_depth else "time [s]", ylabel="tip [mm]")
    panel.set_title(f"Tip, {_counted(study)}", loc="left")


def _along(one: Repetition, over_depth: bool) -> Array:
    return MILLIMETERS * one.depth if over_depth else one.time


def _counted(study: RepeatedLoop) -> str:
    """Return how many repetitions there are, and what became of them."""
    text = f"{len(study.repetitions)} repetition{'s' if len(study.repetitions) != 1 else ''}"
    others = ((study.failed, "failed"), (study.missed, "missed the target's depth"))
    return ", ".join([text, *(f"{number} {what}" for number, what in others if number)])


def _keep_to_complete(panel: Axes, complete: list[Repetition], lateral: float) -> None:
    """Let a tip that went out of all bounds leave the panel, where there are others."""
    if not complete:
        return
    values = [lateral, *chain.from_iterable(MILLIMETERS * one.tip_deflection for one in complete)]
    low, high = min(values), max(values)
    if high > low:
        panel.set_ylim(low - ROOM * (high - low), high + ROOM * (high - low))


def mean_path(paths: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return stations and the mean of several curves, each linear between its points, over the range that all of them have.

    Parameters
    ----------
    paths
        Rising stations (nt,) and values (nt,) of each.
    """
    first, last = max(along[0] for along, _ in paths), min(along[-1] for along, _ in paths)
    stations = np.linspace(first, last, STATIONS)
    return stations, np.mean([np.interp(stations, along, values) for along, values in paths], axis=0)


def _draw_errors(panel: Axes, study: RepeatedLoop) -> None:
    """Draw a histogram of the errors at the target, a mark for each, mean and standard deviation."""
    errors = MILLIMETERS * study.target_errors
    place = "end" if study.scene.target.depth is None else "target"
    panel.set_xlabel("tip minus target [mm], mean and standard deviation", fontsize=9)
    panel.set_title(f"Error at the {place}{_statistics(study)}", loc="left")
    if not errors.size or study.mean is None:
        panel.text(0.5, 0.5, "no repetition arrived", transform=panel.transAxes, ha="center", va="center")
        panel.set(xticks=[], yticks=[])
        return
    style: dict[str, Any] = {"color": TIP, "alpha": 0.45, "edgecolor": "white"}
    counts, *_ = panel.hist(errors, bins=_bins(errors), range=_span(errors), zorder=2, **style)
    panel.plot(errors, np.full(errors.size, -0.04 * np.max(counts)), "|", color=TIP, markersize=9, zorder=3)
    mean = MILLIMETERS * study.mean
    panel.axvline(mean, color=INK, linewidth=2.4, zorder=4)
    panel.axvline(0.0, color=WANTED, linestyle=DASHES, linewidth=1.4, zorder=4)
    if study.standard_deviation is not None:
        spread = MILLIMETERS * study.standard_deviation
        panel.axvspan(mean - spread, mean + spread, color=INK, alpha=0.1, zorder=1)
    panel.set_ylim(-0.08 * np.max(counts), 1.08 * np.max(counts))
    panel.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    panel.set_ylabel("repetitions")


def _statistics(study: RepeatedLoop) -> str:
    if study.mean is None:
        return ""
    mean, deviation = f": {MILLIMETERS * study.mean:.3g}", study.standard_deviation
    return f"{mean} mm" if deviation is None else f"{mean} \N{PLUS-MINUS SIGN} {MILLIMETERS * deviation:.2g} mm"


def _span(errors: Array) -> tuple[float, float]:
    """Return the range of the histogram [mm], a narrow one where all errors are one."""
    low, high = float(np.min(errors)), float(np.max(errors))
    room = 0.0 if high > low else max(0.1 * abs(low), 1e-3)
    return low - room, high + room


def _bins(errors: Array) -> int:
    """Return a number of bins: the square root of the number of errors, which no outlier changes."""
    return int(np.clip(np.ceil(np.sqrt(errors.size)), 1, MOST_BINS))
