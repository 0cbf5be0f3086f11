"""Fits of foundation moduli to simulated tips: time, coverage of the intervals, and what few modes make of finite elements' tips.

    python -m benchmarks.identification

Coverage is the share of 95 % intervals that hold the true value. The tables are those of `docs/identification.md`.
"""

from __future__ import annotations

import time

import numpy as np

from fem_needle import Measurements, Scene, identify, load_scene
from fem_needle.identification.static_model import Place, static_problem

MODULI = ("tissue.layers.0.foundation_modulus", "tissue.layers.1.foundation_modulus")
DEPTHS = np.linspace(0.02, 0.1, 20)  # m
REPETITIONS, MANY = 200, 2000
NOISE = 2e-6  # m
REACH_MODULI, REACH_NOISES = (2e3, 5e3, 2e4, 5e4), (2e-5, 2e-6)  # N/m^2, m


def two_layers() -> Scene:
    """Return the scene `brachytherapy` at rest, the finger pushing with 0.5 N at all depths."""
    force = [{"kind": "lateral", "position": -0.005, "force": 0.5}]
    return load_scene("brachytherapy").with_values({"numerics.analysis": "static", "numerics.elements": 6, "loads": force})


def one_layer(modulus: float) -> Scene:
    """Return a plain needle of 200 mm in one layer with 0.1 N at its tip."""
    return two_layers().with_values(
        {
            "support.guides": [],
            "needle": {"length": 0.2, "bending_stiffness": 0.0157, "mass_per_length": 0.004},
            "tissue.layers": [{"foundation_modulus": modulus}],
            "loads": [{"kind": "tip", "force": 0.1}],
            "numerics.elements": 16,
        }
    )


def tips(scene: Scene) -> np.ndarray:
    """Return the tips at all depths (20,) [m]."""
    places = [Place(float(depth), 0.0, np.array([scene.needle.length])) for depth in DEPTHS]
    problem = static_problem(scene, places, [MODULI[0]])
    assert problem is not None
    return problem.answers(problem.start)[0]


def coverage(
    start: Scene, paths: tuple[str, ...], exact: np.ndarray, noise: float, truth: tuple[float, ...], repetitions: int
) -> tuple:
    """Return coverage of each parameter, mean relative bias of the first one, share of fits whose residuals are not white."""
    random, held, values, suspicious = np.random.default_rng(5), np.zeros(len(paths)), [], 0
    for _ in range(repetitions):
        data = Measurements({"depth": DEPTHS, "tip_deflection": exact + noise * random.standard_normal(len(exact))})
        found = identify(start, paths, data)
        held += [one.interval[0] <= true <= one.interval[1] for one, true in zip(found.parameters, truth, strict=True)]
        values.append(found.parameters[0].value)
        suspicious += found.whiteness.p_value < 0.05
    return held / repetitions, float(np.mean(values)) / truth[0] - 1.0, suspicious / repetitions


def main() -> None:
    """Print all figures."""
    scene = two_layers()
    exact = tips(scene)
    data = Measurements({"depth": DEPTHS, "tip_deflection": exact + NOISE * np.random.default_rng(5).standard_normal(len(exact))})
    start = scene.with_values({MODULI[0]: 2e3, MODULI[1]: 5e4})
    seconds = []
    for _ in range(8):
        begin = time.perf_counter()
        found = identify(start, MODULI, data)
        seconds.append(time.perf_counter() - begin)
    first, later = 1e3 * seconds[0], 1e3 * np.median(seconds[1:])
    print(f"two moduli: first fit {first:.0f} ms, then {later:.0f} ms, {found.evaluations} evaluations")
    held, _, odd = coverage(scene, MODULI, exact, NOISE, (5e3, 2e4), MANY)
    print(f"coverage of both in {MANY} data sets: {held}, p < 0.05 in {100 * odd:.1f} %")
    print("modulus [N/m^2], noise [m], model: bias, coverage, share with p < 0.05")
    for modulus in REACH_MODULI:
        truth = one_layer(modulus)
        modes = truth.with_values({"model.kind": "assumed-modes", "model.modes": 2, "numerics.elements": "auto"})
        for noise in REACH_NOISES:
            for name, model in (("elements", truth), ("two modes", modes)):
                held, bias, odd = coverage(model, MODULI[:1], tips(truth), noise, (modulus,), REPETITIONS)
                print(f"{modulus:g}, {noise:g}, {name}: {100 * bias:+.2f} %, {100 * held[0]:.1f} %, {100 * odd:.1f} %")


if __name__ == "__main__":
    main()
