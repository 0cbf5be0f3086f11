import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, load_scene, run_scene, simulate
from fem_needle.dynamics.vibration import needs_no_steps
from fem_needle.exact import ReleaseFromTipForce
from fem_needle.scene import Guide, Initial, LateralLoad, Layer, Sinusoid, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import GEL, LAYERS, held, moving, scene_of

RELEASED = Initial(shape="tip-displaced", tip_deflection=1e-3)
LOADS = [TipLoad(force=0.1), LateralLoad(position=-0.02, force=-0.3)]
CASES = {
    "entry": scene_of("entry", held(0.1), GEL, (), initial=RELEASED, duration=0.01),
    "entry, loaded, from straight": scene_of("entry", held(0.17), LAYERS, initial=Initial(shape="straight"), duration=0.01),
    "hub": scene_of("hub", held(0.1), LAYERS, LOADS, initial=RELEASED, support={"hub_angle": 0.01}, duration=0.02),
}
MAKERS = [
    lambda scene: FiniteElementNeedle(scene, elements=2),
    pytest.param(lambda scene: AssumedModeNeedle(scene, modes=3), marks=pytest.mark.slow),
]
SHAPE = ("tip_deflection", "tip_angle", "tissue_force")
REACTIONS = ("hub_force", "hub_moment", "push_force")  # their rates are of second order in a step
ENERGIES = ("kinetic_energy", "bending_energy", "tissue_energy", "load_work")


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("name", CASES)
def test_cosines_are_what_small_steps_approach(name, make):
    """Few coordinates, so that small steps resolve every vibration, rates and reactions included."""
    plant = make(CASES[name])
    run = simulate(plant, analysis="dynamic", output_step=1e-3)
    steps = simulate(plant, analysis="dynamic", output_step=1e-3, time_step=2e-6)
    assert run.summary["steps"] == len(run.time) - 1
    for variable in (*SHAPE, *REACTIONS):
        found, expected = getattr(run, variable), getattr(steps, variable)
        near = (2e-3 if variable in REACTIONS else 2e-5) * np.max(np.abs(expected))
        assert found == pytest.approx(expected, abs=near + 1e-15), variable
    scale = np.max(np.abs(steps.bending_energy)) + np.max(np.abs(steps.load_work))
    for variable in ENERGIES:
        assert getattr(run, variable) == pytest.approx(getattr(steps, variable), abs=2e-5 * scale), variable
    assert run.summary["relative_energy_residual"] < 1e-9


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_the_estimate_bounds_the_error_of_a_release(tolerance):
    scene = load_scene("bench-d").with_values({"run.duration": 0.02, "numerics.tolerance": tolerance})
    run = run_scene(scene)
    exact = np.asarray(ReleaseFromTipForce(scene).tip_deflection(run.time))
    error = np.max(np.abs(run.tip_deflection - exact)) / np.max(np.abs(exact))
    assert error <= 1.1 * run.summary["error_estimate"]
    assert run.summary["error_estimate"] <= tolerance
    assert any(skipped["term"] == "time steps" for skipped in run.summary["skipped"])


@pytest.mark.slow
def test_what_cannot_be_reached_is_said():
    with pytest.raises(SceneError, match=r"less than double precision keeps .*got 1e-08; allowed from") as caught:
        run_scene(load_scene("bench-d").with_values({"run.duration": 0.02, "numerics.tolerance": 1e-8}))
    smallest = float(str(caught.value).split("allowed from ")[1].split()[0])
    assert 1e-8 < smallest < 1e-5


def test_a_step_that_was_asked_for_is_taken():
    run = run_scene(CASES["entry"], elements=4, time_step=1e-4)
    assert run.summary["time_step"] == pytest.approx(5e-5)
    assert all(skipped["term"] != "time steps" for skipped in run.summary["skipped"])


@pytest.mark.parametrize(
    "scene",
    [
        scene_of("entry", moving(1.0, 0.05, 0.1), GEL, duration=None),
        scene_of("entry", held(0.1), (Layer(foundation_modulus=5e3, damping=1.0),)),
        scene_of("entry", held(0.1), GEL, [TipLoad(force=Sinusoid(mean=0.0, amplitude=0.1, frequency=10.0))]),
        scene_of("entry", held(0.1), GEL, tissue={"rest_line": "cut-path"}),
        scene_of("entry", held(0.1), GEL, numerics={"spectral_radius": 0.8}),
        scene_of("hub", held(0.1), GEL, support={"guides": [Guide(position=-0.02)]}),
        scene_of("hub", held(0.1), GEL, support={"hub_rotation": "free", "hub_torque": 0.0, "hub_rotational_inertia": 1e-6}),
    ],
    ids=["moving", "damped", "moving load", "cut path", "numerical damping", "guide", "free hub"],
)
def test_scenes_that_need_steps(scene):
    assert not needs_no_steps(scene)
    assert all(needs_no_steps(scene) for scene in CASES.values())


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, pytest.param(1e-6, marks=pytest.mark.slow)])
def test_a_release_keeps_its_tolerance_and_its_estimate(tolerance):
    """Frequencies keep their digits on fine meshes: over 0.1 s the lowest vibration turns by a hundred radians."""
    scene = load_scene("bench-d")
    run = run_scene(scene, tolerance=tolerance)
    exact = ReleaseFromTipForce(scene).tip_deflection(run.time)
    error = np.max(np.abs(run.tip_deflection - exact)) / np.max(np.abs(exact))
    assert error <= run.summary["error_estimate"] <= tolerance
