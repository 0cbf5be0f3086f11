"""A needle at one instant with what holds, pushes and guides it, and by how much its deflection is magnified."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.figures.common import LEAST_RANGE, MILLIMETERS, deflection_unit, largest_deflection, limits_of, placed
from fem_needle.figures.tissue import draw_tissue
from fem_needle.pictures import COLORS, INK
from fem_needle.run_forces import lateral_forces
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

OUTSIDE_SHARE = 0.12  # of the depth that is shown before the skin where nothing bends there
SPACE = 0.04  # of the visible length, at both ends
WANTED, PATH = COLORS[3], COLORS[1]
RIGID, ON_A_SPRING = "rigid guide", "guide on a spring"
GUIDES = {RIGID: ("D", "white"), ON_A_SPRING: ("p", COLORS[5])}  # marker and color


def set_limits(axes: Axes, run: Trajectory, rows: NDArray[np.intp]) -> None:
    """Set limits [mm] that hold what `limits` says."""
    along, across = limits(run, rows)
    axes.set_xlim(*along)
    axes.set_ylim(*across)


def limits(run: Trajectory, rows: NDArray[np.intp]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return limits, along [mm] and across [`deflection_unit`], that hold what is drawn.

    That is the needle at all given samples, its guides, the target and the cut path.
    """
    scene, shown, unit = run.scene, [placed(run, int(row)) for row in rows], deflection_unit(run)[0]
    deepest = max(float(along[-1]) for along, _ in shown)
    first = min(float(along[0]) for along, _ in shown)
    if scene.support.kind == "entry":
        first = max(first, -OUTSIDE_SHARE * max(deepest, 0.0)) if deepest > 0.0 else first
    places = [first, deepest, 0.0, *(MILLIMETERS * guide.position for guide in scene.support.guides)]
    across = [values for _, values in shown]
    if scene.target.depth is not None:
        places.append(MILLIMETERS * scene.target.depth)
        across.append(np.array([unit * scene.target.lateral]))
    if len(run.path_position):
        across.append(unit * run.path_deflection)
    space = SPACE * (max(places) - min(places))
    least = LEAST_RANGE * unit * scene.needle.length
    return (min(places) - space, max(places) + space), limits_of(np.concatenate(across), least)


def draw_scenery(axes: Axes, strip: Axes, run: Trajectory, width: float) -> None:
    """Draw the axis, tissue, guides, target and cut path inside the limits; ``width`` of the axes [points], about."""
    scene, (unit, name) = run.scene, deflection_unit(run)
    draw_tissue(axes, strip, scene, width)
    axes.axhline(0.0, color=INK, linewidth=0.8, linestyle=(0, (6, 4)), zorder=1)
    for kind, places in guides_of(run).items():
        axes.plot(places, np.zeros(len(places)), **_point(*GUIDES[kind]), label=kind)
    if scene.support.kind == "entry":
        axes.plot([0.0], [0.0], **_point("s", COLORS[4]), label="clamp at the skin")
    if len(run.path_position):
        style: dict[str, Any] = {"color": PATH, "linestyle": (0, (1.5, 1.5)), "linewidth": 1.8, "zorder": 2.5}
        axes.plot(MILLIMETERS * run.path_position, unit * run.path_deflection, label="path that the tip cut", **style)
    draw_target(axes, run)
    axes.set(xlabel="place along the insertion axis y [mm], 0 at the skin", ylabel=f"deflection [{name}]")


def guides_of(run: Trajectory) -> dict[str, list[float]]:
    """Return the places of the guides [mm] by kind, of `GUIDES`."""
    found: dict[str, list[float]] = {}
    for guide in run.scene.support.guides:
        kind = RIGID if guide.stiffness == "rigid" else ON_A_SPRING
        found.setdefault(kind, []).append(MILLIMETERS * guide.position)
    return found


def draw_target(axes: Axes, run: Trajectory) -> None:
    """Draw where a closed loop is to bring the tip."""
    target = run.scene.target
    if target.depth is not None:
        place = ([MILLIMETERS * target.depth], [deflection_unit(run)[0] * target.lateral])
        axes.plot(*place, **_point("D", WANTED), label="target")


def _point(marker: str, color: str) -> dict[str, Any]:
    style = {"marker": marker, "markersize": 7, "color": color, "markeredgecolor": INK}
    return {**style, "linestyle": "none", "zorder": 4}


def draw_forces(axes: Axes, run: Trajectory, row: int, label: str) -> bool:
    """Draw an arrow, without scale, where a lateral force acts on the needle at a sample; return whether there is one."""
    along, across = placed(run, row)
    drawn = False
    for y, force in lateral_forces(run, row):
        if force:
            place = MILLIMETERS * y
            height = float(np.interp(place, along, across))
            side = -1.0 if force > 0.0 else 1.0
            arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": PATH, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 2}
            axes.annotate("", (place, height), (0.0, 30.0 * side), textcoords="offset points", arrowprops=arrow, zorder=5)
            axes.plot([], [], marker=r"$\uparrow$", color=PATH, linestyle="none", markersize=10, label="_" * drawn + label)
            drawn = True
    return drawn


def magnification(figure: Figure, axes: Axes, run: Trajectory) -> float:
    """Return by how much the figure stretches deflections more than lengths along the axis, once it is laid out."""
    figure.draw_without_rendering()
    (left, bottom), (right, top) = axes.transData.transform([(0.0, 0.0), (1.0, 1.0)])
    return float((top - bottom) / (right - left)) * deflection_unit(run)[0] / MILLIMETERS


def told(run: Trajectory, factor: float) -> str:
    """Return a magnification in words, or that nothing bends."""
    if largest_deflection(run) <= LEAST_RANGE * run.scene.needle.length:
        return "no deflection"
    return f"deflections magnified {factor:.2g} times" if factor < 99.5 else f"deflections magnified {factor:.0f} times"
