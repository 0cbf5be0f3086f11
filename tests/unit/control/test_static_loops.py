"""Default gains and the sign of the gain, on a tip that answers at once."""

from math import ceil

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_needle import ComputationError, build_plant
from fem_needle.control import controller_of
from fem_needle.control.model_response import model_response
from tests.unit.control.scenes import ENCODER, TIP, static_loop, tube

PERIOD = 1 / 30
OFFSET = 1e-3  # m, of the tip without a command
GRADUAL = ["pid", "proportional", "inverse-dynamics"]


@pytest.fixture(scope="module")
def plant():
    return build_plant(tube())


@pytest.fixture(scope="module")
def known(plant):
    return model_response(plant, "lateral_force", depths=(0.05, 0.12))


def roots(kind, controller, gain):
    """Poles of the sampled loop around y = gain u_before, by its characteristic polynomial."""
    if kind == "pid":
        # u - u_1 = -P (y - y_1) - I T y, y = g u_1: z^2 - (1 - gP - gIT) z - gP
        p, q = gain * controller.proportional, gain * controller.integral * controller.period
        return np.roots([1.0, -(1.0 - p - q), -p])
    if kind == "proportional":
        return np.roots([1.0, gain * controller.proportional])  # u = -P g u_1
    # u = u_1 - (1 - exp(-rate T)) y / g_model
    share = gain / controller.response.gain(0.05)
    return np.roots([1.0, -1.0 + share * (1.0 - np.exp(-controller.rate * controller.period))])


@pytest.mark.parametrize("kind", GRADUAL)
@pytest.mark.parametrize("share", [0.1, 1.0, 1.5])
def test_default_gains_are_stable(kind, share, plant, known):
    """Up to one and a half times the gain that they were chosen for."""
    found = roots(kind, controller_of(tube({"kind": kind}), plant), share * known.largest_gain)
    assert np.max(np.abs(found)) < 1.0
    if share == 1.0:
        assert np.max(np.abs(found)) < np.exp(-1 / 6)  # a few periods


@pytest.mark.parametrize("kind", GRADUAL)
@pytest.mark.parametrize("scale", [0.5, 1.0])
def test_the_polynomial_is_that_of_the_loop(kind, scale, plant, known):
    """The sequence of deflections satisfies the recursion whose polynomial was looked at."""
    controller = controller_of(tube({"kind": kind}), plant)
    gain = scale * known.gain(0.05)
    tips, _ = static_loop(controller, lambda depth, command: OFFSET + gain * command, periods=12)
    coefficients = np.poly(roots(kind, controller, gain))
    order = len(coefficients) - 1
    settled = OFFSET / (1 + gain * controller.proportional) if kind == "proportional" else 0.0
    deviations = np.array(tips) - settled
    missed = [coefficients @ deviations[n - order : n + 1][::-1] for n in range(order + 1, len(tips))]
    assert missed == pytest.approx([0.0] * len(missed), abs=1e-12 * OFFSET)


@pytest.mark.parametrize("kind", GRADUAL)
@pytest.mark.parametrize(
    "period, sensor_period, delay",
    [(1e-3, PERIOD, 0.0), (PERIOD, PERIOD, PERIOD), (0.01, PERIOD, 0.15), (0.1, 0.01, 0.0)],
)
def test_default_gains_know_the_sensor(kind, period, sensor_period, delay, plant, known):
    """A fast controller that sees slow or late images."""
    sensors = [TIP | {"period": sensor_period, "delay": delay}, ENCODER | {"period": period}]
    scene = tube({"kind": kind, "period": period}, sensors=sensors)
    timing = {"periods": round(10.0 / period), "period": period, "sensor_period": sensor_period, "delay": delay}
    gain = known.largest_gain
    tips, _ = static_loop(controller_of(scene, plant), lambda depth, command: OFFSET + gain * command, **timing)
    assert np.max(np.abs(tips)) < 1.5 * OFFSET
    assert tips[-1] == pytest.approx(OFFSET / 1.5 if kind == "proportional" else 0.0, abs=0.01 * OFFSET)


@pytest.mark.parametrize("pixel", [0.0, 1e-4])
@pytest.mark.parametrize("offset", [3e-3, -3e-3])
def test_incremental_control_comes_near_and_rests(pixel, offset, plant, known):
    controller = controller_of(tube({"kind": "incremental"}, sensors=[TIP | {"pixel_size": pixel}, ENCODER]), plant)

    def seen(depth, command):
        tip = offset + known.largest_gain * command
        return round(tip / pixel) * pixel if pixel else tip

    tips, given = static_loop(controller, seen)
    assert abs(tips[-1]) <= controller.smallest_error < abs(offset)
    assert given[-50:] == [given[-1]] * 50


def steered(kind, schedule, plant, known, *, final=0.12):
    """Tips of an insertion from 50 mm through the sign change at 92.3 mm, then held; the tip would be at OFFSET by itself."""
    controller = controller_of(tube({"kind": kind, "schedule": schedule}), plant)

    def tip(depth, command):
        return OFFSET + known.gain(depth) * command

    return static_loop(controller, tip, depth=lambda time: min(0.05 + 0.01 * time, final), periods=600)


@pytest.mark.parametrize("kind", ["pid", "incremental", "proportional"])
def test_fixed_signs_push_the_wrong_way_beyond_the_sign_change(kind, plant, known):
    """The error becomes larger than without a controller, by a command of the sign that was right before."""
    assert known.sign_changes == pytest.approx([0.0923], abs=1e-4)
    assert known.gain(0.05) > 0.0 > known.gain(0.12)
    tips, given = steered(kind, "none", plant, known)
    assert tips[-1] > OFFSET
    assert given[-1] < 0.0


@pytest.mark.parametrize("kind", ["pid", "incremental", "proportional"])
def test_a_schedule_turns_with_the_gain(kind, plant, known):
    tips, given = steered(kind, "model-gain", plant, known)
    gain, largest = known.gain(0.12), known.largest_gain
    loop = 0.5 * gain**2 / (gain**2 + (0.05 * largest) ** 2)  # of proportional control: 0.5 / g_ref times factor times g
    left = {"pid": 1e-9 * OFFSET, "incremental": 1e-4, "proportional": OFFSET / (1.0 + loop) * (1.0 + 1e-6)}[kind]
    assert abs(tips[-1]) <= left < OFFSET
    assert given[-1] > 0.0


def test_a_fixed_sign_with_an_integral_grows_as_its_unstable_pole(plant, known):
    tips, _ = steered("pid", "none", plant, known)
    pole = np.max(np.abs(roots("pid", controller_of(tube({"kind": "pid"}), plant), known.gain(0.12))))
    assert pole > 1.0
    held = np.array(tips[300:])  # 120 mm since 7 s
    assert held[1:] / held[:-1] == pytest.approx(np.full(len(held) - 1, pole), rel=1e-9)


def test_inverse_dynamics_stops_before_the_sign_change(plant, known):
    """In the decision whose depth ahead has a gain below a twentieth of the largest."""
    last = brentq(lambda depth: known.gain(depth) - 0.05 * known.largest_gain, 0.08, 0.09)
    number = ceil((last - 0.05) / (0.01 * PERIOD)) - 1
    with pytest.raises(ComputationError, match=f"time {number * PERIOD:g} s, depth {0.05 + 0.01 * PERIOD * (number + 1):g} m"):
        steered("inverse-dynamics", "none", plant, known)
