"""Runs and loops that look for their own steps and mesh: the estimate holds against much finer ones."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, run_scene, simulate, steer
from fem_needle.closed_loop import steering
from fem_needle.scene import LateralLoad, Layer, TipLoad
from tests.consistency.scenes import BUZZ, held, moving, scene_of

LAYERS = (
    Layer(start=0.0, end=0.052, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.052, foundation_modulus=5e4, damping=20.0),
)
CASES = {
    "growing": scene_of("entry", moving(2.0, 0.05, 0.06), LAYERS, [TipLoad(force=BUZZ)], duration=0.005),
    "let go": scene_of("hub", held(0.1), initial={"shape": "tip-displaced", "tip_deflection": 1e-3}, loads=(), duration=0.005),
}


@pytest.mark.parametrize(("name", "tolerance"), [("growing", 1e-3), ("let go", 1e-2), ("let go", 1e-3)])
def test_a_run_keeps_its_tolerance(name, tolerance):
    """The least numerical damping keeps the held needle from being computed without steps."""
    values = {"numerics.analysis": "dynamic", "numerics.spectral_radius": 0.999, "numerics.output_step": 5e-4}
    scene = CASES[name].with_values(values)
    run = run_scene(scene, tolerance=tolerance)
    fine = simulate(FiniteElementNeedle(scene, elements=24), time_step=5e-6, analysis="dynamic")
    error = np.max(np.abs(run.tip_deflection - fine.tip_deflection)) / np.max(np.abs(fine.tip_deflection))
    assert error <= tolerance
    assert run.summary["error_estimate"] <= tolerance


def commanded(**values):
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.0)]
    scene = scene_of("hub", moving(0.5, 0.05, 0.06), loads=loads, duration=0.02)
    return scene.with_values(
        {
            "controller": {"kind": "pid", "period": 5e-3, "gains": {"proportional": 100.0, "integral": 0.0, "derivative": 0.0}},
            "sensors": [{"kind": "tip-imaging", "period": 5e-3}],
            "target.lateral": 0.0,
            "numerics.elements": 2,
            "numerics.analysis": "dynamic",
            "numerics.output_step": 5e-3,
            **values,
        }
    )


def test_a_loop_refines_its_steps_until_the_tip_agrees():
    run = steer(commanded(**{"numerics.tolerance": 1e-2}))
    assert run.summary["error_estimate"] <= 1e-2
    fine = steer(commanded(**{"numerics.time_step": 1e-5}))
    error = np.max(np.abs(run.tip_deflection - fine.tip_deflection)) / np.max(np.abs(fine.tip_deflection))
    assert error <= 2e-2
    assert np.all(np.isfinite(run.load_work))


def test_a_loop_that_cannot_reach_its_tolerance_says_so(monkeypatch):
    monkeypatch.setattr(steering, "MOST_REFINEMENTS", 1)
    run = steer(commanded(**{"numerics.tolerance": 1e-10}))
    assert any("the tolerance 1e-10 was not reached with steps of" in text for text in run.summary["warnings"])
    assert run.summary["error_estimate"] > 1e-10
