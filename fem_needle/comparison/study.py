"""Compare models with a reference: at rest over the depth, through the run, where they may be trusted, what they cost.

The reference and the models get the same scene, kinematics, analysis, time steps and samples; they are found by name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import choose
from fem_needle.comparison.at_rest import StaticLoad, compared_depths, rest_states, static_errors, static_load
from fem_needle.comparison.equals import equal_at_rest, equal_in_run
from fem_needle.comparison.ranges import Interval, described, intervals_within
from fem_needle.comparison.result import ComparedModel, Comparison, ModelAnswer
from fem_needle.comparison.runs import model_run, reference_run, run_errors
from fem_needle.errors import SceneError
from fem_needle.linear.linearization import reach
from fem_needle.loads import is_steady
from fem_needle.models import build_plant, model_family
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.scene.settings import overriding, refuse_idle
from fem_needle.statics import solve_static
from fem_needle.threads import one_thread

Array = NDArray[np.float64]

WITHIN = 0.01
FEWEST_ELEMENTS, FEWEST_DYNAMIC_ELEMENTS = 8, 16  # of a reference: shapes and frequencies are compared too, not the tip alone
REFERENCE_SHARE = 1e-2  # of the smaller of tolerance and error of the ranges: tolerance of the reference's mesh
SMALLEST_TOLERANCE = 1e-10
DEFAULT_DEPTHS = 3
WITHOUT_STATICS = "as-printed"


@dataclass(frozen=True, eq=False)
class _Setting:
    """What all models share: the reference's scene with its elements, analysis, depths, loads at rest, steps."""

    scene: Scene
    analysis: str
    has_statics: bool
    load: StaticLoad
    curve_depths: Array
    depths: tuple[float, ...]
    moves: bool

    @property
    def steps(self) -> dict[str, Any]:
        """Settings of the reference's run."""
        numerics = self.scene.numerics
        return {"analysis": self.analysis, "tolerance": numerics.tolerance, "output_step": numerics.output_step}


@one_thread
def compare(
    scene: Scene,
    *,
    reference: str = "fem",
    model: str = "assumed-modes",
    modes: Sequence[int] = (),
    variant: str | None = None,
    basis: str | None = None,
    static_corrections: bool | None = None,
    depths: Sequence[float] | None = None,
    within: float = WITHIN,
    elements: int | None = None,
    time_step: float | None = None,
) -> Comparison:
    """Compare a model, with several numbers of modes, with a reference.

    Parameters
    ----------
    scene
        What is compared. Its kinematics, or those that the variant implies, are taken on both sides.
    reference, model
        "fem", "assumed-modes" or other installed models.
    modes
        Numbers of modes, a compared model each; default: one, as the scene says.
    variant, basis, static_corrections
        Of the compared models; default: as the scene says. ``"as-printed"`` has no equilibria: its run alone is compared.
    depths
        At which shapes and figures are given [m]; default: first and last of the range, and its middle or where it is held.
    within
        Error of the tip at rest (1) for which the range of depth is found.
    elements
        Of the reference; default: those of the scene, else as many as a hundredth of the tolerance (or of ``within``) needs.
    time_step
        Largest step of all runs [s]; default: that of the scene, else the reference's automatic choice.

    Raises
    ------
    SceneError
        If a value is out of range, or a model cannot have what the scene asks for.
    ComputationError
        If the reference, or a model at rest, cannot be computed.
    """
    _check(modes, within)
    base = scene.with_values(overriding(_given("numerics", elements=elements, time_step=time_step)))
    asked = _given("model", kind=model, variant=variant, basis=basis, static_corrections=static_corrections)
    tested = base.with_values(asked)
    scenes = [tested.with_value("model.modes", count) for count in modes] or [tested]
    plain = {"model.kind": reference, "model.variant": None, "model.kinematics": tested.model.kinematics}
    has_statics = tested.model.variant != WITHOUT_STATICS
    true_scene, load, error = _reference(base.with_values(plain), not has_statics, within)
    setting = _setting(true_scene, load, has_statics, depths)
    plants = [build_plant(one.with_values(_held(true_scene))) for one in scenes]  # all of them, before anything is computed
    _refuse_equal(plants, modes, asked)
    truth, true_plant = _answer(setting, build_plant(true_scene), None)
    found = (_compared(setting, plant, truth, true_plant, within) for plant in plants)
    compared = tuple(_beside_elements(setting, plant, truth, model) for plant, model in zip(plants, found, strict=True))
    return Comparison(
        scene=scene,
        reference=truth,
        reference_error=error,
        models=compared,
        kinematics=true_scene.model.kinematics,
        analysis=setting.analysis,
        load=setting.load if setting.has_statics else None,
        depths=setting.depths,
        within=within,
    )


