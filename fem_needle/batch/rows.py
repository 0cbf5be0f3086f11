"""Scenes of a uniform kind as rows of numbers, and which of a scene's values each number is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.batch import columns as at
from fem_needle.errors import SceneError
from fem_needle.motion import run_duration
from fem_needle.scene import Scene, Sinusoid, Table, TipLoad, as_function

Array = NDArray[np.float64]

OUTPUTS = 200
# Values in proportion to which a number of a row changes.
_PROPORTIONAL = {
    "needle.youngs_modulus": at.STIFFNESS,
    "needle.second_moment_of_area": at.STIFFNESS,
    "needle.bending_stiffness": at.STIFFNESS,
    "needle.density": at.MASS,
    "needle.area": at.MASS,
    "needle.mass_per_length": at.MASS,
    "tissue.stiffness_factor": at.MODULUS,
    "tissue.layers.0.foundation_modulus": at.MODULUS,
    "tissue.layers.0.damping": at.VISCOSITY,
    "loads.0.force": at.FORCE,
    "loads.0.force.mean": at.FORCE,
    "loads.0.force.amplitude": at.AMPLITUDE,
    "loads.0.force.frequency": at.FREQUENCY,
    "loads.0.force.phase": at.PHASE,
    "initial.tip_deflection": at.START,
    "insertion.initial_depth": at.DEPTH,
    "insertion.speed": at.SPEED,
}


def row_of(scene: Scene) -> Array:
    """Return the numbers of a scene that `is_uniform`, without a time step."""
    needle, insertion = scene.needle, scene.insertion
    row = np.zeros(at.VALUES)
    layer = scene.tissue.layers[0] if scene.tissue.layers else None
    factor = as_function(scene.tissue.stiffness_factor).value(0.0)
    row[at.STIFFNESS], row[at.MASS] = needle.bending_stiffness, needle.mass_per_length
    if layer is not None:
        row[at.MODULUS], row[at.VISCOSITY] = layer.foundation_modulus * factor, layer.damping
    row[at.DEPTH] = insertion.first_depth
    if insertion.kind == "speed" and isinstance(insertion.speed, float):
        row[at.SPEED] = insertion.speed
        row[at.ARRIVAL] = np.inf if insertion.rest_time is None else insertion.rest_time
    _set_force(row, scene)
    row[at.DURATION] = run_duration(scene)
    released = {"equilibrium": np.nan, "straight": 0.0, "tip-displaced": scene.initial.tip_deflection or 0.0}
    row[at.START] = released[scene.initial.shape]
    step = scene.numerics.output_step
    row[at.OUTPUT_STEP] = row[at.DURATION] / OUTPUTS if step == "auto" else step
    return row


def _set_force(row: Array, scene: Scene) -> None:
    for load in scene.loads:
        force = load.force
        if not isinstance(load, TipLoad) or isinstance(force, Table):
            continue  # `is_uniform` has seen to it that there is none
        if isinstance(force, Sinusoid):
            row[at.FORCE] += force.mean
            row[at.AMPLITUDE], row[at.PHASE] = force.amplitude, force.phase
            row[at.FREQUENCY] = 2 * np.pi * force.frequency
        elif load.bevel_coefficient is not None:
            row[at.FORCE] += load.bevel_coefficient * row[at.MODULUS]
        else:
            row[at.FORCE] += float(force or 0.0)


def rows_of(scene: Scene, parameters: Mapping[str, ArrayLike]) -> Array:
    """Return a row for each of many values of some of a scene's values, given by path, without building the scenes.

    Raises
    ------
    SceneError
        If a path cannot be varied so, the numbers of values differ, or the smallest or largest of them is impossible.
    """
    if not parameters:
        return row_of(scene)[None]
    values = {path: np.atleast_1d(np.asarray(given, dtype=float)) for path, given in parameters.items()}
    counts = {len(given) for given in values.values()}
    if len(counts) != 1 or any(given.ndim != 1 for given in values.values()):
        raise SceneError(f"parameters: as many values each (got {sorted(counts)}; allowed one number of them)")
    rows = np.tile(row_of(scene), (counts.pop(), 1))
    for path, given in values.items():
        _check(scene, path, given)
        column = _PROPORTIONAL[path]
        base = _base_value(scene, path)
        rows[:, column] = given * (rows[0, column] / base) if base else given
    if {"insertion.speed", "insertion.initial_depth"} & set(values):
        _set_arrival(rows, scene)
    return rows


def can_vary(scene: Scene, paths: Sequence[str]) -> bool:
    """Return whether all the paths are numbers of a row, and none of them hides in a sum."""
    alone = len(scene.loads) <= 1 and not any(getattr(load, "bevel_coefficient", None) for load in scene.loads)
    return alone and all(path in _PROPORTIONAL for path in paths)


def _check(scene: Scene, path: str, values: Array) -> None:
    """Let the scene judge the extremes; what lies between is allowed where they are."""
    if not np.all(np.isfinite(values)):
        raise SceneError(f"{path}: not finite (got {values[~np.isfinite(values)][0]}; allowed finite numbers)")
    for value in {float(np.min(values)), float(np.max(values))}:
        scene.with_value(path, value)


def _base_value(scene: Scene, path: str) -> float:
    found: Any = scene.to_dict()
    for part in path.split("."):
        found = found[int(part)] if isinstance(found, list | tuple) else found[part]
    return float(found)


def _set_arrival(rows: Array, scene: Scene) -> None:
    """Find when the needle comes to rest, and how long the run lasts, with other speeds or starts."""
    final, was = scene.insertion.final_depth, rows[:, at.DURATION].copy()
    if final is not None:
        rows[:, at.ARRIVAL] = (final - rows[:, at.DEPTH]) / rows[:, at.SPEED]
        if scene.run.duration is None:
            rows[:, at.DURATION] = rows[:, at.ARRIVAL]
    if scene.numerics.output_step == "auto":
        rows[:, at.OUTPUT_STEP] *= rows[:, at.DURATION] / was


def times_of(rows: Array) -> Array:
    """Return the output times [s] of every row (runs, outputs), 0, S, 2 S, ... and the end; NaN after it."""
    duration, step = rows[:, at.DURATION, None], rows[:, at.OUTPUT_STEP, None]
    last = np.floor(duration / step * (1 + 1e-12))
    last += last * step <= duration * (1 - 1e-12)
    number = np.arange(int(np.max(last)) + 1)
    return np.where(number > last, np.nan, np.minimum(number * step, duration))


def depths_of(rows: Array, times: Array) -> Array:
    """Return the depths [m] at times (runs, outputs)."""
    arrival = rows[:, at.ARRIVAL, None]
    return rows[:, at.DEPTH, None] + rows[:, at.SPEED, None] * np.minimum(times, arrival)
