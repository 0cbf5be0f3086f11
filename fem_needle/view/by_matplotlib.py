"""A drawing by matplotlib, where VTK finds no GL."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from fem_needle.pictures import INK, png_bytes, shared_style
from fem_needle.view.drawing import Drawing

Array = NDArray[np.float64]

SIZE = (11.0, 6.3)  # inches


def picture(drawn: Drawing) -> bytes:
    """Return a PNG."""
    with shared_style():
        figure = Figure(figsize=SIZE)
        axes: Any = figure.add_axes((0.0, 0.06, 1.0, 0.86), projection="3d")
        for part in drawn.parts:
            points = _turned(part.surface.points)
            corners = points[part.surface.triangles]
            faces = Poly3DCollection(corners, facecolor=part.color, alpha=part.opacity, linewidth=0.0, clip_on=False)
            axes.add_collection3d(faces)
        for color, points in drawn.lines:
            axes.plot(*_turned(points).T, color=color, linewidth=1.0, clip_on=False)
        for label in drawn.labels:
            axes.text(*_turned(np.array([label.place]))[0], label.text, ha="center", fontsize=9, color=INK)
        _frame(axes, _turned(drawn.corners()))
        for number, (name, color) in enumerate(drawn.legend):
            figure.text(0.78, 0.9 - 0.035 * number, f"\u25a0 {name}", color=color, fontsize=9)
        figure.suptitle(drawn.title, x=0.02, ha="left")
        figure.text(0.02, 0.015, drawn.caption, ha="left", va="bottom", fontsize=9)
        return png_bytes(figure)


def _turned(points: Array) -> Array:
    """Return points with matplotlib's third axis up: x, -z, y of the drawing."""
    return np.column_stack((points[:, 0], -points[:, 2], points[:, 1]))


def _frame(axes: Any, points: Array) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, span = (low + high) / 2.0, np.maximum(high - low, 0.1 * np.max(high - low))
    axes.set(
        xlim=(middle[0] - span[0] / 2, middle[0] + span[0] / 2),
        ylim=(middle[1] - span[1] / 2, middle[1] + span[1] / 2),
        zlim=(middle[2] - span[2] / 2, middle[2] + span[2] / 2),
    )
    axes.set_box_aspect(tuple(span), zoom=1.55)
    axes.set_axis_off()
    axes.view_init(elev=18, azim=-72)
