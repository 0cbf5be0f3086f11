from math import inf

import pytest

from fem_needle import SceneError
from fem_needle.closed_loop.inputs import Inputs, Ramp, limited, own_value
from fem_needle.scene import Table
from tests.consistency.closed_loop_scenes import loop_scene

RATED = loop_scene().with_value("actuators.lateral_force", {"minimum": -1.0, "maximum": 2.0, "rate": 4.0})
SLOW = Ramp(time=1.0, start=3.0, target=-1.0, rate=2.0)  # 3 at 1 s, 0 at 2.5 s, -1 from 3 s on


@pytest.mark.parametrize(
    "time, value, slope", [(1.0, 3.0, -2.0), (2.0, 1.0, -2.0), (2.5, 0.0, -2.0), (3.0, -1.0, 0.0), (9.0, -1.0, 0.0)]
)
def test_a_ramp(time, value, slope):
    assert (SLOW.value(time), SLOW.slope(time)) == (value, slope)


def test_a_ramp_is_a_table_until_it_has_arrived():
    assert SLOW.arrival == 3.0
    function = SLOW.function(2.0)
    assert isinstance(function, Table)
    assert (list(function.time), list(function.values)) == ([1.0, 3.0], [3.0, -1.0])
    assert SLOW.function(3.0) == -1.0


def test_without_a_rate_it_jumps():
    jump = Ramp(time=1.0, start=3.0, target=-1.0)
    assert (jump.arrival, jump.value(1.0), jump.slope(1.0), jump.function(1.0)) == (1.0, -1.0, 0.0, -1.0)
    still = Ramp(time=1.0, start=3.0, target=3.0, rate=2.0)
    assert (still.arrival, still.value(1.0), still.slope(1.0)) == (1.0, 3.0, 0.0)


def test_commands_are_cut_and_approached_at_the_rate():
    inputs = Inputs(RATED).commanded(1.0, {"lateral_force": 9.0})
    assert inputs.ramps["lateral_force"] == Ramp(1.0, 0.05, 2.0, 4.0)
    turned = inputs.commanded(1.25, {"lateral_force": -9.0})  # on its way, at 0.05 + 4 * 0.25
    assert turned.ramps["lateral_force"] == Ramp(1.25, 1.05, -1.0, 4.0)
    assert turned.value("lateral_force", 1.5) == pytest.approx(0.05)
    assert inputs.value("lateral_force", 1.25) == 1.05  # the earlier inputs are what they were


def test_the_same_target_is_no_new_command():
    inputs = Inputs(RATED).commanded(1.0, {"lateral_force": 9.0})
    assert inputs.commanded(1.1, {"lateral_force": 5.0}) is inputs  # both are cut to 2 N
    assert inputs.commanded(1.1, {}) is inputs
    assert Inputs(RATED).commanded(0.0, {"hub_angle": 0.0}).ramps["hub_angle"] == Ramp(0.0, 0.0, 0.0, inf)


def test_the_next_kink_is_the_next_arrival():
    inputs = Inputs(RATED).commanded(1.0, {"lateral_force": 1.05, "hub_angle": 0.1})
    assert inputs.next_kink(1.0) == 1.25  # the hub has no rate
    assert inputs.next_kink(1.25) == inf
    assert Inputs(RATED).next_kink(0.0) == inf


def test_what_the_scene_says_before_any_command():
    scene = loop_scene().with_value("loads.1.force", {"time": [0.0, 1.0], "value": [0.0, 2.0]})
    assert own_value(scene, "lateral_force", 0.25) == 0.5
    assert own_value(scene, "tip_direction", 0.25) == 1.0
    assert own_value(scene, "hub_deflection", 0.25) == 0.0
    assert Inputs(scene).commanded(0.25, {"lateral_force": 9.0}).ramps["lateral_force"].start == 0.5


@pytest.mark.parametrize("wanted, found", [(-3.0, -1.0), (0.25, 0.25), (3.0, 1.0)])
def test_a_direction_has_limits_of_its_own(wanted, found):
    assert limited(loop_scene(), "tip_direction", wanted) == found
    assert limited(loop_scene(), "lateral_force", wanted) == wanted


@pytest.mark.parametrize(
    "command, message",
    [
        ({"speed": 1.0}, "needs insertion.kind = 'speed'"),
        ({"push_force": 1.0}, "needs insertion.kind = 'force'"),
        ({"hub_torque": 1.0}, "hub_rotation = 'free'"),
        ({"wheel": 1.0}, "'wheel' is unknown .allowed .*lateral_force"),
        ({"lateral_force": inf}, "lateral_force: is not finite .got inf at time 2 s"),
    ],
)
def test_commands_that_are_refused(command, message):
    with pytest.raises(SceneError, match=message):
        Inputs(loop_scene()).commanded(2.0, command)
