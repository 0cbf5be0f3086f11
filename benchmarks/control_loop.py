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
SENSORS = [
    {"kind": "tip-imaging", "period": PERIOD, "pixel_size": 1e-4, "noise": 1e-4},
    {"kind": "encoder", "period": PERIOD},
]
CASES = {
    "quasi-static, tip only": ({"tissue.layers.0.damping": 0.0}, False),
    "quasi-static, works and balance": ({"tissue.layers.0.damping": 0.0}, True),
    "quasi-static, viscous tissue": ({}, True),
    "dynamic": ({"numerics.analysis": "dynamic"}, True),
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


def main() -> None:
    """Print a row for each case."""
    print("| loop, 1 kHz, 40 elements | a tick [us] | times real time | before it begins [s] |")
    print("|---|---|---|---|")
    for name, (changes, energies) in CASES.items():
        scene = scene_of(changes)
        plant, repeats = build_plant(scene), REPEATS if not energies else 3
        begun = clock.perf_counter()
        Simulation(plant, time_step=PERIOD, output_step=0.1, energies=energies)
        controller_of(scene)
        prepared = clock.perf_counter() - begun
        count = TICKS if not energies else 100
        found = [
            ticks(Simulation(plant, time_step=PERIOD, output_step=0.1, energies=energies), scene, count) for _ in range(repeats)
        ]
        tick = median(found)
        print(f"| {name} | {1e6 * tick:.1f} | {PERIOD / tick:.2g} | {prepared:.2g} |")


if __name__ == "__main__":
    main()
