"""Many runs at once: the same tips as one by one, whatever the number of threads."""

import numpy as np
import pytest

from fem_needle import ComputationError, SceneError, SuspiciousValueWarning, load_scene, run_scene, simulate_many
from fem_needle.batch import many
from fem_needle.exact import ReleaseFromTipForce
from fem_needle.scene import TipLoad
from tests.consistency.scenes import BUZZ, LAYERS, held, moving, scene_of

SWINGING = scene_of("entry", moving(0.5, 0.04, 0.14), loads=(TipLoad(force=BUZZ),), duration=0.25).with_value(
    "numerics.output_step", 0.01
)
GIVEN = SWINGING.with_values({"numerics.elements": 4, "numerics.time_step": 1e-3, "numerics.analysis": "dynamic"})
FORCES = np.array([0.05, 0.1, 0.2, -0.1, 0.3])


@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_a_run_keeps_its_tolerance(kinematics, damping):
    scene = SWINGING.with_values({"tissue.layers.0.damping": damping, "model.kinematics": kinematics})
    found = simulate_many(scene.with_value("numerics.tolerance", 1e-4))
    exact = run_scene(scene, analysis="dynamic", elements=24, time_step=1e-4).tip_deflection
    assert np.max(np.abs(found.tip_deflection[0] - exact)) < 1e-4 * np.max(np.abs(exact))
    assert 0.0 < found.error_estimate <= 1e-4


def test_arrays_are_the_same_as_scenes():
    speeds = np.linspace(0.3, 0.6, len(FORCES))
    scene = GIVEN.with_values({"run.duration": None, "loads.0.force": 0.1})
    together = simulate_many(scene, {"loads.0.force": FORCES, "insertion.speed": speeds})
    scenes = [scene.with_values({"loads.0.force": f, "insertion.speed": v}) for f, v in zip(FORCES, speeds, strict=True)]
    apart = simulate_many(scenes)
    assert len(together) == len(FORCES)
    assert np.array_equal(together.time, apart.time, equal_nan=True)
    assert np.array_equal(together.tip_deflection, apart.tip_deflection, equal_nan=True)
    ends = [run_scene(each).tip_deflection[-1] for each in scenes]
    assert np.array_equal(together.final_tip_deflection, ends)
    assert np.isnan(together.tip_deflection[-1, -1])  # the fastest run ends first


@pytest.mark.parametrize("model", [{"kind": "fem"}, {"kind": "assumed-modes", "basis": "inserted-length", "modes": 4}])
def test_any_number_of_threads_gives_the_same_bits(model):
    scene, parameters = GIVEN.with_value("model", model), {"loads.0.force.amplitude": np.linspace(0.0, 0.1, 23)}
    one, two = (simulate_many(scene, parameters, threads=threads) for threads in (1, 3))
    assert np.array_equal(one.tip_deflection, two.tip_deflection)
    assert one.steps == two.steps


def test_any_variable_of_a_run():
    found = simulate_many(GIVEN, {"loads.0.force.mean": FORCES}, variables=["tip_angle", "push_force"])
    runs = [run_scene(GIVEN.with_value("loads.0.force.mean", float(force))) for force in FORCES]
    assert np.array_equal(found.variables["tip_angle"], [run.tip_angle for run in runs])
    assert np.array_equal(found.variables["push_force"], [run.push_force for run in runs])
    with pytest.raises(SceneError, match=r"variables: unknown \(got 'tip'; allowed depth, "):
        simulate_many(GIVEN, variables=["tip"])


def test_scenes_that_are_chosen_for_are_run_as_they_are_alone():
    scene = scene_of("hub", held(0.1), LAYERS, duration=1.0)
    told = []
    found = simulate_many(scene, {"needle.bending_stiffness": [0.02, 0.03]}, threads=2, progress=told.append)
    exact = [run_scene(scene.with_value("needle.bending_stiffness", value)).tip_deflection for value in (0.02, 0.03)]
    assert np.array_equal(found.tip_deflection, exact)
    assert told == [0.5, 1.0]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"loads.0.force.mean": [0.1, np.nan]}, "loads.0.force.mean: is not finite"),
        ({"needle.bending_stiffness": [0.1, -0.1]}, "bending_stiffness"),
        ({"needle.bending_stiffness": [0.1], "loads.0.force.mean": [0.1, 0.2]}, "as many values each"),
        ({"needle.bending_stiffness": []}, "nothing to compute"),
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


def test_arguments_of_former_versions():
    with pytest.warns(SuspiciousValueWarning, match="cores: .* threads is its name now"):
        found = simulate_many(GIVEN, cores=1)
    with pytest.warns(SuspiciousValueWarning, match="vibrations: .* every run has all that its model has"):
        again = simulate_many(GIVEN, vibrations=3)
    assert np.array_equal(found.tip_deflection, again.tip_deflection)


@pytest.mark.parametrize("threads", [1, 3])
def test_runs_with_given_settings_are_those_runs(threads):
    scene = scene_of("hub", moving(1.0, 0.02, 0.06), LAYERS, (TipLoad(force=BUZZ),), duration=0.02)
    scene = scene.with_values({"numerics.elements": 5, "numerics.analysis": "dynamic"})
    found = simulate_many(scene, {"needle.bending_stiffness": [0.02, 0.03, 0.05]}, time_step=1e-4, threads=threads)
    exact = [run_scene(scene.with_value("needle.bending_stiffness", b), time_step=1e-4) for b in (0.02, 0.03, 0.05)]
    assert np.array_equal(found.tip_deflection, [run.tip_deflection for run in exact])
    assert found.steps == sum(run.summary["steps"] for run in exact)
    assert np.isnan(found.error_estimate)


def test_a_release_in_cosines():
    scene = load_scene("bench-d").with_values({"run.duration": 0.0305, "numerics.tolerance": 1e-3})
    found = simulate_many(scene, {"initial.tip_deflection": [1e-3, 2e-3]})
    exact = np.asarray(ReleaseFromTipForce(scene).tip_deflection(found.time[0]))
    for scale, tips in zip((1e-3, 2e-3), found.tip_deflection, strict=True):
        assert np.max(np.abs(tips / scale - exact / exact[0])) < 1e-3
    assert found.error_estimate < 1e-3


def test_what_is_computed_survives_a_run_that_fails(monkeypatch):
    original = many.simulate

    def failing(plant):
        if plant.scene.loads[0].force.mean == FORCES[2]:
            raise ComputationError("step to time 1 s, depth 0.1 m failed")
        return original(plant)

    monkeypatch.setattr(many, "simulate", failing)
    with pytest.raises(ComputationError, match=r"run 2: step to time 1 s, depth 0\.1 m failed") as caught:
        simulate_many(GIVEN, {"loads.0.force.mean": FORCES}, threads=1)
    tips = caught.value.partial.tip_deflection
    assert np.isfinite(tips[:2]).all()
    assert np.isnan(tips[2]).all()


def test_a_bar_is_shown_by_default_and_only_to_somebody_who_looks(monkeypatch, capsys):
    monkeypatch.setattr("fem_needle.progress_bar.PATIENCE", 0.0)
    scene = GIVEN
    simulate_many(scene, {"loads.0.force": [0.1, 0.2]})
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("FORCE_COLOR", "1")
    simulate_many(scene, {"loads.0.force": [0.1, 0.2]})
    assert "2 runs" in capsys.readouterr().err
