import pytest

from fem_needle.control.pid import Pid, PidState
from fem_needle.control.signals import Limits, output_reader
from tests.unit.control.scenes import COMMON, commands, falling_gain, tip_readings

GAINS = {"target": 1.0, "period": 0.5, "proportional": 2.0, "integral": 4.0, "derivative": 0.5, "filter_time": 0.5}


def pid(**changes):
    return Pid(**(COMMON | GAINS | changes))


def test_three_decisions():
    # e = 1, 0.75, 0.5;  S = 0.5, 0.875, 1.125;  d = 0, (0 - 0.25) / 1 = -0.25, (-0.125 - 0.25) / 1 = -0.375
    # u = 2 + 2 + 0;  1.5 + 3.5 - 0.125;  1 + 4.5 - 0.1875
    assert commands(pid(), tip_readings(0.0, 0.25, 0.5)) == [4.0, 4.875, 5.3125]


def test_the_other_sign():
    # e = -1, -1.25: u = -2 - 2;  d = -0.25, u = -2.5 + 4 (-0.5 - 0.625) - 0.125
    assert commands(pid(), tip_readings(2.0, 2.25)) == [-4.0, -7.125]


def test_without_a_filter_the_rate_is_the_difference():
    # d = -0.25 / 0.5 = -0.5 with the second reading, 0 with the third: u = 0.5 d
    only = {"proportional": 0.0, "integral": 0.0, "filter_time": 0.0}
    assert commands(pid(**only), tip_readings(0.0, 0.25, 0.25)) == [0.0, -0.25, 0.0]


def test_a_step_of_the_target_does_not_kick():
    """The derivative is that of the measurement."""
    state = PidState(command=0.0, output=0.25)
    only = {"proportional": 0.0, "integral": 0.0}
    near, far = (pid(target=target, **only).update(state, 0.0, {"tip_deflection": 0.375})[1] for target in (0.0, 9.0))
    assert near == far == {"lateral_force": -0.0625}  # d = -0.125 / 1


def test_missing_readings_keep_the_command():
    # Before the first reading the scene's own value; then e = 1: u = 2 + 2.
    found = commands(pid(initial=0.75), [{}, {"depth": 0.1}, *tip_readings(0.0), {}])
    assert found == [0.75, 0.75, 4.0, 4.0]


def test_the_integral_waits_while_the_command_is_cut():
    # 2: 4.875 is above 4.5 and e > 0 drives it further: S stays 0.5, u = 1.5 + 2 - 0.125 = 3.375
    # 3: S = 0.75, u = 1 + 3 - 0.1875
    limited = pid(limits=Limits(maximum=4.5))
    assert commands(limited, tip_readings(0.0, 0.25, 0.5)) == [4.0, 3.375, 3.8125]


@pytest.mark.parametrize("maximum, integral", [(4.875, 0.875), (4.874, 0.5)])
def test_a_command_at_the_limit_is_not_beyond_it(maximum, integral):
    controller = pid(limits=Limits(maximum=maximum))
    state, _ = controller.update(PidState(4.0, 0.5, 0.0), 0.5, {"tip_deflection": 0.25})
    assert state.integral == integral


def test_an_error_that_drives_back_unwinds():
    # e = -0.25: wanted -0.5 + 4 (2 - 0.125) = 7 is cut to 4.5, but S falls to 1.875.
    state, command = pid(limits=Limits(maximum=4.5)).update(PidState(4.5, 2.0, 1.25), 0.5, {"tip_deflection": 1.25})
    assert (state.integral, command) == (1.875, {"lateral_force": 4.5})


def test_lower_limit_with_negative_gains():
    # P = -2, I = -4, e = 1: wanted -4 is cut to -1, e drives it further: S stays 0, u = -2 is cut too.
    controller = pid(proportional=-2.0, integral=-4.0, derivative=0.0, limits=Limits(minimum=-1.0))
    state, command = controller.update(controller.begin(), 0.0, {"tip_deflection": 0.0})
    assert (state.integral, command) == (0.0, {"lateral_force": -1.0})


def test_a_slow_actuator_is_not_asked_for_more():
    # 4 is a step of at most 1 from 0 away; S waits: u = min(2, 1); then 1.5 + 0 - 0.125, a step of 0.375.
    assert commands(pid(limits=Limits(step=1.0)), tip_readings(0.0, 0.25)) == [1.0, 1.375]


def test_the_schedule_multiplies_all_gains():
    # At z = 25 mm g = 1: factor 1 * 2 / (1 + 0.25) = 1.6; at 75 mm g = -1: -1.6; at 50 mm 0.
    near, far, zero = (
        commands(pid(schedule=falling_gain()), tip_readings(0.0, 0.25, depth=depth)) for depth in (0.025, 0.075, 0.05)
    )
    assert near == pytest.approx([1.6 * 4.0, 1.6 * 4.875], rel=1e-12)
    assert far == pytest.approx([-1.6 * 4.0, -1.6 * 4.875], rel=1e-12)
    assert zero == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_schedule_waits_for_the_depth():
    assert commands(pid(schedule=falling_gain(), initial=0.5), tip_readings(0.0)) == [0.5]


def test_the_mean_of_tip_and_tissue():
    # y = (0.5 + 0.25) / 2 = 0.375, e = 0.625: u = 1.25 + 1.25; both readings are needed.
    readings = [{"tip_deflection": 0.5}, {"tissue_displacement": 0.25}, {"tip_deflection": 0.5, "tissue_displacement": 0.25}]
    assert commands(pid(read=output_reader("image_error")), readings) == [0.0, 0.0, 2.5]
