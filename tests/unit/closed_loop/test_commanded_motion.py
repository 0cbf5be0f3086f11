from math import inf, sqrt

import pytest

from fem_needle.closed_loop.motion import CommandedMotion
from fem_needle.motion import Instant


def motion(speed, acceleration=0.0, *, time=1.0, depth=0.05):
    return CommandedMotion(Instant(time, depth, speed, acceleration))


def test_a_constant_acceleration():
    braking = motion(0.2, -0.1)
    assert braking.depth(3.0) == pytest.approx(0.05 + 0.2 * 2 - 0.05 * 4)
    assert braking.layer_depth(1.0, 3.0) == braking.depth(2.0)
    assert braking.after(3.0) == braking.before(3.0)
    assert braking.after(2.0).speed == pytest.approx(0.1)
    assert (braking.after(2.0).time, braking.after(2.0).acceleration) == (2.0, -0.1)


@pytest.mark.parametrize(
    "speed, acceleration, time",
    [(0.2, -0.1, 3.0), (-0.2, 0.1, 3.0), (0.2, 0.1, inf), (0.2, 0.0, inf), (0.0, 0.1, inf), (0.0, 0.0, inf)],
)
def test_where_it_turns_round(speed, acceleration, time):
    assert motion(speed, acceleration).turning_time() == pytest.approx(time)


@pytest.mark.parametrize(
    "speed, acceleration, level, time",
    [
        (0.01, 0.0, 0.07, 3.0),
        (0.01, 0.0, 0.04, inf),
        (-0.01, 0.0, 0.04, 2.0),
        (0.0, 0.0, 0.07, inf),
        (0.01, 0.0, 0.05, inf),  # it is there
        (0.0, 0.02, 0.09, 3.0),  # 0.01 t^2
        (0.0, -0.02, 0.04, 2.0),
        (0.0, 0.02, 0.04, inf),
        (0.02, -0.01, 0.0701, inf),
        (0.02, -0.01, 0.065, 2.0),  # 0.02 t - 0.005 t^2 = 0.015: at 1 and at 3
        (0.02, -0.01, 0.04, 1.0 + 2.0 + sqrt(6.0)),  # after it has turned round
        (-0.02, 0.01, 0.035, 2.0),
        (-0.02, 0.01, 0.06, 1.0 + 2.0 + sqrt(6.0)),
    ],
)
def test_when_a_level_is_passed(speed, acceleration, level, time):
    assert motion(speed, acceleration).passing_time(level) == pytest.approx(time, rel=1e-12)


def test_a_level_where_it_turns_round():
    assert motion(0.25, -0.125, depth=0.0).passing_time(0.25) == 3.0


def test_a_small_acceleration_takes_no_digits():
    """Both roots of a nearly linear motion; the difference of nearly equal numbers would leave none of these digits."""
    level = 0.05 + 0.01 * 2.0 + 0.5e-15 * 4.0
    assert motion(0.01, 1e-15).passing_time(level) == pytest.approx(3.0, rel=1e-14)
