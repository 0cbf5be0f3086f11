"""Inputs that once failed, against tips of an independent solver."""

import json
from pathlib import Path

import numpy as np
import pytest

from fem_needle import load_scene, run_scene

FOLDER = Path(__file__).parent


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_the_steps_of_a_push_are_controlled(tolerance):
    """Two trial runs whose steps a swinging push had cut to the same ones agreed to the last digit."""
    run = run_scene(load_scene(FOLDER / "swinging-push.toml"), tolerance=tolerance)
    true = json.loads((FOLDER / "swinging-push.json").read_text())
    tips, scale = np.interp(true["time"], run.time, run.tip_deflection), np.max(np.abs(true["tip"]))
    error = np.max(np.abs(tips - true["tip"])) / scale
    assert error < run.summary["error_estimate"] < 20.0 * error
    assert error < tolerance


def test_a_force_that_ramps_up_does_not_make_a_long_run_slow():
    """Against given steps of another method, which follow the vibrations, on twice as many elements."""
    scene = load_scene("three-layers")
    run, fine = run_scene(scene), run_scene(scene, elements=12, analysis="dynamic", time_step=1e-3)
    true = np.interp(run.time, fine.time, fine.tip_deflection)
    error = np.max(np.abs(run.tip_deflection - true)) / np.max(np.abs(true))
    assert error < run.summary["error_estimate"] < scene.numerics.tolerance
    assert run.summary["steps"] < 1000
    assert run.summary["relative_energy_residual"] < scene.numerics.tolerance
    assert [part["how"] for part in run.summary["parts"]] == ["steps over vibrations"]
