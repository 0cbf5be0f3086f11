from math import inf

import pytest

from fem_needle import SceneError, build_plant
from fem_needle.control import build, controller_of, defaults
from fem_needle.control.controller import Uncontrolled
from fem_needle.control.incremental import Incremental
from fem_needle.control.inverse_dynamics import InverseDynamics
from fem_needle.control.model_response import model_response
from fem_needle.control.pid import Pid
from fem_needle.control.printed import PrintedProportional
from fem_needle.control.proportional import Proportional
from fem_needle.control.signals import Limits
from fem_needle.scene.steering import VARIANTS
from tests.unit.control.scenes import ENCODER, TIP, TISSUE, tube

ALL_PID = {"proportional": 1.0, "integral": 2.0, "derivative": 0.5, "filter_time": 0.25}
ALL_INCREMENTAL = {"smallest_error": 1e-4, "smallest_change": 2e-5, "largest_command": 2.0, "increment": 0.1}


@pytest.fixture(scope="module")
def known():
    """Response of the scene's own plant, by a lateral force."""
    return model_response(build_plant(tube()), "lateral_force", depths=(0.05, 0.12))


@pytest.fixture
def no_model(monkeypatch):
    """A model must be neither built nor asked."""

    def refuse(*arguments, **named):
        raise AssertionError("the model was asked")

    monkeypatch.setattr(defaults, "build_plant", refuse)
    monkeypatch.setattr(defaults, "model_response", refuse)


def test_no_controller(no_model):
    controller = controller_of(tube())
    assert isinstance(controller, Uncontrolled)
    assert controller.update(controller.begin(), 0.0, {"tip_deflection": 1.0}) == (controller.begin(), {})


def test_fully_actuated_is_not_sampled(no_model):
    controller = {"kind": "inverse-dynamics", "variant": "fully-actuated"}
    assert isinstance(controller_of(tube(controller)), Uncontrolled)


def test_gains_that_are_given_need_no_model(no_model):
    pid = controller_of(tube({"kind": "pid", "period": 0.01, "gains": ALL_PID}))
    assert isinstance(pid, Pid)
    assert (pid.proportional, pid.integral, pid.derivative, pid.filter_time, pid.period) == (1.0, 2.0, 0.5, 0.25, 0.01)
    assert (pid.schedule, pid.limits, pid.initial, pid.target, pid.input) == (None, Limits(), 0.0, 0.0, "lateral_force")
    steps = controller_of(tube({"kind": "incremental", "gains": ALL_INCREMENTAL}))
    assert isinstance(steps, Incremental)
    assert (steps.smallest_error, steps.smallest_change, steps.largest_command, steps.increment) == (1e-4, 2e-5, 2.0, 0.1)
    gains = {"proportional": -3.0, "smallest_change": 1e-3, "largest_error": 1e-2}
    direct = controller_of(tube({"kind": "proportional", "gains": gains}))
    assert isinstance(direct, Proportional)
    assert (direct.proportional, direct.smallest_change, direct.largest_error) == (-3.0, 1e-3, 1e-2)


def test_default_gains_of_pid(known):
    pid = controller_of(tube({"kind": "pid", "period": 0.02}, sensors=[TIP | {"period": 0.03, "delay": 0.05}, ENCODER]))
    assert pid.proportional == pytest.approx(0.2 / known.largest_gain, rel=1e-9)
    assert pid.integral == pytest.approx(0.2 / known.largest_gain / (0.03 + 0.05), rel=1e-9)
    assert (pid.derivative, pid.filter_time) == (0.0, 0.04)


def test_zero_is_a_gain_too(no_model):
    pid = controller_of(tube({"kind": "pid", "gains": {"proportional": 0.0, "integral": 0.0}}))
    assert (pid.proportional, pid.integral) == (0.0, 0.0)


