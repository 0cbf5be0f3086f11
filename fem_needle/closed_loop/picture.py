"""The picture of a closed loop: the tip and its target, the commands, the error; over the depth, or over the time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fem_needle.closed_loop.units import shown_unit
from fem_needle.pictures import COLORS, INK, new_figure, png_bytes, shared_style, write_title
from fem_needle.scene import Scene
from fem_needle.scene.signals import INPUT_UNITS
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

MILLIMETERS = 1e3
WIDTH, PANEL_HEIGHT = 8.0, 2.5  # inches
TIP, SEEN, COMMAND, WANTED = COLORS[0], COLORS[1], COLORS[2], COLORS[3]
AXIAL = ("push_force", "speed")  # inputs that steer the depth
FAR_LIMIT = 4.0  # times the largest command: a limit beyond is told and not drawn
DECADES = 5.0  # of the error that are shown below its largest value
ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2, "frameon": False}
FAILURES = ("failed", "unstable", "interrupted")


@dataclass(frozen=True)
class LoopCurves:
    """What a picture shows of a loop, in mm, N, s, degrees.

    Attributes
    ----------
    run
        The loop.
    """

    run: Trajectory

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.run.scene

    @cached_property
    def commands(self) -> tuple[str, ...]:
        """Names of what was commanded."""
        return tuple(name.removeprefix("command_") for name in self.run.signals if name.startswith("command_"))

    @cached_property
    def steers_depth(self) -> bool:
        """Whether the insertion itself is commanded."""
        return any(name in AXIAL for name in self.commands)

    @cached_property
    def over_depth(self) -> bool:
        """Whether the depth can stand for the time: it rises throughout and nobody commands it."""
        return not self.steers_depth and bool(np.all(np.diff(self.run.depth) > 0.0))

    @property
    def along(self) -> Array:
        """Depth [mm] or time [s] of the samples (nt,)."""
        return MILLIMETERS * self.run.depth if self.over_depth else self.run.time

    @property
    def along_label(self) -> str:
        """What `along` is."""
        return "depth [mm]" if self.over_depth else "time [s]"

    @property
    def target(self) -> tuple[float, float] | None:
        """Where on `along` the target is, and its lateral place [mm]; None where it was not reached."""
        summary = self.run.summary
        if not summary["target_reached"]:
            return None
        place = MILLIMETERS * summary["target_depth"] if self.over_depth else summary["target_time"]
        return float(place), MILLIMETERS * self.scene.target.lateral

    @cached_property
    def seen(self) -> NDArray[np.intp]:
        """Indices of the samples at which a new image of the tip was known."""
        readings = self.run.signals.get("measurement_tip_deflection")
        sensor = next((one for one in self.scene.sensors if "tip_deflection" in one.readings), None)
        if readings is None or sensor is None:
            return np.zeros(0, dtype=np.intp)
        number = np.floor((self.run.time - sensor.delay) / sensor.period + 1e-9)
        return np.flatnonzero(np.isfinite(readings) & (np.diff(number, prepend=-np.inf) > 0))

    def command(self, name: str) -> tuple[Array, float, str]:
        """Return a command in its unit for pictures (nt,), that unit's size in SI, and its name."""
        size, unit = shown_unit(INPUT_UNITS[name])
        return self.run.signals[f"command_{name}"] / size, size, unit


def steer_picture(run: Trajectory) -> bytes:
    """Return the picture of a loop as PNG, also of one that failed: tip, depth where it is steered, commands, error."""
    curves = LoopCurves(run)
    with shared_style():
        count = 2 + curves.steers_depth + len(curves.commands)
        figure = new_figure(WIDTH, PANEL_HEIGHT * count + 0.3)
        panels = iter(np.atleast_1d(figure.subplots(count, 1, sharex=True)))
        _draw_tip(next(panels), curves)
        if curves.steers_depth:
            _draw_depth(next(panels), curves)
        for name in curves.commands:
            _draw_command(next(panels), curves, name)
        last = next(panels)
        _draw_error(last, curves)
        last.set_xlabel(curves.along_label)
        figure.align_ylabels()
        write_title(figure, run.scene.title)
        return png_bytes(figure)


def _draw_tip(panel: Axes, curves: LoopCurves) -> None:
    run, along = curves.run, curves.along
    panel.axhline(MILLIMETERS * run.scene.target.lateral, color=WANTED, linestyle=(0, (5, 2)), linewidth=1.4, label="wanted")
    panel.plot(along, MILLIMETERS * run.tip_deflection, color=TIP, label="tip", zorder=3)
    if curves.seen.size:
        readings = MILLIMETERS * run.signals["measurement_tip_deflection"][curves.seen]
        style: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 5, "color": SEEN, "zorder": 2}
        panel.plot(along[curves.seen], readings, label="latest measurement", **style)
    _mark_end(panel, along, MILLIMETERS * run.tip_deflection, run)
    if curves.target is not None:
        panel.plot(*curves.target, marker="D", markersize=9, color=WANTED, markeredgecolor=INK, linestyle="none", label="target")
    panel.set_ylabel("tip [mm]")
    panel.set_title(f"Tip{'' if curves.commands else ', nothing is commanded'}{_ending(run)}", loc="left")
    panel.legend(ncols=5, fontsize=9, handlelength=1.6, columnspacing=1.2, **ABOVE)


