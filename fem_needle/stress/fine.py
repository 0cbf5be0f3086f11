"""Cases that are not one scene through all checks: fine meshes, many steps, forces too large for small deflections."""

from __future__ import annotations

import warnings

import numpy as np

from fem_needle.checks import suspicious
from fem_needle.errors import SuspiciousValueWarning
from fem_needle.exact import exact_static
from fem_needle.models import build_plant
from fem_needle.scene_file import load_scene
from fem_needle.simulation import simulate
from fem_needle.statics import solve_static
from fem_needle.stress.numbers import LayerNumbers, Numbers, scene_of
from fem_needle.stress.trial import Figure, Trial

FINE = 1e-9  # of the tip
DRIFT = 1e-6  # of the energy, over the whole run
LARGE = 0.1  # of the length that bends: a larger deflection must be warned of


def fine_mesh(elements: int) -> list[Trial]:
    """Compare the tip of benchmark S on a mesh with the exact one."""
    scene = load_scene("bench-s").with_value("numerics.elements", elements)
    depth = scene.insertion.first_depth
    tip = solve_static(build_plant(scene), depth=depth).tip_deflection
    error = abs(tip / exact_static(scene, depth).tip_deflection - 1.0)
    return [Trial(f"{elements} elements", (Figure("tip", error, FINE),))]


def many_steps(steps: int) -> list[Trial]:
    """Let go of an undamped needle and step it through its vibrations; its energy must neither grow nor fall."""
    numbers = Numbers(initial_shape="tip-displaced", tip_deflection=1e-3, tip_force=0.0, elements=4, time_step=1e-5, steps=steps)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SuspiciousValueWarning)
        run = simulate(build_plant(scene_of(numbers)))
    energy = run.kinetic_energy + run.bending_energy + run.tissue_energy
    drift = float(np.max(np.abs(energy / energy[0] - 1.0)))
    return [Trial(f"{steps} steps", (Figure("energy", drift, DRIFT),))]


def small_deflections() -> list[Trial]:
    """Raise the force at the tip until the deflection is large: `check` must say so before."""
    trials = []
    for force in 10.0 ** np.arange(-12.0, 5.0):
        scene = scene_of(Numbers(tip_force=float(force), layers=(LayerNumbers(0.0, None, 5e3),)))
        tip = exact_static(scene, 0.1).tip_deflection
        warned = any("too much for small deflections" in message for message in suspicious(scene))
        unsaid = float(abs(tip) > LARGE * scene.needle.length and not warned)
        trials.append(Trial(f"{force:g} N", (Figure("large deflections without a warning", unsaid, 0.5),)))
    return trials
