"""The compiled loop and the numpy loop give the same samples, in every kind of scene."""

from dataclasses import fields

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, loops, simulate
from fem_needle.collocation import collocation
from fem_needle.errors import ComputationError
from fem_needle.legs import compiled
from fem_needle.legs.compiled import compiled_march
from fem_needle.legs.equilibria import equilibrium_march
from fem_needle.legs.vibrations import modal_march
from fem_needle.loops import is_compiled, run_loop
from fem_needle.march import march, time_grid
from fem_needle.modal_stepper import ModalStepper
from fem_needle.scene import Guide, LateralLoad, Sinusoid, Table, TipLoad
from fem_needle.steppers import DynamicStepper, Inviscid, Massless, StaticStepper
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import BUZZ, DAMPED, LAYERS, held, moving, profile, scene_of

AGREEMENT = 1e-9  # of the largest value of the run
GUIDED = {"guides": (Guide(position=-0.03), Guide(position=-0.01, stiffness=2e3))}
FINGER = (LateralLoad(position=-0.005, force=Table(time=[0.004, 0.01], value=[0.0, 0.5])), TipLoad(force=0.1))
SCENES = {
    "entry": scene_of("entry", moving(3.0, 0.02, 0.08), loads=(TipLoad(force=BUZZ),), duration=0.03),
    "entry-layers": scene_of("entry", moving(3.0, 0.02, 0.14), LAYERS, duration=0.04),
    "entry-damped": scene_of("entry", moving(-2.0, 0.14, 0.06), DAMPED, duration=0.04),
    "entry-fixed-frame": scene_of("entry", moving(5.0, 0.02, 0.14), duration=0.024, model={"kinematics": "fixed-frame"}),
    "entry-out-and-in": scene_of("entry", profile([0.0, 0.01, 0.03], [0.02, 0.05, 0.03]), LAYERS, duration=0.03),
    "swelling": scene_of(
        "entry", held(0.1), DAMPED, tissue={"stiffness_factor": Sinusoid(mean=1.0, amplitude=0.3, frequency=40.0)}, duration=0.02
    ),
    "hub": scene_of("hub", moving(3.0, 0.02, 0.14), LAYERS, duration=0.04),
    "hub-damped": scene_of("hub", moving(3.0, 0.06, 0.16), DAMPED, duration=0.04),
    "guides": scene_of("hub", moving(1.0, 0.02, 0.06), DAMPED, FINGER, support=GUIDED, duration=0.05),
    "moving-hub": scene_of(
        "hub", moving(1.0, 0.02, 0.06), support={"hub_deflection": BUZZ, "hub_angle": Table(time=[0.0, 0.02], value=[0.0, 0.1])},
        duration=0.04,
    ),
    "free-hub": scene_of(
        "hub", held(0.1), support={"hub_rotation": "free", "hub_torque": BUZZ, "hub_rotational_inertia": 1e-5}, duration=0.03
    ),
    "tip-spring": scene_of(
        "entry", moving(3.0, 0.02, 0.08), (), tissue={"kind": "tip-spring", "tip_stiffness": 50.0}, duration=0.02
    ),
    "bevel": scene_of("hub", moving(3.0, 0.02, 0.14), LAYERS, (TipLoad(bevel_coefficient=2e-6),), duration=0.04),
}


def samples(generator):
    found = []
    while True:
        try:
            found.append(next(generator))
        except StopIteration as finished:
            return found, finished.value


def assert_same(plant, stepper, grid, loop=compiled_march):
    (expected, end), (found, found_end) = samples(march(plant, stepper, grid)), samples(loop(plant, stepper, grid))
    assert found_end == end
    assert len(found) == len(expected) > 5
    for field in fields(expected[0]):
        values = [np.array([np.atleast_1d(getattr(s, field.name)) for s in many], dtype=float) for many in (expected, found)]
        scale = np.max(np.abs(values[0]), initial=1e-15)
        assert np.max(np.abs(values[1] - values[0]), initial=0.0) <= AGREEMENT * scale, field.name


@pytest.mark.parametrize("inertia", [True, False], ids=["dynamic", "creeping"])
@pytest.mark.parametrize("name", SCENES)
def test_finite_elements(name, inertia):
    plant = FiniteElementNeedle(SCENES[name], elements=7, degree=3 if name == "hub" else 4)
    model = plant if inertia else Massless(plant)
    stepper = DynamicStepper(model, collocation(1.0 if inertia else 0.0), inertia=inertia)
    assert_same(plant, stepper, time_grid(plant, SCENES[name].duration / 60, SCENES[name].duration / 9))


@pytest.mark.parametrize("name", [name for name in SCENES if name != "free-hub"])
def test_equilibria(name):
    plant = FiniteElementNeedle(SCENES[name], elements=7)
    grid = time_grid(plant, SCENES[name].duration / 20, SCENES[name].duration / 9)
    assert_same(plant, StaticStepper(Inviscid(plant)), grid, equilibrium_march)


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_vibrations_of_a_held_needle(kind):
    start = {"shape": "tip-displaced", "tip_deflection": 1e-3}
    scene = scene_of(kind, held(0.1), LAYERS, initial=start, duration=0.02)
    plant = FiniteElementNeedle(scene, elements=6)
    assert_same(plant, ModalStepper(plant), time_grid(plant, 1e-3, 1e-3), modal_march)


