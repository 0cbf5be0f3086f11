"""The result of a comparison: what the reference and the models answered, how they differ, as plain data and as a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.comparison.at_rest import FREQUENCIES, RestStates, StaticErrors, StaticLoad
from fem_needle.comparison.equals import EqualElements
from fem_needle.comparison.ranges import Interval
from fem_needle.comparison.runs import ENERGIES, RunErrors, TimedRun, shape_at
from fem_needle.display import Card, Shown, in_millimeters, text
from fem_needle.scene import Scene

Array = NDArray[np.float64]

SHAPE_STATIONS = 101


@dataclass(frozen=True, eq=False)
class ModelAnswer:
    """What one model answered.

    Attributes
    ----------
    label
        Its name in tables and pictures, such as "2 modes".
    description
        What it says of itself: kind, elements or modes, variant, basis.
    unknowns
        Degrees of freedom: coordinates that are not prescribed.
    chosen
        At rest at the chosen depths; None of a model without statics.
    curve
        At rest over the range of depth.
    run
        Its run; None where nothing moves.
    warnings
        What to know of it.
    """

    label: str
    description: dict[str, Any]
    unknowns: int
    chosen: RestStates | None
    curve: RestStates | None
    run: TimedRun | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ComparedModel:
    """A model's answer and its differences from the reference.

    Attributes
    ----------
    answer
        The answer.
    chosen, curve
        Static differences at the chosen depths and over the range of depth; None of a model without statics.
    ranges
        Depths and characteristic numbers at which the tip at rest is within the error.
    run
        Differences over the run; None where nothing moves.
    covers
        Whether the run was compared to its end, or nearly; True where there is none.
    equal
        The cheapest elements whose tip is as right, in the run, or at rest where nothing moves; None where there are none.
    """

    answer: ModelAnswer
    chosen: StaticErrors | None
    curve: StaticErrors | None
    ranges: tuple[Interval, ...]
    run: RunErrors | None
    covers: bool
    equal: EqualElements | None = None

    @property
    def largest_tip_error(self) -> float:
        """Largest relative error of the tip (1): over the run, infinite if it fails or ends early; without one at rest."""
        if self.run is not None:
            failed = self.answer.run is not None and self.answer.run.failure
            return self.run.largest_tip if self.covers and not failed else float("inf")
        return float("inf") if self.curve is None else float(np.max(np.abs(self.curve.tip)))


@dataclass(frozen=True, eq=False)
class Shape:
    """All models' needles at one depth.

    Attributes
    ----------
    depth
        z [m].
    at_rest
        Whether they rest; else they are taken from the run, at the sample next to the depth.
    position
        Stations along the insertion axis y [m], from the hub to the tip, shape (n,).
    deflections
        Of the reference and the models, in this order [m], shape (1 + models, n).
    """

    depth: float
    at_rest: bool
    position: Array
    deflections: Array


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """Models against a reference on the same scene.

    Attributes
    ----------
    scene
        What was compared.
    reference
        Its answer.
    reference_error
        What twice the elements change in the reference's static tips, by the largest (1); None if that is not known.
    models
        The compared models.
    kinematics
        Of all of them: "material" or "fixed-frame".
    analysis
        "static", "quasi-static" or "dynamic".
    load
        What the equilibria are loaded with; None without statics.
    depths
        Chosen depths [m].
    within
        Error of the ranges (1).
    """

    scene: Scene
    reference: ModelAnswer
    reference_error: float | None
    models: tuple[ComparedModel, ...]
    kinematics: str
    analysis: str
    load: StaticLoad | None
    depths: tuple[float, ...]
    within: float

    def _card(self) -> Card:
        facts = (
            ("reference", self.reference.label),
            ("models", ", ".join(model.answer.label for model in self.models)),
            ("largest tip error", text(self.largest_tip_error, 3)),
            ("analysis", self.analysis),
            ("depths", ", ".join(in_millimeters(depth) for depth in self.depths)),
            ("kinematics", self.kinematics),
        )
        columns: dict[str, list[Any]] = {
            "model": [model.answer.label for model in self.models],
            "unknowns": [model.answer.unknowns for model in self.models],
            "largest tip error": [float(f"{model.largest_tip_error:.3g}") for model in self.models],
            "warnings": ["; ".join(model.answer.warnings) for model in self.models],
        }
        return Card("Comparison", self.scene.title, facts, columns)

    @property
    def answers(self) -> tuple[ModelAnswer, ...]:
        """Those of the reference and of the models."""
        return (self.reference, *(model.answer for model in self.models))

    @property
    def largest_tip_error(self) -> float:
        """The largest of all models (1), see `ComparedModel.largest_tip_error`."""
        return max(model.largest_tip_error for model in self.models)

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Needles at the chosen depths: at rest where every model can be, else in the run."""
        return tuple(self._shape(index) for index in range(len(self.depths)))

    def _shape(self, index: int) -> Shape:
        length = self.scene.needle.length
        stations = np.linspace(0.0, length, SHAPE_STATIONS)
        rests = [answer.chosen.rests[index] for answer in self.answers if answer.chosen is not None]
        if len(rests) == len(self.answers):
            depth = self.depths[index]
            return Shape(depth, True, stations - (length - depth), np.array([rest.deflection(stations) for rest in rests]))
        runs = [answer.run.run for answer in self.answers if answer.run is not None]
        row = int(np.argmin(np.abs(runs[0].depth[: min(len(run.time) for run in runs)] - self.depths[index])))
        depth = float(runs[0].depth[row])
        return Shape(depth, False, stations - (length - depth), np.array([shape_at(run, row, stations) for run in runs]))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI: `compare.json`."""
        return {
            "format": 1,
            "title": self.scene.title,
            "kinematics": self.kinematics,
            "analysis": self.analysis,
            "static_load": None if self.load is None else {"text": self.load.text, **asdict(self.load)},
            "depths": list(self.depths),
            "within": self.within,
            "largest_tip_error": self.largest_tip_error,
            "reference": _answer(self.reference) | {"error_estimate": self.reference_error},
            "models": [_answer(model.answer) | _differences(model, self.reference) for model in self.models],
            "shapes": [asdict(shape) for shape in self.shapes],
        }

    def columns(self) -> dict[str, list[Any]]:
        """Return the curves as columns, first over the depth at rest, then over the run: `compare.csv`."""
        curve, run = self.reference.curve, self.reference.run
        counts = (0 if curve is None else len(curve.depths), 0 if run is None else len(run.run.time))
        time = None if run is None else run.run.time
        places = (None if curve is None else curve.depths, None if run is None else run.run.depth)
        result = {
            "part": ["rest"] * counts[0] + ["run"] * counts[1],
            "time [s]": _column(counts, None, time),
            "depth [m]": _column(counts, *places),
        }
        for answer in self.answers:
            model = next((one for one in self.models if one.answer is answer), None)
            result |= {
                f"{name}_{self.suffix(answer)} [{unit}]": _column(counts, at_rest, moving)
                for name, unit, at_rest, moving in _curves(answer, model)
            }
        return result

    def suffix(self, answer: ModelAnswer) -> str:
        """Return what ends a model's columns: "reference", "2_modes", "model"."""
        if answer is self.reference:
            return "reference"
        return answer.label.replace(" ", "_") if "modes" in answer.description else "model"


