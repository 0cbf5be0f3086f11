"""What a needle is to a controller: linear models over the depth, their vibrations, what reaches and shows them, gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.analysis.controllability import (
    Balanced,
    PencilTest,
    balance,
    controllable_modes,
    controllable_subspace,
    observable_modes,
    observable_subspace,
    output_controllability,
)
from fem_needle.analysis.depth_gains import DepthGains, depth_gains
from fem_needle.display import Card, Shown, columns_in_millimeters, in_millimeters
from fem_needle.errors import SceneError
from fem_needle.linear.linearization import Axial, linearize, reach
from fem_needle.linear.modal_form import AXIAL, modal
from fem_needle.linear.model import LinearModel
from fem_needle.linear.slow_cut import slow_cut
from fem_needle.models import build_plant, model_family
from fem_needle.motion import depth_law, run_duration
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.threads import one_thread

Array = NDArray[np.float64]

RESPONSE_RANGE = (0.0937, 2.13)  # of the first and the third natural frequency; no grid point is likely to hit one
RESPONSE_POINTS = 61
ELEMENTS = 16  # where the scene leaves them to the program
SLOWEST = 6  # vibrations in which controllability is judged
BETWEEN = 3  # depths between the first and the last


@dataclass(frozen=True)
class Verdict:
    """One question, its answer, and the numbers that it rests on.

    Attributes
    ----------
    question
        "controllable", "observable" or "output-controllable".
    signals
        By these inputs, or from these outputs.
    dimension, full
        Of the controllable or observable subspace and of the state; of the outputs that can be moved and of all outputs.
    holds
        Whether dimension and smallest singular value say yes.
    smallest, threshold
        The singular value that comes nearest to its threshold.
    at
        Natural frequency of the eigenvalue that it belongs to [rad/s]; None for outputs.
    singular_values
        All of them: by eigenvalue, or by output direction.
    """

    question: str
    signals: tuple[str, ...]
    dimension: int
    full: int
    holds: bool
    smallest: float
    threshold: float
    at: float | None
    singular_values: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class DepthAnalysis:
    """A needle at one depth.

    Attributes
    ----------
    model
        Linear model in the model's own coordinates.
    slow
        The same in its slowest six vibrations, in which the verdicts were found; the same model where it has no more coordinates.
    gains
        Static gain of the tip at the held depth by input.
    verdicts
        With all inputs (outputs) together, then with each alone.
    """

    model: LinearModel
    slow: LinearModel
    gains: dict[str, float]
    verdicts: tuple[Verdict, ...]

    def verdict(self, question: str, *signals: str) -> Verdict:
        """Return the verdict on a question; without signals the one with all."""
        found = [one for one in self.verdicts if one.question == question and (not signals or one.signals == signals)]
        if not found:
            known = ", ".join(f"{one.question} {'+'.join(one.signals)}" for one in self.verdicts)
            raise SceneError(f"no such verdict (got {question!r} {signals}; allowed {known})")
        return found[0]


@dataclass(frozen=True, eq=False, repr=False)
class Analysis(Shown):
    """Analyses at chosen depths, and the gains over all depths.

    Attributes
    ----------
    plant
        The model.
    axial
        Whether the depth is a state ("free") or "held".
    points
        One for each depth.
    curve
        Gains and frequencies over the depth.
    """

    plant: Plant
    axial: Axial
    points: tuple[DepthAnalysis, ...]
    curve: DepthGains
    warnings: tuple[str, ...] = ()

    @property
    def depths(self) -> Array:
        """Chosen depths [m]."""
        return np.array([one.model.operating_point.depth for one in self.points])

    def _card(self) -> Card:
        changes = [f"{one.input} at {in_millimeters(one.depth)}" for one in self.curve.sign_changes]
        facts = (
            ("model", " ".join(str(value) for value in self.plant.describe().values())),
            ("depths", ", ".join(in_millimeters(float(depth)) for depth in self.depths)),
            ("axial", self.axial),
            ("gain changes sign", "; ".join(changes) or "nowhere"),
            ("warnings", "; ".join(self.warnings) or "none"),
        )
        rows = [(one.model.natural_frequencies, one.verdicts) for one in self.points]
        columns: dict[str, list[Any]] = {
            "depth [m]": self.depths.tolist(),
            "lowest natural frequency [rad/s]": [float(np.min(found)) if len(found) else None for found, _ in rows],
        }
        for name in self.points[0].gains:
            columns[f"static gain of {name} [m per unit]"] = [one.gains[name] for one in self.points]
        questions = dict.fromkeys(verdict.question for verdict in self.points[0].verdicts)
        columns |= {question: [one.verdict(question).holds for one in self.points] for question in questions}
        return Card("Analysis", self.plant.scene.title, facts, columns_in_millimeters(columns))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI."""
        first = self.points[0].model
        return {
            **self.plant.describe(),
            "axial": self.axial,
            "speed": first.operating_point.speed,
            "time": first.operating_point.time,
            "states": [asdict(signal) for signal in first.states],
            "inputs": [asdict(signal) for signal in first.inputs],
            "outputs": [asdict(signal) for signal in first.outputs],
            "depths": [_plain(one) for one in self.points],
            "sign_changes": [asdict(change) for change in self.curve.sign_changes],
            "warnings": list(self.warnings),
        }

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return the curves as columns with units in their headers."""
        curve = self.curve
        columns: dict[str, Sequence[Any]] = {"depth [m]": curve.depths.tolist()}
        for signal, gain in zip(curve.inputs, curve.gains.T, strict=True):
            columns[f"tip_deflection / {signal.name} [m/({signal.unit})]"] = gain.tolist()
        for number, frequency in enumerate(curve.frequencies.T, start=1):
            columns[f"natural_frequency_{number} [rad/s]"] = frequency.tolist()
        return columns


@one_thread
def analyze(
    scene: Scene,
    depths: Sequence[float] | None = None,
    *,
    time: float = 0.0,
    speed: float = 0.0,
    axial: Axial = "free",
) -> Analysis:
    """Linearize a scene's needle at depths and judge it as a system to be controlled.

    Parameters
    ----------
    scene
        Any scene; its model is taken as it says, 16 elements on "auto".
    depths
        z [m]; default: the scene's first and last depth and three between, or its only one.
    time, speed, axial
        As in `linearize`.

    Raises
    ------
    SceneError
        If a value is out of range.
    ComputationError
        If there is no equilibrium.
    """
    numerics = scene.numerics
    if numerics.elements == "auto" and numerics.mesh is None:
        scene = scene.with_value("numerics.elements", ELEMENTS)
    plant = build_plant(scene)
    chosen = scene_depths(scene) if depths is None else [float(depth) for depth in depths]
    if not chosen or len(set(chosen)) < len(chosen):
        raise SceneError(f"depths: given twice or not at all (got {chosen}; allowed different depths)")
    path = slow_cut(plant, max(chosen), time)
    models = [linearize(plant, depth=depth, time=time, speed=speed, axial=axial, path=path) for depth in chosen]
    points = tuple(_analyzed(plant, model) for model in models)
    warnings = (*plant.warnings, *_range_warnings(scene))
    return Analysis(plant, axial, points, depth_gains(plant, time=time), warnings)


def _range_warnings(scene: Scene) -> tuple[str, ...]:
    """Return what a model of few coordinates says of its range; the elements of an analysis are enough."""
    return () if scene.model.kind == "fem" else model_family(scene.model.kind).choose(scene, "dynamic").warnings


def scene_depths(scene: Scene) -> list[float]:
    """Return the first and the last depth of a scene's insertion [m] and three between; one where nothing moves."""
    insertion = scene.insertion
    if insertion.kind == "force":
        ends = [insertion.first_depth, insertion.final_depth or reach(scene)]
    else:
        law, duration = depth_law(scene), run_duration(scene)
        times = [0.0, *law.turning_times(duration), *law.kinks(duration), duration]
        ends = [law.depth(moment) for moment in times]
    first, last = max(min(ends), 0.01 * scene.needle.length), max(ends)
    return [first] if last <= first else [float(depth) for depth in np.linspace(first, last, BETWEEN + 2)]