def test_equilibria_out_of_the_tissue_and_in_again():
    scene = scene_of("entry", profile([0.0, 0.01, 0.02, 0.03], [0.02, 0.0, 0.0, 0.03]), duration=0.03)
    plant = FiniteElementNeedle(scene, elements=4)
    assert_same(plant, StaticStepper(Massless(plant)), time_grid(plant, 5e-4, 1e-3), equilibrium_march)


@pytest.mark.parametrize("basis", ["full-length", "inserted-length"])
@pytest.mark.parametrize("name", ["entry", "entry-damped", "entry-fixed-frame", "hub-damped", "guides", "tip-spring"])
def test_assumed_modes(name, basis):
    plant = AssumedModeNeedle(SCENES[name], modes=2 if basis == "full-length" else 4, basis=basis)
    if not plant.has_table:
        pytest.skip("two modes of the full length are told apart, four are not")
    stepper = DynamicStepper(plant, collocation(plant.largest_spectral_radius))
    assert_same(plant, stepper, time_grid(plant, SCENES[name].duration / 60, SCENES[name].duration / 9))


def test_forty_elements_in_a_long_run():
    scene = scene_of("entry", moving(0.2, 0.02, 0.18), loads=(TipLoad(force=BUZZ),), duration=0.8)
    plant = FiniteElementNeedle(scene, elements=40)
    stepper, grid = DynamicStepper(plant, collocation(1.0)), time_grid(plant, 1e-3, 0.04)
    tips = [np.array([s.coordinates[-2] for s in samples(loop(plant, stepper, grid))[0]]) for loop in (march, compiled_march)]
    assert np.max(np.abs(tips[1] - tips[0])) <= AGREEMENT * np.max(np.abs(tips[0]))


def test_the_scene_chooses_the_loop():
    scene = scene_of("entry", moving(0.5, 0.02, 0.06), duration=0.02)
    tips = {}
    for loop in ("numpy", "compiled"):
        plant = FiniteElementNeedle(scene.with_value("numerics.loop", loop), elements=4)
        tips[loop] = simulate(plant, time_step=1e-3, analysis="dynamic", output_step=0.01).tip_deflection
    assert np.max(np.abs(tips["numpy"] - tips["compiled"])) < 1e-12 * np.max(np.abs(tips["numpy"]))


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"tissue.rest_line": "cut-path", "numerics.analysis": "dynamic"}, "step by step"),
        ({"numerics.analysis": "static"}, "nothing is stepped"),
    ],
)
def test_a_compiled_loop_that_cannot_be_is_refused(values, reason):
    scene = scene_of("entry", moving(0.5, 0.02, 0.06), duration=0.02).with_values(values | {"numerics.loop": "compiled"})
    with pytest.raises(SceneError, match=f"numerics.loop: .*{reason}"):
        simulate(FiniteElementNeedle(scene, elements=4), time_step=1e-3)


def test_a_step_without_an_answer_says_where(monkeypatch):
    scene = scene_of("entry", moving(0.5, 0.02, 0.06), duration=0.02)
    plant = FiniteElementNeedle(scene, elements=4)
    table = plant.table

    def spoiled(depths):
        found = table(depths)
        found.matrices.scale[depths > 0.025] = np.nan
        return found

    monkeypatch.setattr(plant, "table", spoiled)
    seen = []
    with pytest.raises(ComputationError, match=r"time 0\.0\d* s, depth 0\.02\d* m failed"):
        for sample in compiled_march(plant, DynamicStepper(plant, collocation(1.0)), time_grid(plant, 1e-3, 2e-3)):
            seen.append(sample)
    assert len(seen) > 3


def test_without_numba_the_steps_are_taken_in_numpy(monkeypatch):
    scene = scene_of("entry", moving(0.5, 0.02, 0.06), duration=0.02)
    plant = FiniteElementNeedle(scene, elements=4)
    stepper, grid = DynamicStepper(plant, collocation(1.0)), time_grid(plant, 2e-5, 1e-2)
    assert is_compiled(plant, stepper, grid)
    monkeypatch.setattr(loops, "find_spec", lambda name: None)
    assert not is_compiled(plant, stepper, grid)
    assert len(samples(run_loop(plant, stepper, time_grid(plant, 1e-3, 1e-2)))[0]) == 3


@pytest.mark.parametrize(("insertion", "factored"), [(held(0.1), 1), (moving(0.5, 0.02, 0.06), 20)], ids=["held", "moving"])
def test_only_what_changes_is_factored_anew(monkeypatch, insertion, factored):
    counted, run = [], compiled.run_steps

    def counting(*given):
        counted.append(int(np.sum(given[4][-1])))
        return run(*given)

    monkeypatch.setattr(compiled, "run_steps", counting)
    plant = FiniteElementNeedle(scene_of("entry", insertion, DAMPED, (TipLoad(force=BUZZ),), duration=0.02), elements=4)
    samples(compiled_march(plant, DynamicStepper(plant, collocation(1.0)), time_grid(plant, 1e-3, 2e-2)))
    assert counted == [factored]
