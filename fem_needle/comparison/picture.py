"""The picture of a comparison: shapes at depths, the tip's error at rest over the depth, the tip and the energies in the run."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from fem_needle.comparison.result import Comparison
from fem_needle.comparison.runs import ENERGIES
from fem_needle.pictures import COLORS, INK, MARKERS, new_figure, png_bytes, shared_style, write_title

Array = NDArray[np.float64]

MILLIMETERS = 1e3
WIDTH, ROW_HEIGHT = 10.0, 3.3  # inches
TRUTH = "#b0b0b0"
TRUTH_WIDTH, ENERGY_WIDTH = 5.0, 4.0
CUT = 3.0  # times the reference's largest value: a panel shows no more
DASHES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)), (0, (3, 3)), (0, (8, 2)))
ENERGY_COLORS = COLORS[3:6]  # none of those of the first three models
SMALLEST = 1e-12  # error that is still drawn


def comparison_picture(comparison: Comparison) -> bytes:
    """Return the picture of a comparison as PNG: what is at rest in the first row, the run, where there is one, in the second."""
    rest, moves = comparison.load is not None, comparison.reference.run is not None
    with shared_style():
        panels = 2 * (rest + moves) if rest else 3
        figure = new_figure(WIDTH, ROW_HEIGHT * (1 + (panels > 2)) + 0.6)
        grid = figure.add_gridspec((panels + 1) // 2, 2)
        axes = [figure.add_subplot(grid[number // 2, number % 2]) for number in range(panels - panels % 2)]
        if panels % 2:
            axes.append(figure.add_subplot(grid[-1, :]))
        _draw_shapes(axes[0], comparison)
        if rest:
            _draw_errors(axes[1], comparison)
        if moves:
            _draw_tips(axes[-2], comparison)
            _draw_energies(axes[-1], comparison)
        _legend(figure, comparison)
        write_title(figure, comparison.scene.title)
        return png_bytes(figure)


def _legend(figure: Figure, comparison: Comparison) -> None:
    """Name the models below all panels."""
    truth = Line2D([], [], color=TRUTH, linewidth=TRUTH_WIDTH, label=f"{comparison.reference.label} (reference)")
    lines = [truth, *(Line2D([], [], label=model.answer.label, **_style(i)) for i, model in enumerate(comparison.models))]
    figure.legend(handles=lines, loc="outside lower center", ncols=min(len(lines), 6), frameon=False)


def _style(index: int) -> dict[str, Any]:
    return {"color": COLORS[index % len(COLORS)], "linestyle": DASHES[(index + 1) % len(DASHES)]}


def _draw_shapes(axes: Axes, comparison: Comparison) -> None:
    """Draw needles in place; a dot where the reference's tip is."""
    shapes = comparison.shapes
    for shape in shapes:
        truth, *others = MILLIMETERS * shape.deflections
        along = MILLIMETERS * shape.position
        axes.plot(along, truth, color=TRUTH, linewidth=TRUTH_WIDTH, solid_capstyle="round", zorder=2)
        axes.plot(along[-1:], truth[-1:], marker="o", color=INK, markersize=5, zorder=4)
        for index, deflection in enumerate(others):
            axes.plot(along, deflection, zorder=3, **_style(index))
    depths = ", ".join(f"{MILLIMETERS * shape.depth:.4g}" for shape in shapes)
    state = "at rest" if all(shape.at_rest for shape in shapes) else "in the run"
    if comparison.scene.support.kind == "entry":
        axes.set_xlim(left=-0.03 * MILLIMETERS * max(shape.depth for shape in shapes))
    axes.axvline(0.0, color=INK, linewidth=0.8, zorder=1)
    axes.set(xlabel="y [mm], 0 at the skin", ylabel="deflection [mm]")
    axes.set_title(f"Needles {state}, depth {depths} mm", loc="left")


