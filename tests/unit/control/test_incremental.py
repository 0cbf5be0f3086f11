import pytest

from fem_needle.control.incremental import Incremental
from fem_needle.control.signals import Limits
from tests.unit.control.scenes import COMMON, commands, falling_gain, tip_readings

LITTLE = 2.0**-20


def incremental(**changes):
    given = {"target": 0.0, "smallest_error": 1.0, "smallest_change": 0.5, "increment": 0.25, "largest_command": 0.5}
    return Incremental(**(COMMON | given | changes))


@pytest.mark.parametrize("sign", [1, -1])
def test_an_error_that_grows(sign):
    # e = 2, 3, 4, 5, each 1 more than before: -0.25, -0.5, then threshold 3 holds.
    found = commands(incremental(), tip_readings(*(sign * value for value in (2.0, 3.0, 4.0, 5.0))))
    assert found == [sign * value for value in (-0.25, -0.5, -0.5, -0.5)]


@pytest.mark.parametrize("error, step", [(1.0 - LITTLE, 0.0), (1.0, 0.0), (1.0 + LITTLE, 0.25)])
def test_threshold_one_must_be_exceeded(error, step):
    assert commands(incremental(), tip_readings(error)) == [-step]
    assert commands(incremental(), tip_readings(-error)) == [step]


@pytest.mark.parametrize("change, step", [(0.5 - LITTLE, 0.0), (0.5, 0.0), (0.5 + LITTLE, 0.25)])
@pytest.mark.parametrize("way", [1, -1])
def test_threshold_two_must_be_exceeded(change, step, way):
    # The first reading, 4 after 0, takes one increment; the second only if it has changed enough, either way.
    assert commands(incremental(), tip_readings(4.0, 4.0 + way * change)) == [-0.25, -0.25 - step]


def test_a_large_error_that_stays_holds_the_force():
    assert commands(incremental(), tip_readings(4.0, 4.0, 4.0, 4.0)) == [-0.25] * 4


def test_the_error_before_is_that_of_the_last_decision():
    # 0.3 each time never exceeds 0.5, however far it creeps from where the force was changed last.
    assert commands(incremental(), tip_readings(0.3, 0.6, 0.9, 1.2, 1.5)) == [0.0] * 5


def test_the_force_follows_a_change_of_sign():
    # 2: -0.25; -2: back to 0; -3: +0.25
    assert commands(incremental(), tip_readings(2.0, -2.0, -3.0)) == [-0.25, 0.0, 0.25]


def test_the_target_counts():
    assert commands(incremental(target=3.0), tip_readings(2.5, 1.0)) == [0.0, 0.25]


def test_missing_readings_keep_the_command():
    assert commands(incremental(initial=0.125), [{}, *tip_readings(2.0), {}]) == [0.125, -0.125, -0.125]


def test_threshold_three_cuts_what_the_scene_began_with():
    assert commands(incremental(initial=2.0), tip_readings(0.0)) == [0.5]


def test_the_actuator_cuts_too():
    limits = Limits(minimum=-0.375, step=0.2)
    assert commands(incremental(limits=limits), tip_readings(2.0, 3.0, 4.0)) == pytest.approx([-0.2, -0.375, -0.375])


def test_the_schedule_gives_the_sign():
    # g = 2 - 40 z, s = 1/4 of 2: at 25 mm positive, at 75 mm negative, from 37.5 to 62.5 mm too small.
    found = [commands(incremental(schedule=falling_gain()), tip_readings(2.0, depth=z))[0] for z in (0.025, 0.075, 0.05)]
    assert found == [-0.25, 0.25, 0.0]


def test_a_schedule_waits_for_the_depth():
    assert commands(incremental(schedule=falling_gain()), tip_readings(2.0)) == [0.0]


def test_without_threshold_three():
    free = incremental(largest_command=float("inf"))
    assert commands(free, tip_readings(*range(2, 12)))[-1] == -2.5
