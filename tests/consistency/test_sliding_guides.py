"""Needles that slide through rigid guides, index-3 constraints that move through the mesh: the push has no spikes."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, run_scene, simulate
from fem_needle.motion import wanted_radius
from fem_needle.scene import Guide, Scene
from tests.consistency.scenes import DAMPED, GEL, LAYERS, PUSH, held, moving, profile, scene_of
from tests.references import hub_motion

QUICKENS = profile([0.0, 0.05, 0.1, 0.2], [0.05, 0.051, 0.061, 0.081])  # 0.02, 0.2, 0.2 m/s: the guide passes three nodes
RIGID = {"guides": [Guide(position=-0.0317)], "hub_deflection": 1e-3}
UNDAMPED = {"spectral_radius": 1.0}


def sliding(layers, **parts) -> Scene:
    return scene_of("hub", QUICKENS, layers, PUSH, support=RIGID, duration=0.2, **parts)


def spikes(scene: Scene, step: float) -> float:
    """Return the largest distance of a push [N] from the mean of its neighbors, kinks of the speed aside."""
    run = simulate(FiniteElementNeedle(scene, elements=16), time_step=step, analysis="dynamic", output_step=step)
    apart = np.abs(run.push_force[1:-1] - 0.5 * (run.push_force[:-2] + run.push_force[2:]))
    return float(np.max(apart))


@pytest.mark.parametrize("layers", [GEL, DAMPED], ids=["elastic", "viscous"])
@pytest.mark.parametrize("step", [1e-3, 2e-4])
def test_a_push_without_spikes(layers, step):
    """The push is 1.5 mN; undamped steps of 1 ms show 0.26 N (viscous) and 0.7 N (elastic) where the guide passes a node."""
    assert spikes(sliding(layers), step) < 2e-4


def test_undamped_steps_spike():
    assert spikes(sliding(GEL, numerics=UNDAMPED), 1e-3) > 0.1


def test_two_rigid_guides_and_a_spring():
    """Nothing damps the needle that starts straight under a turned hub; undamped steps let its push grow to 1e9 N."""
    guides = [Guide(position=-0.01), Guide(position=-0.04), Guide(position=-0.07, stiffness=500.0)]
    case = scene_of(
        "hub", moving(0.01, 0.05, 0.1), LAYERS, PUSH, support={"guides": guides, "hub_angle": 0.01}, duration=None,
        initial={"shape": "straight"},
    )  # fmt: skip

    def largest(scene: Scene) -> float:
        run = simulate(FiniteElementNeedle(scene, elements=32), time_step=5e-4, analysis="dynamic", output_step=1e-2)
        return float(np.max(np.abs(run.push_force[5:])))

    assert largest(case) < 0.1
    assert largest(case.with_value("numerics.spectral_radius", 1.0)) > 1.0


def test_damped_steps_move_the_tip_as_an_independent_solver_does():
    scene = sliding(GEL)
    run = simulate(FiniteElementNeedle(scene, elements=16), time_step=2e-4, analysis="dynamic", output_step=1e-2)
    true = hub_motion(scene, 0.2, run.time, degree=30, steps_per_second=4e3).tip_deflection
    assert np.max(np.abs(run.tip_deflection - true)) < 1e-3 * np.max(np.abs(true))


@pytest.mark.parametrize("tolerance", [3e-3, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_automatic_steps_see_vibrations_that_damped_steps_lose(tolerance):
    """Steps of 2 ms agreed with shorter ones that nothing vibrates: 4.5e-3 of the tip with an estimate of 1.3e-3."""
    numerics = {"analysis": "dynamic", "output_step": 2e-3, "tolerance": tolerance}
    scene = sliding(GEL, numerics=numerics)
    run = run_scene(scene)
    true = hub_motion(scene, 0.2, run.time, degree=30, steps_per_second=4e3).tip_deflection
    error = np.max(np.abs(run.tip_deflection - true)) / np.max(np.abs(true))
    assert error < run.summary["error_estimate"]
    assert error < tolerance


def test_who_gets_damped_steps():
    still = scene_of("hub", held(0.05), GEL, PUSH, support=RIGID)
    soft = scene_of("hub", QUICKENS, GEL, PUSH, support={"guides": [Guide(position=-0.0317, stiffness=500.0)]})
    asked = sliding(GEL, numerics={"spectral_radius": 0.5})
    assert [wanted_radius(scene) for scene in (sliding(GEL), still, soft, asked)] == [0.0, 1.0, 1.0, 0.5]


def test_the_complete_scene_of_a_run_repeats_it():
    scene = sliding(GEL)
    assert wanted_radius(Scene.from_dict(scene.to_dict(complete=True))) == wanted_radius(scene) == 0.0