def _draw_errors(axes: Axes, comparison: Comparison) -> None:
    """Draw |tip error| at rest over the depth, and the error of the range."""
    drawn = False
    for index, model in enumerate(comparison.models):
        curve, states = model.curve, model.answer.curve
        if curve is None or states is None:
            continue
        errors = np.abs(curve.tip)
        shown = np.where(np.isfinite(errors) & (errors > SMALLEST), errors, np.nan)
        axes.plot(MILLIMETERS * states.depths, 100 * shown, **_style(index))
        if np.isfinite(shown).any():
            drawn = True
        else:
            axes.set_xlim(MILLIMETERS * states.depths[0], MILLIMETERS * states.depths[-1])
        chosen = np.array([] if model.chosen is None else np.abs(model.chosen.tip))
        places = MILLIMETERS * np.array(comparison.depths)
        marker = MARKERS[index % len(MARKERS)]
        dots = chosen > SMALLEST
        axes.plot(places[dots], 100 * chosen[dots], marker=marker, color=COLORS[index % len(COLORS)], linestyle="none")
    axes.axhline(100 * comparison.within, color=INK, linewidth=1.2, linestyle=":")
    if not drawn:
        axes.text(0.5, 0.75, "no error to show", transform=axes.transAxes, ha="center")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    axes.set(xlabel="depth [mm]", ylabel="|tip error| [%]")
    axes.set_title(f"Tip error at rest; dotted: {100 * comparison.within:g} %", loc="left")


def _draw_tips(axes: Axes, comparison: Comparison) -> None:
    runs = [answer.run.run for answer in comparison.answers if answer.run is not None]
    for index, run in enumerate(runs):
        style: dict[str, Any] = _style(index - 1) if index else {"color": TRUTH, "linewidth": TRUTH_WIDTH}
        axes.plot(run.time, MILLIMETERS * run.tip_deflection, **style)
    axes.set(xlabel="time [s]", ylabel="tip [mm]")
    cut = _cut(axes, [run.tip_deflection for run in runs])
    axes.set_title(f"Tip in the run ({comparison.analysis}){cut}", loc="left")


def _draw_energies(axes: Axes, comparison: Comparison) -> None:
    """Draw each energy over the depth, or over the time of a needle that is held: a color for each energy, the model's dashes."""
    runs = [answer.run.run for answer in comparison.answers if answer.run is not None]
    held = float(np.ptp(runs[0].depth)) == 0.0
    for index, run in enumerate(runs):
        places = run.time if held else MILLIMETERS * run.depth
        for color, name in zip(ENERGY_COLORS, ENERGIES, strict=True):
            style: dict[str, Any] = {"linewidth": 1.4} if index else {"linewidth": ENERGY_WIDTH, "alpha": 0.45}
            axes.plot(places, MILLIMETERS * run.series[name], color=color, linestyle=DASHES[index % len(DASHES)], **style)
    lines = [
        Line2D([], [], color=color, linewidth=ENERGY_WIDTH, label=name.removesuffix("_energy"))
        for color, name in zip(ENERGY_COLORS, ENERGIES, strict=True)
    ]
    place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}
    axes.legend(handles=lines, ncols=3, frameon=False, fontsize=9, handlelength=1.4, columnspacing=1.2, **place)
    axes.set(xlabel="time [s]" if held else "depth [mm]", ylabel="energy [mJ]")
    cut = _cut(axes, [np.concatenate([run.series[name] for name in ENERGIES]) for run in runs])
    axes.set_title(f"Energies{cut}", loc="left")


def _cut(axes: Axes, values: list[Array]) -> str:
    """Cut a panel where a model leaves the reference far behind, and return what to say of it."""
    largest, *others = (float(np.max(np.abs(MILLIMETERS * one))) for one in values)
    if not largest or max(others) <= CUT * largest:
        return ""
    lowest, highest = (float(bound) for bound in axes.get_ylim())
    axes.set_ylim(max(lowest, -CUT * largest), min(highest, CUT * largest))
    return f"; cut at {CUT:g} x reference"
