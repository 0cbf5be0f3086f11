"""Error against time of integrators: the kernel's collocation family, and prototypes with one real matrix (`one_matrix`).

    python -m benchmarks.integrators --out benchmarks/results/integrators.csv
    python -m benchmarks.integrators_page          tables and picture of docs/integrators.md

Every method takes fixed steps, compiled, one thread, of the same parts, without ledger and reactions; "product" is the product's
own loop with them. What is true: `integrator_cases`. Times are of the processor, the shortest of nine runs.
"""

from __future__ import annotations

import argparse
import csv
import time as clock
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import one_matrix
from benchmarks.integrator_cases import Case, cases, guided, miss
from benchmarks.one_matrix_run import Prototype
from fem_needle import FiniteElementNeedle, Trajectory, simulate
from fem_needle.collocation import collocation
from fem_needle.dynamics.engine import DYNAMIC
from fem_needle.dynamics.grid import TimeGrid, time_grid
from fem_needle.dynamics.run import Integration, run_samples
from fem_needle.free_response import frozen_matrices, vibrations
from fem_needle.sample_arrays import joined, tips_of
from fem_needle.scene import Scene
from tests.consistency.scenes import GEL, PUSH, held, moving, scene_of
from tests.stability.orders import DURATION, HUB, pushed_reference, pushed_scene

Array = NDArray[np.float64]
NAMES: dict[str, str | float] = {"Gauss": 1.0, "radius 1/2": 0.5, "Radau IIA": 0.0, "SDIRK": "SDIRK", "RODAS": "RODAS"}
REPEATS = 9
PERIODS, PER_PERIOD = 1000, (8, 16, 32)
PUSH_STEPS = (8e-5, 4e-5, 2e-5, 1e-5)
CUT_STEPS = (2e-2, 1e-2, 5e-3, 2.5e-3)


@dataclass(frozen=True)
class Row:
    """One run.

    Attributes
    ----------
    case, method
        Their names; "graded": the first step behind a kink is taken in parts.
    step, steps
        The largest step [s] (of the vibration: steps per period) and how many were taken.
    seconds
        That they took.
    error
        Of the tip over all outputs, relative to its largest deflection; of a push that of the depth, too.
    doubt
        What two runs of the solver differ by that is taken as true.
    energy
        Relative residual of the ledger; of the vibration the change of its energy.
    phase
        Of the vibration at the end [rad].
    spike
        Largest distance [N] of a push from the mean of its neighbors.
    """

    case: str
    method: str
    step: float
    steps: int
    seconds: float | None = None
    error: float | None = None
    doubt: float | None = None
    energy: float | None = None
    phase: float | None = None
    spike: float | None = None


def timed(case: Case, name: str, step: float, *, graded: bool = False) -> Row:
    """Return the row of a prototype."""
    grid = replace(time_grid(case.needle, step, case.output), is_graded=graded)
    prototype = Prototype(case.needle, NAMES[name])
    runs = [prototype.run(grid) for _ in range(REPEATS)]
    error = miss(runs[0].states[:, 0, -2], case.true_tips[1:])
    full = name + (", graded" if graded else "")
    return Row(case.name, full, step, runs[0].steps, min(run.seconds for run in runs), error, case.doubt)


def product(case: Case, name: str, step: float) -> Row:
    """Return the row of the product's own loop, works, energies and reactions included."""
    grid, radius = time_grid(case.needle, step, case.output), float(NAMES[name])
    seconds = []
    for _ in range(REPEATS):
        began = clock.thread_time()
        blocks = list(run_samples(case.needle, Integration(DYNAMIC, collocation(radius)), grid))
        seconds.append(clock.thread_time() - began)
    error = miss(tips_of(case.needle, joined(blocks)), case.true_tips)
    return Row(case.name, f"product, {name}", step, grid.steps, min(seconds), error, case.doubt)


def moved() -> Iterator[Row]:
    """Yield the rows of needles that move in tissue."""
    for case in cases():
        for step in case.steps:
            for name in NAMES:
                yield timed(case, name, step)
            for name in ("Gauss", "Radau IIA", "SDIRK", "RODAS"):
                yield timed(case, name, step, graded=True)
            yield product(case, "Gauss", step)


def spike(run: Trajectory) -> float:
    """Return the largest distance of a push from the mean of its neighbors [N]."""
    push = run.push_force
    return float(np.max(np.abs(push[1:-1] - 0.5 * (push[:-2] + push[2:]))))