def _ending(run: Trajectory) -> str:
    """Return what to say of a loop that did not end as it should."""
    reason = run.summary["stop_reason"]
    if reason in FAILURES:
        return f": {reason} at {run.time[-1]:.3g} s"
    return "" if run.summary["target_reached"] else ": target not reached"


def _mark_end(panel: Axes, along: Array, values: Array, run: Trajectory) -> None:
    """Mark where a loop broke off."""
    if run.summary["stop_reason"] in FAILURES:
        panel.plot(along[-1:], values[-1:], marker="X", markersize=9, color=INK, linestyle="none", zorder=5)


def _draw_depth(panel: Axes, curves: LoopCurves) -> None:
    run, goal = curves.run, curves.scene.target.depth
    if goal is not None:
        panel.axhline(MILLIMETERS * goal, color=WANTED, linestyle=(0, (5, 2)), linewidth=1.4)
    panel.plot(curves.along, MILLIMETERS * run.depth, color=TIP)
    _mark_end(panel, curves.along, MILLIMETERS * run.depth, run)
    panel.set_ylabel("depth [mm]")
    panel.set_title("Depth", loc="left")


def _draw_command(panel: Axes, curves: LoopCurves, name: str) -> None:
    values, size, unit = curves.command(name)
    panel.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    panel.plot(curves.along, values, drawstyle=_draw_style(curves.scene, name), color=COMMAND)
    _mark_end(panel, curves.along, values, curves.run)
    actuator = getattr(curves.scene.actuators, name)
    bounds = () if actuator is None else (actuator.minimum, actuator.maximum)
    limits = [bound / size for bound in bounds if bound is not None]
    largest = float(np.max(np.abs(values)))
    near = [limit for limit in limits if abs(limit) <= FAR_LIMIT * largest]
    for number, limit in enumerate(near):
        label = "_limit" if number else "limit"
        panel.axhline(limit, color=SEEN, linestyle=(0, (1.5, 1.5)), linewidth=1.6, label=label)
    far = " to ".join(f"{limit:.4g}" for limit in limits) if len(near) < len(limits) else ""
    symbol = "" if unit == "1" else f" {unit}"
    panel.set_ylabel(name.replace("_", " ") + (f" [{unit}]" if symbol else ""))
    panel.set_title(f"Command{f', limits {far}{symbol}' if far else ''}", loc="left")
    if near:
        panel.legend(fontsize=9, handlelength=1.6, **ABOVE)


def _draw_style(scene: Scene, name: str) -> str:
    """Return how an input goes from one sample to the next: it jumps, unless its rate is limited or nobody samples it."""
    actuator = getattr(scene.actuators, name)
    gradual = scene.controller.variant == "fully-actuated" or (actuator is not None and actuator.rate is not None)
    return "default" if gradual else "steps-post"


def _draw_error(panel: Axes, curves: LoopCurves) -> None:
    """Draw the distance of the tip, and of a depth that is steered, from where it should be; over decades logarithmically."""
    run, target = curves.run, curves.scene.target
    errors = {"tip": MILLIMETERS * np.abs(run.tip_deflection - target.lateral)}
    if curves.steers_depth and target.depth is not None:
        errors["depth"] = MILLIMETERS * np.abs(run.depth - target.depth)
    floor = max(float(np.max(values)) for values in errors.values()) * 10.0**-DECADES
    for (name, values), color, line in zip(errors.items(), (TIP, SEEN), ("-", "--"), strict=False):
        panel.plot(curves.along, np.maximum(values, floor), color=color, linestyle=line, label=name)
    if curves.target is not None:
        panel.axvline(curves.target[0], color=WANTED, linestyle=(0, (5, 2)), linewidth=1.4)
    everything = np.maximum(np.concatenate([*errors.values()]), floor)
    if np.max(everything) > 10.0 * np.min(everything):
        panel.set_yscale("log")
        panel.yaxis.set_major_formatter("{x:g}")
    else:
        panel.set_ylim(bottom=0.0)
    panel.set_ylabel("|error| [mm]")
    panel.set_title(_error_title(curves), loc="left")
    if len(errors) > 1:
        panel.legend(ncols=2, fontsize=9, handlelength=1.6, **ABOVE)


def _error_title(curves: LoopCurves) -> str:
    title = "Distance of the tip from where it is wanted"
    if curves.target is None:
        return title
    place = "end" if curves.scene.target.depth is None else "target"
    return f"{title}: {MILLIMETERS * curves.run.summary['target_error']:.3g} mm at the {place}"
