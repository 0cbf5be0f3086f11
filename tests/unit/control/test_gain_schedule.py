import pytest

from tests.unit.control.scenes import falling_gain

# g = 2 - 40 z, g_ref = 2, s = 1/4: floor 0.5.


@pytest.mark.parametrize("depth, gain", [(0.0, 2.0), (0.025, 1.0), (0.0375, 0.5), (0.05, 0.0), (0.0625, -0.5), (0.1, -2.0)])
def test_the_factor_carries_the_sign_and_vanishes_with_the_gain(depth, gain):
    expected = 2.0 * gain / (gain**2 + 0.25)
    assert falling_gain().factor(depth) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_factor_is_bounded_where_the_gain_is_the_floor():
    factors = [falling_gain().factor(0.0001 * number) for number in range(1001)]
    assert max(factors) == pytest.approx(1 / (2 * 0.25), rel=1e-4)
    assert min(factors) == pytest.approx(-1 / (2 * 0.25), rel=1e-4)


def test_the_gain_of_the_loop_is_never_larger_than_chosen():
    schedule = falling_gain()
    loops = [schedule.factor(0.001 * number) * schedule.response.gain(0.001 * number) / 2.0 for number in range(101)]
    assert min(loops) == pytest.approx(0.0, abs=1e-12)
    assert max(loops) == pytest.approx(1.0 / (1.0 + 0.25**2), rel=1e-9)


@pytest.mark.parametrize("depth, sign", [(0.0, 1), (0.0374, 1), (0.0376, 0), (0.05, 0), (0.0624, 0), (0.0626, -1), (0.1, -1)])
def test_the_sign(depth, sign):
    assert falling_gain().sign(depth) == sign
