"""The report of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_needle.closed_loop.units import shown_unit
from fem_needle.display import measurable, without_rounding
from fem_needle.figures import tip_path, waterfall
from fem_needle.figures.common import suited
from fem_needle.figures.energy_figure import LEDGER, RESIDUALS, largest_energy, ledger_terms
from fem_needle.pictures import png_bytes
from fem_needle.report.numbers import MISSING, millimeters, number, quantity, ratio, tidy, with_unit
from fem_needle.report.parts import Grid, Page, Picture, Section
from fem_needle.report.run_charts import course_chart, energy_chart, needle_chart
from fem_needle.report.shared import scene_section, subject, values_section, versions_section, warnings_section
from fem_needle.scene import Scene
from fem_needle.scene.signals import INPUT_UNITS, effort_unit
from fem_needle.trajectory import VARIABLES, Trajectory

UNTITLED = "Run without a title"
LOOP_PICTURE = "steer.png"
# How a run may end, in words after "The run ".
ENDINGS = {
    "duration": "lasted as long as the scene asks",
    "final-depth": "ended at the final depth",
    "full-length": "ended when the whole needle was inserted",
    "hub-contact": "ended when the hub met a guide or the tissue",
    "stuck": "ended because friction holds the needle for good",
    "withdrawn": "ended because the needle had left the tissue",
}
MODELS = {"fem": "finite-element model", "assumed-modes": "model of assumed modes"}
FAILURES = {
    "failed": "The computation failed before the end.",
    "unstable": "The loop became unstable: it drove the needle out of all bounds.",
    "interrupted": "The run was interrupted before its end.",
    "running": "The run was broken off, or is still being computed.",
}


def run_page(run: Trajectory, manifest: dict[str, Any], folder: Path) -> Page:
    """Return the report of a run, also of one that ended early."""
    scene, summary = run.scene, run.summary
    sections = (
        _summary_section(run),
        warnings_section(_list(summary, "warnings")),
        _scene_section(run),
        _method_section(run),
        _results_section(run, folder),
        _ledger_section(run),
        values_section(scene),
        versions_section(scene, manifest),
    )
    kind = "Closed loop" if run.signals else "Run"
    alarm = FAILURES.get(str(summary.get("stop_reason")), "")
    return Page(scene.title or UNTITLED, subject(kind, manifest), alarm, sections)


def broken_page(scene: Scene, summary: dict[str, Any], manifest: dict[str, Any]) -> Page:
    """Return the report of a run that left no results."""
    state = str(summary.get("stop_reason") or manifest.get("state"))
    alarm = f"{FAILURES.get(state, FAILURES['running'])} It has left no results."
    sections = (
        warnings_section(_list(summary, "warnings")),
        scene_section(scene),
        *_skipped_sections(summary),
        values_section(scene),
        versions_section(scene, manifest),
    )
    return Page(scene.title or UNTITLED, subject("Run", manifest), alarm, sections)


def _scene_section(run: Trajectory) -> Section:
    """Return the scene in words; of a loop that was left open, that it was."""
    section = scene_section(run.scene)
    if run.scene.controller.kind == "none" or "controller" in run.summary:
        return section
    told = ("Open loop", "The scene's controller did not act in this run.")
    return replace(section, paragraphs=(*section.paragraphs, told))


def _list(summary: dict[str, Any], name: str) -> list[Any]:
    found = summary.get(name)
    return found if isinstance(found, list) else []


def _summary_section(run: Trajectory) -> Section:
    reason = str(run.summary.get("stop_reason"))
    ending = ENDINGS.get(reason, f"ended early ({reason})")
    depth, tip = millimeters(float(run.depth[-1])), millimeters(float(run.tip_deflection[-1]))
    told = f"The run {ending}, after {quantity(float(run.time[-1]), 's')}: the tip is {depth} deep and deflected by {tip}."
    grid = Grid("Figures of the run", ("figure", "value"), tuple(_summary_rows(run)))
    return Section("summary", "Summary", paragraphs=(("", told),), grids=(grid,))


def _summary_rows(run: Trajectory) -> Iterator[tuple[str, str]]:
    """Yield name and value of the figures of a run."""
    summary = run.summary
    largest = float(np.nanmax(np.abs(run.tip_deflection), initial=0.0))
    push = float(np.nanmax(np.abs(run.push_force), initial=0.0))
    yield "depth at the end", millimeters(float(run.depth[-1]))
    yield "tip deflection at the end", millimeters(float(run.tip_deflection[-1]))
    yield "largest tip deflection", millimeters(largest)
    yield "push force at the end", quantity(measurable(float(run.push_force[-1])), "N")
    yield "largest push force", quantity(measurable(push), "N")
    if "target_error" in summary:
        yield from _target_rows(summary)
    estimate, residual = summary.get("error_estimate"), summary.get("relative_energy_residual")
    none = "none: nothing finer to compare with"
    yield "estimated error of the tip", none if estimate is None else f"{ratio(estimate)} of its largest deflection"
    yield "residual of the energy balance", "not computed" if residual is None else f"{ratio(residual)} of the largest energy"
    yield "samples", str(len(run.time))


def _target_rows(summary: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "error of the tip at the target", millimeters(summary["target_error"])
    missed = "no: the error is that where the run ended"
    yield "target reached", missed if summary.get("target_reached") is False else number(summary.get("target_reached"))
    for name, value in (summary.get("largest_command") or {}).items():
        yield f"largest command, {name.replace('_', ' ')}", quantity(value, INPUT_UNITS.get(name, "1"))
    for name, value in (summary.get("effort") or {}).items():
        size, shown = shown_unit(effort_unit(name)) if name in INPUT_UNITS else (1.0, "1")
        yield f"effort, {name.replace('_', ' ')}", with_unit(number(value / size), shown)


def _method_section(run: Trajectory) -> Section:
    """Return how it was computed, and what was left out with the reason."""
    summary, numerics = run.summary, run.scene.numerics
    analysis = {"dynamic": "with inertia", "quasi-static": "without inertia", "static": "as a series of equilibria"}
    name = str(summary.get("analysis"))
    told = f"{_model(summary)} The analysis is {name}{', ' + analysis[name] if name in analysis else ''}."
    steps, step = summary.get("steps"), summary.get("time_step")
    if isinstance(steps, int) and isinstance(step, int | float):
        told += f" It took {steps} steps of up to {quantity(float(step), 's')}."
    told += f" The tip was to be exact to {ratio(numerics.tolerance)} of its largest deflection."
    section = Section("method", "How it was computed", paragraphs=(("Model", told), *_inertia(summary)))
    skipped = _skipped_sections(summary)
    return replace(section, grids=skipped[0].grids) if skipped else section


def _model(summary: dict[str, Any]) -> str:
    kind = str(summary.get("model"))
    name = MODELS.get(kind, f"model {kind}")
    if "elements" in summary:
        degree = f" of degree {summary['degree']}" if "degree" in summary else ""
        noun = "element" if summary["elements"] == 1 else "elements"
        return f"The {name} has {summary['elements']} {noun}{degree}."
    if "modes" in summary:
        words = ", ".join(str(summary[key]) for key in ("variant", "basis") if key in summary)
        return f"The {name} has {summary['modes']} mode{'s' * (summary['modes'] != 1)}{f' ({words})' if words else ''}."
    return f"The model is {kind}."


def _inertia(summary: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    found = [item for item in _list(summary, "skipped") if isinstance(item, dict) and item.get("term") == "inertia"]
    if found:
        return (("Inertia", f"Inertia was left out: {tidy(str(found[0].get('reason')))}."),)
    parts = [part for part in _list(summary, "parts") if isinstance(part, dict)]
    told = [f"{_when(part, parts)}{part['how']}: {tidy(str(part['reason']))}." for part in parts]
    return (("Inertia", " ".join(told)),) if told else ()


def _when(part: dict[str, Any], parts: Sequence[dict[str, Any]]) -> str:
    """Return when a part of a run was, if it was not the whole."""
    return f"{quantity(part['begin'], 's')} to {quantity(part['end'], 's')}: " if len(parts) > 1 else ""


def _skipped_sections(summary: dict[str, Any]) -> tuple[Section, ...]:
    rows = tuple(
        (str(item.get("term")), tidy(str(item.get("reason")))) for item in _list(summary, "skipped") if isinstance(item, dict)
    )
    grid = Grid("What was left out, and why", ("term", "reason"), rows)
    return (Section("skipped", "What was left out", grids=(grid,)),) if rows else ()


def _results_section(run: Trajectory, folder: Path) -> Section:
    charts = (needle_chart(run), course_chart(run), energy_chart(run))
    pictures = [
        Picture("Path of the tip.", "The path that the tip takes through the tissue.", png_bytes(tip_path(run))),
        Picture("The whole needle over time.", "Shapes of the needle, one above the other.", png_bytes(waterfall(run))),
    ]
    if (folder / LOOP_PICTURE).exists():
        about = "The closed loop: tip and target, what was measured, the command, the error."
        pictures.insert(0, Picture(about, about, (folder / LOOP_PICTURE).read_bytes()))
    return Section("results", "Results", charts=charts, pictures=tuple(pictures), new_page=True)


def _ledger_section(run: Trajectory) -> Section:
    """Return every term of the ledger at the end of the run."""
    grids = tuple(_ledger_grid(run, title, names) for title, names in LEDGER)
    told = "Works and losses count from the start. The residual is what the terms, each computed for itself, leave over."
    return Section("ledger", "Energy ledger", paragraphs=(("", told),), grids=grids, new_page=True)


def _ledger_grid(run: Trajectory, title: str, names: dict[str, str]) -> Grid:
    terms = ledger_terms(run, title, names)
    size, unit = suited(terms.values(), "J")
    largest = 0.0 if title == RESIDUALS else largest_energy(run)
    rows = []
    for name, values in terms.items():
        finite = values[np.isfinite(values)]
        ends = (values[0], values[-1], np.max(np.abs(finite))) if finite.size else (np.nan,) * 3
        cells = (number(without_rounding(float(end), largest) / size) for end in ends)
        rows.append((VARIABLES[name][1], *("not computed" if cell == MISSING else cell for cell in cells)))
    return Grid(title, ("term", f"start [{unit}]", f"end [{unit}]", f"largest magnitude [{unit}]"), tuple(rows))
