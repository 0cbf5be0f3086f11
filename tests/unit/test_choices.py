import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, run_scene, solve_static
from fem_needle.choices import choose, first_time_step, loaded_times, tip_difference
from fem_needle.exact import exact_static, natural_frequencies
from fem_needle.finite_element_model import FAMILY
from fem_needle.scene import Layer, Sinusoid, Table, TipLoad
from tests.consistency.scenes import GEL, characteristic_modulus, held, moving, scene_of


def chosen(scene):
    return choose(scene, lambda: FiniteElementNeedle(scene, elements=8))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("number", [2.0, 12.0])
def test_the_mesh_keeps_the_tip_within_the_tolerance(tolerance, number):
    layers = (Layer(foundation_modulus=characteristic_modulus(number)),)
    scene = scene_of("hub", held(0.1), layers, numerics={"tolerance": tolerance})
    found = FAMILY.choose(scene, "static")
    exact = exact_static(scene, 0.1).tip_deflection
    error = abs(solve_static(found.plant, depth=0.1).tip_deflection / exact - 1.0)
    assert error < 0.5 * tolerance
    assert found.error <= 0.1 * tolerance
    assert error < 2.0 * found.error + 1e-9


def test_more_accuracy_needs_more_elements():
    layers = (Layer(foundation_modulus=characteristic_modulus(12.0)),)
    scenes = [scene_of("hub", held(0.1), layers, numerics={"tolerance": tolerance}) for tolerance in (1e-2, 1e-4, 1e-6)]
    counts = [FAMILY.choose(scene, "static").plant.mesh.elements for scene in scenes]
    assert counts == sorted(set(counts))


FORCES = {
    "vanishes at all equal times": Sinusoid(amplitude=0.1, frequency=1.0),
    "acts between equal times": Table(time=[0.0, 5.55, 5.9, 6.3, 11.0], value=[0.0, 0.0, 0.1, 0.0, 0.0]),
    "constant": 0.1,
}


@pytest.mark.parametrize("force", FORCES.values(), ids=FORCES)
def test_models_are_judged_where_loads_act(force):
    layers = (Layer(foundation_modulus=5e4),)
    scene = scene_of("hub", held(0.15), layers, [TipLoad(force=force)], duration=11.0)
    plant = FiniteElementNeedle(scene, elements=2)
    error = abs(solve_static(plant, depth=0.15, time=5.9).tip_deflection / exact_static(scene, 0.15, 5.9).tip_deflection - 1.0)
    for count in (7, 12):
        assert tip_difference(scene, plant, FiniteElementNeedle(scene, elements=64)) == pytest.approx(error, rel=1e-2)
        assert (loaded_times(scene, 11.0, count) == np.linspace(0.0, 11.0, count).tolist()) is (force == 0.1)
    assert FAMILY.choose(scene, "quasi-static").plant.mesh.elements > 4


def test_mesh_error_is_that_of_the_tip():
    scene = scene_of("entry", held(0.1), GEL, numerics={"degree": 3})
    plant = FiniteElementNeedle(scene, elements=2)
    exact = exact_static(scene, 0.1).tip_deflection
    true = abs(solve_static(plant, depth=0.1).tip_deflection / exact - 1.0)
    assert tip_difference(scene, plant, FiniteElementNeedle(scene, elements=32)) == pytest.approx(true, rel=1e-2)


def test_an_analysis_that_was_asked_for_is_obeyed():
    scene = scene_of("entry", moving(3.0, 0.05, 0.1), numerics={"analysis": "static"}, duration=None)
    found = chosen(scene)
    assert found.analysis == "static"
    assert found.skipped[0].term == "inertia"
    assert "asked for" in found.skipped[0].reason


def test_output_steps():
    scene = scene_of("entry", held(0.1), duration=4.0)
    assert chosen(scene).output_step == 4.0 / 200
    assert chosen(scene.with_value("numerics.output_step", 0.5)).output_step == 0.5
    with pytest.raises(SceneError, match="longer than the run"):
        chosen(scene.with_value("numerics.output_step", 5.0))


def test_the_first_step_resolves_loads_and_the_longest_period():
    plain = FiniteElementNeedle(scene_of("entry", held(0.1), GEL), elements=8)
    period = 2 * np.pi / natural_frequencies(plain.scene, 0.1, 1)[0]
    assert first_time_step(plain, "dynamic", 10.0) == pytest.approx(period / 16, rel=1e-4)
    assert first_time_step(plain, "static", 10.0) == 10.0
    loads = [TipLoad(force=Sinusoid(amplitude=0.1, frequency=3000.0))]
    fast = FiniteElementNeedle(scene_of("entry", held(0.1), GEL, loads), elements=8)
    assert first_time_step(fast, "dynamic", 10.0) == pytest.approx(1 / 3000 / 24)


def test_meshes_that_agree_and_are_wrong_are_told():
    """The tip of a needle in very stiff tissue bends within a millimeter: one, two and four elements agree, 99 % off."""
    layers = (Layer(foundation_modulus=8e8),)
    scene = scene_of("hub", held(0.1), layers=layers, numerics={"analysis": "static", "output_step": 1.0})
    scene = scene.with_values({"needle.bending_stiffness": 1e-7})
    run = run_scene(scene)
    exact = exact_static(scene, 0.1).tip_deflection
    wrong = abs(run.tip_deflection[-1] / exact - 1.0) > scene.numerics.tolerance
    told = "decay lengths (4 EI / k)^(1/4) long > 4: the tolerance may be missed"
    assert wrong and any(told in text for text in run.summary["warnings"])


@pytest.mark.parametrize("swelling", [1.0, 1e4])
def test_elements_are_as_short_as_the_decay_asks_where_that_is_possible(swelling):
    layers = (Layer(foundation_modulus=characteristic_modulus(300.0) / swelling),)  # the needle is 300 decay lengths long
    scene = scene_of("hub", held(0.1), layers=layers, numerics={"analysis": "static", "output_step": 1.0})
    scene = scene.with_value("tissue.stiffness_factor", swelling)
    run = run_scene(scene)
    assert run.summary["elements"] >= 300.0 / 4.0
    assert run.summary["warnings"] == []
    assert run.tip_deflection[-1] == pytest.approx(exact_static(scene, 0.1).tip_deflection, rel=scene.numerics.tolerance)
