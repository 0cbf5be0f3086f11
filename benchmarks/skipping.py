"""What each rule of `fem_needle.skipping` saves: the same scene with a term that has no effect, and without it.

Usage: python -m benchmarks.skipping [--repeats N]. Runs alternate; shown are medians and the smallest and largest time of a run.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fem_needle import FiniteElementNeedle, Scene, load_scene, simulate

STEPS = {"analysis": "dynamic", "time_step": 1e-4, "output_step": 1e-2}
STILL = {"time": [0.0, 1.0], "value": [1.0, 1.0]}
LAYERS = [{"start": 0.0, "end": 0.1, "foundation_modulus": 520.0}, {"start": 0.1, "foundation_modulus": 520.0}]


@dataclass(frozen=True)
class Pair:
    """A rule, a scene that does without the term, the changes that put it in, and how both are simulated."""

    rule: str
    scene: Scene
    term: Mapping[str, Any]
    settings: Mapping[str, Any]
    term_settings: Mapping[str, Any]


def pairs() -> list[Pair]:
    """Return a pair for each rule."""
    entry = load_scene("bench-m2").with_values({"insertion.speed": 0.2, "run.duration": 0.5})
    hub = entry.with_value("support.kind", "hub")
    held = hub.with_value("insertion", {"kind": "hold", "initial_depth": 0.1})
    tip, finger = entry.to_dict()["loads"][0], {"kind": "lateral", "position": -0.01, "force": 0.0}
    slow, release = load_scene("thesis"), load_scene("bench-d")
    creeping, outputs = {"time_step": 1e-2, "output_step": 0.08}, {"output_step": 1e-4}
    return [
        Pair("needle outside the tissue (or a hub)", entry, {"support.kind": "hub"}, STEPS, STEPS),
        Pair("tissue viscosity", entry, {"tissue.layers.0.damping": 1e-9}, STEPS, STEPS),
        Pair("swelling", held, {"tissue.stiffness_factor": STILL}, STEPS, STEPS),
        Pair("points between hub and tissue", hub, {"loads": [tip, finger]}, STEPS, STEPS),
        Pair("layer loop", entry, {"tissue.layers": LAYERS}, STEPS, STEPS),
        Pair("path memory", hub, {"tissue.rest_line": "cut-path"}, STEPS | {"time_step": 1e-3}, STEPS | {"time_step": 1e-3}),
        Pair("hub motion", hub, {"support.hub_deflection": {"time": [0.0, 1.0], "value": [0.0, 1e-15]}}, STEPS, STEPS),
        Pair("inertia", slow, {}, creeping | {"analysis": "quasi-static"}, creeping | {"analysis": "dynamic", "time_step": 1e-3}),
        Pair("time steps of a held needle", release, {}, outputs, outputs | {"time_step": 1e-5}),
        Pair("samples that nobody asked for", entry, {}, STEPS, STEPS | {"output_step": 1e-4}),
    ]


def timed(scene: Scene, settings: Mapping[str, Any]) -> float:
    """Return the time of one run [s]; the plant is there already."""
    plant = FiniteElementNeedle(scene, elements=24)
    begun = time.perf_counter()
    simulate(plant, **settings)
    return time.perf_counter() - begun


def main() -> None:
    """Print a row for each rule."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print("| left out | without it [ms] | with it [ms] | ratio |\n|---|---|---|---|")
    for pair in pairs():
        runs = ((pair.scene, pair.settings), (pair.scene.with_values(pair.term), pair.term_settings))
        for scene, settings in runs:  # loads and compiles
            timed(scene, settings)
        times = [[timed(scene, settings) for scene, settings in runs] for _ in range(repeats)]
        lean, full = (sorted(1e3 * row[side] for row in times) for side in (0, 1))
        ratio = statistics.median(row[1] / row[0] for row in times)
        shown = (f"{statistics.median(found):.3g} ({found[0]:.3g} to {found[-1]:.3g})" for found in (lean, full))
        print(f"| {pair.rule} | {' | '.join(shown)} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
