"""Systems whose controllability is known beforehand, well and badly scaled."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError
from fem_needle.analysis.controllability import (
    balance,
    controllable_modes,
    controllable_subspace,
    modal_coupling,
    observable_modes,
    observable_subspace,
    output_controllability,
)
from fem_needle.errors import ComputationError
from fem_needle.linear.linearization import linearize
from fem_needle.linear.modal_form import modal
from fem_needle.scene import Guide, LateralLoad, TipLoad
from tests.consistency.scenes import DAMPED, GEL, held, scene_of

POLES = -np.geomspace(1.0, 1e8, 12)  # what a needle's vibrations span
EVERY = np.ones((12, 1))
DOUBLE = (np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]))


def krylov(system, inputs):
    return np.hstack([np.linalg.matrix_power(system, power) @ inputs for power in range(len(system))])


def judged(system, inputs, outputs):
    scaled = balance(system, inputs, outputs)
    control, observe = controllable_modes(scaled), observable_modes(scaled)
    return control.holds, controllable_subspace(scaled).dimension, observe.holds, observable_subspace(scaled).dimension


def test_a_double_integrator():
    system, inputs, outputs = DOUBLE
    assert judged(system, inputs, outputs) == (True, 2, True, 2)
    assert judged(system, inputs[::-1], outputs) == (False, 1, True, 2)  # a push on the position alone leaves the speed
    assert judged(system, inputs, outputs[:, ::-1]) == (True, 2, False, 1)  # a speedometer does not know where it is


def test_where_the_rank_of_powers_fails():
    """Twelve poles from 1 to 1e8 rad/s, all driven and seen: the powers say rank 2 or so, the pencil says what is true."""
    system = np.diag(POLES)
    assert np.linalg.matrix_rank(krylov(system, EVERY)) < 6
    assert judged(system, EVERY, EVERY.T)[::2] == (True, True)


def test_a_deaf_pole_is_found_among_fast_ones():
    inputs = EVERY.copy()
    inputs[4] = 0.0
    for outputs in (EVERY.T, EVERY.T @ np.diag(np.arange(12.0) + 1)):
        found = controllable_modes(balance(np.diag(POLES), inputs, outputs))
        assert found.failing == pytest.approx([POLES[4]])


def test_a_hidden_zero_is_found_in_any_coordinates():
    """Rotated, the deaf pole is nowhere a zero of B."""
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(8, 8)))[0]
    poles, inputs = -np.arange(1.0, 9.0), np.ones((8, 1))
    inputs[2] = 0.0
    system = rotation @ np.diag(poles) @ rotation.T
    scaled = balance(system, rotation @ inputs, np.ones((1, 8)) @ rotation.T)
    found = controllable_modes(scaled)
    assert found.failing == pytest.approx([-3.0])
    assert controllable_subspace(scaled).dimension == 7
    assert np.min(found.thresholds) > 0.0
    assert np.max(found.singular_values[found.singular_values <= found.thresholds]) < 1e-12
    assert np.min(found.singular_values[found.singular_values > found.thresholds]) > 1e-2


def test_equal_vibrations_need_two_inputs():
    block = np.array([[0.0, 1.0], [-4.0, 0.0]])
    system = np.kron(np.eye(2), block)
    one, two = np.array([[0.0], [1.0], [0.0], [1.0]]), np.kron(np.eye(2), np.array([[0.0], [1.0]]))
    assert judged(system, one, one.T)[:2] == (False, 2)
    assert judged(system, two, two.T)[:2] == (True, 4)


@pytest.mark.parametrize("seed", [1, 2])
def test_units_do_not_matter(seed):
    random = np.random.default_rng(seed)
    system, inputs, outputs = random.normal(size=(6, 6)), random.normal(size=(6, 2)), random.normal(size=(3, 6))
    units = 2.0 ** random.integers(-30, 30, size=6)
    others = balance(units[:, None] * system / units, units[:, None] * inputs * 1e7, outputs / units * 1e-5)
    first = balance(system, inputs, outputs)
    again = controllable_modes(others)
    assert again.holds and controllable_modes(first).holds
    assert again.thresholds == pytest.approx(controllable_modes(first).thresholds, rel=0.9)
    assert np.min(again.singular_values) > 1e-3


def test_a_state_in_tiny_units_is_no_lost_state():
    inputs = np.array([[1.0], [1e-14]])
    assert judged(np.diag([-1.0, -2.0]), inputs, np.array([[1.0, 1e9]]))[:2] == (True, 2)


def test_output_controllability_counts_outputs():
    """One input moves position and speed of a mass anywhere at once, two positions of one mass it does not."""
    system, inputs, _ = DOUBLE
    both = output_controllability(balance(system, inputs, np.eye(2)))
    assert (both.rank, both.holds) == (2, True)
    same = output_controllability(balance(system, inputs, np.array([[1.0, 0.0], [2.0, 0.0]])))
    assert (same.rank, same.holds) == (1, False)
    none = output_controllability(balance(system, 0 * inputs, np.eye(2)))
    assert (none.rank, none.holds) == (0, False)
    direct = output_controllability(balance(system, 0 * inputs, np.array([[1.0, 0.0]])), [[5.0]])
    assert direct.holds


def test_participation_names_the_states():
    system = np.zeros((4, 4))
    system[:2, :2], system[2:, 2:] = DOUBLE[0], DOUBLE[0]
    reach = controllable_subspace(balance(system, np.array([[0.0], [0.0], [0.0], [3.0]]), np.ones((1, 4))))
    assert reach.participation == pytest.approx([0.0, 0.0, 1.0, 1.0], abs=1e-14)


def test_coupling_of_modes():
    system = np.array([[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    values, reached, seen = modal_coupling(balance(system, np.array([[0.0], [1.0], [0.0]]), np.array([[0.0, 0.0, 1.0]])))
    assert values == pytest.approx([-1.0, 2j])
    assert reached[:, 0] == pytest.approx([0.0, np.sqrt(0.5)])
    assert seen[:, 0] == pytest.approx([1.0, 0.0])


@pytest.mark.parametrize("matrices", [(np.eye(2), np.ones((3, 1)), np.ones((1, 2))), (np.nan * np.eye(1), [[1.0]], [[1.0]])])
def test_wrong_matrices(matrices):
    with pytest.raises(SceneError, match="got"):
        balance(*matrices)


LOADS = [LateralLoad(position=-0.0123, force=0.3), TipLoad(force=0.1)]


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_modal_form_is_the_same_model(speed):
    scene = scene_of("hub", held(0.1), DAMPED, LOADS, support={"guides": [Guide(position=-0.05, stiffness=1e4)]})
    model = linearize(FiniteElementNeedle(scene, elements=4), depth=0.0911, speed=speed)
    form = modal(model)
    for omega in (30.0, 3e3):
        for output in model.outputs:
            for given in model.inputs:
                expected = model.transfer_function(output.name, given.name, omega)
                found = form.transfer_function(output.name, given.name, omega)
                assert abs(found - expected) < 1e-8 * abs(expected), (output, given)
    assert [one.name for one in form.states[:3]] == ["depth", "mode_1", "mode_2"]


def test_few_modes_keep_slow_poles_and_the_way_with_the_depth():
    model = linearize(FiniteElementNeedle(scene_of("hub", held(0.1), GEL, LOADS), elements=8), depth=0.1)
    few = modal(model, 4)
    assert len(few.A) == 10
    assert few.natural_frequencies[:2] == pytest.approx(model.natural_frequencies[:2], rel=1e-6)
    assert few.static_gain("tip_deflection", "push") == pytest.approx(model.static_gain("tip_deflection", "push"), rel=1e-6)
    with pytest.raises(SceneError, match="modes"):
        modal(model, 1000)


def test_a_needle_under_push_alone():
    """Straight, the push moves the depth and nothing else; bent, it reaches every mode. More elements change neither."""
    for elements in (4, 8):
        for loads, dimension in (([], 2), (LOADS[1:], 10)):
            model = linearize(FiniteElementNeedle(scene_of("hub", held(0.1), GEL, loads), elements=elements), depth=0.1)
            few = modal(model, 4)
            scaled = balance(few.A, few.B[:, :1], few.C)
            assert controllable_subspace(scaled).dimension == dimension
            assert controllable_modes(scaled).holds == (dimension == 10)


def test_no_vibrations_without_stiffness():
    model = linearize(FiniteElementNeedle(scene_of("hub", held(0.1), GEL), elements=2), depth=0.1)
    object.__setattr__(model.second_order, "stiffness", -model.second_order.stiffness)
    with pytest.raises(ComputationError, match="stiffness"):
        modal(model)
