"""What `steer` shows at the end, of one run and of many: short tables in mm, N, s, degrees."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fem_needle.cli.run_table import EXPLANATION as RUN_EXPLANATION
from fem_needle.cli.run_table import Row, computation_rows
from fem_needle.display import without_rounding

if TYPE_CHECKING:
    from fem_needle.closed_loop.repeated import RepeatedLoop
    from fem_needle.scene import Scene, Sensor
    from fem_needle.trajectory import Trajectory

MOST_FAILURES = 3  # that are told
_OF_A_LOOP = (
    (
        "target error",
        "tip minus target.lateral where the tip reaches target.depth; at the end of the run where the scene names no depth.",
    ),
    ("command", "largest magnitude of what the actuator gave, and the integral of its magnitude over time."),
    ("tip deflection", "sideways displacement of the tip from the straight axis: the largest magnitude, and that at the end."),
    ("controller", "--controller and --schedule choose; its gains: --set controller.gains.<key>=<value>."),
    ("sensors", "--sensor changes one or adds one."),
    (
        "energy residual",
        "largest gap in the balance of lateral energy and works, each term computed for itself.",
    ),
    (
        "error estimate",
        "largest change of the tip over the run by its largest deflection when the same commands act with steps of half the "
        "length. --tolerance sets the aim.",
    ),
    ("analysis", "dynamic: with inertia; quasi-static: without; static: a series of equilibria. --analysis chooses."),
    ("model", "--model, --modes, --variant, --basis, --static-corrections and --elements choose."),
)
_SHARED = ("time step", "left out", "run folder")
EXPLANATION = (*_OF_A_LOOP, *((name, meaning) for name, meaning in RUN_EXPLANATION if name in _SHARED))


def steer_rows(run: Trajectory, folder: Path, known_warnings: Sequence[str]) -> Iterator[Row]:
    """Yield name and value of every row; warnings that were shown before are left out."""
    summary = run.summary
    yield from _target_rows(run)
    for name in summary["effort"]:
        yield "command", f"{name.replace('_', ' ')}: {_spent(name, summary['largest_command'][name], summary['effort'][name])}"
    largest, last = (1e3 * summary[key] for key in ("max_abs_tip_deflection", "final_tip_deflection"))
    last = without_rounding(last, largest)
    yield "tip deflection", f"largest {largest:.4g} mm, {last:.4g} mm at the end"
    yield from _loop_rows(run.scene)
    residual = summary["relative_energy_residual"]
    yield "energy residual", "not computed" if residual is None else f"{residual:.1e} of the largest lateral energy"
    yield from computation_rows(run, folder, known_warnings)
    yield "picture", str(folder / "steer.png")


def _target_rows(run: Trajectory) -> Iterator[Row]:
    summary = run.summary
    place = f"at {summary['target_time']:.4g} s, depth {1e3 * summary['target_depth']:.4g} mm"
    yield "target error", f"{1e3 * summary['target_error']:.4g} mm {place} ({summary['stop_reason']})"
    if not summary["target_reached"]:
        depth = 1e3 * (run.scene.target.depth or 0.0)
        yield "warning", f"the tip never reached the target's depth, {depth:.4g} mm: the error is that where it ended"


def _loop_rows(scene: Scene) -> Iterator[Row]:
    from fem_needle.closed_loop.steering import described

    controller = scene.controller
    words = described(controller)
    if controller.feedback:
        words = f"{words}; {controller.input} from {controller.output} every {1e3 * controller.period:.4g} ms"
    yield "controller", words
    yield "sensors", "; ".join(_sensor_text(sensor) for sensor in scene.sensors) or "none"


def _sensor_text(sensor: Sensor) -> str:
    late = f", {1e3 * sensor.delay:.4g} ms late" if sensor.delay else ""
    return f"{sensor.kind} every {1e3 * sensor.period:.4g} ms{late}"


def _spent(name: str, largest: float, effort: float) -> str:
    from fem_needle.scene.signals import INPUT_UNITS, effort_unit

    return f"largest {_shown(largest, INPUT_UNITS[name])}, integral {_shown(effort, effort_unit(name))}"


def _shown(value: float, unit: str) -> str:
    from fem_needle.closed_loop.units import shown_unit

    size, shown = shown_unit(unit)
    return f"{value / size:.4g}" + ("" if shown == "1" else f" {shown}")


def repeat_rows(study: RepeatedLoop, folder: Path) -> Iterator[Row]:
    """Yield name and value of every row of many runs."""
    ran, arrived = len(study.repetitions), study.target_errors.size
    asked = "" if ran == study.asked else f" of {study.asked}"
    yield "repetitions", f"{ran}{asked}: {arrived} arrived, {study.failed} failed, {study.missed} missed the target's depth"
    figures = {"mean error": study.mean, "standard deviation": study.standard_deviation, "largest |error|": study.largest_error}
    for name, value in figures.items():
        yield name, "none" if value is None else f"{1e3 * value:.4g} mm"
    for name in study.inputs:
        yield "command", f"{name.replace('_', ' ')}: {_means(study, name)}"
    yield from _loop_rows(study.scene)
    failures = [f"repetition {one.number}: {one.failure}" for one in study.repetitions if one.failure]
    yield from (("failed", text) for text in failures[:MOST_FAILURES])
    if len(failures) > MOST_FAILURES:
        yield "", f"and {len(failures) - MOST_FAILURES} more, see steer.json"
    yield "folder", str(folder)


def _means(study: RepeatedLoop, name: str) -> str:
    """Return the largest command and the mean effort of those repetitions that were complete."""
    summaries: list[dict[str, Any]] = [one.summary for one in study.repetitions if one.is_complete]
    if not summaries:
        return "no repetition was complete"
    efforts = [summary["effort"].get(name, 0.0) for summary in summaries]
    largest = max(summary["largest_command"].get(name, 0.0) for summary in summaries)
    return f"{_spent(name, largest, sum(efforts) / len(efforts))} in the mean"
