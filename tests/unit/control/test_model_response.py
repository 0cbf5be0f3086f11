import numpy as np
import pytest

from fem_needle import ComputationError, SceneError, build_plant, load_scene, solve_static
from fem_needle.analysis.depth_gains import tip_gains
from fem_needle.control import model_response as module
from fem_needle.control.model_response import DepthCurve, depth_range, model_response
from tests.unit.control.scenes import ENCODER, TIP, tube

LAYERS = {"layers": [{"end": 0.075, "foundation_modulus": 5e3}, {"start": 0.075, "foundation_modulus": 4e4}]}
BEVEL = [{"kind": "lateral", "position": 0.0, "force": 0.2}, {"kind": "tip", "bevel_coefficient": 2e-6}]
DEPTHS = np.sort(np.random.default_rng(0).uniform(0.05, 0.12, 25)).tolist()


def test_a_curve_by_hand():
    # 1 + 2 x + 3 x^2 + 4 x^3 from 0, x = 0.5: 1 + 1 + 0.75 + 0.5; then 7 - x from 1; constant outside.
    curve = DepthCurve((0.0, 1.0), 2.0, ((4.0, 3.0, 2.0, 1.0), (0.0, 0.0, -1.0, 7.0)))
    assert [curve(depth) for depth in (-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0)] == [1.0, 1.0, 3.25, 7.0, 6.5, 6.0, 6.0]


@pytest.mark.parametrize("name, column", [("lateral_force", 0), ("hub_deflection", 2), ("hub_angle", 3)])
def test_gains_between_the_grid_points(name, column):
    """Two layers, whose interface the tip passes; loads are lateral, tip, hub's deflection and angle."""
    plant = build_plant(tube(tissue=LAYERS, loads=BEVEL))
    found = model_response(plant, name, depths=(0.05, 0.12))
    direct = np.array([tip_gains(plant, depth)[column] for depth in DEPTHS])
    assert np.max(np.abs([found.gain(depth) for depth in DEPTHS] - direct)) < 1e-5 * np.max(np.abs(direct))
    assert found.largest_gain == pytest.approx(np.max(np.abs(direct)), rel=0.1)


def test_gain_and_rest_are_the_equilibria():
    """A bevel, whose force jumps at the interface, beside the finger that is commanded."""
    scene = tube(tissue=LAYERS, loads=BEVEL)
    found = model_response(build_plant(scene), "lateral_force", depths=(0.05, 0.12))
    for command in (0.0, 0.7):
        plant = build_plant(scene.with_value("loads.0.force", command))
        tips = np.array([solve_static(plant, depth=depth).tip_deflection for depth in DEPTHS])
        model = np.array([found.rest(depth) + found.gain(depth) * command for depth in DEPTHS])
        assert np.max(np.abs(model - tips)) < 1e-5 * np.max(np.abs(tips))


def test_a_direction_scales_the_tip_forces_whatever_direction_they_have():
    loads = [BEVEL[0], BEVEL[1] | {"direction": 0.5}]
    scene = tube(tissue=LAYERS, loads=loads)
    found = model_response(build_plant(scene), "tip_direction", depths=(0.05, 0.12))
    for direction in (-1.0, 0.25):
        plant = build_plant(scene.with_value("loads.1.direction", direction))
        for depth in (0.06, 0.0749, 0.0751, 0.11):
            tip = solve_static(plant, depth=depth).tip_deflection
            assert found.rest(depth) + found.gain(depth) * direction == pytest.approx(tip, abs=1e-5 * 1e-3)


def test_the_output_is_rest_and_gain_times_input():
    response = model_response(build_plant(tube(loads=BEVEL)), "lateral_force", depths=(0.02, 0.14))
    for depth, value in ((0.02, 0.3), (0.0777, -1.2), (0.14, 2.0), (0.5, 1.0)):
        assert response.output(depth, value) == pytest.approx(response.rest(depth) + response.gain(depth) * value, rel=1e-13)