def _analyzed(plant: Plant, model: LinearModel) -> DepthAnalysis:
    coordinates = len(model.states) // 2 - sum(signal.name in AXIAL for signal in model.states)
    slow = modal(model, SLOWEST) if coordinates > SLOWEST else model
    point = model.operating_point
    held = depth_gains(plant, [point.depth], time=point.time, path=point.path)
    gains = {signal.name: float(gain) for signal, gain in zip(held.inputs, held.gains[0], strict=True)}
    return DepthAnalysis(model, slow, gains, tuple(_verdicts(slow)))


def _verdicts(model: LinearModel) -> list[Verdict]:
    inputs, outputs = ([one.name for one in signals] for signals in (model.inputs, model.outputs))
    every, all_outputs = list(range(len(inputs))), list(range(len(outputs)))
    sets = [every, *([one] for one in every)] if len(every) > 1 else [every]
    shown = [all_outputs, *([one] for one in all_outputs)]
    systems = [(balance(model.A, model.B[:, chosen], model.C), chosen) for chosen in sets]
    seen = [(balance(model.A, model.B, model.C[chosen]), chosen) for chosen in shown]
    return [
        *(_controllable(system, tuple(inputs[one] for one in chosen)) for system, chosen in systems),
        *(_observable(system, tuple(outputs[one] for one in chosen)) for system, chosen in seen),
        *(_movable(system, model.D[:, chosen], tuple(inputs[one] for one in chosen)) for system, chosen in systems),
    ]


