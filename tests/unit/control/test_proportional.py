import pytest

from fem_needle.control.proportional import Proportional
from fem_needle.control.signals import Limits
from tests.unit.control.scenes import COMMON, commands, falling_gain, tip_readings

LITTLE = 2.0**-20


def proportional(**changes):
    given = {"target": 0.0, "proportional": 2.0, "smallest_change": 0.5, "largest_error": 4.0}
    return Proportional(**(COMMON | given | changes))


def test_both_signs():
    assert commands(proportional(), tip_readings(1.0, -1.0, 2.0)) == [-2.0, 2.0, -4.0]


@pytest.mark.parametrize("change, used", [(0.5 - LITTLE, 0.0), (0.5, 0.0), (0.5 + LITTLE, 0.5 + LITTLE)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_change_must_exceed_the_smallest(change, used, way):
    assert commands(proportional(), tip_readings(1.0, 1.0 + way * change)) == [-2.0, -2.0 * (1.0 + way * used)]


def test_changes_are_counted_from_the_error_used():
    # 0.3 is not used, 0.6 is 0.6 from 0, 0.9 is 0.3 from 0.6, 1.2 is 0.6 from it.
    assert commands(proportional(), tip_readings(0.3, 0.6, 0.9, 1.2)) == pytest.approx([0.0, -1.2, -1.2, -2.4])


@pytest.mark.parametrize("error, command", [(4.0 - LITTLE, -2.0 * (4.0 - LITTLE)), (4.0, -2.0), (4.0 + LITTLE, -2.0)])
def test_a_fault_of_the_image_changes_nothing(error, command):
    assert commands(proportional(), tip_readings(1.0, error, error)) == [-2.0, command, command]
    assert commands(proportional(), tip_readings(-1.0, -error)) == [2.0, -command]


def test_after_a_fault_it_goes_on():
    assert commands(proportional(), tip_readings(1.0, 9.0, 2.0)) == [-2.0, -2.0, -4.0]


def test_missing_readings_and_small_errors_keep_what_the_scene_began_with():
    assert commands(proportional(initial=0.25), [{}, *tip_readings(0.5, 0.75), {}]) == [0.25, 0.25, -1.5, -1.5]


def test_the_target_counts():
    assert commands(proportional(target=1.0), tip_readings(0.0)) == [2.0]


def test_the_command_is_cut():
    limits = Limits(minimum=-3.0, maximum=1.0, step=2.0)
    # -4 is cut to -3, a step of 2 at most: -2, -3; then 2 is cut to 1, again in two steps.
    assert commands(proportional(limits=limits), tip_readings(2.0, 2.0, -1.0, -1.0)) == [-2.0, -3.0, -1.0, 1.0]


def test_the_schedule_acts_on_the_error_used():
    # Factor 1.6 at 25 mm, -1.6 at 75 mm, 0 at 50 mm; the error does not change, the depth does.
    readings = [{"tip_deflection": 1.0, "depth": depth} for depth in (0.025, 0.05, 0.075)]
    assert commands(proportional(schedule=falling_gain()), readings) == pytest.approx([-3.2, 0.0, 3.2], abs=1e-12)


def test_a_schedule_waits_for_the_depth():
    assert commands(proportional(schedule=falling_gain(), initial=0.5), tip_readings(1.0)) == [0.5]
