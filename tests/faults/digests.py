"""Prints a digest of every kind of computation: `python -m tests.faults.digests`."""

import hashlib
import sys

import numpy as np

from fem_needle import analyze, load_scene, run_scene, simulate_many, steer
from fem_needle.closed_loop.repeating import repeat

SHORT = {"run.duration": 0.02, "numerics.time_step": 1e-3, "numerics.analysis": "dynamic"}


def digest(*arrays):
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return found.hexdigest()


def of_run(run):
    return digest(*run.series.values(), *run.signals.values(), run.station_deflection)


def runs():
    """Yield name and digest; large enough for threaded products where those could be."""
    moving = load_scene("bench-m").with_values(SHORT)
    yield "modes", of_run(run_scene(moving, model="assumed-modes", modes=100))
    yield "vibration", of_run(run_scene(load_scene("release").with_value("run.duration", 0.05), elements=150))


def more_runs():
    moving = load_scene("bench-m").with_values(SHORT)
    yield "elements", of_run(run_scene(moving, elements=150))
    yield "static", of_run(run_scene(load_scene("thesis"), elements=300, analysis="static", time_step=2.0, output_step=2.0))
    forces = np.linspace(0.05, 0.2, 8)
    for threads in (1, 2):
        many = simulate_many(load_scene("thesis"), {"loads.0.force": forces}, threads=threads)
        yield "many", digest(many.final_tip_deflection)
    loop = load_scene("steering").with_values({"numerics.elements": 8, "insertion.final_depth": 0.05, "target.depth": 0.05})
    yield "loop", of_run(steer(loop))
    for processes in (1, 2):
        yield "repetitions", digest(repeat(loop, 3, processes=processes).target_errors)
    points = analyze(load_scene("brachytherapy"), [0.05]).points
    yield "analysis", digest(points[0].model.A, points[0].model.B)


if __name__ == "__main__":
    for name, value in (*runs(), *(more_runs() if "--more" in sys.argv else ())):
        print(f"{name}: {value}")
