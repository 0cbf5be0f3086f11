from itertools import pairwise
from math import exp, log

import pytest

from fem_needle import ComputationError
from fem_needle.control.inverse_dynamics import InverseDynamics
from fem_needle.control.signals import Limits
from tests.unit.control.scenes import COMMON, commands, line, response, static_loop

HALF = log(2.0)  # rate [1/s] at which an error halves in 1 s


def inverse(gain, rest=None, **changes):
    given = {
        "target": 0.0,
        "period": 1.0,
        "rate": HALF,
        "response": response(gain, rest, largest=2.0),
        "smallest_response": 0.25,
        "encoder_period": 1.0,
    }
    return InverseDynamics(**(COMMON | given | changes))


def readings(*pairs):
    return [{"tip_deflection": tip, "depth": depth} for tip, depth in pairs]


def test_a_needle_that_is_held():
    # g = 2, y_d - y = -y / 2: u = 0 - 0.5 / 2, then -0.25 + 0.25 / 2 from y = -0.5
    assert commands(inverse(line(2.0, 0.0)), readings((1.0, 0.05), (-0.5, 0.05)), 1.0) == pytest.approx([-0.25, -0.125])


def test_the_target_counts():
    # y - target = -1, y_d - y = +0.5: u = 0.5 / 2
    assert commands(inverse(line(2.0, 0.0), target=2.0), readings((1.0, 0.05)), 1.0) == pytest.approx([0.25])


def test_the_model_looks_one_period_ahead():
    # g = 2 - 10 z, y0 = 5 z. First decision: no speed yet, g(0.02) = 1.8, u = -0.5 / 1.8.
    # Second: z 0.02 -> 0.04, ahead 0.06: y0 moves 0.1, g from 1.6 to 1.4, y_d - y = -0.25.
    first = -0.5 / 1.8
    second = first + (-0.25 - 0.1 + 0.2 * first) / 1.4
    found = commands(inverse(line(2.0, -10.0), line(0.0, 5.0)), readings((1.0, 0.02), (0.5, 0.04)), 1.0)
    assert found == pytest.approx([first, second], rel=1e-12)


def test_the_speed_is_reckoned_from_readings_of_the_depth():
    # Period 1 s, encoder every 2 s. y0 = 5 z, g = 1, y = 0: u falls by 5 times the way ahead. The speed is first known
    # at 2 s: (0.04 - 0.02) / 2 = 0.01; it stays at 3 s, though the reading does too; at 4 s (0.06 - 0.04) / 2 again.
    controller = inverse(line(1.0, 0.0), line(0.0, 5.0), encoder_period=2.0)
    found = commands(controller, readings((0, 0.02), (0, 0.02), (0, 0.04), (0, 0.04), (0, 0.06)), 1.0)
    assert found == pytest.approx([0.0, 0.0, -0.05, -0.1, -0.15], abs=1e-12)


def test_the_error_falls_as_asked_while_the_needle_moves():
    """On its own model the tip follows exp(-rate t) exactly from the second decision on, through a gain that changes."""
    gain, rest = line(2.0, -30.0, end=0.2), line(1.0, 7.0, end=0.2)
    controller = inverse(gain, rest, period=0.5, rate=0.4, encoder_period=0.5)

    def tip(depth, command):
        return rest(depth) + gain(depth) * command + 0.3  # and something the model does not know

    tips, _ = static_loop(controller, tip, depth=lambda time: 0.01 + 0.004 * time, periods=20, period=0.5)
    ratios = [after / before for before, after in pairwise(tips[2:])]
    assert ratios == pytest.approx([exp(-0.2)] * len(ratios), rel=1e-9)


def test_missing_readings_keep_the_command():
    found = commands(inverse(line(2.0, 0.0), initial=0.5), [{}, {"tip_deflection": 1.0}, {"depth": 0.05}], 1.0)
    assert found == [0.5, 0.5, 0.5]


def test_the_command_is_cut_and_known():
    # Wanted -0.5 / 2 = -0.25, then from the -0.125 that were given: -0.125 - 0.25, cut again.
    controller = inverse(line(2.0, 0.0), limits=Limits(minimum=-0.2, step=0.125))
    assert commands(controller, readings((1.0, 0.05), (1.0, 0.05)), 1.0) == pytest.approx([-0.125, -0.2])


@pytest.mark.parametrize("depth, refused", [(0.0374, False), (0.0376, True), (0.05, True), (0.0624, True), (0.0626, False)])
def test_a_gain_too_small_is_refused(depth, refused):
    # g = 2 - 40 z is 0.5, a quarter of 2, at 37.5 mm and -0.5 at 62.5 mm.
    controller = inverse(line(2.0, -40.0))
    if not refused:
        assert commands(controller, readings((0.0, depth)), 1.0) == [0.0]
        return
    with pytest.raises(ComputationError, match=rf"time 0 s, depth {depth:g} m: lateral_force .* 0\.25 .*schedule = 'model-gain'"):
        commands(controller, readings((0.0, depth)), 1.0)


def test_the_gain_ahead_counts():
    # At 37 mm g = 0.52, but from 30 mm the needle comes with 7 mm in a period: at 44 mm it is 0.24.
    with pytest.raises(ComputationError, match=r"time 1 s, depth 0\.044 m"):
        commands(inverse(line(2.0, -40.0)), readings((0.0, 0.03), (0.0, 0.037)), 1.0)
