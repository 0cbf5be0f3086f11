"""Many runs at once: the same tips as one by one, whatever the number of cores."""

import numpy as np
import pytest

from fem_needle import SceneError, load_scene, run_scene, simulate_many
from fem_needle.exact import ReleaseFromTipForce
from fem_needle.scene import Sinusoid, TipLoad
from tests.consistency.scenes import BUZZ, LAYERS, held, moving, scene_of

SWINGING = scene_of("entry", moving(0.5, 0.04, 0.14), loads=(TipLoad(force=BUZZ),), duration=0.25).with_value(
    "numerics.output_step", 0.01
)
FORCES = np.array([0.05, 0.1, 0.2, -0.1, 0.3])


def one_by_one(scene, **settings):
    return run_scene(scene, analysis="dynamic", **settings).tip_deflection


@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_a_uniform_run_is_that_of_the_finite_elements(kinematics, damping):
    scene = SWINGING.with_values({"tissue.layers.0.damping": damping, "model.kinematics": kinematics})
    found = simulate_many(scene.with_value("numerics.tolerance", 1e-4))
    exact = one_by_one(scene, elements=24, time_step=1e-4)
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-4 * np.max(np.abs(exact))
    assert 0.0 < found.error_estimate <= 0.5e-4


def test_it_rests_at_the_final_depth():
    scene = SWINGING.with_value("run.duration", 0.35)
    found, exact = simulate_many(scene), one_by_one(scene, elements=24, time_step=1e-4)
    assert found.depth[0, -1] == found.depth[0, -5] == 0.14
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-3 * np.max(np.abs(exact))


def test_arrays_are_the_same_as_scenes():
    speeds = np.linspace(0.3, 0.6, len(FORCES))
    scene = SWINGING.with_values({"run.duration": None, "loads.0.force": 0.1})
    settings = {"time_step": 1e-3, "vibrations": 3}
    together = simulate_many(scene, {"loads.0.force": FORCES, "insertion.speed": speeds}, **settings)
    scenes = [scene.with_values({"loads.0.force": f, "insertion.speed": v}) for f, v in zip(FORCES, speeds, strict=True)]
    apart = simulate_many(scenes, **settings)
    assert len(together) == len(FORCES)
    np.testing.assert_allclose(together.time, apart.time, rtol=1e-14)
    np.testing.assert_allclose(together.tip_deflection, apart.tip_deflection, rtol=1e-12)
    ends = [simulate_many(each, **settings).final_tip_deflection[0] for each in scenes]
    np.testing.assert_allclose(together.final_tip_deflection, ends, rtol=1e-12)
    assert np.isnan(together.tip_deflection[-1, -1])  # the fastest run ends first


def test_any_number_of_cores_gives_the_same_bits():
    parameters = {"loads.0.force.amplitude": np.linspace(0.0, 0.1, 23)}
    settings = {"time_step": 5e-4, "vibrations": 8}
    one, two = (simulate_many(SWINGING, parameters, cores=cores, **settings) for cores in (1, 3))
    assert np.array_equal(one.tip_deflection, two.tip_deflection)
    assert one.steps == two.steps


def test_assumed_modes_too():
    scene = SWINGING.with_values({"model.kind": "assumed-modes", "model.basis": "inserted-length", "model.modes": 4})
    found = simulate_many(scene, time_step=1e-3, vibrations=4)
    exact = run_scene(scene, analysis="dynamic", time_step=1e-3).tip_deflection
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-9 * np.max(np.abs(exact))


def test_vibrations_that_do_not_move_are_at_rest():
    scene = SWINGING.with_values({"loads.0.force": 0.1, "numerics.analysis": "quasi-static"})
    found, exact = simulate_many(scene), run_scene(scene).tip_deflection
    assert found.steps == 0
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-3 * np.max(np.abs(exact))


def test_other_scenes_are_run_one_by_one():
    scene = scene_of("hub", held(0.1), LAYERS, duration=1.0)
    told = []
    found = simulate_many(scene, {"needle.bending_stiffness": [0.02, 0.03]}, cores=2, progress=told.append)
    exact = [run_scene(scene.with_value("needle.bending_stiffness", value)).tip_deflection for value in (0.02, 0.03)]
    assert np.array_equal(found.tip_deflection, exact)
    assert told == [0.5, 1.0]


def test_progress_reaches_the_end():
    told = []
    simulate_many(SWINGING, {"loads.0.force.mean": FORCES}, time_step=1e-3, vibrations=2, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"loads.0.force.mean": [0.1, np.nan]}, "loads.0.force.mean: not finite"),
        ({"needle.bending_stiffness": [0.1, -0.1]}, "bending_stiffness"),
        ({"needle.bending_stiffness": [0.1], "loads.0.force.mean": [0.1, 0.2]}, "as many values each"),
        ({"needle.stiffness": [0.1]}, "stiffness"),
    ],
)
def test_wrong_parameters_are_refused(parameters, message):
    with pytest.raises(SceneError, match=message):
        simulate_many(SWINGING, parameters)


def test_nothing_to_compute_is_refused():
    with pytest.raises(SceneError, match="nothing to compute"):
        simulate_many([])
    with pytest.raises(SceneError, match="vary one scene"):
        simulate_many([SWINGING], {"loads.0.force": [1.0]})


def test_the_benchmark_of_a_swinging_force():
    scene = load_scene("bench-m2")
    assert isinstance(scene.loads[0].force, Sinusoid)
    found = simulate_many(scene)
    exact = one_by_one(scene, elements=16, time_step=5e-4)
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-3 * np.max(np.abs(exact))


@pytest.mark.parametrize("cores", [1, 3])
def test_runs_with_given_settings_are_those_runs(cores):
    scene = scene_of("hub", moving(1.0, 0.02, 0.06), LAYERS, (TipLoad(force=BUZZ),), duration=0.02)
    scene = scene.with_values({"numerics.elements": 5, "numerics.analysis": "dynamic"})
    found = simulate_many(scene, {"needle.bending_stiffness": [0.02, 0.03, 0.05]}, time_step=1e-4, cores=cores)
    exact = [run_scene(scene.with_value("needle.bending_stiffness", b), time_step=1e-4) for b in (0.02, 0.03, 0.05)]
    assert np.array_equal(found.tip_deflection, [run.tip_deflection for run in exact])
    assert found.steps == sum(run.summary["steps"] for run in exact)


def test_a_release_is_turned_from_output_to_output():
    scene = load_scene("bench-d").with_values({"run.duration": 0.0305, "numerics.tolerance": 1e-3})
    found = simulate_many(scene, {"initial.tip_deflection": [1e-3, 2e-3]})
    exact = np.asarray(ReleaseFromTipForce(scene).tip_deflection(found.time[0]))
    for scale, tips in zip((1e-3, 2e-3), found.tip_deflection, strict=True):
        assert np.max(np.abs(tips / scale - exact / exact[0])) < 1e-3
    assert found.error_estimate < 0.5e-3


@pytest.mark.parametrize("start", [{"shape": "straight"}, {"shape": "tip-displaced", "tip_deflection": 1e-3}])
def test_a_damped_start_away_from_equilibrium(start):
    held_there = {"kind": "hold", "initial_depth": 0.1}
    scene = SWINGING.with_values({"initial": start, "tissue.layers.0.damping": 20.0, "insertion": held_there})
    found, exact = simulate_many(scene), one_by_one(scene, elements=24, time_step=5e-5)
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-3 * np.max(np.abs(exact))