def test_gains_without_a_schedule_have_the_sign_at_the_first_depth(known):
    deep = {"kind": "speed", "initial_depth": 0.1, "speed": -0.01, "final_depth": 0.05}
    kinds = {
        "pid": lambda one: one.proportional,
        "proportional": lambda one: one.proportional,
        "incremental": lambda one: one.increment,
    }
    for kind, gain in kinds.items():
        outward = tube({"kind": kind}, insertion=deep)
        outward = outward.with_values({"insertion.final_depth": 0.095})  # all of it beyond the sign change
        assert gain(controller_of(outward)) < 0.0
        assert gain(controller_of(outward.with_value("controller.schedule", "model-gain"))) > 0.0
        assert gain(controller_of(tube({"kind": kind}))) > 0.0


def test_default_gains_of_incremental_control(known):
    plain = controller_of(tube({"kind": "incremental"}))
    assert (plain.smallest_error, plain.smallest_change) == (1e-4, 0.0)
    assert plain.increment == pytest.approx(1e-4 / known.largest_gain, rel=1e-9)
    assert plain.largest_command == pytest.approx(0.05 * 0.2 / known.largest_gain, rel=1e-9)
    pixels = tube({"kind": "incremental"}, sensors=[TIP | {"pixel_size": 2e-4}], actuators={"lateral_force": {"maximum": 1.0}})
    found = controller_of(pixels)
    assert (found.smallest_error, found.smallest_change) == pytest.approx((3e-4, 1e-4))
    assert found.increment == pytest.approx(3e-4 / known.largest_gain, rel=1e-9)
    assert found.largest_command == plain.largest_command  # one limit is no range
    ranged = controller_of(pixels.with_value("actuators.lateral_force.minimum", -2.0))
    assert (ranged.largest_command, ranged.limits) == (inf, Limits(-2.0, 1.0))


def test_default_gains_of_proportional_control(known):
    found = controller_of(tube({"kind": "proportional"}, sensors=[TIP | {"pixel_size": 2e-4}]))
    assert found.proportional == pytest.approx(0.5 / known.largest_gain, rel=1e-9)
    assert (found.smallest_change, found.largest_error) == pytest.approx((1e-4, 0.02))


def test_an_image_error_holds_half_of_the_tip(known):
    scene = tube({"kind": "proportional", "output": "image_error"}, sensors=[TIP | {"pixel_size": 2e-4}, TISSUE])
    found = controller_of(scene)
    assert found.proportional == pytest.approx(1.0 / known.largest_gain, rel=1e-9)
    assert (found.smallest_change, found.largest_error) == pytest.approx((5e-5, 0.01))


def test_default_gains_of_inverse_dynamics(known):
    sensors = [TIP | {"period": 0.04, "delay": 0.06}, ENCODER | {"period": 0.2}]
    found = controller_of(tube({"kind": "inverse-dynamics", "period": 0.05}, sensors=sensors))
    assert isinstance(found, InverseDynamics)
    assert found.rate == pytest.approx(1.0 / (3 * (0.05 + 0.06)))
    assert (found.smallest_response, found.encoder_period, found.period) == (0.05, 0.2, 0.05)
    assert found.response.gain(0.07) == pytest.approx(known.gain(0.07), rel=1e-12)
    given = {"kind": "inverse-dynamics", "gains": {"rate": 7.0, "smallest_response": 0.1}}
    found = controller_of(tube(given))
    assert (found.rate, found.smallest_response, found.encoder_period) == (7.0, 0.1, 1 / 30)


def test_the_model_that_the_controller_believes_in():
    scene = tube({"kind": "pid", "schedule": "model-gain"})
    wrong = build_plant(tube(modulus=2e4))
    believed = model_response(wrong, "lateral_force", depths=(0.05, 0.12))
    assert controller_of(scene, wrong).schedule.response.sign_changes == believed.sign_changes
    assert controller_of(scene).schedule.response.sign_changes == pytest.approx([0.0923], abs=1e-4)


