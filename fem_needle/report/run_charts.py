"""The curves of a run: the needle under a slider over time, courses, energies."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from fem_needle.closed_loop.units import shown_unit
from fem_needle.figures import courses, energies, shapes
from fem_needle.figures.common import MILLIMETERS, deflection_unit, placed, suited
from fem_needle.figures.course_figure import axial_forces
from fem_needle.figures.energy_figure import LEDGER, ledger_terms
from fem_needle.figures.scenery import ON_A_SPRING, RIGID, WANTED, guides_of, limits
from fem_needle.figures.tissue import bands_of
from fem_needle.layer_names import layer_key
from fem_needle.pictures import COLORS, INK, png_bytes
from fem_needle.report.charts import Curve, Panel, panels_figure, thinned
from fem_needle.report.numbers import duration, millimeters
from fem_needle.report.parts import Chart, Picture
from fem_needle.scene.steering import signal_description
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

MOST_FRAMES = 100  # positions of the slider, spread over the run
NEEDLE_HEIGHT = 380  # pixels
STATIONS = 101  # of the needle in a frame, at most
LETTER = 0.02  # width of a letter over that of the picture on a small screen
KEY_WIDTH = 1000  # characters: the browser breaks the lines
SYMBOLS = {RIGID: ("diamond", "white", "white diamonds"), ON_A_SPRING: ("pentagon", COLORS[5], "blue pentagons")}
TARGET = ("diamond", WANTED, "the purple diamond")
TIME = "time [s]"
COURSES = (
    "Courses over time; lateral forces act on the needle. Friction and cutting are drawn as their sizes against the motion, "
    "while the needle rests under a push what holds it; what they leave of the push is the needle's own axial force and inertia."
)


def needle_chart(run: Trajectory) -> Chart:
    """Return the needle in its tissue with a slider over time."""
    rows = thinned(len(run.time), MOST_FRAMES)
    figure = _needle_figure(run, rows)
    alternative = f"Shape of the needle at {len(rows)} times; at the end the tip is {_tip(run, -1)}."
    static = Picture("The needle at some depths.", f"Shapes of the needle in the tissue. {alternative}", png_bytes(shapes(run)))
    moments = tuple(f"{duration(float(run.time[row]))}: {_tip(run, int(row))}" for row in rows)
    return Chart("needle", _needle_caption(run), alternative, figure, static, moments, len(rows) - 1)


def _tip(run: Trajectory, row: int) -> str:
    """Return where the tip is at a sample, in words."""
    depth, tip = float(run.depth[row]), float(run.tip_deflection[row])
    return f"{millimeters(depth)} deep, deflected by {millimeters(tip)}"


def _needle_figure(run: Trajectory, rows: NDArray[np.intp]) -> go.Figure:
    lines = [placed(run, int(row)) for row in rows]
    (low, high), across = limits(run, rows)
    straight = {"color": INK, "width": 1, "dash": "dash"}
    axis = go.Scatter(x=[low, high], y=[0.0, 0.0], mode="lines", line=straight, hoverinfo="skip", showlegend=False)
    figure = panels_figure([Panel(f"deflection [{deflection_unit(run)[1]}]", ())], "place along the axis [mm]")
    figure.add_traces([axis, _needle_line(*lines[-1]), *_points(run)])
    figure.frames = [
        go.Frame(data=[_needle_line(*line)], traces=[1], name=str(index)) for index, line in enumerate(lines)
    ]
    figure.update_layout(
        height=NEEDLE_HEIGHT, showlegend=False, shapes=_blocks(run, low, high), annotations=_names(run, low, high),
        margin={"l": 10, "r": 40, "t": 40, "b": 10},
    )  # fmt: skip
    figure.update_xaxes(range=[low, high])
    figure.update_yaxes(range=list(across))
    return figure


def _needle_line(along: Array, across: Array) -> go.Scatter:
    chosen = thinned(len(along), STATIONS)
    return go.Scatter(x=along[chosen], y=across[chosen], mode="lines", line={"color": COLORS[0], "width": 4}, name="needle")


def _blocks(run: Trajectory, low: float, high: float) -> list[dict[str, Any]]:
    """Return the layers as blocks behind the needle."""
    style: dict[str, Any] = {"type": "rect", "xref": "x", "yref": "paper", "y0": 0, "y1": 1, "layer": "below"}
    return [
        style | {"x0": band.start, "x1": band.end, "fillcolor": band.shade, "line": {"width": 0}}
        for band in bands_of(run.scene, low, high)
    ]


def _names(run: Trajectory, low: float, high: float) -> list[dict[str, Any]]:
    """Return the layers' names above them, or their numbers where one would not fit; of very many thin ones, some have none."""
    bands, short = bands_of(run.scene, low, high), _numbered(run, low, high)
    place: dict[str, Any] = {"yref": "paper", "y": 1.0, "yanchor": "bottom", "showarrow": False, "font": {"size": 12}}
    texts = [str(band.number) if short else band.text for band in bands]
    return [
        place | {"x": (band.start + band.end) / 2.0, "text": escape(text)}
        for band, text in zip(bands, texts, strict=True)
        if not short or band.end - band.start >= len(text) * LETTER * (high - low)
    ]


