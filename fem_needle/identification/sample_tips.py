"""The sample "brachytherapy-tips": tips at 20 depths of a needle at rest, simulated with seeded noise and rounded.

The scene is `brachytherapy` with other foundation moduli, `TRUTH`, computed at rest while the finger pushes.
"""

from __future__ import annotations

import numpy as np

from fem_needle.errors import ComputationError
from fem_needle.identification.static_model import Place, static_problem
from fem_needle.scene_file import load_scene

SCENE, NAME = "brachytherapy", "brachytherapy-tips"
TRUTH = {"tissue.layers.0.foundation_modulus": 4e3, "tissue.layers.1.foundation_modulus": 3e4}  # N/m^2; the scene has 5e3 and 2e4
NOISE = 2e-6  # m
SEED = 11
FIRST, LAST, ROWS = 0.03, 0.085, 20  # depths [m], within the time in which the finger pushes
START, SPEED = 0.005, 0.01  # of the scene's insertion [m], [m/s]: when the tip is where
ELEMENTS = 32


def made_tips() -> str:
    """Return the text of the sample's CSV file, made anew.

    Raises
    ------
    ComputationError
        If the equilibria cannot be computed.
    """
    scene = load_scene(SCENE)
    scene = scene.with_values(TRUTH | {"numerics.analysis": "static", "numerics.elements": ELEMENTS})
    depths = np.round(np.linspace(FIRST, LAST, ROWS), 4)
    times = (depths - START) / SPEED
    tip = np.array([scene.needle.length])
    places = [Place(depth, time, tip) for depth, time in zip(depths.tolist(), times.tolist(), strict=True)]
    problem = static_problem(scene, places, list(TRUTH))
    if problem is None:
        raise ComputationError("sample: its equilibria are not known")
    tips = problem.answers(problem.start)[0] + NOISE * np.random.default_rng(SEED).standard_normal(len(depths))
    rows = zip(times.tolist(), (1e3 * depths).tolist(), (1e3 * tips).tolist(), strict=True)
    lines = [f"{time:.2f},{depth:.1f},{tip:.4f}" for time, depth, tip in rows]
    return "\n".join(["time [s],depth [mm],tip_deflection [mm]", *lines]) + "\n"
