"""One scene on a series of discretizations of which a single one varies: the raw material of a convergence study."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.choices import choose, first_time_step
from fem_needle.dynamics.engine import REST
from fem_needle.dynamics.run import without_inertia
from fem_needle.errors import SceneError
from fem_needle.loads import is_steady
from fem_needle.models import model_family
from fem_needle.motion import depth_law, run_duration
from fem_needle.plant import Plant
from fem_needle.rounding import round_off
from fem_needle.scene import Scene
from fem_needle.scene.settings import overriding
from fem_needle.simulation import simulate
from fem_needle.statics import solve_static

Array = NDArray[np.float64]

PATHS = {"elements": "numerics.elements", "time-step": "numerics.time_step", "modes": "model.modes"}
STATIC_INSTANTS = 21  # equilibria over a run that moves
FIXED_STEP_SHARE = 0.125  # of the automatic first step: the step that is held fixed
ROUND_OFF_INSTANTS = 7


def refuse_refined(over: str, given: Mapping[str, object]) -> None:
    """Refuse a value, by path, for what a study refines and does not hold fixed.

    Raises
    ------
    SceneError
        With the path.
    """
    path = PATHS.get(over, "")
    if given.get(path) is not None:
        raise SceneError(f"{path}: has no effect where it is refined (got {given[path]!r}; give the values of the study instead)")


@dataclass(frozen=True)
class Setting:
    """What is the same in every row.

    Attributes
    ----------
    scene
        The scene, with the analysis that was chosen.
    over
        "elements", "time-step" or "modes".
    times
        Instants of the equilibria [s]; None where the run is integrated in time.
    time_step, output_step
        Of the integration [s]; no time step where it is what varies.
    """

    scene: Scene
    over: str
    times: tuple[float, ...] | None
    time_step: float | None
    output_step: float

    @property
    def analysis(self) -> str:
        """What is computed: "static", "quasi-static" or "dynamic"."""
        return "static" if self.times is not None else self.scene.numerics.analysis


@dataclass(frozen=True, eq=False)
class Level:
    """One discretization and its answer.

    Attributes
    ----------
    value
        What was asked for: elements, modes, or the time step [s].
    size
        What the error is a power of: 1 / elements, 1 / modes, or the largest time step that was taken [s].
    plant
        The model.
    times
        Instants [s], shape (nt,).
    tips
        Deflection of the tip then [m], shape (nt,).
    shape
        Deflection along the needle at the end [m], shape (stations,).
    round_off
        Of the tip, relative to its largest deflection over the run; of an integrated run times the root of the steps.
    solve_time
        To make the model and to solve it [s].
    """

    value: float
    size: float
    plant: Plant
    times: Array
    tips: Array
    shape: Array
    round_off: float
    solve_time: float


def setting_of(scene: Scene, over: str, values: Sequence[float] | None) -> Setting:
    """Return what all rows share: the analysis, the instants, the time step that is held fixed.

    Raises
    ------
    SceneError
        If there is nothing to vary: a time step of equilibria.
    """
    family = model_family(scene.model.kind)
    if over != "time-step" and values:
        scene = scene.with_values(overriding({PATHS[over]: max(values)}))
    choice = choose(scene, lambda: family.pilot(scene))
    scene, followed = scene.with_value("numerics.analysis", choice.analysis), choice.analysis
    if choice.passes_over:
        scene, followed = scene.with_value("numerics.spectral_radius", 0.0), "quasi-static"
    plant = family.pilot(scene)
    if _is_series_of_equilibria(scene, plant):
        if over == "time-step":
            raise SceneError("over: got 'time-step', but this run is a series of equilibria (allowed 'elements', 'modes')")
        return Setting(scene, over, _instants(scene), None, choice.output_step)
    given = scene.numerics.time_step
    step = given if isinstance(given, float) else FIXED_STEP_SHARE * first_time_step(plant, followed, choice.output_step)
    return Setting(scene, over, None, None if over == "time-step" else step, choice.output_step)


def coarsest_time_step(setting: Setting) -> float:
    """Return the step that the automatic choice would begin with [s]."""
    plant = model_family(setting.scene.model.kind).pilot(setting.scene)
    return first_time_step(plant, setting.analysis, setting.output_step)


def levels_of(setting: Setting, values: Sequence[float]) -> tuple[Level, ...]:
    """Return the answers of all discretizations, coarse to fine.

    Raises
    ------
    SceneError
        If a value is impossible or two of them give the same discretization.
    """
    family = model_family(setting.scene.model.kind)
    if setting.over == "time-step":
        plant = family.choose(setting.scene, setting.analysis).plant
        levels = tuple(solve_level(replace(setting, time_step=value), lambda: plant, value) for value in values)
    else:
        path = PATHS[setting.over]
        scenes = [setting.scene.with_values(overriding({path: value})) for value in values]
        makers = [partial(family.build, scene) for scene in scenes]
        _refuse_unchanged(setting, [makers[0](), makers[-1]()])
        levels = tuple(solve_level(setting, make, value) for make, value in zip(makers, values, strict=True))
    _refuse_equal(setting, levels)
    return levels


def solve_level(setting: Setting, make: Callable[[], Plant], value: float) -> Level:
    """Return the answer of one discretization; ``make`` makes its model.

    Raises
    ------
    KeyboardInterrupt
        Also where the run itself would end in order.
    """
    started, steps = clock.perf_counter(), 1
    plant = make()
    if setting.times is not None:
        times, tips, shape = _equilibria(setting.scene, setting.times, plant)
        size = 1.0 / value
    else:
        run = simulate(plant, time_step=setting.time_step, analysis=setting.analysis, output_step=setting.output_step)
        if run.summary["stop_reason"] == "interrupted":  # half a run must not pass for a row
            raise KeyboardInterrupt
        times, tips, shape = run.time, run.tip_deflection, run.station_deflection[-1]
        size = float(run.summary["time_step"]) if setting.over == "time-step" else 1.0 / value
        steps = int(run.summary["steps"])
    seconds = clock.perf_counter() - started
    floor = sqrt(steps) * _largest_round_off(setting, plant, times, tips)  # the steps' round-off adds up as a random walk
    return Level(value, size, plant, times, tips, shape, floor, seconds)


def finer_otherwise(setting: Setting, finest: Level) -> Level | None:
    """Return the finest row once more with what is held fixed made finer by two; None where that is impossible."""
    if setting.over != "time-step":
        halved = replace(setting, time_step=0.5 * float(setting.time_step or 0.0))
        return solve_level(halved, lambda: finest.plant, finest.value)
    key, count = size_of(finest.plant)
    if not key:
        return None
    try:
        plant = model_family(setting.scene.model.kind).build(setting.scene.with_value(PATHS[key], 2 * count))
    except SceneError:
        return None
    return solve_level(replace(setting, time_step=finest.value), lambda: plant, finest.value)


def size_of(plant: Plant) -> tuple[str, int]:
    """Return what the size of a model is called and how large it is; an empty name where it does not say."""
    description: dict[str, Any] = plant.describe()
    return next(((key, int(description[key])) for key in ("modes", "elements") if key in description), ("", 0))


def _largest_round_off(setting: Setting, plant: Plant, times: Array, tips: Array) -> float:
    """Return the largest round-off among some instants, each by the share of its tip in the largest."""
    law, largest = depth_law(setting.scene), float(np.max(np.abs(tips))) or 1.0
    stepped = setting.times is None
    chosen = np.unique(np.linspace(0, len(times) - 1, ROUND_OFF_INSTANTS).astype(int)).tolist()
    found = [abs(tips[row]) / largest * round_off(plant, law.depth(times[row]), times[row], stepped=stepped) for row in chosen]
    return float(max(found))


def _is_series_of_equilibria(scene: Scene, plant: Plant) -> bool:
    """Return whether no instant depends on an earlier one, or nothing ever moves."""
    if scene.insertion.kind == "force":
        return False
    if scene.numerics.analysis == "static":
        return True
    if scene.numerics.analysis == "quasi-static" and without_inertia(scene).kind == REST:
        return True
    rests = scene.insertion.kind == "hold" and is_steady(scene)
    return rests and scene.initial.shape == "equilibrium" and scene.tissue.rest_line == "straight"


def _instants(scene: Scene) -> tuple[float, ...]:
    if scene.insertion.kind == "hold" and is_steady(scene):
        return (0.0,)
    return tuple(np.linspace(0.0, run_duration(scene), STATIC_INSTANTS).tolist())


def _equilibria(scene: Scene, times: Sequence[float], plant: Plant) -> tuple[Array, Array, Array]:
    """Return times, tips and the last shape."""
    law = depth_law(scene)
    rests = [solve_static(plant, depth=law.depth(time), time=time) for time in times]
    stations = np.linspace(0.0, scene.needle.length, scene.numerics.output_points)
    return np.array(times), np.array([rest.tip_deflection for rest in rests]), rests[-1].deflection(stations)


def _refuse_unchanged(setting: Setting, plants: Sequence[Plant]) -> None:
    """Refuse, before anything is computed, a model that knows nothing of what is varied."""
    if len({plant.size for plant in plants}) == 1:
        kind = setting.scene.model.kind
        other = "assumed-modes" if setting.over == "modes" else "fem"
        raise SceneError(f"over: got {setting.over!r}; the model {kind!r} does not change with it, {other!r} does (--model)")


def _refuse_equal(setting: Setting, levels: Sequence[Level]) -> None:
    """Refuse rows that are the same discretization."""
    sizes = [level.size for level in levels]
    if len(set(sizes)) < len(sizes) or any(fine >= coarse for coarse, fine in pairwise(sizes)):
        found = ", ".join(f"{level.value:g} s gives {level.size:g} s" for level in levels)
        limits = f"an output every {setting.output_step:g} s and kinks of the motion shorten steps"
        raise SceneError(f"values: two time steps are the same ({found}; {limits}: use shorter steps or a longer output step)")
