"""Runs of few samples in which something is to be seen, or nothing; computed once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from matplotlib.text import Text

from fem_needle import Trajectory, load_scene, run_scene, steer

FEW = {"numerics.elements": 8, "numerics.analysis": "static"}
LONG_TITLE = "A $long$ <b>title</b> " * 9
LONG_NAMES = [
    {"name": f"layer of $muscle_{number}$ & <fat>", "start": start, "end": start + 0.008, "foundation_modulus": 800.0}
    for number, start in enumerate(0.01 * count for count in range(10))
]
PUSHED = {"numerics.output_step": 1e-3, "numerics.analysis": "dynamic", "numerics.time_step": 1e-4}


def changes(name):
    """Return the shipped scene that a run starts from, and what is changed in it."""
    back = {"time": [0.0, 5.0, 8.0], "value": [0.02, 0.12, 0.05]}
    bevel = [{"kind": "tip", "bevel_coefficient": 3e-5}]
    return {
        "entry": ("thesis", {"numerics.output_step": 2.0}),
        "hub": ("brachytherapy", {"numerics.output_step": 0.5}),
        "hold": ("bench-s", {"numerics.output_step": 0.25}),
        "still": ("brachytherapy", {"numerics.output_step": 1.0, "loads": []}),
        "empty": ("brachytherapy", {"numerics.output_step": 1.0, "tissue.layers": [], "title": ""}),
        "thin": ("brachytherapy", {"numerics.output_step": 1.0, "tissue.layers": LONG_NAMES, "title": LONG_TITLE}),
        "back": ("thesis", {"numerics.output_step": 0.5, "insertion": {"kind": "profile", "depth": back}}),
        "tip spring": ("thesis", {"numerics.output_step": 2.0, "tissue": {"kind": "tip-spring", "tip_stiffness": 30.0}}),
        "cut path": (
            "brachytherapy",
            {
                "numerics.output_step": 1.0,
                "numerics.time_step": 0.1,
                "numerics.elements": 4,
                "numerics.analysis": "quasi-static",
                "tissue.rest_line": "cut-path",
                "insertion.initial_depth": 0.03,
                "loads": bevel,
            },
        ),
        "pushed": ("thesis-open-loop", PUSHED),
    }[name]


SOLVED = ("entry", "hub", "hold", "still", "empty", "thin", "back", "tip spring", "cut path", "pushed")
NAMES = (*SOLVED, "loop", "one sample", "interrupted")


@cache
def run_named(name: str) -> Trajectory:
    """Return one of `NAMES`."""
    if name == "loop":
        return steer(load_scene("steering").with_values({"numerics.elements": 8, "numerics.output_step": 0.5}))
    if name == "one sample":
        return cut_off(run_named("hub"), 1)
    if name == "interrupted":
        return cut_off(run_named("entry"), 5)
    scene, values = changes(name)
    return run_scene(load_scene(scene).with_values(FEW | values))


def cut_off(run: Trajectory, samples: int) -> Trajectory:
    """Return the first samples of a run, as one that was interrupted."""
    return replace(
        run,
        time=run.time[:samples],
        series={name: values[:samples] for name, values in run.series.items()},
        guide_force=run.guide_force[:samples],
        station_deflection=run.station_deflection[:samples],
        summary=run.summary | {"stop_reason": "interrupted"},
        plant=None,
        samples=None,
        lateral_force=run.lateral_force[:samples],
    )


def visible_texts(figure):
    """Return the texts of a drawn figure that are seen, with their boxes in pixels."""
    figure.draw_without_rendering()
    renderer, hidden = figure._get_renderer(), hidden_ticks(figure)
    found = [one for one in figure.findobj(Text) if one.get_visible() and one.get_text().strip() and id(one) not in hidden]
    boxes = [(one, one.get_window_extent(renderer)) for one in found]
    return [(one, box) for one, box in boxes if box.width > 0]


def hidden_ticks(figure):
    """Return the ids of labels of ticks that are not drawn."""
    hidden = set()
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        drawn = {id(tick) for tick in axis._update_ticks()}
        ticks = (*axis.get_major_ticks(), *axis.get_minor_ticks())
        hidden |= {id(label) for tick in ticks if id(tick) not in drawn for label in (tick.label1, tick.label2)}
    return hidden