def _column(counts: tuple[int, int], at_rest: Array | None, moving: Array | None) -> list[Any]:
    """Return a column of both parts; None where a curve is missing, ends early or is not a number."""
    column: list[Any] = []
    for count, values in zip(counts, (at_rest, moving), strict=True):
        known = [] if values is None else [value if np.isfinite(value) else None for value in values.tolist()][:count]
        column += known + [None] * (count - len(known))
    return column


def _curves(answer: ModelAnswer, model: ComparedModel | None) -> Iterator[tuple[str, str, Array | None, Array | None]]:
    """Yield name, unit and values at rest and in the run of a model's columns."""
    curve, run = answer.curve, answer.run
    yield "tip_deflection", "m", None if curve is None else curve.tips, None if run is None else run.run.tip_deflection
    if model is not None:
        still, moving = model.curve, model.run
        yield "tip_error", "1", None if still is None else still.tip, None if moving is None else moving.tip
        yield "shape_error", "1", None if still is None else still.shape, None if moving is None else moving.shape
    for number in range(FREQUENCIES):
        yield f"natural_frequency_{number + 1}", "rad/s", None if curve is None else curve.frequencies[:, number], None
    if run is not None:
        yield from ((name, "J", None, run.run.series[name]) for name in ENERGIES)
        yield "total_energy", "J", None, run.energy


