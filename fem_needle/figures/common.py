"""What the pictures of a run share: titles, panels, places of the needle in mm."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.pictures import INK, write_title
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

MILLIMETERS = 1e3
SMALL = 8.5  # points: the smallest letters of a picture
SAME_DEPTH = 1e-9  # of the needle's length: what a held depth may differ by
MARGIN = 0.08  # of the range of values, above and below
LEAST_RANGE = 1e-9  # of the needle's length: deflections below it are drawn as zero
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"), (1e-15, "f"), (1e-18, "a"))
LENGTHS = ((1e3, "mm"), (1e6, "µm"), (1e9, "nm"), (1e12, "pm"))  # of a meter, and the unit
LEAST_SHOWN = 0.01  # of a unit, that deflections are shown in
FAILURES = ("failed", "unstable", "interrupted")
ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2, "frameon": False}


def name_figure(figure: Figure, run: Trajectory) -> None:
    """Write the title of the scene above everything, and how the run ended where it did not end as it should."""
    reason = run.summary.get("stop_reason")
    ending = f" ({reason} at {run.time[-1]:.3g} s)" if reason in FAILURES else ""
    write_title(figure, run.scene.title or "Run without a title", ending)


def moves(run: Trajectory) -> bool:
    """Return whether the depth changes in a run."""
    return bool(np.ptp(run.depth) > SAME_DEPTH * run.scene.needle.length)


def placed(run: Trajectory, row: int) -> tuple[Array, Array]:
    """Return places y [mm] and deflections [`deflection_unit`] of the needle at a sample, (n,) each, from the hub to the tip.

    Under ``entry`` the place where the needle enters is among them.
    """
    along = run.arc_length - run.scene.needle.length + run.depth[row]
    across = run.station_deflection[row]
    if run.scene.support.kind == "entry":
        index = int(np.searchsorted(along, 0.0))
        along, across = np.insert(along, index, 0.0), np.insert(across, index, 0.0)
    return MILLIMETERS * along, deflection_unit(run)[0] * across


def largest_deflection(run: Trajectory) -> float:
    """Return the largest magnitude of all deflections [m] that are finite."""
    finite = run.station_deflection[np.isfinite(run.station_deflection)]
    return float(np.max(np.abs(finite), initial=0.0))


def deflection_unit(run: Trajectory) -> tuple[float, str]:
    """Return the unit in which a picture shows deflections: how many of it a meter is, and its name; mm unless all are tiny."""
    target = run.scene.target
    wanted = 0.0 if target.depth is None else abs(target.lateral)
    return length_unit(max(largest_deflection(run), wanted), run.scene.needle.length)


def length_unit(largest: float, length: float) -> tuple[float, str]:
    """Return the same for a largest deflection [m] of a needle of a length [m]."""
    if largest <= LEAST_RANGE * length:
        return LENGTHS[0]
    return next((pair for pair in LENGTHS if largest * pair[0] >= LEAST_SHOWN), LENGTHS[-1])


def limits_of(values: Array, least: float) -> tuple[float, float]:
    """Return limits of an axis that hold all finite values and 0 with a margin; -1 and 1 where nothing exceeds ``least``."""
    finite = values[np.isfinite(values)]
    low, high = min(0.0, float(np.min(finite, initial=0.0))), max(0.0, float(np.max(finite, initial=0.0)))
    if high - low <= least:
        return -1.0, 1.0
    return low - MARGIN * (high - low), high + MARGIN * (high - low)


def set_time_limits(axes: Axes, time: Array) -> None:
    """Let a time axis [s] begin and end with the samples; one sample stands in the middle."""
    start, end = float(time[0]), float(time[-1])
    axes.set_xlim(*((start, end) if end > start else (start - 1.0, end + 1.0)))


def lone_marker(run: Trajectory) -> dict[str, Any]:
    """Return the style that makes a line of one sample visible."""
    return {"marker": "o", "markersize": 5} if len(run.time) == 1 else {}


def mark_end(axes: Axes, x: Array, y: Array, run: Trajectory) -> None:
    """Mark with a cross where a run broke off."""
    if run.summary.get("stop_reason") in FAILURES and len(run.time) > 1:
        axes.plot(x[-1:], y[-1:], marker="X", markersize=8, color=INK, linestyle="none", zorder=6, clip_on=False)


def suited(curves: Iterable[Array], unit: str, least: float = 1.0) -> tuple[float, str]:
    """Return size and name of the part of a unit in which the largest value is at least ``least``; the unit where all are 0."""
    largest = max((float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0)) for values in curves), default=0.0)
    if not largest:
        return 1.0, unit
    size, prefix = next((pair for pair in PREFIXES if largest >= least * pair[0]), PREFIXES[-1])
    return size, prefix + unit


def draw_zero(axes: Axes) -> None:
    """Draw the line of zero."""
    axes.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