def test_half_of_it_is_the_image_error():
    plant = build_plant(tube(loads=BEVEL))
    whole, half = (model_response(plant, "lateral_force", depths=(0.05, 0.12), share=share) for share in (1.0, 0.5))
    assert half.gain(0.07) == pytest.approx(0.5 * whole.gain(0.07), rel=1e-12)
    assert half.rest(0.07) == pytest.approx(0.5 * whole.rest(0.07), rel=1e-12)
    assert half.largest_gain == pytest.approx(0.5 * whole.largest_gain, rel=1e-12)


@pytest.mark.parametrize("modulus, expected", [(5e3, [0.09230]), (5e4, [0.03690, 0.16568])])
def test_sign_changes(modulus, expected):
    """Those of the exact solution: docs/analysis.md."""
    plant = build_plant(tube(modulus=modulus).with_value("numerics.elements", 16))
    found = model_response(plant, "lateral_force", depths=(0.01, 0.19))
    assert found.sign_changes == pytest.approx(expected, abs=2e-5)
    assert found.gain(expected[0] - 1e-3) > 0.0 > found.gain(expected[0] + 1e-3)


def test_a_needle_that_is_held():
    plant = build_plant(tube())
    found = model_response(plant, "lateral_force", depths=(0.08, 0.08))
    assert found.gain(0.03) == found.gain(0.08) == pytest.approx(tip_gains(plant, 0.08)[0], rel=1e-12)
    assert (found.first_depth, found.last_depth, found.sign_changes) == (0.08, 0.08, ())


@pytest.mark.parametrize("name", ["speed", "push_force"])
def test_inputs_without_a_static_gain(name):
    with pytest.raises(SceneError, match=f"no static gain of the tip .got '{name}'; allowed lateral_force"):
        model_response(build_plant(tube()), name, depths=(0.05, 0.12))


def test_an_input_that_the_model_has_not():
    with pytest.raises(SceneError, match="in the scene of the model 'lateral_force' needs one load"):
        model_response(build_plant(tube(loads=[])), "lateral_force", depths=(0.05, 0.12))


def test_an_input_that_moves_nothing():
    loads = [{"kind": "tip", "force": 0.0}]
    with pytest.raises(SceneError, match=r"does not move the tip of the model at t = 0 .got 'tip_direction'"):
        model_response(build_plant(tube(loads=loads)), "tip_direction", depths=(0.05, 0.12))


def test_a_model_too_rough(monkeypatch):
    monkeypatch.setattr(module, "FINEST", 16)
    monkeypatch.setattr(module, "ACCURACY", 1e-12)
    with pytest.raises(ComputationError, match=r"too rough over the depth between 0\.05 and 0\.12 m"):
        model_response(build_plant(tube()), "lateral_force", depths=(0.05, 0.12))


def test_the_range_of_a_run():
    assert depth_range(tube()) == pytest.approx((0.05, 0.12))
    back = {"kind": "profile", "depth": {"time": [0.0, 1.0, 2.0], "value": [0.05, 0.1, 0.02]}}
    assert depth_range(tube(insertion=back)) == pytest.approx((0.02, 0.1))
    shallow = {"kind": "speed", "initial_depth": 0.0, "speed": 0.01, "final_depth": 0.1}
    assert depth_range(tube(insertion=shallow)) == (0.0, 0.1)
    assert depth_range(tube(insertion=shallow, support="entry")) == (0.002, 0.1)


def test_the_range_of_a_push():
    push = {"kind": "force", "initial_depth": 0.03, "push_force": 1.0}
    loads = [{"kind": "lateral", "position": -0.01, "force": 0.0}]
    endless = tube(insertion=push, loads=loads, run={"duration": 1.0})
    assert depth_range(endless) == pytest.approx((0.03, 0.2 - 0.01 - 0.004))
    assert depth_range(tube(insertion=push | {"final_depth": 0.1})) == pytest.approx((0.03, 0.1))


def test_modes_have_a_response_too():
    scene = load_scene("thesis").with_values({"model.kind": "assumed-modes", "model.modes": 3})
    plant = build_plant(scene.with_values({"sensors": [TIP, ENCODER]}))
    found = model_response(plant, "tip_direction", depths=(0.02, 0.18))
    assert found.gain(0.1) == pytest.approx(solve_static(plant, depth=0.1).tip_deflection, rel=1e-5)
