"""Deflection, depth and forces of a run over the time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.closed_loop.units import shown_unit
from fem_needle.figures.common import (
    ABOVE,
    MILLIMETERS,
    SMALL,
    deflection_unit,
    draw_zero,
    limits_of,
    lone_marker,
    mark_end,
    name_figure,
    set_time_limits,
    suited,
)
from fem_needle.pictures import COLORS, DASHES, crowded, new_figure, shared_style
from fem_needle.scene.signals import INPUT_UNITS
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

WIDTH, PANEL_HEIGHT = 8.0, 2.0  # inches
THIN = 0.8  # points: lines of curves that turn very often
MOST_POINTS = 3  # that have a line of their own
LEAST_FORCE = 0.05  # of a unit, that a panel shows in it
COMMAND = "command_"


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves that share an axis.

    Attributes
    ----------
    title
        Above the panel.
    label
        Of its axis, with the unit.
    curves
        Values (nt,) by name.
    """

    title: str
    label: str
    curves: dict[str, Array]


def courses(run: Trajectory) -> Figure:
    """Draw tip deflection, depth, axial and lateral forces, and the commands of a loop, over the time [s].

    Parameters
    ----------
    run
        Computed or loaded.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each, in mm, N; forces are those on the needle.
    """
    panels = (*_panels(run), *_command_panels(run))
    with shared_style():
        figure = new_figure(WIDTH, PANEL_HEIGHT * len(panels) + 0.4)
        places = figure.subplots(len(panels), 1, sharex=True)
        for axes, panel in zip(places, panels, strict=True):
            draw_panel(axes, panel, run)
        set_time_limits(places[-1], run.time)
        places[-1].set_xlabel("time [s]")
        figure.align_ylabels()
        name_figure(figure, run)
    return figure


def draw_panel(axes: Axes, panel: Panel, run: Trajectory) -> None:
    """Draw the curves of a panel over the time; their names above it where there is more than one."""
    draw_zero(axes)
    for number, (name, values) in enumerate(panel.curves.items()):
        line = {"linestyle": "-", "linewidth": THIN} if crowded(values) else {"linestyle": DASHES[number % len(DASHES)]}
        style = {"color": COLORS[number % len(COLORS)], **line}
        axes.plot(run.time, values, label=name, **style, **lone_marker(run))
        mark_end(axes, run.time, values, run)
    everything = np.concatenate([*panel.curves.values()]) if panel.curves else np.zeros(0)
    axes.set_ylim(*limits_of(everything, 0.0))
    axes.set_ylabel(panel.label)
    zero = bool(panel.curves) and not np.any(np.nan_to_num(everything))
    axes.set_title(f"{panel.title}{', zero throughout' if zero else ''}", loc="left")
    if len(panel.curves) > 1:
        axes.legend(ncols=len(panel.curves), fontsize=SMALL, handlelength=2.0, columnspacing=1.0, **ABOVE)


def _panels(run: Trajectory) -> tuple[Panel, ...]:
    unit, name = deflection_unit(run)
    hub = {} if _all_zero(run.hub_force) else {"hub" if run.scene.support.kind == "hub" else "clamp": run.hub_force}
    applied = {} if _all_zero(np.nan_to_num(run.tip_force)) else {"tip": run.tip_force}
    lateral = {"tissue": run.tissue_force} | hub | _many(run.guide_force, "guide") | _many(run.lateral_force, "load") | applied
    return (
        Panel("Tip", f"tip [{name}]", {"deflection": unit * run.tip_deflection}),
        Panel("Insertion", "depth [mm]", {"depth": MILLIMETERS * run.depth}),
        _forces("Axial: push and what resists it", axial_forces(run)),
        _forces("Lateral forces on the needle", lateral),
    )


def axial_forces(run: Trajectory) -> dict[str, Array]:
    """Return push, friction and cutting [N] over the time, by name; of a push also what holds the needle while it rests.

    What the three leave over is the needle's own axial force, and inertia.
    """
    friction, found = run.friction_force, {"push": run.push_force}
    resting = (run.speed == 0.0) & (friction != 0.0)
    found["friction"] = np.where(resting, np.nan, friction)
    if np.any(np.nan_to_num(run.cutting_force)):
        found["cutting"] = np.where(resting, np.nan, run.cutting_force)
    if np.any(resting):
        found["hold at rest"] = np.where(resting, friction, np.nan)
    return found


def _forces(title: str, curves: dict[str, Array]) -> Panel:
    size, unit = suited(curves.values(), "N", LEAST_FORCE)
    return Panel(title, f"force [{unit}]", {name: values / size for name, values in curves.items()})


def _many(forces: Array, name: str) -> dict[str, Array]:
    """Return the forces (nt, count) of guides or loads one by one, of many their sum."""
    count = forces.shape[1]
    if count > MOST_POINTS:
        return {f"{count} {name}s together": np.sum(forces, axis=1)}
    return {name if count == 1 else f"{name} {index + 1}": forces[:, index] for index in range(count)}


def _command_panels(run: Trajectory) -> tuple[Panel, ...]:
    panels = []
    for signal, values in run.signals.items():
        if signal.startswith(COMMAND):
            name = signal.removeprefix(COMMAND)
            size, unit = shown_unit(INPUT_UNITS[name])
            words = name.replace("_", " ")
            shown = "" if unit == "1" else f" [{unit}]"
            panels.append(Panel(f"Command: {words}", f"command{shown}", {words: values / size}))
    return tuple(panels)


def _all_zero(values: Array) -> bool:
    return not np.any(values)