def _given(part: str, **values: Any) -> dict[str, Any]:
    """Return the values of a part that are given, by path."""
    return {f"{part}.{key}": value for key, value in values.items() if value is not None}


def _held(scene: Scene) -> dict[str, Any]:
    """Return what the models take from the reference's scene: analysis, samples, elements."""
    numerics = scene.numerics
    found = {"numerics.analysis": numerics.analysis, "numerics.output_step": numerics.output_step}
    return found | (overriding({"numerics.elements": numerics.elements}) if numerics.mesh is None else {})


def _check(modes: Sequence[int], within: float) -> None:
    mistakes = []
    if len(set(modes)) < len(modes):
        mistakes.append(f"modes: a number is given twice (got {', '.join(map(str, modes))}; allowed numbers that differ)")
    if not 0.0 < within < 1.0:
        mistakes.append(f"within: out of range (got {within:g}; allowed above 0 and below 1)")
    if mistakes:
        raise SceneError(mistakes)


def _refuse_equal(plants: Sequence[Plant], modes: Sequence[int], asked: Mapping[str, Any]) -> None:
    """Refuse numbers of modes, and settings by path, that a model does not know."""
    refuse_idle(plants[0].scene.model.kind, asked)
    if modes and "modes" not in plants[0].describe():
        kind = plants[0].scene.model.kind
        raise SceneError(f"modes: the model {kind!r} does not change with them (got {len(plants)} numbers; allowed none)")


def _reference(scene: Scene, dynamic: bool, within: float) -> tuple[Scene, StaticLoad, float | None]:
    """Return the reference's scene with its analysis, samples and elements, the loads at rest and the error of its mesh."""
    if dynamic and scene.numerics.analysis == "auto":
        scene = scene.with_value("numerics.analysis", "dynamic")
    family = model_family(scene.model.kind)
    choice = choose(scene, lambda: family.pilot(scene))
    scene = scene.with_values({"numerics.analysis": choice.analysis, "numerics.output_step": choice.output_step})
    finest = max(REFERENCE_SHARE * min(within, scene.numerics.tolerance), SMALLEST_TOLERANCE)
    load = static_load(family.pilot(scene))
    loaded = load.applied(scene).with_value("numerics.tolerance", finest)
    chosen = family.choose(loaded, choice.analysis)
    elements = chosen.plant.describe().get("elements")
    fewest = FEWEST_DYNAMIC_ELEMENTS if choice.analysis == "dynamic" else FEWEST_ELEMENTS
    if elements is not None and int(elements) < fewest and scene.numerics.elements == "auto" and scene.numerics.mesh is None:
        elements = fewest
        chosen = family.choose(loaded.with_value("numerics.elements", elements), choice.analysis)
    if elements is not None and scene.numerics.mesh is None:
        scene = scene.with_value("numerics.elements", elements)
    return scene, load, chosen.error


def _setting(scene: Scene, load: StaticLoad, has_statics: bool, depths: Sequence[float] | None) -> _Setting:
    least, most = build_plant(scene).smallest_depth, reach(scene)
    curve = compared_depths(scene, least)
    default = np.linspace(curve[0], curve[-1], DEFAULT_DEPTHS)
    if scene.insertion.kind == "hold" and curve[0] < scene.insertion.first_depth < curve[-1]:
        default[1] = scene.insertion.first_depth
    chosen = tuple(float(depth) for depth in (default if depths is None else depths))
    if not chosen or len(set(chosen)) < len(chosen) or not all(max(least, 0.0) < depth <= most for depth in chosen):
        shown = ", ".join(f"{depth:g}" for depth in chosen)
        raise SceneError(f"depths: got {shown or 'none'}; allowed different depths above {least:g} to {most:g} m")
    analysis = scene.numerics.analysis
    moves = analysis != "static" and not _rests(scene)
    if not moves and not has_statics:
        raise SceneError(f"model.variant: '{WITHOUT_STATICS}' has no equilibrium, and nothing moves in this scene")
    load = load if has_statics else StaticLoad(0.0, 0.0)
    return _Setting(scene, analysis, has_statics, load, curve, chosen, moves)


