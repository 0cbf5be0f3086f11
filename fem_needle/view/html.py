"""A run as one HTML page that needs no network: it turns under the mouse, a slider over time moves the needle."""

from __future__ import annotations

from html import escape
from math import ceil, log10
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import plotly.io

from fem_needle.atomic_file import write_file
from fem_needle.pictures import INK
from fem_needle.view.arrangement import Arrangement, Pose
from fem_needle.view.drawing import Part, layer_labels, lines, moving_parts, ruler_labels, still_parts, title_of

WIDTH = 3.6  # of the scene, which then takes 1.3 times the height of the window; a narrow one makes it smaller
SCRIPT = """
const view = document.getElementById("{plot_id}"), ratio = view.layout.scene.aspectratio;
const shrink = Math.min(1, 0.67 * view.clientWidth / view.clientHeight);
Plotly.relayout(view, {"scene.aspectratio": {x: shrink * ratio.x, y: shrink * ratio.y, z: shrink * ratio.z}});
for (const box of document.querySelectorAll("#key input"))
  box.addEventListener("change", () => Plotly.restyle(view, {visible: box.checked}, [Number(box.value)]));
"""
MARGIN = 0.02
MOST_FRAMES = 60  # samples in a page, spread over the run: each takes some 25 kB
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
html, body {{ height: 100%; margin: 0; font: 15px/1.4 system-ui, sans-serif; color: #303030; background: #fff; }}
body {{ display: flex; flex-direction: column; }}
header {{ padding: 10px 16px 0; }}
h1 {{ font-size: 18px; margin: 0 0 2px; }}
p {{ margin: 0; }}
#key {{ list-style: none; display: flex; flex-wrap: wrap; gap: 0 14px; margin: 4px 0 0; padding: 0; font-size: 13px; }}
#key i {{ display: inline-block; width: 12px; height: 12px; margin-right: 4px; border: 1px solid #777; vertical-align: -1px; }}
main {{ flex: 1; min-height: 420px; }}
main > div {{ width: 100%; height: 100%; }}
</style>
</head>
<body>
<header><h1>{title}</h1><p>{note}. Drag to turn, scroll to zoom.</p>
<ul id="key">{key}</ul></header>
<main>{figure}</main>
</body>
</html>
"""


def write_html(arranged: Arrangement, path: Path, row: int | None = None) -> int:
    """Write the page and return how many of the run's samples are in it.

    Parameters
    ----------
    arranged
        The run.
    path
        File.
    row
        Sample that the page shows first; the last one by default.

    Raises
    ------
    ComputationError
        If the file cannot be written.
    """
    rows = shown_rows(len(arranged.run.time), row)
    write_file(path, html_page(arranged, row).encode())
    return len(rows)


def html_page(arranged: Arrangement, row: int | None = None) -> str:
    """Return the page, plotly.js inside."""
    rows = shown_rows(len(arranged.run.time), row)
    first = rows.index(len(arranged.run.time) - 1 if row is None else row)
    shown = plotly.io.to_html(
        _figure(arranged, rows, first), full_html=False, include_plotlyjs=True, auto_play=False, div_id="view",
        config={"displaylogo": False, "responsive": True}, default_height="100%",
        post_script=SCRIPT,
    )  # fmt: skip
    samples = len(arranged.run.time)
    note = f"{arranged.note[0].upper()}{arranged.note[1:]}; {len(rows)} of {samples} samples"
    return PAGE.format(title=escape(title_of(arranged)), note=escape(note), key=_key(arranged, row), figure=shown)


def _key(arranged: Arrangement, row: int | None) -> str:
    """Return the list of what is drawn; a box that is not checked hides it."""
    still, moving = _shown_parts(arranged), moving_parts(arranged.pose(-1 if row is None else row))
    first = len(still) + len(lines(arranged))  # as the traces of the figure are numbered
    numbers = (*range(len(still)), *range(first, first + len(moving)))
    item = '<li><label><input type="checkbox" checked value="{}"><i style="background: {}"></i>{}</label></li>'
    parts = zip(numbers, (*still, *moving), strict=True)
    return "\n".join(item.format(number, part.color, escape(part.name)) for number, part in parts)


def _shown_parts(arranged: Arrangement) -> list[Part]:
    return [part for part in still_parts(arranged) if len(part.surface.triangles)]


def shown_rows(samples: int, row: int | None = None) -> list[int]:
    """Return the samples of a page: all, or as many as it may have, the wanted one among them."""
    wanted = samples - 1 if row is None else row
    spread = np.linspace(0, samples - 1, min(samples, MOST_FRAMES)).round().astype(int)
    return sorted({*spread.tolist(), wanted})


def _figure(arranged: Arrangement, rows: list[int], first: int) -> go.Figure:
    still = [_mesh(part) for part in _shown_parts(arranged)]
    still += [_line(color, points) for color, points in lines(arranged)]
    poses = [arranged.pose(row) for row in rows]
    shown = [_mesh(part) for part in moving_parts(poses[first])]
    numbers = list(range(len(still), len(still) + len(shown)))
    frames = [
        go.Frame(data=_moved(pose), traces=numbers, name=str(row), layout={"title": {"text": escape(pose.caption)}})
        for row, pose in zip(rows, poses, strict=True)
    ]
    figure = go.Figure(data=[*still, *shown], frames=frames)
    figure.update_layout(
        title={"text": escape(poses[first].caption), "x": 0.01, "xanchor": "left", "font": {"size": 15}},
        font={"color": INK}, margin={"l": 0, "r": 0, "t": 40, "b": 0}, showlegend=False, uirevision="view",
        modebar={"orientation": "v"},
        scene=_scene(arranged, poses), sliders=[_slider(arranged, rows, first)] if len(rows) > 1 else [],
    )  # fmt: skip
    return figure


def _moved(pose: Pose) -> list[go.Mesh3d]:
    """Return the meshes of a frame; the needle's triangles stay what they are."""
    needle, *arrows = moving_parts(pose)
    points = needle.surface.points.astype(np.float32)
    return [go.Mesh3d(x=points[:, 0], y=points[:, 1], z=points[:, 2]), *(_mesh(part) for part in arrows)]


def _mesh(part: Part) -> go.Mesh3d:
    points, triangles = part.surface.points.astype(np.float32), part.surface.triangles.astype(np.int32)
    return go.Mesh3d(
        x=points[:, 0], y=points[:, 1], z=points[:, 2], i=triangles[:, 0], j=triangles[:, 1], k=triangles[:, 2],
        color=part.color, opacity=part.opacity, name=escape(part.name), hoverinfo="name",
        flatshading=part.opacity < 1.0, lighting={"ambient": 0.7, "specular": 0.1},
    )  # fmt: skip


def _line(color: str, points: Any) -> go.Scatter3d:
    return go.Scatter3d(
        x=points[:, 0], y=points[:, 1], z=points[:, 2], mode="lines", line={"color": color, "width": 3}, showlegend=False,
        hoverinfo="skip",
    )  # fmt: skip


def _scene(arranged: Arrangement, poses: list[Pose]) -> dict[str, Any]:
    """Return axes that show everything at all samples, the same scale on each, and the texts."""
    labels = (*layer_labels(arranged, numbered=True), *ruler_labels(arranged))
    surfaces = [part.surface for part in still_parts(arranged)]
    surfaces += [part.surface for pose in poses for part in moving_parts(pose)]
    points = np.concatenate([*(surface.points for surface in surfaces), np.array([label.place for label in labels])])
    margin = MARGIN * (points.max(axis=0) - points.min(axis=0))
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    axes = {
        f"{name}axis": {"visible": False, "range": [float(low[number]), float(high[number])]} for number, name in enumerate("xyz")
    }
    texts = [
        dict(zip("xyz", label.place, strict=True)) | {"text": escape(label.text), "showarrow": False, "font": {"size": 12}}
        for label in labels
    ]
    ratio = WIDTH * (high - low) / (high[0] - low[0])
    eye = {"x": 0.3, "y": 0.35, "z": 1.1}
    return axes | {
        "aspectmode": "manual",
        "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True)),
        "annotations": texts,
        "dragmode": "orbit",
        "camera": {"up": {"x": 0, "y": 1, "z": 0}, "eye": eye, "projection": {"type": "orthographic"}},
    }


def _slider(arranged: Arrangement, rows: list[int], first: int) -> dict[str, Any]:
    at_once = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
    steps = [
        {"method": "animate", "args": [[str(row)], at_once], "label": label}
        for row, label in zip(rows, _times(arranged, rows), strict=True)
    ]
    return {
        "active": first, "steps": steps, "currentvalue": {"prefix": "time ", "suffix": " s"}, "pad": {"l": 20, "r": 20, "b": 15},
        "len": 0.9, "x": 0.05,
    }  # fmt: skip


def _times(arranged: Arrangement, rows: list[int]) -> list[str]:
    """Return the times [s] at the slider with no more digits than tell its samples apart; the caption tells them in full."""
    times = arranged.run.time[rows]
    spacing = float(times[-1] - times[0]) / (len(rows) - 1)
    digits = ceil(-log10(spacing)) if spacing > 0.0 else 0
    return [f"{round(float(time), digits) + 0.0:.6g}" for time in times]
