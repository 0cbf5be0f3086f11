"""Draw the pictures of README and conventions: ``python docs/pictures/make_pictures.py`` writes them beside this file."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_needle import Scene, TipLoad, load_scene, run_scene
from fem_needle.figures import picture_bytes, shapes, waterfall

FOLDER = Path(__file__).parent
SHOWN_DEPTHS = (0.015, 0.04, 0.06, 0.08, 0.1)  # m
BEVEL = TipLoad(bevel_coefficient=1.5e-5)  # m^2: a bevel that nobody steers; slopes stay below 0.2
SHADES = ("#f4e3d2", "#e6bfa8")
INK = "#303030"


def main() -> None:
    """Write every picture."""
    mpl.use("Agg")
    run = run_scene(beveled_scene(), analysis="quasi-static", elements=32, time_step=0.05)
    for name, figure in (("needle_shapes.png", shapes(run, SHOWN_DEPTHS)), ("needle_waterfall.png", waterfall(run))):
        (FOLDER / name).write_bytes(picture_bytes(figure))
    signs().savefig(FOLDER / "signs.png", dpi=130, metadata={"Software": None})


def beveled_scene() -> Scene:
    """Return the shipped brachytherapy scene with a beveled tip."""
    scene = load_scene("brachytherapy")
    bevel = {"kind": "tip", "bevel_coefficient": BEVEL.bevel_coefficient}
    cut = {"tissue.rest_line": "cut-path", "numerics.output_step": 0.1}
    return scene.with_values({"loads": [*scene.to_dict()["loads"], bevel], **cut})


def signs() -> Figure:
    """Draw frames, symbols and signs; no scale."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-8.0, 8.4), ylim=(-3.3, 3.6))
    axes.axis("off")
    axes.axvspan(0.0, 2.6, ymax=0.86, color=SHADES[0], zorder=0)
    axes.axvspan(2.6, 8.4, ymax=0.86, color=SHADES[1], zorder=0)
    _draw_supports(axes)
    _draw_forces(axes)
    _draw_lengths(axes)
    return figure


def _shape(y: np.ndarray) -> np.ndarray:
    """Return a deflection that looks like one: clamped at -6, held at -2."""
    return 0.0034 * (y + 6.0) ** 2 * (y + 2.0) * 0.55


def _draw_supports(axes: Axes) -> None:
    y = np.linspace(-6.0, 5.6, 200)
    axes.plot([-7.6, 8.2], [0.0, 0.0], color=INK, linewidth=0.8, linestyle=(0, (6, 4)))
    axes.plot(y, _shape(y), color="#1f5fa8", linewidth=3.0, zorder=3)
    axes.fill([-6.5, -6.0, -6.0, -6.5], [-0.5, -0.5, 0.5, 0.5], color=INK)
    axes.text(-6.25, 0.65, "hub", ha="center")
    for side in (-1.0, 1.0):
        axes.fill([-2.2, -2.0, -1.8], [0.42 * side, 0.1 * side, 0.42 * side], color=INK, zorder=4)
    axes.text(-2.0, 0.55, "template", ha="center")
    axes.plot([0.0, 0.0], [-3.2, 2.62], color=INK, linewidth=1.6)
    axes.text(0.0, 2.75, "skin, y = 0", ha="center")
    axes.text(1.35, 2.25, "layer 0", ha="center")
    axes.text(4.2, 2.25, "layer 1", ha="center")


def _draw_forces(axes: Axes) -> None:
    tip = float(_shape(np.array(5.6)))
    _arrow(axes, (-7.7, 0.0), (-6.5, 0.0), "#b03030")
    axes.text(-7.65, 0.2, "push > 0", color="#b03030", ha="left", va="bottom", fontsize=9)
    _arrow(axes, (5.6, tip), (5.6, tip + 0.75), "#b03030")
    axes.text(5.75, tip + 0.35, "tip force F > 0", color="#b03030", va="center")
    _arrow(axes, (3.5, float(_shape(np.array(3.5)))), (3.5, -0.35), "#2e7d32")
    axes.text(3.5, -0.5, "tissue on needle, $-k\\,w$", color="#2e7d32", ha="center", va="top")
    _arrow(axes, (7.3, 0.0), (7.3, 1.3), INK)
    axes.text(7.45, 0.65, "w > 0", va="center")
    _arrow(axes, (-5.6, 2.9), (-4.0, 2.9), INK)
    axes.text(-3.85, 2.9, "speed v > 0", va="center")


def _draw_lengths(axes: Axes) -> None:
    spans = (
        ((-6.0, 0.0), -1.5, "d = l - z, outside"),
        ((0.0, 5.6), -1.5, "depth z, inside"),
        ((-6.0, 5.6), -2.7, "arc length s, 0 at the hub to l at the tip"),
    )
    for (start, end), height, name in spans:
        axes.annotate("", (end, height), (start, height), arrowprops={"arrowstyle": "<->", "color": INK})
        middle = (start + min(end, 0.0)) / 2 if start < 0.0 else (start + end) / 2  # not across the skin
        axes.text(middle, height + 0.1, name, ha="center", va="bottom")
    for place in (-6.0, 5.6):
        axes.plot([place, place], [-2.9, -0.6 if place < 0 else 0.9], color=INK, linewidth=0.6, linestyle=":")
    _arrow(axes, (6.2, -1.5), (8.0, -1.5), INK)
    axes.text(7.1, -1.4, "y > 0", ha="center", va="bottom")


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], color: str) -> None:
    style = {"arrowstyle": "-|>", "color": color, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=style, zorder=5)


if __name__ == "__main__":
    main()
