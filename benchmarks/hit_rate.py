"""How often automatic settings keep the tolerance, how honest their error estimate is, and what they cost.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.hit_rate --seeds 0 500 --out benchmarks/results/hit_rate.csv
    OPENBLAS_NUM_THREADS=1 python -m benchmarks.hit_rate --new --out new.csv

Random scenes of every kind (`tests/consistency/random_kinds.py`): a seed announces its kind, seeds 0 to 499 are the announced
ones, `--new` takes 100 that follow from the version. The truth comes from spectral solvers that share no code with the needle
and are refined until two of them agree (`tests/consistency/truth.py`). A scene that is refused, fails or takes long is a miss.
The cheapest fixed setting is looked for from the automatic one downwards: fewer elements, then longer steps, until the tolerance
is missed. Cost is steps times unknowns, trial runs included. Rows of other seeds and tolerances that the file has are kept.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import time
import warnings
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fem_needle import FiniteElementNeedle, NeedleError, run_scene, simulate
from fem_needle.finite_element_model import ELEMENT_CHOICES
from tests.consistency.random_kinds import KINDS, kind_of, scene_of_seed
from tests.consistency.random_scenes import OUTPUTS
from tests.consistency.truth import Truth, true_rows

FIELDS = (
    "seed", "kind", "support", "insertion", "initial", "tolerance", "analysis", "elements", "steps", "cost", "error", "estimate",
    "uncertainty", "fixed_elements", "fixed_steps", "fixed_cost", "seconds", "truth", "note",
)  # fmt: skip
KNOWN = 0.3  # of the tolerance: what the truth may miss
WANTED = KNOWN * 1e-5  # to which truths are refined
UNKNOWN = "truth unknown"
NEW = 100
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


def new_seeds(release: str | None = None) -> range:
    """Return the fresh seeds of a version, default the installed one."""
    first = 1000 + int(hashlib.sha256((release or version("fem-needle")).encode()).hexdigest()[:7], 16)
    return range(first, first + NEW)


def measured(seed: int, tolerance: float, seconds: float, *, fixed: bool) -> dict[str, object]:
    """Return one row of the table."""
    scene = scene_of_seed(seed).with_value("numerics.tolerance", tolerance)
    row: dict[str, object] = dict.fromkeys(FIELDS, "") | {"seed": seed, "kind": kind_of(seed), "tolerance": tolerance}
    row |= {"support": scene.support.kind, "insertion": scene.insertion.kind, "initial": scene.initial.shape}
    started = time.perf_counter()
    try:
        run = run_scene(scene, observer=Patience(seconds))
    except (NeedleError, KeyboardInterrupt) as error:
        return row | {"note": type(error).__name__}
    row |= {name: run.summary[name] for name in ("analysis", "elements", "steps")} | {"seconds": time.perf_counter() - started}
    if run.summary["stop_reason"] == "interrupted":
        return row | {"note": "took too long"}
    truth = _truth(seed)
    row |= {"cost": run.summary["step_unknowns"], "estimate": run.summary["error_estimate"]}
    row |= {"uncertainty": truth.doubt, "truth": "pieces"}
    if truth.doubt > KNOWN * tolerance:
        return row | {"note": UNKNOWN}
    error = truth.error(run)
    row |= {"error": error, "note": "; ".join(text.split(":")[0] for text in run.summary["warnings"])}
    return row | (cheapest(scene, run, truth, tolerance) if fixed and error <= tolerance else {})


@lru_cache(maxsize=1)
def _truth(seed: int) -> Truth:
    return true_rows(scene_of_seed(seed), WANTED)


def cheapest(scene, run, truth, tolerance):
    """Return the cheapest fixed setting that is found below the automatic one."""
    analysis = "dynamic" if run.summary["analysis"] == "dynamic" else run.summary["analysis"]

    def tried(elements, step):
        plant = FiniteElementNeedle(scene, elements=elements)
        fixed = simulate(plant, time_step=step, analysis=analysis)
        return truth.error(fixed), fixed.summary["steps"], plant.size

    count, longest = int(run.summary["elements"]), scene.duration / OUTPUTS
    step = min(run.summary["time_step"], longest)
    found = (run.summary["steps"], FiniteElementNeedle(scene, elements=count).size, count)
    for fewer in reversed([number for number in ELEMENT_CHOICES if number < count]):
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
    """Return a table: for each tolerance and kind hit rates and quantiles of estimate / error and cost / cheapest."""
    heads = ("tolerance", "kind", "scenes", "hits", "misses", "truth unknown", "below estimate", "estimate / error", "1 to 20")
    lines = [f"| {' | '.join((*heads, 'cost / cheapest'))} |", "|---" * (len(heads) + 1) + "|"]
    for tolerance in sorted({float(str(row["tolerance"])) for row in rows}, reverse=True):
        for kind in ("all", *KINDS):
            mine = [row for row in rows if float(str(row["tolerance"])) == tolerance and kind in {"all", row["kind"]}]
            if mine:
                lines.append(f"| {tolerance:g} | {kind} | {_line(mine, tolerance)} |")
    return "\n".join(lines)


def _line(rows: list[dict[str, object]], tolerance: float) -> str:
    unknown = sum(row["note"] == UNKNOWN for row in rows)
    done = [row for row in rows if row["error"] not in {"", None}]
    error, estimate, doubt = (_column(done, name) for name in ("error", "estimate", "uncertainty"))
    hits = int(np.sum(error <= tolerance))
    counts = f"{len(rows)} | {hits} | {len(rows) - unknown - hits} | {unknown} | {int(np.sum(error <= estimate + doubt))}"
    ratio = estimate / np.maximum(error, 1e-300)
    priced = [row for row in done if row["fixed_cost"] not in {"", None}]
    costs = _column(priced, "cost") / np.maximum(_column(priced, "fixed_cost"), 1.0)
    between = f"{np.mean((ratio >= 1.0) & (ratio <= 20.0)):.0%}" if done else ""
    return f"{counts} | {_quantiles(ratio)} | {between} | {_quantiles(costs)}"


def _column(rows: list[dict[str, object]], name: str) -> np.ndarray:
    return np.array([float(str(row[name])) for row in rows])


def _quantiles(values: np.ndarray) -> str:
    return " / ".join(f"{value:.2g}" for value in np.quantile(values, (0.1, 0.5, 0.9))) if values.size else ""


def _kept(path: Path | None) -> dict[tuple[int, float], dict[str, object]]:
    if path is None or not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as file:
        return {(int(row["seed"]), float(row["tolerance"])): dict(row) for row in csv.DictReader(file)}


def _write(path: Path, rows: dict[tuple[int, float], dict[str, object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows[key] for key in sorted(rows, key=lambda key: (key[0], -key[1])))


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 20], help="start, stop and step as of range()")
    parser.add_argument("--new", action="store_true", help=f"the {NEW} fresh seeds of this version")
    parser.add_argument("--tolerances", type=float, nargs="+", default=(1e-2, 1e-3, 1e-4, 1e-5))
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--no-fixed", action="store_true")
    parser.add_argument("--fixed-from", type=float, default=0.0, help="tolerance below which no fixed setting is looked for")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows = _kept(given.out)
    warnings.simplefilter("ignore")
    for seed in new_seeds() if given.new else range(*given.seeds):
        for tolerance in given.tolerances:
            fixed = not given.no_fixed and tolerance >= given.fixed_from
            row = measured(seed, tolerance, given.seconds, fixed=fixed)
            rows[seed, tolerance] = row
            print({name: value for name, value in row.items() if value != ""}, flush=True)
        if given.out:
            _write(given.out, rows)
    print(summarized(list(rows.values())))


if __name__ == "__main__":
    main()