def _rests(scene: Scene) -> bool:
    """Return whether nothing ever moves."""
    rests = scene.insertion.kind == "hold" and is_steady(scene)
    return rests and scene.initial.shape == "equilibrium" and scene.tissue.rest_line == "straight"


def _answer(setting: _Setting, plant: Plant, truth: ModelAnswer | None) -> tuple[ModelAnswer, Plant]:
    """Return what a model answers (the reference, where there is no truth yet), and the plant of its equilibria."""
    still = plant if not setting.load.probe_force else build_plant(setting.load.applied(plant.scene))
    chosen = curve = run = None
    if setting.has_statics:
        chosen = rest_states(still, setting.depths, setting.load.time)
        curve = rest_states(still, setting.curve_depths, setting.load.time)
    if setting.moves:
        known = None if truth is None else truth.run
        run = reference_run(plant, **setting.steps) if known is None else model_run(plant, known.run)
    warnings = tuple(run.run.summary["warnings"]) if run is not None else plant.warnings
    description = dict(plant.describe())
    answer = ModelAnswer(
        label=_label(description, plant.scene.model.kind),
        description=description,
        unknowns=plant.size - plant.prescribed,
        chosen=chosen,
        curve=curve,
        run=run,
        warnings=warnings if run is None or not run.failure else (*warnings, run.failure),
    )
    return answer, still


def _label(description: dict[str, Any], kind: str) -> str:
    if "modes" not in description:
        return kind
    return f"{description['modes']} mode{'s' if description['modes'] != 1 else ''}"


def _compared(setting: _Setting, model: Plant, truth: ModelAnswer, true_plant: Plant, within: float) -> ComparedModel:
    answer, plant = _answer(setting, model, truth)
    chosen, curve = (
        None if found is None or exact is None else static_errors(found, exact, setting.scene)
        for found, exact in ((answer.chosen, truth.chosen), (answer.curve, truth.curve))
    )
    ranges = _ranges(setting, true_plant, plant, within)
    if answer.run is None or truth.run is None:
        return ComparedModel(answer, chosen, curve, ranges, None, covers=True)
    run = run_errors(answer.run, truth.run)
    covers = run.covers(truth.run)
    if not covers:
        found = answer.run.run
        text = (
            f"{answer.label}: the run ends at {found.time[-1]:.4g} s ({found.summary['stop_reason']}), that of the reference at "
            f"{truth.run.run.time[-1]:.4g} s: errors are those up to {run.time[-1]:.4g} s"
        )
        answer = replace(answer, warnings=(*answer.warnings, text))
    return ComparedModel(answer, chosen, curve, ranges, run, covers)


def _beside_elements(setting: _Setting, plant: Plant, truth: ModelAnswer, model: ComparedModel) -> ComparedModel:
    """Return a model with the cheapest elements that are as right."""
    error, equal = model.largest_tip_error, None
    if truth.run is not None:
        equal = equal_in_run(setting.scene, plant, error, truth.run)
    elif truth.curve is not None:
        equal = equal_at_rest(setting.scene, plant, error, truth.curve, setting.load)
    return replace(model, equal=equal)


def _ranges(setting: _Setting, true_plant: Plant, plant: Plant, within: float) -> tuple[Interval, ...]:
    """Return where the tip at rest is within the error; none of a model without statics."""
    if not setting.has_statics:
        return ()
    time = setting.load.time

    def tips(depth: float) -> tuple[float, float]:
        found = (solve_static(one, depth=depth, time=time).tip_deflection for one in (true_plant, plant))
        return next(found), next(found)

    return described(setting.scene, time, intervals_within(tips, setting.curve_depths, within))
