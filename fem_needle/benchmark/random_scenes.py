"""Random scenes whose true tips an independent solution knows: to see how often a tolerance is kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.growing_beam import spectral_tips
from fem_needle.benchmark.reference import growing_beam
from fem_needle.dynamics.grid import output_times
from fem_needle.exact import exact_static
from fem_needle.motion import depth_law, run_duration
from fem_needle.scene import Scene

Array = NDArray[np.float64]

OUTPUTS = 50
STEPS_PER_RADIAN = 24.0  # twice as many change the tips by up to 1.2e-7 of the largest


@dataclass(frozen=True, eq=False)
class RandomScene:
    """A scene with a tolerance, and its true tips at its outputs [m]."""

    scene: Scene
    tips: Array


def random_scene(seed: int) -> RandomScene:
    """Return the scene of a seed: odd ones grow in homogeneous tissue with inertia, even ones have a hub and none."""
    chance = np.random.default_rng(seed)
    return _growing(chance) if seed % 2 else _held(chance)


def _needle(chance: np.random.Generator) -> dict[str, float]:
    return {
        "length": chance.uniform(0.1, 0.25),
        "bending_stiffness": 10 ** chance.uniform(-2.5, -1.0),
        "mass_per_length": 10 ** chance.uniform(-2.5, -1.5),
    }


def _growing(chance: np.random.Generator) -> RandomScene:
    """Return a scene like M2 with other numbers."""
    needle = _needle(chance)
    first, last = chance.uniform(0.2, 0.4) * needle["length"], chance.uniform(0.6, 0.9) * needle["length"]
    speed = 10 ** chance.uniform(-1.0, 0.5)
    frequency = chance.uniform(0.5, 3.0) * speed / (last - first)
    force = {"mean": 0.1, "amplitude": chance.uniform(0.0, 0.05), "frequency": frequency}
    scene = Scene.from_dict(
        {
            "needle": needle,
            "support": {"kind": "entry"},
            "tissue": {"layers": [{"foundation_modulus": 10 ** chance.uniform(2.0, 4.0)}]},
            "insertion": {"kind": "speed", "initial_depth": first, "speed": speed, "final_depth": last},
            "loads": [{"kind": "tip", "force": force}],
            "numerics": {"analysis": "dynamic", "tolerance": _tolerance(chance), "output_step": (last - first) / speed / OUTPUTS},
        }
    )
    times = _times(scene)
    return RandomScene(scene, spectral_tips(growing_beam(scene), times, steps_per_radian=STEPS_PER_RADIAN))


def _held(chance: np.random.Generator) -> RandomScene:
    """Return a scene with a hub, two layers and a lateral force, without inertia."""
    needle = _needle(chance)
    border = chance.uniform(0.1, 0.4) * needle["length"]
    moduli = 10 ** chance.uniform(2.0, 4.5, 2)
    layers = [{"end": border, "foundation_modulus": moduli[0]}, {"start": border, "foundation_modulus": moduli[1]}]
    place = -chance.uniform(0.05, 0.1) * needle["length"]
    loads = [{"kind": "tip", "force": 0.1}, {"kind": "lateral", "position": place, "force": chance.uniform(-0.5, 0.5)}]
    scene = Scene.from_dict(
        {
            "needle": needle,
            "support": {"kind": "hub"},
            "tissue": {"layers": layers},
            "insertion": {"kind": "speed", "initial_depth": 0.0, "speed": 0.01, "final_depth": 0.8 * needle["length"]},
            "loads": loads,
            "numerics": {
                "analysis": "quasi-static",
                "tolerance": _tolerance(chance),
                "output_step": 0.8 * needle["length"] / 0.01 / OUTPUTS,
            },
        }
    )
    law = depth_law(scene)
    return RandomScene(scene, np.array([exact_static(scene, law.depth(t), t).tip_deflection for t in _times(scene).tolist()]))


def _tolerance(chance: np.random.Generator) -> float:
    return float(10 ** chance.uniform(-6.0, -2.0))


def _times(scene: Scene) -> Array:
    step = scene.numerics.output_step
    return np.array(output_times(run_duration(scene), float(step)))
