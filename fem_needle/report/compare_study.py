"""The report of a comparison of models."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem_needle.report.charts import Curve, Panel, column, panels_figure
from fem_needle.report.numbers import millimeters, number, ratio
from fem_needle.report.parts import Chart, Grid
from fem_needle.report.study_parts import Columns, StudyParts, hertz, model_words, share
from fem_needle.scene import Scene

MILLI = 1e3


def compare_parts(data: dict[str, Any], columns: Columns, scene: Scene) -> StudyParts:
    """Return words, errors and curves of a comparison."""
    reference, models = data["reference"], data["models"]
    labels = ", ".join(str(model["label"]) for model in models)
    paragraphs = [
        ("Study", f"{labels} against {reference['label']}, kinematics {data['kinematics']}, analysis {data['analysis']}."),
        ("Reference", f"{model_words(reference)}, {reference['unknowns']} unknowns."),
        *((str(one["label"]), f"{model_words(one)}, {one['unknowns']} unknowns. {_range(one, data)}") for one in models),
    ]
    if data.get("static_load"):
        paragraphs.append(("At rest", f"Under the {data['static_load']['text']}."))
    warnings = [f"{one['label']}: {text}" for one in (reference, *models) for text in one.get("warnings", ())]
    runs = [(one, (one.get("run") or {}).get("failure")) for one in (reference, *models)]
    warnings += [f"{one['label']}: the run failed: {failure}" for one, failure in runs if failure]
    grids = (*_rest_grids(data), _figures(reference, models))
    picture = "Shapes, error of the tip at rest, tip and energies in the run, of all models."
    return StudyParts(
        "Comparison of models", tuple(paragraphs), grids, _charts(columns, reference, models), picture, tuple(warnings)
    )


def _range(model: dict[str, Any], data: dict[str, Any]) -> str:
    ranges = [f"{millimeters(part['start'])} to {millimeters(part['end'])}" for part in model.get("ranges") or ()]
    where = f"at depths of {', '.join(ranges)}" if ranges else "nowhere"
    return f"At rest its tip is within {ratio(data['within'])} {where}."


def _rest_grids(data: dict[str, Any]) -> tuple[Grid, ...]:
    """Return tips, errors and the lowest frequency at rest, a row for each depth and model."""
    rows = []
    for index, depth in enumerate(data["depths"]):
        for one in (data["reference"], *data["models"]):
            states, errors = one.get("at_rest"), one.get("errors_at_rest")
            if states:
                state = states[index]
                error = errors[index] if errors else None
                shares = ("", "") if error is None else (share(error["tip"]), share(error["shape"]))
                first = next(iter(state["natural_frequencies"]), None)
                rows.append((millimeters(depth), str(one["label"]), millimeters(state["tip_deflection"]), *shares, hertz(first)))
    headers = ("depth", "model", "tip", "tip error", "shape error", "lowest frequency [Hz]")
    return (Grid("At rest", headers, tuple(rows)),) if rows else ()


def _figures(reference: dict[str, Any], models: list[dict[str, Any]]) -> Grid:
    """Return errors and cost, a column for each model."""
    rows = [("unknowns", *(str(one["unknowns"]) for one in (reference, *models)))]
    at_rest = (_nested(one, "largest_errors_at_rest", "tip") for one in models)
    rows.append(("largest tip error at rest, of the tip there", "", *at_rest))
    for key in ("tip", "shape", "bending_energy", "tissue_energy", "total_energy"):
        norm = "largest total energy" if "energy" in key else f"largest {key}"
        in_run = (_nested(one, "run_errors", key) for one in models)
        rows.append((f"{key.replace('_', ' ')} error in the run, of the {norm}", "", *in_run))
    for key, name in (("static", "at rest"), ("run", "of the run")):
        rows.append((f"time {name} beside the reference's", "1", *(_beside(one, key) for one in models)))
    equals = [one.get("equal_elements") or {} for one in models]
    if any(equals):
        rows.append(("cheapest elements as right", "", *(str(one.get("elements", "none")) for one in equals)))
        rows.append(("time beside theirs", "", *(number(one.get("factor"), 2) for one in equals)))
    headers = ("", *(str(one["label"]) for one in (reference, *models)))
    return Grid("Largest errors and cost", headers, tuple(rows))


def _beside(one: dict[str, Any], key: str) -> str:
    """Return a model's time by the reference's: above 1 it is slower."""
    faster = (one.get("speed_up") or {}).get(key)
    return number(1.0 / faster if faster else None, 2)


def _nested(one: dict[str, Any], table: str, key: str) -> str:
    return share((one.get(table) or {}).get(key))


def _charts(columns: Columns, reference: dict[str, Any], models: list[dict[str, Any]]) -> tuple[Chart, ...]:
    charts = []
    for part, axis, name in (("rest", "depth [m]", "rest"), ("run", "time [s]", "run")):
        chosen = np.array([text == part for text in columns["part"]], dtype=bool)
        if np.any(chosen):
            charts.append(_chart(columns, chosen, axis, name, (reference, *models)))
    return tuple(charts)


def _chart(columns: Columns, chosen: np.ndarray, axis: str, name: str, answers: tuple[dict[str, Any], ...]) -> Chart:
    across = column(columns, axis)[chosen] * (MILLI if axis == "depth [m]" else 1.0)
    endings = ["reference", *(str(one["label"]).replace(" ", "_") for one in answers[1:])]
    tips, errors = [], []
    for one, ending in zip(answers, endings, strict=True):
        label = str(one["label"])
        if f"tip_deflection_{ending} [m]" in columns:
            tips.append(Curve(label, across, MILLI * column(columns, f"tip_deflection_{ending} [m]")[chosen]))
        if f"tip_error_{ending} [1]" in columns:
            size = np.abs(column(columns, f"tip_error_{ending} [1]")[chosen])
            errors.append(Curve(f"{label}, error", across, np.where(size > 0.0, size, np.nan)))
    panels = [Panel("tip [mm]", tuple(tips))]
    if errors:
        panels.append(Panel("|tip error|", tuple(errors), logarithmic=True))
    where = "at rest over the depth" if name == "rest" else "in the run over time"
    about = f"Tip deflection of all models and their errors, {where}."
    return Chart(name, about, about, panels_figure(panels, axis.replace("[m]", "[mm]")))
