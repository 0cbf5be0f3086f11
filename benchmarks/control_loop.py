"""How fast a closed loop runs: a 1 kHz controller and its sensors on 40 finite elements, against the time that it simulates.

python -m benchmarks.control_loop            prints the table of docs/control.md
"""

from __future__ import annotations

import time as clock
from statistics import median

from fem_needle import build_plant, controller_of, load_scene
from fem_needle.closed_loop.simulation import Simulation
from fem_needle.scene import Scene

PERIOD = 1e-3
TICKS = 1000
REPEATS = 7
OUTPUT = 0.1  # s: between samples, at which everything is known
SENSORS = [
    {"kind": "tip-imaging", "period": PERIOD, "pixel_size": 1e-4, "noise": 1e-4},
    {"kind": "encoder", "period": PERIOD},
]
CASES = {
    "quasi-static, elastic tissue": {"tissue.layers.0.damping": 0.0},
    "quasi-static, viscous tissue": {},
    "dynamic": {"numerics.analysis": "dynamic"},
    "dynamic, cut path": {"numerics.analysis": "dynamic", "tissue.rest_line": "cut-path"},
    "quasi-static, viscous, two modes": {"model.kind": "assumed-modes", "numerics.elements": "auto"},
}


def scene_of(changes: dict) -> Scene:
    """Return the scene `steering-stiff` with a controller and sensors of 1 kHz and 40 elements."""
    common = {"numerics.elements": 40, "controller.period": PERIOD, "sensors": SENSORS}
    return load_scene("steering-stiff").with_values(common | changes)


def ticks(simulation: Simulation, scene: Scene, count: int) -> float:
    """Return the time of a tick [s]: sensors, controller, actuator and needle."""
    controller = controller_of(scene)
    state, measurement = controller.begin(), simulation.measurement()
    begun = clock.perf_counter()
    for _ in range(count):
        state, command = controller.update(state, simulation.time, measurement)
        measurement = simulation.step(command, PERIOD)
    return (clock.perf_counter() - begun) / count


def tick(scene: Scene) -> tuple[float, float]:
    """Return the median time of a tick [s], and that of what is prepared before the first one [s], libraries and code loaded."""
    found, plant = [], build_plant(scene)
    for _ in range(REPEATS + 1):
        begun = clock.perf_counter()
        simulation = Simulation(plant, time_step=PERIOD, output_step=OUTPUT)
        prepared = clock.perf_counter() - begun
        found.append(ticks(simulation, scene, TICKS))
    return median(found[1:]), prepared  # the first one loads what is compiled


def main() -> None:
    """Print a row for each case."""
    columns = ("a tick [us]", "times real time", "prepared in [s]")
    print(f"| 1 kHz, 40 elements | {' | '.join(columns)} |")
    print("|---|---|---|---|")
    for name, changes in CASES.items():
        scene = scene_of(changes)
        spent, prepared = tick(scene)
        print(f"| {name} | {1e6 * spent:.0f} | {PERIOD / spent:.2g} | {prepared:.2g} |")


if __name__ == "__main__":
    main()
