import pytest

from fem_needle.closed_loop.inputs import Ramp
from fem_needle.closed_loop.outcome import Effort, first_arrival, magnitude_integral, outcome
from tests.consistency.closed_loop_scenes import loop_scene

AIMED = loop_scene().with_values({"target.depth": 0.06, "target.lateral": 1e-3})
SIGNED = Ramp(time=1.0, start=3.0, target=-1.0, rate=2.0)  # 3 at 1 s, 0 at 2.5 s, -1 from 3 s on


@pytest.mark.parametrize(
    "start, end, integral",
    [(1.0, 2.0, 2.0), (1.0, 2.5, 2.25), (1.0, 3.0, 2.5), (1.0, 5.0, 4.5), (2.25, 2.75, 0.125), (4.0, 5.0, 1.0), (2.0, 2.0, 0.0)],
)
def test_the_integral_of_a_magnitude(start, end, integral):
    assert magnitude_integral(SIGNED, start, end) == pytest.approx(integral, rel=1e-12)


def test_the_integral_of_a_jump():
    jump = Ramp(time=1.0, start=3.0, target=-2.0)
    assert magnitude_integral(jump, 1.0, 4.0) == 6.0


def test_effort_adds_up():
    effort = Effort().after(SIGNED, 1.0, 2.0).after(SIGNED, 2.0, 3.0)
    assert effort.integral == pytest.approx(2.5, rel=1e-12)
    assert effort.largest == 3.0


def test_the_tip_where_the_target_is_passed():
    start = first_arrival(AIMED, 0.05, 0.0)
    assert (start.reached, start.time, start.depth) == (False, 0.0, 0.05)
    near = start.followed(AIMED, 1.0, 0.059, 2e-3)
    assert (near.reached, near.time, near.depth, near.tip_deflection) == (False, 1.0, 0.059, 2e-3)
    passed = near.followed(AIMED, 2.0, 0.063, 6e-3)  # a quarter of the way
    assert (passed.reached, passed.depth) == (True, 0.06)
    assert (passed.time, passed.tip_deflection) == pytest.approx((1.25, 3e-3))
    assert passed.followed(AIMED, 3.0, 0.07, 0.0) is passed


def test_a_step_that_ends_at_the_target_is_taken_as_it_is():
    near = first_arrival(AIMED, 0.05, 0.0)
    there = near.followed(AIMED, 1.0, 0.06 - 1e-15, 2e-3)
    assert (there.reached, there.time, there.tip_deflection) == (True, 1.0, 2e-3)


def test_a_needle_that_begins_at_the_target():
    assert first_arrival(AIMED, 0.06, 5e-4).reached
    assert first_arrival(AIMED, 0.08, 5e-4).tip_deflection == 5e-4


def test_without_a_depth_the_end_counts():
    scene = loop_scene()
    arrival = first_arrival(scene, 0.05, 0.0).followed(scene, 1.0, 0.07, 2e-3).followed(scene, 2.0, 0.06, 1e-3)
    assert (arrival.reached, arrival.time, arrival.depth, arrival.tip_deflection) == (True, 2.0, 0.06, 1e-3)


def test_what_the_summary_says():
    arrival = first_arrival(AIMED, 0.06, 5e-4)
    told = outcome(AIMED, arrival, {"lateral_force": Effort(2.5, 3.0)})
    assert told["target_error"] == pytest.approx(-5e-4)
    assert (told["target_reached"], told["target_depth"], told["target_time"]) == (True, 0.06, 0.0)
    assert (told["effort"], told["largest_command"]) == ({"lateral_force": 2.5}, {"lateral_force": 3.0})
    assert (told["controller"]["kind"], told["sensors"]) == ("none", [])