def _answer(answer: ModelAnswer) -> dict[str, Any]:
    """Return a model's own figures."""
    curve, run = answer.curve, answer.run
    return {
        **answer.description,
        "label": answer.label,
        "unknowns": answer.unknowns,
        "warnings": list(answer.warnings),
        "static_solve_time": None if curve is None else curve.solve_time,
        "at_rest": _rests(answer.chosen),
        "run": None if run is None else _run(run),
    }


def _rests(states: RestStates | None) -> list[dict[str, Any]]:
    if states is None:
        return []
    rows = zip(states.depths.tolist(), states.tips.tolist(), states.frequencies.tolist(), strict=True)
    return [{"depth": depth, "tip_deflection": tip, "natural_frequencies": found} for depth, tip, found in rows]


def _run(timed: TimedRun) -> dict[str, Any]:
    summary = timed.run.summary
    names = ("time_step", "steps", "stop_reason", "final_depth", "final_tip_deflection", "max_abs_tip_deflection")
    figures = {name: summary[name] for name in (*names, "relative_energy_residual")}
    return figures | {"failure": timed.failure, "solve_time": timed.solve_time}


def _differences(model: ComparedModel, reference: ModelAnswer) -> dict[str, Any]:
    """Return what separates a model from the reference."""
    curve, run = model.curve, model.run
    result: dict[str, Any] = {
        "largest_tip_error": model.largest_tip_error,
        "ranges": [asdict(interval) for interval in model.ranges],
        "errors_at_rest": [] if model.chosen is None else _error_rows(model.chosen),
        "largest_errors_at_rest": None if curve is None else largest_errors(curve),
        "run_errors": None,
        "speed_up": speed_ups(model.answer, reference),
        "equal_elements": None if model.equal is None else asdict(model.equal) | {"factor": model.equal.factor},
    }
    if run is not None:
        result["run_errors"] = {
            "tip": run.largest_tip,
            "shape": float(np.max(run.shape)),
            "depth_difference": run.depth_difference,
            **run.energies,
            "compared_until": float(run.time[-1]),
        }
    return result


def _error_rows(errors: StaticErrors) -> list[dict[str, Any]]:
    rows = zip(errors.tip.tolist(), errors.shape.tolist(), errors.frequency.tolist(), strict=True)
    return [{"tip": tip, "shape": shape, "frequency": found} for tip, shape, found in rows]


def largest_errors(errors: StaticErrors) -> dict[str, Any]:
    """Return the largest |tip|, shape and |frequency| error over the depths (1)."""
    frequency = np.max(np.abs(errors.frequency), axis=0)
    return {
        "tip": float(np.max(np.abs(errors.tip))),
        "shape": float(np.max(errors.shape)),
        "frequency": frequency.tolist(),
    }


def speed_ups(answer: ModelAnswer, reference: ModelAnswer) -> dict[str, float | None]:
    """Return the reference's solve time by the model's (1): of the equilibria and of the run."""
    static = run = None
    if answer.curve is not None and reference.curve is not None:
        static = reference.curve.solve_time / answer.curve.solve_time
    if answer.run is not None and reference.run is not None:
        run = reference.run.solve_time / answer.run.solve_time
    return {"static": static, "run": run}
