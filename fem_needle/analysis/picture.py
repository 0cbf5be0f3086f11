"""The picture of an analysis: gains of the tip over the depth with their zeros, and the lowest undamped natural frequencies."""

from __future__ import annotations

from math import pi

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fem_needle.analysis.depth_gains import DepthGains
from fem_needle.analysis.study import Analysis
from fem_needle.pictures import COLORS, INK, MARKERS, WIDTH, new_figure, png_bytes, shared_style, write_title

Array = NDArray[np.float64]

MILLIMETERS = 1e3
PANEL_HEIGHT = 2.3  # inches
WIDE = 20.0  # largest gain by the median one, from which a panel is linear around zero and logarithmic beyond
# By the unit of the input: what a gain is shown in, and how many of it 1 m per SI unit is.
SHOWN = {
    "N": ("tip per force [mm/N]", 1e3),
    "m": ("tip per travel [mm/mm]", 1.0),
    "rad": ("tip per angle [mm/deg]", 1e3 * pi / 180.0),
    "N m": ("tip per torque [mm/(N mm)]", 1.0),
}
LINES = ("-", (0, (6, 2)), (0, (2, 1.5)), "-.")


def analysis_picture(analysis: Analysis) -> bytes:
    """Return gains, a panel for each unit of inputs, and frequencies over the depth as PNG."""
    curve = analysis.curve
    units = [unit for unit in SHOWN if any(signal.unit == unit for signal in curve.inputs)]
    with shared_style():
        figure = new_figure(WIDTH, PANEL_HEIGHT * (len(units) + 1) + 0.4)
        panels = np.atleast_1d(figure.subplots(len(units) + 1, 1, sharex=True))
        for panel, unit in zip(panels, units, strict=False):
            _draw_gains(panel, curve, unit)
        _draw_frequencies(panels[-1], curve)
        write_title(figure, analysis.plant.scene.title)
        panels[0].set_title("Answer of the tip at rest, by input")
        panels[-1].set_xlabel("depth [mm]")
        for panel in panels:
            if panel.get_legend_handles_labels()[0]:
                panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)
        return png_bytes(figure)


def _draw_gains(panel: Axes, curve: DepthGains, unit: str) -> None:
    label, factor = SHOWN[unit]
    chosen = [index for index, signal in enumerate(curve.inputs) if signal.unit == unit]
    panel.axhline(0.0, color=INK, linewidth=1.0)
    for number, index in enumerate(chosen):
        name = curve.inputs[index].name
        zeros = [MILLIMETERS * change.depth for change in curve.sign_changes if change.input == name]
        places = "".join(f"\n0 at {zero:.4g} mm" for zero in zeros)
        color, line = COLORS[number % len(COLORS)], LINES[number % len(LINES)]
        text = f"{name.replace('_', ' ')}{places}"
        panel.plot(MILLIMETERS * curve.depths, factor * curve.gains[:, index], color=color, linestyle=line, label=text)
        marker = MARKERS[number % len(MARKERS)]
        panel.plot(zeros, np.zeros(len(zeros)), linestyle="none", marker=marker, color=color, markeredgecolor=INK, zorder=5)
    panel.set_ylabel(label)
    sizes = factor * np.abs(curve.gains[:, chosen])
    usual = float(np.median(sizes))
    if 0.0 < WIDE * usual < float(np.max(sizes)):  # large values beside the surface would hide the zeros
        panel.set_yscale("asinh", linear_width=usual)
        decades = 10.0 ** np.arange(np.ceil(np.log10(2.0 * usual)), np.floor(np.log10(np.max(sizes))) + 1)
        low, high = panel.get_ylim()
        ticks = [tick for tick in (*-decades[::-1], 0.0, *decades) if low <= tick <= high]
        panel.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        panel.set_yticks([], minor=True)


def _draw_frequencies(panel: Axes, curve: DepthGains) -> None:
    if not np.any(np.isfinite(curve.frequencies)):
        panel.text(0.5, 0.5, "no vibrations at a held depth", transform=panel.transAxes, ha="center")
        panel.set_yticks([])
        return
    for number, frequency in enumerate(curve.frequencies.T):
        if not np.any(np.isfinite(frequency)):
            continue
        label = f"{number + 1}. natural\nfrequency,\nundamped" if number == 0 else f"{number + 1}."
        line = LINES[number % len(LINES)]
        panel.plot(MILLIMETERS * curve.depths, frequency / (2 * pi), color=COLORS[number], linestyle=line, label=label)
    panel.set_yscale("log")
    panel.set_ylabel("undamped [Hz]")