def through_guide() -> Iterator[Row]:
    """Yield the rows of a jerked hub; pushes and energies where there is a ledger."""
    case = guided()
    for step in case.steps:
        for name in ("Gauss", "radius 1/2", "Radau IIA", "SDIRK"):
            row = timed(case, name, step)
            if name != "SDIRK":
                scene = case.scene.with_value("numerics.spectral_radius", float(NAMES[name]))
                needle = FiniteElementNeedle(scene, elements=case.elements)
                run = simulate(needle, time_step=step, analysis="dynamic", output_step=step)
                row = replace(row, energy=run.summary["relative_energy_residual"], spike=spike(run))
            yield row


def vibrating() -> Iterator[Row]:
    """Yield energy and phase of the first vibration of a held needle after many periods, against its closed form."""
    scene = scene_of("hub", held(0.1), GEL, (), duration=1.0)
    needle = FiniteElementNeedle(scene, elements=4)
    mass, _, stiffness, _ = frozen_matrices(needle, 0.1, 0.0)
    squares, shapes = vibrations(mass, stiffness)
    shape, omega = shapes[:, 0], float(np.sqrt(squares[0]))
    begin = np.zeros((2, needle.size))
    begin[0, needle.prescribed :] = 1e-3 * shape
    for count in PER_PERIOD:
        end = PERIODS * 2 * np.pi / omega
        grid = TimeGrid((0.0, end), (), end / (PERIODS * count))
        for name, method in NAMES.items():
            run = Prototype(needle, method).run(grid, begin)
            q, p = run.states[-1][:, needle.prescribed :]
            amplitude = complex(shape @ mass @ q, -(shape @ p) / omega) / 1e-3
            energy = float(p @ np.linalg.solve(mass, p) + q @ stiffness @ q) / (1e-3 * omega) ** 2 - 1.0
            phase = float(np.angle(amplitude)) if abs(amplitude) > 1e-6 else None
            yield Row("first vibration, 1000 periods", name, count, grid.steps, run.seconds, energy=energy, phase=phase)


def pushed() -> Iterator[Row]:
    """Yield the rows of a push whose force has kinks: depth and tip against DOP853 (`tests/stability`)."""
    model, kind = HUB, "moving, kinked"
    true = pushed_reference(model, kind)
    for step in PUSH_STEPS:
        for name in ("Gauss", "radius 1/2", "Radau IIA"):
            scene = pushed_scene(model, kind).with_value("numerics.spectral_radius", float(NAMES[name]))
            run, seconds = _clocked(model.plant(scene), step, "dynamic", DURATION)
            found = np.array([run.depth[-1] - 0.1, run.tip_deflection[-1]])
            error, energy = float(np.max(np.abs(found / true - 1.0))), run.summary["relative_energy_residual"]
            yield Row("push with kinks", name, step, run.summary["steps"], seconds, error, energy=energy)


def cutting() -> Iterator[Row]:
    """Yield the rows of a needle on the path that it cuts: nothing but the ledger is known of it."""
    path: Scene = scene_of("hub", moving(0.05, 0.03, 0.08), GEL, PUSH, tissue={"rest_line": "cut-path"}, duration=1.0)
    for step in CUT_STEPS:
        for name in ("Gauss", "radius 1/2", "Radau IIA"):
            scene = path.with_value("numerics.spectral_radius", float(NAMES[name]))
            run, seconds = _clocked(FiniteElementNeedle(scene, elements=8), step, "dynamic", 0.1)
            yield Row("cut path", name, step, run.summary["steps"], seconds, energy=run.summary["relative_energy_residual"])


def _clocked(needle: FiniteElementNeedle, step: float, analysis: str, output: float) -> tuple[Trajectory, float]:
    found = []
    for _ in range(REPEATS):
        began = clock.thread_time()
        run = simulate(needle, time_step=step, analysis=analysis, output_step=output)
        found.append(clock.thread_time() - began)
    return run, min(found)


def write(path: Path, rows: list[Row]) -> None:
    """Write rows; what is not known stays empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = [field.name for field in fields(Row)]
        writer.writerow(names)
        for row in rows:
            values = [getattr(row, name) for name in names]
            writer.writerow(["" if value is None else f"{value:.5g}" if isinstance(value, float) else value for value in values])


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/integrators.csv"))
    arguments = parser.parse_args()
    one_matrix.prepare()
    rows = []
    for part in (moved, through_guide, vibrating, pushed, cutting):
        for row in part():
            rows.append(row)
            print(row, flush=True)
    write(arguments.out, rows)


if __name__ == "__main__":
    main()
