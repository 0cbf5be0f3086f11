"""Steps, estimates and refusals of automatic runs."""

from itertools import pairwise

import numpy as np
import pytest

from fem_needle import SceneError, run_scene
from fem_needle.exact import exact_static
from fem_needle.expectation import SAFETY, expectation
from fem_needle.finite_element_model import Meshes
from fem_needle.refined_run import SHORTEST, next_ratio
from fem_needle.scene import Friction, Insertion, Sinusoid
from fem_needle.scene_file import load_scene
from tests.consistency.scenes import LAYERS, moving, scene_of

STEPS = [1.0, 0.5, 0.2]


def differences(error):
    values = [error(step) for step in STEPS]
    return [float(a - b) for a, b in pairwise(values)]


@pytest.mark.parametrize("order", [3.0, 4.0])
def test_an_error_of_the_methods_order_is_found(order):
    found = expectation(STEPS, differences(lambda h: h**order), order)
    assert found.error() == pytest.approx(SAFETY * 0.2**order)
    assert found.error(0.5) == pytest.approx(SAFETY * 0.1**order)
    assert found.ratio(SAFETY * 0.1**order) == pytest.approx(0.5)


def test_a_part_of_first_order_is_not_hidden_by_the_fourth():
    """One observed order would extrapolate the small slow part away."""
    found = expectation(STEPS, differences(lambda h: h**4 + 0.01 * h), 4.0)
    assert found.error() == pytest.approx(SAFETY * (0.2**4 + 0.01 * 0.2))


@pytest.mark.parametrize("order", [0.6, 1.0, 2.0, 3.0])
def test_slower_errors_are_bounded(order):
    found = expectation(STEPS, differences(lambda h: h**order), 4.0)
    assert 0.2**order < found.error() < 10.0 * 0.2**order


def test_errors_that_do_not_fall_count_in_full():
    assert expectation(STEPS, [1.0, 1.0], 4.0).error() > 1.0


def test_one_difference_is_a_hope():
    found = expectation(STEPS[:2], [1.0], 4.0)
    assert found.error() < 0.5
    assert found.bound >= 1.0


def test_no_order_is_trusted_over_a_long_jump():
    """What the last run still has hides behind the error of the run before."""
    found = expectation([1.0, 0.5, 0.1], [0.9375, 0.0624], 4.0)
    assert found.bound > 10.0 * found.error()


def test_unresolved_vibrations_prove_no_order():
    """Where vibrations have arbitrary phases in both runs, their difference counts in full."""
    falling = differences(lambda h: h**4)
    assert expectation(STEPS, falling, 4.0, resolved=False).bound == pytest.approx(SAFETY * falling[-1])
    assert expectation(STEPS, falling, 4.0).bound < 0.1 * falling[-1]


def test_a_far_step_is_not_jumped_to():
    near, far = (expectation(STEPS, differences(lambda h: h**4), 4.0) for _ in range(2))
    assert next_ratio(near, near.error(0.5)) == pytest.approx(0.5)
    assert next_ratio(far, far.error(0.1)) == pytest.approx(SHORTEST)


def test_equilibria_meet_any_tolerance():
    insertion = moving(0.05, 0.02, 0.18)
    scene = scene_of("entry", insertion, LAYERS, numerics={"analysis": "static", "output_step": 0.125})
    run = run_scene(scene, tolerance=1e-10)
    exact = np.array([exact_static(scene, depth).tip_deflection for depth in run.depth.tolist()])
    assert np.max(np.abs(run.tip_deflection - exact)) < 1e-10 * np.max(np.abs(exact))


def test_steps_refuse_a_tolerance_below_round_off():
    scene = scene_of("entry", moving(0.05, 0.02, 0.18), LAYERS, numerics={"analysis": "dynamic", "output_step": 0.125})
    with pytest.raises(SceneError, match=r"numerics.tolerance: less than double precision .* allowed from (\S+) on") as caught:
        run_scene(scene, tolerance=1e-10)
    assert 1e-10 < float(str(caught.value).split("allowed from ")[1].split()[0]) < 1e-8


def test_few_elements_are_enough_for_bench_m():
    run = run_scene(load_scene("bench-m").with_value("numerics.output_step", 0.1))
    assert run.summary["elements"] <= 3
    assert run.summary["steps"] <= 100
    assert run.summary["step_unknowns"] >= run.summary["steps"] * run.plant.size


def test_the_ladder_of_meshes_ends():
    meshes = Meshes(load_scene("bench-m"), "dynamic")
    assert meshes.finer(meshes.needle(2), 1.5).describe()["elements"] == 3
    assert meshes.finer(meshes.needle(2), 100.0).describe()["elements"] == 256
    assert meshes.finer(meshes.needle(2), 1000.0) is None


@pytest.mark.slow
def test_a_straight_needle_is_pushed_to_its_depth_within_the_tolerance():
    """It has no tip to compare; the depth is what a push asks for."""
    push = Insertion(kind="force", initial_depth=0.02, push_force=Sinusoid(mean=1.0, amplitude=1.0, frequency=2.0))
    friction = Friction(viscous=10.0, viscous_per_length=100.0)
    scene = scene_of("entry", push, (), (), friction=friction, duration=0.25).with_value("numerics.elements", 1)
    depths, errors = [], []
    for tolerance in (1e-2, 1e-4):
        run = run_scene(scene, tolerance=tolerance)
        depths.append(run.depth[-1])
        errors.append(run.summary["error_estimate"])
    assert 0.0 < abs(depths[0] / depths[1] - 1.0) <= errors[0] <= 1e-2
    assert 0.0 < errors[1] <= 1e-4
