"""Two models through the same run on the same times: tips, shapes, energies, their differences, and what each costs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.comparison.at_rest import shape_stations
from fem_needle.errors import ComputationError
from fem_needle.plant import Plant
from fem_needle.run_job import run_along
from fem_needle.simulation import simulate
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

ENERGIES = ("kinetic_energy", "bending_energy", "tissue_energy")
SAME_TIME = 1e-9  # of the run
COVERED = 0.9  # of the reference's time: a run that has less in common with it is no answer


@dataclass(frozen=True, eq=False)
class TimedRun:
    """A run and what it took.

    Attributes
    ----------
    run
        The trajectory; of a failed run, what was computed before.
    solve_time
        Of the steps, from the first sample to the last [s]; trial runs are left out.
    failure
        Why it stopped before its end; empty where it did not.
    """

    run: Trajectory
    solve_time: float
    failure: str = ""

    @property
    def energy(self) -> Array:
        """Kinetic, bending and tissue energy together [J], shape (nt,)."""
        return np.asarray(sum(self.run.series[name] for name in ENERGIES), dtype=float)


@dataclass(frozen=True, eq=False)
class RunErrors:
    """Differences of a run from the reference's, at the samples that both have.

    Attributes
    ----------
    time, depth
        Times [s] and the reference's depths [m], shape (nt,).
    tip
        (w - w_ref) / max |w_ref| at the tip (1), the largest over the whole run, shape (nt,).
    shape
        |w - w_ref| / max |w_ref|, root mean squares along the part that bends (1), shape (nt,).
    depth_difference
        Largest difference of the depths [m]; 0 in a prescribed motion.
    energies
        Largest difference of each energy, and of ``total_energy``, by the reference's largest total energy (1).
    """

    time: Array
    depth: Array
    tip: Array
    shape: Array
    depth_difference: float
    energies: dict[str, float]

    @property
    def largest_tip(self) -> float:
        """Largest |tip error| (1)."""
        return float(np.max(np.abs(self.tip)))

    def covers(self, reference: TimedRun) -> bool:
        """Return whether most of the reference's time is compared: a push may end early, a run may fail."""
        return bool(self.time[-1] >= COVERED * reference.run.time[-1])


def reference_run(plant: Plant, **settings: Any) -> TimedRun:
    """Run the reference through its scene with settings of `fem_needle.simulate`, and once more to see what its steps take.

    Raises
    ------
    ComputationError
        If the run fails.
    KeyboardInterrupt
        Also where the run itself would end in order: half a run must not pass for one.
    """
    run = simulate(plant, **settings)
    if run.summary["stop_reason"] == "interrupted":
        raise KeyboardInterrupt
    return replace(model_run(plant, run), run=run)


def model_run(plant: Plant, reference: Trajectory) -> TimedRun:
    """Run a plant in the steps of the reference; a run that fails on its way is an answer: what it computed.

    Raises
    ------
    ComputationError
        If the run fails before its first sample.
    KeyboardInterrupt
        Also where the run itself would end in order.
    """
    run, failure = run_along(plant, reference.course, plant.scene)
    if run.summary["stop_reason"] == "interrupted":
        raise KeyboardInterrupt
    return TimedRun(run, run.summary["solve_time"], failure)


def run_errors(found: TimedRun, reference: TimedRun) -> RunErrors:
    """Return the differences at the samples that both runs have."""
    run, true = found.run, reference.run
    count = _common(run, true)
    floor = true.scene.numerics.absolute_tolerance
    tip_scale = max(float(np.max(np.abs(true.tip_deflection))), floor)
    shape_scale, shapes = _shape_norms(run, true, count)
    energy_scale = float(np.max(reference.energy)) or 1.0
    gaps = {name: run.series[name][:count] - true.series[name][:count] for name in ENERGIES}
    gaps["total_energy"] = found.energy[:count] - reference.energy[:count]
    return RunErrors(
        true.time[:count],
        true.depth[:count],
        (run.tip_deflection[:count] - true.tip_deflection[:count]) / tip_scale,
        shapes / max(shape_scale, floor * np.sqrt(true.scene.needle.length)),
        float(np.max(np.abs(run.depth[:count] - true.depth[:count]))),
        {name: float(np.max(np.abs(gap))) / energy_scale for name, gap in gaps.items()},
    )


def _common(run: Trajectory, true: Trajectory) -> int:
    """Return how many leading samples have the same times: a push may end at slightly different ones."""
    count = min(len(run.time), len(true.time))
    same = np.abs(run.time[:count] - true.time[:count]) <= SAME_TIME * true.time[-1]
    return count if same.all() else int(np.argmin(same))


def _shape_norms(run: Trajectory, true: Trajectory, count: int) -> tuple[float, Array]:
    """Return the largest norm of the reference's shape and the norms of the differences [m^1.5], shape (count,)."""
    norms, largest = np.zeros(count), 0.0
    for row in range(count):
        stations, weights = shape_stations(true.scene, float(true.depth[row]))
        exact = shape_at(true, row, stations)
        largest = max(largest, float(np.sqrt(weights @ exact**2)))
        norms[row] = np.sqrt(weights @ (shape_at(run, row, stations) - exact) ** 2)
    return largest, norms


def shape_at(run: Trajectory, row: int, stations: Array) -> Array:
    """Return the deflection [m] of one sample of a run that was not loaded, at arc lengths [m]."""
    if run.plant is None or run.samples is None:
        raise ComputationError("a run that was loaded from files has no model (compare runs as they are computed)")
    return run.plant.deflection(run.samples.coordinates[row], run.samples.point_forces[row], float(run.depth[row]), stations)