def _numbered(run: Trajectory, low: float, high: float) -> bool:
    """Return whether the name of a layer is longer than the layer between two places [mm]."""
    return any(band.end - band.start < len(band.text) * LETTER * (high - low) for band in bands_of(run.scene, low, high))


def _points(run: Trajectory) -> list[go.Scatter]:
    """Return the guides and the target of a loop."""
    target = run.scene.target
    points = [_point(*SYMBOLS[kind][:2], kind, places, [0.0] * len(places)) for kind, places in guides_of(run).items()]
    if target.depth is not None:
        points.append(_point(*TARGET[:2], "target", [MILLIMETERS * target.depth], [deflection_unit(run)[0] * target.lateral]))
    return points


def _point(symbol: str, color: str, name: str, along: list[float], across: list[float]) -> go.Scatter:
    marker = {"symbol": symbol, "color": color, "size": 11, "line": {"color": INK, "width": 1}}
    return go.Scatter(x=along, y=across, mode="markers", marker=marker, name=name)


def _needle_caption(run: Trajectory) -> str:
    """Return what is drawn, what its symbols are, and the key of layers that are numbered."""
    parts = ["The needle in the tissue, the skin at 0; deflections have a scale of their own."]
    symbols = [f"{SYMBOLS[kind][2]}: {kind.replace('guide', 'guides')}" for kind in guides_of(run)]
    symbols += [f"{TARGET[2]}: target"] if run.scene.target.depth is not None else []
    if symbols:
        told = "; ".join(symbols)
        parts.append(f"{told[0].upper()}{told[1:]}.")
    (low, high), _ = limits(run, thinned(len(run.time), MOST_FRAMES))
    if _numbered(run, low, high):
        parts.append(f"{layer_key((band.note for band in bands_of(run.scene, low, high)), KEY_WIDTH)}.")
    return " ".join(parts)


def course_chart(run: Trajectory) -> Chart:
    """Return tip, depth, forces and the commands of a loop over time."""
    unit, name = deflection_unit(run)
    panels = [
        Panel(f"tip [{name}]", (_over_time(run, "tip deflection", unit * run.tip_deflection),)),
        Panel("depth [mm]", (_over_time(run, "depth", MILLIMETERS * run.depth),)),
        _suited(run, "axial force", "N", axial_forces(run)),
        _suited(run, "lateral force", "N", _lateral(run)),
        *_commands(run),
    ]
    largest = float(np.nanmax(np.abs(run.tip_deflection), initial=0.0))
    about = f"Tip deflection, depth, axial and lateral forces over time; the tip deflects by up to {millimeters(largest)}."
    return Chart("courses", COURSES, about, panels_figure(panels, TIME), Picture(COURSES, about, png_bytes(courses(run))))


def _over_time(run: Trajectory, name: str, values: Array) -> Curve:
    return Curve(name, run.time, values)


def _suited(run: Trajectory, label: str, unit: str, found: dict[str, Array]) -> Panel:
    size, shown = suited(found.values(), unit, 0.05)
    return Panel(f"{label} [{shown}]", tuple(_over_time(run, name, values / size) for name, values in found.items()))


def _lateral(run: Trajectory) -> dict[str, Array]:
    clamp = "hub" if run.scene.support.kind == "hub" else "clamp"
    guides = {f"guide {index + 1}": run.guide_force[:, index] for index in range(run.guide_force.shape[1])}
    return {"tissue": run.tissue_force, clamp: run.hub_force} | guides


def _commands(run: Trajectory) -> list[Panel]:
    panels = []
    for name, values in run.signals.items():
        if name.startswith("command_"):
            size, shown = shown_unit(signal_description(name)[0])
            words = name.removeprefix("command_").replace("_", " ")
            unit = "" if shown == "1" else f" [{shown}]"
            panels.append(Panel(f"{words}{unit}", (_over_time(run, f"command: {words}", values / size),)))
    return panels


def energy_chart(run: Trajectory) -> Chart:
    """Return stored energies, works and residuals over time; terms that are zero throughout have no curve."""
    panels = []
    for title, names in LEDGER:
        known = {names[name]: values for name, values in ledger_terms(run, title, names).items()}
        drawn = {short: values for short, values in known.items() if np.any(np.nan_to_num(values))}
        if drawn:
            panels.append(_suited(run, title.lower(), "J", drawn))
    about = "Stored energies, works since the start and residuals of the balances over time."
    static = Picture(about, about, png_bytes(energies(run)))
    return Chart("energies", about, about, panels_figure(panels or [Panel("energy [J]", ())], TIME), static)
