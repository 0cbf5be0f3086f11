"""What `compare` shows: a column for each model, in mm, Hz, s."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import isnan, pi
from pathlib import Path
from typing import TYPE_CHECKING, cast

import typer

from fem_needle.cli.run_table import model_text
from fem_needle.cli.short_path import short_path
from fem_needle.cli.tables import new_table, show
from fem_needle.display import without_rounding

if TYPE_CHECKING:
    from fem_needle.comparison.at_rest import RestStates, StaticErrors
    from fem_needle.comparison.ranges import Interval
    from fem_needle.comparison.result import ComparedModel, Comparison, ModelAnswer
    from fem_needle.comparison.runs import RunErrors
    from fem_needle.trajectory import Trajectory

Row = tuple[str, ...]
EARLY = "ends early"
_ENERGIES = ("kinetic", "bending", "tissue", "total")


def show_comparison(comparison: Comparison, folder: Path) -> None:
    """Print the table, what was compared how, and where the files are."""
    table = new_table(comparison.scene.title, "", *(answer.label for answer in comparison.answers))
    for rows in (_at_rest(comparison), _range(comparison), _in_the_run(comparison), _cost(comparison)):
        for row in rows:
            table.add_row(*row)
    show(table)
    typer.echo(f"reference: {_reference(comparison)}")
    for model in comparison.models:
        typer.echo(f"{model.answer.label}: {model_text(model.answer.description)}")
    typer.echo(f"kinematics {comparison.kinematics}, analysis {comparison.analysis}{_steps(comparison)}")
    if comparison.load is not None:
        rest = "; on a straight rest line" if comparison.scene.tissue.rest_line != "straight" else ""
        typer.echo(f"at rest: {comparison.load.text}{rest}")
        typer.echo("k: modulus of the layer that holds the tip, times the stiffness factor")
    else:
        typer.echo("at rest: nothing, for this variant has no equilibrium")
    typer.echo(f"files: {short_path(folder)}")


def _reference(comparison: Comparison) -> str:
    text = model_text(comparison.reference.description)
    error = comparison.reference_error
    return text if error is None else f"{text}; a finer one changes its tip at rest by {error:.1e} of the largest"


def _steps(comparison: Comparison) -> str:
    run = comparison.reference.run
    if run is None:
        return ", nothing moves"
    return f", {run.run.summary['steps']} steps of up to {run.run.summary['time_step']:.4g} s"


def _at_rest(comparison: Comparison) -> Iterator[Row]:
    """Yield tips, shapes and frequencies at the chosen depths, and the largest tip error over all."""
    truth = comparison.reference.chosen
    if truth is None:
        return
    for index, depth in enumerate(comparison.depths):
        yield f"at rest at {1e3 * depth:.4g} mm:", *("" for _ in comparison.answers)
        yield "  tip [mm]", *(f"{1e3 * _chosen(answer).tips[index]:.5g}" for answer in comparison.answers)
        yield "  tip error, of the tip there", "", *(_percent(_still(model).tip[index]) for model in comparison.models)
        yield "  shape error, of the shape there", "", *(_percent(_still(model).shape[index]) for model in comparison.models)
        for number, frequency in enumerate(truth.frequencies[index].tolist()):
            cells = (_frequency(model, index, number) for model in comparison.models)
            yield f"  natural frequency {number + 1} [Hz]", f"{frequency / (2 * pi):.5g}", *cells
    yield _errors(comparison, "largest tip error at rest, of the tip there", _largest_at_rest)


def _largest_at_rest(model: ComparedModel) -> str:
    curve, states = model.curve, model.answer.curve
    if curve is None or states is None:
        return ""
    worst = int(abs(curve.tip).argmax())
    return f"{_percent(curve.tip[worst])} at {1e3 * states.depths[worst]:.4g} mm"


def _frequency(model: ComparedModel, index: int, number: int) -> str:
    value, error = _chosen(model.answer).frequencies[index, number], _still(model).frequency[index, number]
    return "none" if isnan(value) else f"{value / (2 * pi):.5g} ({_percent(error)})"


def _range(comparison: Comparison) -> Iterator[Row]:
    if comparison.load is None:
        return
    named = f"within {100 * comparison.within:g} % at rest"
    yield _errors(comparison, f"{named}: depth [mm]", lambda model: _depths(model.ranges))
    yield _errors(comparison, f"{named}: (k/4EI)^(1/4) z", lambda model: _numbers(model.ranges))


def _depths(ranges: tuple[Interval, ...]) -> str:
    """Return intervals of depth; parts in touching layers as one."""
    merged: list[tuple[float, float]] = []
    for part in ranges:
        start = merged.pop()[0] if merged and merged[-1][1] == part.start else part.start
        merged.append((start, part.end))
    return ", ".join(f"{1e3 * start:.1f} to {1e3 * end:.1f}" for start, end in merged) or "nowhere"


def _numbers(ranges: tuple[Interval, ...]) -> str:
    inside = [part for part in ranges if part.layer]
    several = len({part.layer for part in inside}) > 1
    texts = (f"{part.number_start:.3f} to {part.number_end:.3f}{f' ({part.layer})' if several else ''}" for part in inside)
    return ", ".join(texts) or ("in no layer" if ranges else "nowhere")


def _in_the_run(comparison: Comparison) -> Iterator[Row]:
    runs = [answer.run for answer in comparison.answers]
    if any(run is None for run in runs):
        return
    known = [run for run in runs if run is not None]
    yield "in the run:", *("" for _ in known)
    yield "  ends", *(f"{1e3 * run.run.depth[-1]:.4g} mm, {run.run.time[-1]:.4g} s" for run in known)
    yield "  tip at the end [mm]", *(f"{_last_tip(run.run):.5g}" for run in known)
    tips = (_run_percent(model, _moving(model).largest_tip) for model in comparison.models)
    shapes = (_run_percent(model, float(_moving(model).shape.max())) for model in comparison.models)
    yield "  largest tip error, of the largest tip", "", *tips
    yield "  largest shape error, of the largest shape", "", *shapes
    if comparison.scene.insertion.kind == "force":
        yield _errors(comparison, "  depth error [mm]", lambda model: f"{1e3 * _moving(model).depth_difference:.2g}")
    for name in _ENERGIES:
        cells = (_run_percent(model, _moving(model).energies[f"{name}_energy"]) for model in comparison.models)
        yield f"  {name} energy error, of the largest total", "", *cells
    yield "  energy residual", *(f"{run.run.summary['relative_energy_residual']:.1e}" for run in known)


def _last_tip(run: Trajectory) -> float:
    """Return the tip at the end [mm], round-off as 0."""
    return 1e3 * without_rounding(float(run.tip_deflection[-1]), run.summary["max_abs_tip_deflection"])


def _cost(comparison: Comparison) -> Iterator[Row]:
    truth = comparison.reference
    yield "degrees of freedom", *(str(answer.unknowns) for answer in comparison.answers)
    if truth.curve is not None:
        seconds = [answer.curve.solve_time for answer in comparison.answers if answer.curve is not None]
        yield f"time of {len(truth.curve.depths)} equilibria [s]", *_times(seconds)
    if truth.run is not None:
        yield "time of the run [s]", *_times([answer.run.solve_time for answer in comparison.answers if answer.run is not None])
    if any(model.equal is not None for model in comparison.models):
        yield _errors(comparison, "cheapest elements as right", _equal)


def _equal(model: ComparedModel) -> str:
    """Return the elements that are as right as a model, and what the model costs beside them."""
    if model.equal is None:
        return "none"
    count, factor = model.equal.elements, model.equal.factor
    noun = "element" if count == 1 else "elements"
    return f"{count} {noun} ({_percent(model.equal.tip_error)}): the model takes {factor:.2g} x their time"


def _times(seconds: list[float]) -> Iterator[str]:
    """Yield times, those of models with their ratio to the reference's."""
    yield f"{seconds[0]:.3g}"
    yield from (f"{value:.3g} ({value / seconds[0]:.2g} x reference)" for value in seconds[1:])


def _errors(comparison: Comparison, name: str, cell: Callable[[ComparedModel], str]) -> Row:
    return name, "", *(cell(model) for model in comparison.models)


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _run_percent(model: ComparedModel, value: float) -> str:
    """Return an error of the run, or that it ended too early to have one."""
    return _percent(value) if model.covers else EARLY


def _chosen(answer: ModelAnswer) -> RestStates:
    return cast("RestStates", answer.chosen)  # rows at rest are shown where there are any


def _still(model: ComparedModel) -> StaticErrors:
    return cast("StaticErrors", model.chosen)


def _moving(model: ComparedModel) -> RunErrors:
    return cast("RunErrors", model.run)
