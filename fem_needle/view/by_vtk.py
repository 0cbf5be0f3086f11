"""A drawing by VTK: a picture off the screen, or a window with a slider over time."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pyvista as pv

from fem_needle.pictures import INK
from fem_needle.view.arrangement import Arrangement
from fem_needle.view.drawing import Drawing, Part, drawing, moving_parts, told
from fem_needle.view.solids import Surface

SIZE = (1400, 700)
TEXT = 11


def render(drawn: Drawing, window: str) -> tuple[int, int, bytes]:
    """Return width, height and pixels of a picture drawn off the screen; may end the process where VTK finds no GL."""
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = window
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # VTK's warnings: what counts is whether there is a picture
    plotter = pv.Plotter(off_screen=True, window_size=list(SIZE))
    _fill(plotter, drawn)
    image = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    return image.shape[1], image.shape[0], image.tobytes()


def show(arranged: Arrangement, row: int) -> None:
    """Open a window on the display; its slider moves the needle."""
    plotter: Any = pv.Plotter(window_size=list(SIZE), title="fem-needle view")
    _fill(plotter, drawing(arranged, row))

    def move(time: float) -> None:
        pose = arranged.pose(arranged.row(time))
        for part in moving_parts(pose):
            plotter.remove_actor(part.name, reset_camera=False)
            if len(part.surface.triangles):
                _add(plotter, part)
        _write(plotter, told(arranged, pose), (0.02, 0.03), name="caption")

    times = arranged.run.time
    if len(times) > 1:
        plotter.add_slider_widget(
            move, [float(times[0]), float(times[-1])], value=float(times[row]), title="time [s]", pointa=(0.62, 0.12),
            pointb=(0.95, 0.12), color=INK, slider_width=0.02, tube_width=0.004, fmt="{:.4g}",
        )  # fmt: skip
    plotter.show()


def _fill(plotter: Any, drawn: Drawing) -> None:
    """Add everything to an empty scene."""
    plotter.set_background("white")
    for part in drawn.parts:
        _add(plotter, part)
    for color, points in drawn.lines:
        plotter.add_mesh(pv.MultipleLines(points), color=color, line_width=2)
    for label in drawn.labels:  # one by one: VTK leaves out those that it thinks too near to others
        plotter.add_point_labels(
            np.array([label.place]), [label.text], font_size=17, text_color=INK, bold=False, shape=None, show_points=False,
            always_visible=True, justification_horizontal="center", justification_vertical="center",
        )  # fmt: skip
    _write(plotter, drawn.title, (0.02, 0.94), size=TEXT + 2)
    _write(plotter, drawn.caption, (0.02, 0.03), name="caption")
    for number, (name, color) in enumerate(drawn.legend):
        _write(plotter, name, (0.02, 0.88 - 0.04 * number), size=TEXT - 2, color=color)
    plotter.enable_parallel_projection()
    plotter.view_vector((0.28, 0.32, 1.0), viewup=(0.0, 1.0, 0.0))
    plotter.camera.zoom(1.55)


def _write(plotter: Any, text: str, place: tuple[float, float], *, size: int = TEXT, color: str = INK, name: str = "") -> None:
    plotter.add_text(text, position=place, viewport=True, font_size=size, color=color, name=f"text {name or text}")


def _add(plotter: Any, part: Part) -> None:
    solid = part.opacity == 1.0
    plotter.add_mesh(
        _poly_data(part.surface), color=part.color, opacity=part.opacity, smooth_shading=solid, name=part.name, ambient=0.35,
        reset_camera=False,
    )  # fmt: skip


def _poly_data(surface: Surface) -> Any:
    faces: Any = surface.triangles
    return pv.PolyData.from_regular_faces(surface.points, faces)
