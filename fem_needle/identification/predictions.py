"""What a scene says of measured rows: equilibria with exact sensitivities, or runs with differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle.dynamics.vibration import needs_no_steps
from fem_needle.errors import SceneError
from fem_needle.identification.data_columns import SHAPE, check_time, fitted_columns
from fem_needle.identification.measurements import Measurements
from fem_needle.identification.static_model import Place, StaticProblem, static_problem
from fem_needle.motion import run_duration
from fem_needle.scene import Scene
from fem_needle.simulation import run_scene
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

SAMPLES_BETWEEN, MOST_BETWEEN, MOST_SAMPLES = 4, 40, 20_000  # of a run: fewest and most in a measured interval; in all
HIT = 1e-6  # of a sample's interval: a measured time that is a sample's
STEP = 1e-4  # of a parameter: of the differences of a run


@dataclass(frozen=True)
class MeasuredRow:
    """Where a measured value comes from.

    Attributes
    ----------
    source, column
        Data set and column.
    depth, time
        [m], [s]; None where the data do not say.
    """

    source: str
    column: str
    depth: float | None
    time: float | None

    @property
    def unit(self) -> str:
        """SI unit of the value."""
        return "N" if self.column == "push_force" else "m"


class Predictor(Protocol):
    """The model of some rows."""

    @property
    def rows(self) -> tuple[MeasuredRow, ...]:
        """Where each row comes from."""

    @property
    def measured(self) -> Array:
        """Measured values (n,), SI."""

    @property
    def deviations(self) -> Array:
        """Standard deviation of each row (n,), or 1."""

    @property
    def is_absolute(self) -> bool:
        """Whether the deviations were given."""

    def answers(self, values: Array) -> tuple[Array, Array]:
        """Return what the model says of every row (n,) and how that changes with each parameter (n, p)."""


@dataclass(frozen=True, eq=False)
class AtRest:
    """Rows of a needle at rest."""

    problem: StaticProblem
    measured: Array
    deviations: Array
    is_absolute: bool
    rows: tuple[MeasuredRow, ...]

    def answers(self, values: Array) -> tuple[Array, Array]:
        """Return deflections and exact sensitivities."""
        return self.problem.answers(values)


@dataclass(frozen=True, eq=False)
class InMotion:
    """Rows along a run of a scene, each a column at a time; sensitivities by central differences of runs with the same steps."""

    scene: Scene
    paths: tuple[str, ...]
    sets: tuple[Measurements, ...]
    measured: Array
    deviations: Array
    is_absolute: bool
    rows: tuple[MeasuredRow, ...]

    def answers(self, values: Array) -> tuple[Array, Array]:
        """Return what runs say; one run, and two for each parameter."""
        slopes = []
        for number, value in enumerate(values):
            step = STEP * (abs(value) or 1.0)
            ends = [self._answers(_replaced(values, number, value + sign * step)) for sign in (1.0, -1.0)]
            slopes.append((ends[0] - ends[1]) / (2.0 * step))
        return self._answers(values), np.stack(slopes, axis=1)

    def _answers(self, values: Array) -> Array:
        run = run_scene(self.scene.with_values(dict(zip(self.paths, values.tolist(), strict=True))))
        return np.concatenate([_column(run, one, name) for one in self.sets for name in fitted_columns(one)])


def _replaced(values: Array, number: int, value: float) -> Array:
    result = values.copy()
    result[number] = value
    return result


def predictor_of(
    scene: Scene, sets: Sequence[Measurements], paths: Sequence[str], deviations: Mapping[str, float]
) -> Predictor:
    """Return the model of data sets: equilibria where a depth is measured and nothing but deflections, else runs.

    Raises
    ------
    SceneError
        If a data set has no column that could be fitted, or neither depth nor time.
    """
    names = [name for one in sets for name in fitted_columns(one)]
    measured = np.concatenate([one[name] for one in sets for name in fitted_columns(one)])
    known = _deviations(sets, names, deviations)
    rows = tuple(row for one in sets for name in fitted_columns(one) for row in _rows(one, name))
    at_rest = all("depth" in one for one in sets) and "push_force" not in names and _rests(scene)
    if at_rest:
        places, order = _places(scene, sets)
        problem = static_problem(scene, places, paths)
        if problem is not None:
            return AtRest(problem, measured[order], known[order], bool(deviations), tuple(rows[one] for one in order))
    if not all("time" in one for one in sets):
        raise SceneError("data: need a column 'time [s]' here (got none): only equilibria of plain loads are known by depth")
    return InMotion(_fixed(_sampled(scene, sets)), tuple(paths), tuple(sets), measured, known, bool(deviations), rows)


def _rests(scene: Scene) -> bool:
    """Return whether the scene is computed through equilibria."""
    still = not any(layer.damping > 0.0 for layer in scene.tissue.layers)
    return scene.tissue.rest_line == "straight" and (
        scene.numerics.analysis == "static" or (scene.numerics.analysis == "quasi-static" and still)
    )


def _rows(data: Measurements, name: str) -> list[MeasuredRow]:
    """Return where the values of a column come from."""
    depths, times = (data[key].tolist() if key in data else [None] * data.size for key in ("depth", "time"))
    return [MeasuredRow(data.source, name, depth, time) for depth, time in zip(depths, times, strict=True)]


def _station(name: str, length: float) -> float:
    """Return the arc length [m] of a column."""
    if name == "tip_deflection":
        return length
    try:
        station = 1e-3 * float(name.removeprefix(SHAPE))
    except ValueError:
        station = -1.0
    if not 0.0 <= station <= length * (1 + 1e-9):
        raise SceneError(f"column {name!r}: is no arc length of the needle (allowed {SHAPE}0 to {SHAPE}{1e3 * length:g}, in mm)")
    return min(station, length)


def _places(scene: Scene, sets: Sequence[Measurements]) -> tuple[list[Place], NDArray[np.intp]]:
    """Return a place for each row of each set, and the order in which their deflections come among the columns."""
    places, order, offset, length = [], [], 0, scene.needle.length
    for one in sets:
        check_time(scene, one)
        columns = fitted_columns(one)
        stations = np.array([_station(name, length) for name in columns])
        times = one["time"] if "time" in one else np.zeros(one.size)
        for row, (depth, time) in enumerate(zip(one["depth"], times, strict=True)):
            if not 0.0 < depth <= length:
                raise SceneError(f"{one.source}: depth out of range (got {depth:g}; allowed above 0 to {length:g} m)")
            places.append(Place(float(depth), float(time), stations))
            order += [offset + column * one.size + row for column in range(len(columns))]
        offset += one.size * len(columns)
    return places, np.array(order, dtype=np.intp)


def _deviations(sets: Sequence[Measurements], names: Sequence[str], given: Mapping[str, float]) -> Array:
    kinds = {"deflection" if name != "push_force" else name for name in names}
    missing, idle = sorted(set(names) - set(given)), sorted(set(given) - set(names))
    if idle:
        raise SceneError(f"deviations: {', '.join(idle)}: no column that is fitted (allowed {', '.join(dict.fromkeys(names))})")
    if given and missing:
        raise SceneError(f"deviations: of every column or of none (missing {', '.join(missing)})")
    if not given and len(kinds) > 1:
        raise SceneError("deviations: must be given where forces and deflections are fitted together")
    if any(not value > 0.0 for value in given.values()):
        raise SceneError(f"deviations: must be positive (got {dict(given)})")
    return np.concatenate([np.full(one.size, given.get(name, 1.0)) for one in sets for name in fitted_columns(one)])


def _sampled(scene: Scene, sets: Sequence[Measurements]) -> Scene:
    """Return the scene with samples at the measured times, or dense enough between them, where it says nothing of them."""
    if scene.numerics.output_step != "auto":
        return scene
    times = np.concatenate([one["time"] for one in sets])
    closest = min(float(np.min(np.diff(one["time"]))) for one in sets if one.size > 1)
    # At the times themselves nothing is interpolated, so that kinks do no harm.
    shares = (closest / parts for parts in range(SAMPLES_BETWEEN, MOST_BETWEEN + 1))
    step = next((one for one in shares if np.all(np.abs(times / one - np.round(times / one)) < HIT)), closest / SAMPLES_BETWEEN)
    return scene.with_value("numerics.output_step", max(step, run_duration(scene) / MOST_SAMPLES))


def _fixed(scene: Scene) -> Scene:
    """Return the scene with the mesh and the steps that a run of it chooses: differences of runs must not see other ones."""
    first = run_scene(scene)
    changes: dict[str, float | int | str] = {}
    if scene.numerics.time_step == "auto" and not needs_no_steps(scene):
        changes["numerics.time_step"] = float(first.summary["time_step"])
    if "elements" in first.summary and scene.numerics.mesh is None:
        changes["numerics.elements"] = int(first.summary["elements"])
    if scene.numerics.analysis == "auto":
        changes["numerics.analysis"] = str(first.summary["analysis"])
    return scene.with_values(changes) if changes else scene


def _column(run: Trajectory, data: Measurements, name: str) -> Array:
    """Return what a run says of a column at the measured times, by a cubic spline through its samples."""
    times = data["time"]
    if times[0] < run.time[0] or times[-1] > run.time[-1] * (1 + 1e-9):
        limits = f"got {times[0]:g} to {times[-1]:g} s; allowed {run.time[0]:g} to {run.time[-1]:g} s, the run's"
        raise SceneError(f"{data.source}: times outside the run ({limits})")
    if name.startswith(SHAPE):
        station = np.array([_station(name, run.scene.needle.length)])
        values = run.deflection(station)[:, 0]
    else:
        values = getattr(run, name)
    return np.asarray(scipy.interpolate.CubicSpline(run.time, values)(times))