def test_what_the_scene_begins_with_and_its_limits(no_model):
    loads = [
        {"kind": "lateral", "position": 0.0, "force": {"time": [0.0, 1.0], "value": [0.5, 1.0]}},
        {"kind": "tip", "force": 0.1, "direction": -0.5},
    ]
    gains = {"proportional": 1.0, "integral": 1.0}
    finger = tube({"kind": "pid", "gains": gains, "period": 0.1}, loads=loads, actuators={"lateral_force": {"rate": 3.0}})
    found = controller_of(finger)
    assert (found.initial, found.limits.step) == (0.5, pytest.approx(0.3))
    bevel = controller_of(tube({"kind": "pid", "gains": gains, "input": "tip_direction"}, loads=loads))
    assert (bevel.initial, bevel.limits) == (-0.5, Limits(-1.0, 1.0))
    actuators = {"tip_direction": {"minimum": -0.25, "maximum": 5.0}}
    narrow = controller_of(tube({"kind": "pid", "gains": gains, "input": "tip_direction"}, loads=loads, actuators=actuators))
    assert narrow.limits == Limits(-0.25, 1.0)
    speed = controller_of(tube({"kind": "pid", "gains": gains, "input": "speed", "output": "depth"}))
    assert (speed.initial, speed.target) == (0.01, 0.0)
    hub = tube({"kind": "pid", "gains": gains, "input": "hub_angle"}, target={"lateral": 1e-3})
    hub = hub.with_value("support.hub_angle", 0.02)
    assert (controller_of(hub).initial, controller_of(hub).target) == (0.02, 1e-3)


@pytest.mark.parametrize("name", ["speed", "push_force"])
def test_an_input_without_a_static_gain_needs_gains(name):
    insertion = {"kind": "force", "initial_depth": 0.05, "push_force": 1.0, "final_depth": 0.1}
    changes = {"insertion": insertion} if name == "push_force" else {}
    with pytest.raises(SceneError, match=rf"controller.input: has no static gain of the tip .got '{name}'; .*all gains given"):
        controller_of(tube({"kind": "pid", "input": name}, **changes))


@pytest.mark.parametrize(
    "controller, key",
    [
        ({"kind": "pid"}, "controller.output: the model has no static gain"),
        ({"kind": "inverse-dynamics"}, "controller.output: the model has no static gain"),
        ({"kind": "pid", "gains": ALL_PID, "schedule": "model-gain"}, "controller.output: the model has no static gain"),
        ({"kind": "incremental", "gains": {"increment": 0.1, "largest_command": 1.0}}, "controller.gains.smallest_error: has no"),
        ({"kind": "proportional", "gains": {"proportional": 1.0}}, "controller.gains.largest_error: has no default"),
    ],
)
def test_an_output_that_the_model_does_not_know(controller, key):
    sensors = [{"kind": "base-force"}, ENCODER]
    with pytest.raises(SceneError, match=rf"{key}.*'hub_force'"):
        controller_of(tube(controller | {"output": "hub_force"}, sensors=sensors))


def test_the_printed_program(no_model):
    controller = {"kind": "proportional", "variant": "as-printed", "period": 0.15}
    scene = tube(controller, sensors=[TIP, TISSUE | {"pixel_size": 2e-4}])
    found = controller_of(scene)
    assert found == PrintedProportional("lateral_force", 0.15, 2e-4, 1.0, 0.5, 4.0, 0.0)
    gains = {"proportional": 2.0, "smallest_change": 0.25, "largest_error": 8.0}  # pixels
    other = controller_of(scene.with_values({f"controller.gains.{key}": value for key, value in gains.items()}))
    assert (other.gain, other.smallest_rise, other.largest_total) == (2.0, 0.25, 8.0)


def test_the_printed_program_needs_pixels(no_model):
    controller = {"kind": "proportional", "variant": "as-printed"}
    with pytest.raises(SceneError, match=r"sensors.1.pixel_size: the printed program counts in pixels .got 0; allowed above 0 m"):
        controller_of(tube(controller, sensors=[TIP, TISSUE]))


def test_every_kind_has_a_maker():
    assert set(build._MAKERS) | {"none"} == set(VARIANTS)
