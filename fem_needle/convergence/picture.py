"""The picture of a convergence study: errors over the size of the discretization, both logarithmic, and the slope of theory."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator
from numpy.typing import NDArray

from fem_needle.convergence.rows import ROUND_OFF, ConvergenceRow
from fem_needle.convergence.study import ConvergenceStudy
from fem_needle.pictures import COLORS, INK, MARKERS, TITLE_SIZE, WIDTH, new_figure, png_bytes, shared_style, title_lines

Array = NDArray[np.float64]

MILLISECONDS = 1e3
LABELS = {"elements": "elements", "modes": "modes", "time-step": "time step [ms]"}
BESIDE = 0.3  # of the errors: where the slope of theory is drawn, so that neither line hides the other
GRAY = "#808080"
TITLE_SHARE = 0.85  # of the width of the picture


def convergence_picture(study: ConvergenceStudy) -> bytes:
    """Return the log-log picture of a study as PNG.

    Drawn are the errors of the tip and of the shape, the grid convergence index of each row, the floor of the round-off where
    it matters, and a dashed line with the order of theory below the rows that no floor holds up.
    """
    with shared_style():
        figure = new_figure()
        axes = figure.subplots()
        axes.set_xscale("log")
        axes.set_yscale("log")
        drawn = [_draw(axes, study, name, index) for index, name in enumerate(_SERIES)]
        _draw_theory(axes, study)
        _draw_floor(axes, study)
        _label(axes, study)
        if any(drawn):
            axes.legend(loc="best", fontsize=9)
        else:
            axes.text(0.5, 0.5, "no error above 0", transform=axes.transAxes, ha="center")
        return png_bytes(figure)


_SERIES = {
    "error": "error of the tip",
    "shape_error": "error of the shape at the end",
    "grid_convergence_index": "grid convergence index",
}


def _place(study: ConvergenceStudy, row: ConvergenceRow) -> float:
    """Return where a row stands: elements, modes, or milliseconds."""
    return MILLISECONDS * row.value if study.over == "time-step" else row.value


def _draw(axes: Axes, study: ConvergenceStudy, name: str, index: int) -> bool:
    """Draw one figure of all rows and return whether there was any."""
    points = [(_place(study, row), getattr(row, name)) for row in study.rows]
    points = [(place, value) for place, value in points if value is not None and value > 0.0]
    if not points:
        return False
    places, values = zip(*points, strict=True)
    axes.plot(places, values, color=COLORS[index], marker=MARKERS[index], label=_SERIES[name], zorder=3)
    return True


def _draw_theory(axes: Axes, study: ConvergenceStudy) -> None:
    """Draw the slope of theory beside the finest row that no floor holds up."""
    order = study.theoretical_order
    free = [row for row in study.rows if row.error and not row.note.startswith((ROUND_OFF, "limited"))]
    if order is None or not free:
        return
    anchor = free[-1]
    last = max(study.rows.index(anchor), 1)
    places: Array = np.array([_place(study, row) for row in study.rows[: last + 1]])
    exponent = order if study.over == "time-step" else -order
    values = BESIDE * float(anchor.error or 0.0) * (places / _place(study, anchor)) ** exponent
    label = f"slope of theory, order {order:.3g}"
    axes.plot(places, values, color=INK, linestyle=(0, (5, 3)), linewidth=1.3, label=label, zorder=2)


def _draw_floor(axes: Axes, study: ConvergenceStudy) -> None:
    """Draw the round-off, and what the held discretization costs, where they hold a row up."""
    if study.held_error and any(row.note.startswith("limited") for row in study.rows):
        label = "a finer model changes" if study.over == "time-step" else "half the time step changes"
        axes.axhline(study.held_error, color=GRAY, linestyle="-.", linewidth=1.3, label=label, zorder=2)
    if not any(row.note == ROUND_OFF for row in study.rows):
        return
    places = [_place(study, row) for row in study.rows]
    floors = [row.round_off for row in study.rows]
    axes.plot(places, floors, color=GRAY, linestyle=":", linewidth=1.3, label="round-off", zorder=2)


def _label(axes: Axes, study: ConvergenceStudy) -> None:
    """Name axes and picture; the axis runs from coarse to fine."""
    places = [_place(study, row) for row in study.rows]
    axes.set(xlabel=LABELS[study.over], ylabel="relative error [1]")
    axes.xaxis.set_major_locator(NullLocator())
    axes.set_xticks(_apart(places))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda place, _: f"{place:.4g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    if study.over == "time-step":
        axes.invert_xaxis()
    title = title_lines(study.scene.title, TITLE_SHARE * WIDTH)
    axes.set_title("\n".join((title, study.reference)), loc="left", fontsize=TITLE_SIZE, parse_math=False)


def _apart(places: list[float], smallest_ratio: float = 1.25) -> list[float]:
    """Return the places whose labels do not touch: neighbors a quarter apart, relative to the whole span."""
    kept: list[float] = []
    least = max(smallest_ratio, (max(places) / min(places)) ** (1.0 / 14.0))
    for place in sorted(places):
        if not kept or place >= least * kept[-1]:
            kept.append(place)
    return kept