def _controllable(system: Balanced, names: tuple[str, ...]) -> Verdict:
    return _judged("controllable", names, controllable_modes(system), controllable_subspace(system).dimension, len(system.A))


def _observable(system: Balanced, names: tuple[str, ...]) -> Verdict:
    return _judged("observable", names, observable_modes(system), observable_subspace(system).dimension, len(system.A))


def _judged(question: str, names: tuple[str, ...], pencil: PencilTest, dimension: int, full: int) -> Verdict:
    nearest = int(np.argmin(pencil.singular_values / pencil.thresholds))
    return Verdict(
        question,
        names,
        dimension,
        full,
        pencil.holds and dimension == full,
        float(pencil.singular_values[nearest]),
        float(pencil.thresholds[nearest]),
        float(np.abs(pencil.eigenvalues[nearest])),
        tuple(pencil.singular_values.tolist()),
    )


def _movable(system: Balanced, direct: Array, names: tuple[str, ...]) -> Verdict:
    test = output_controllability(system, direct)
    values = tuple(test.singular_values.tolist())
    return Verdict(
        "output-controllable", names, test.rank, len(values), test.holds, min(values), test.threshold, None, values
    )


def _plain(one: DepthAnalysis) -> dict[str, Any]:
    model, point = one.model, one.model.operating_point
    return {
        "depth": point.depth,
        "tip_deflection": point.tip_deflection,
        "push_force": point.push_force,
        "natural_frequencies": model.natural_frequencies[:SLOWEST].tolist(),
        "damping_ratios": model.damping_ratios[:SLOWEST].tolist(),
        "poles": [[float(pole.real), float(pole.imag)] for pole in model.poles[: 2 * SLOWEST + 2]],
        "static_gains": one.gains,
        "transfer_functions": _transfer_functions(model),
        "verdicts": [asdict(verdict) for verdict in one.verdicts],
    }


def _transfer_functions(model: LinearModel) -> dict[str, Any]:
    """Return magnitude and phase of the tip's answer to each input, from far below the first to beyond the third vibration."""
    found = model.natural_frequencies
    if not len(found):
        return {}
    lowest, highest = RESPONSE_RANGE[0] * float(found[0]), RESPONSE_RANGE[1] * float(found[:3][-1])
    frequencies = np.geomspace(lowest, highest, RESPONSE_POINTS)
    answers = {signal.name: model.transfer_function("tip_deflection", signal.name, frequencies) for signal in model.inputs}
    return {
        "frequencies": frequencies.tolist(),
        "magnitudes": {name: np.abs(answer).tolist() for name, answer in answers.items()},
        "phases": {name: np.angle(answer).tolist() for name, answer in answers.items()},
    }
