"""How often automatic settings keep the tolerance, how honest their error estimate is, and what they cost.

    python -m benchmarks.hit_rate --seeds 0 40 --tolerances 1e-2 1e-3 --out benchmarks/results/hit_rate.csv

Random scenes (`tests/consistency/random_scenes.py`); the truth comes from spectral solvers that share no code with the needle.
The cheapest fixed setting is looked for from the automatic one downwards: fewer elements, then longer steps, until the tolerance
is missed. Cost is steps times unknowns, trial runs included.
"""

from __future__ import annotations

import argparse
import csv
import time
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np

from fem_needle import FiniteElementNeedle, NeedleError, run_scene, simulate
from tests.consistency.random_scenes import OUTPUTS, random_scene, true_tips

FIELDS = (
    "seed", "support", "insertion", "initial", "tolerance", "analysis", "elements", "steps", "cost", "error", "estimate",
    "uncertainty", "fixed_elements", "fixed_steps", "fixed_cost", "seconds", "note",
)  # fmt: skip
SHARE = 0.3  # of the difference of two truths: what the finer one may miss
ELEMENTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
LONGER = (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)


class Patience:
    """An observer that ends a run after some seconds."""

    def __init__(self, seconds: float) -> None:
        self.until = time.perf_counter() + seconds

    def begin(self, plant: object, choice: dict[str, object]) -> None:
        """Ignore."""

    def progress(self, fraction: float) -> None:
        """Interrupt a run that takes too long."""
        if time.perf_counter() > self.until:
            raise KeyboardInterrupt

    def samples(self, block: object) -> None:
        """Ignore."""


def measured(seed: int, tolerance: float, seconds: float, *, fixed: bool) -> dict[str, object]:
    """Return one row of the table."""
    scene = random_scene(seed).with_value("numerics.tolerance", tolerance)
    row: dict[str, object] = dict.fromkeys(FIELDS, "") | {"seed": seed, "tolerance": tolerance}
    row |= {"support": scene.support.kind, "insertion": scene.insertion.kind, "initial": scene.initial.shape}
    truth, uncertainty = _truth(seed)
    row |= {"uncertainty": SHARE * uncertainty}
    if SHARE * uncertainty > 0.3 * tolerance:
        return row | {"note": "truth unknown"}
    started = time.perf_counter()
    try:
        run = run_scene(scene, observer=Patience(seconds))
    except (NeedleError, KeyboardInterrupt) as error:
        return row | {"note": type(error).__name__}
    row |= {name: run.summary[name] for name in ("analysis", "elements", "steps")} | {"seconds": time.perf_counter() - started}
    if run.summary["stop_reason"] == "interrupted":
        return row | {"note": "took too long"}
    error = error_of(run.tip_deflection, truth)
    row |= {"cost": run.summary["step_unknowns"], "error": error, "estimate": run.summary["error_estimate"]}
    row |= {"note": "; ".join(text.split(":")[0] for text in run.summary["warnings"])}
    return row | (cheapest(scene, run, truth, tolerance) if fixed and error <= tolerance else {})


@lru_cache(maxsize=1)
def _truth(seed: int) -> tuple[np.ndarray, float]:
    scene = random_scene(seed)
    return true_tips(scene, np.linspace(0.0, scene.duration, OUTPUTS + 1))


def error_of(tips: np.ndarray, truth: np.ndarray) -> float:
    """Return the largest difference relative to the largest tip."""
    return float(np.max(np.abs(tips - truth)) / np.max(np.abs(truth)))


def cheapest(scene, run, truth, tolerance):
    """Return the cheapest fixed setting that is found below the automatic one."""
    analysis = "dynamic" if run.summary["analysis"] == "dynamic" else run.summary["analysis"]

    def tried(elements, step):
        plant = FiniteElementNeedle(scene, elements=elements)
        fixed = simulate(plant, time_step=step, analysis=analysis)
        return error_of(fixed.tip_deflection, truth), fixed.summary["steps"], plant.size

    count, longest = int(run.summary["elements"]), scene.duration / OUTPUTS
    step = min(run.summary["time_step"], longest)
    found = (run.summary["steps"], FiniteElementNeedle(scene, elements=count).size, count)
    for fewer in reversed([number for number in ELEMENTS if number < count]):
        error, steps, size = tried(fewer, step)
        if error > tolerance:
            break
        found, count = (steps, size, fewer), fewer
    for factor in LONGER:
        if step * factor > 1.4 * longest:
            break
        error, steps, size = tried(count, min(step * factor, longest))
        if error > tolerance:
            break
        found = (steps, size, count)
    return {"fixed_elements": found[2], "fixed_steps": found[0], "fixed_cost": found[0] * found[1]}


def summarized(rows: list[dict[str, object]]) -> str:
    """Return a table: for each tolerance the hit rates and the quantiles of estimate / error and cost / cheapest cost."""
    heads = ("tolerance", "scenes", "below tolerance", "below estimate", "estimate / error", "cost / cheapest", "left out")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for tolerance in sorted({float(str(row["tolerance"])) for row in rows}, reverse=True):
        mine = [row for row in rows if float(str(row["tolerance"])) == tolerance]
        done = [row for row in mine if row["error"] not in {"", None}]
        if not done:
            continue
        names = ("error", "estimate", "uncertainty")
        error, estimate, doubt = (np.array([float(str(row[name])) for row in done]) for name in names)
        ratio = estimate / np.maximum(error, 1e-300)
        costs = [float(str(row["cost"])) / float(str(row["fixed_cost"])) for row in done if row["fixed_cost"] != ""]
        lines.append(
            f"| {tolerance:g} | {len(done)} | {np.sum(error <= tolerance)} | {np.sum(error <= estimate + doubt)} | "
            f"{_quantiles(ratio)} | {_quantiles(np.array(costs)) if costs else ''} | {len(mine) - len(done)} |"
        )
    return "\n".join(lines)


def _quantiles(values: np.ndarray) -> str:
    return " / ".join(f"{value:.2g}" for value in np.quantile(values, (0.1, 0.5, 0.9)))


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 20))
    parser.add_argument("--tolerances", type=float, nargs="+", default=(1e-2, 1e-3))
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--no-fixed", action="store_true")
    parser.add_argument("--out", type=Path)
    given, rows = parser.parse_args(), list[dict[str, object]]()
    warnings.simplefilter("ignore")
    for seed in range(*given.seeds):
        for tolerance in given.tolerances:
            rows.append(measured(seed, tolerance, given.seconds, fixed=not given.no_fixed))
            print({name: value for name, value in rows[-1].items() if value != ""}, flush=True)
            if given.out:
                with given.out.open("w", newline="", encoding="utf-8") as file:
                    writer = csv.DictWriter(file, FIELDS)
                    writer.writeheader()
                    writer.writerows(rows)
    print(summarized(rows))


if __name__ == "__main__":
    main()
