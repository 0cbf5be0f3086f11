import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from fem_needle.scene import Constant, Insertion, Sinusoid, Table, as_function

TABLE = Table(time=[-1.0, 1.0, 2.0, 4.0], value=[1.0, 3.0, -1.0, -1.0])
WAVE = Sinusoid(mean=0.4, amplitude=-2.0, frequency=1.7, phase=0.6)
FUNCTIONS = [Constant(2.5), TABLE, WAVE]


def test_a_table_is_linear_between_and_constant_outside():
    np.testing.assert_allclose(TABLE.value(np.array([-5.0, 0.0, 1.5, 3.0, 9.0])), [1.0, 2.0, 1.0, -1.0, -1.0])


def test_a_table_has_the_derivative_from_the_right():
    assert [TABLE.derivative(time) for time in (-2.0, -1.0, 0.0, 1.0, 2.0, 4.0)] == [0.0, 1.0, 1.0, -4.0, 0.0, 0.0]


@pytest.mark.parametrize("function", FUNCTIONS, ids=["constant", "table", "sinusoid"])
@pytest.mark.parametrize("time", [-3.0, -0.5, 0.0, 0.7, 1.0, 1.9, 6.0])
def test_the_integral_is_that_of_the_value(function, time):
    low, high = sorted((0.0, time))
    inside = [kink for kink in function.breakpoints if low < kink < high]
    expected, _ = quad(function.value, 0.0, time, points=inside or None, epsabs=1e-13)
    assert function.integral(time) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("function", FUNCTIONS, ids=["constant", "table", "sinusoid"])
def test_a_number_gives_a_float_and_an_array_its_shape(function):
    grid = np.linspace(-2.0, 5.0, 6).reshape(2, 3)
    for method in (function.value, function.derivative, function.integral):
        assert type(method(0.3)) is float
        assert method(grid).shape == (2, 3)
        assert method(grid)[1, 2] == pytest.approx(method(float(grid[1, 2])), rel=1e-15)


def test_a_sinusoid_has_its_derivative():
    step = 1e-6
    expected = (WAVE.value(0.3 + step) - WAVE.value(0.3 - step)) / (2 * step)
    assert WAVE.derivative(0.3) == pytest.approx(expected, rel=1e-8)


def test_the_integral_of_a_slow_sinusoid_keeps_its_digits():
    slow = Sinusoid(mean=0.0, amplitude=1.0, frequency=1e-9, phase=0.5)
    assert slow.integral(2.0) == pytest.approx(2.0 * np.sin(0.5 + 2e-9 * np.pi), rel=1e-14)


def test_as_function():
    assert as_function(3.0).value(7.0) == 3.0
    assert as_function(TABLE) is TABLE


@pytest.mark.parametrize(
    ("time", "value", "message"),
    [
        ([0.0, 1.0], [0.0], "1 values for 2 times"),
        ([0.0, 0.0], [0.0, 1.0], "times must rise"),
        ([1.0, 0.0], [0.0, 1.0], "times must rise"),
        ([1.0], [0.0], "at least 2"),
        ([0.0, float("nan")], [0.0, 1.0], "not finite"),
        ([0.0, 1.0], [0.0, True], "not a number"),
    ],
)
def test_a_wrong_table_says_why(time, value, message):
    with pytest.raises(ValueError, match=message):
        Table(time=time, value=value)


depths = st.floats(0.0, 1.0)
waves = st.builds(
    Sinusoid, mean=st.floats(-1, 1), amplitude=st.floats(-2, 2), frequency=st.floats(0.05, 4.0), phase=st.floats(-7, 7)
)
tables = st.lists(st.tuples(st.integers(-3, 12), st.floats(-2, 2)), min_size=2, max_size=6, unique_by=lambda point: point[0]).map(
    lambda points: Table(time=[time for time, _ in sorted(points)], value=[value for _, value in sorted(points)])
)


@given(st.one_of(waves, tables), st.floats(0.1, 10.0), st.sampled_from(["speed", "profile"]))
def test_the_depth_range_holds_every_depth_and_is_reached(function, duration, kind):
    """Against a fine grid: nothing outside, and the ends reached to the grid's error."""
    insertion = (
        Insertion(kind="speed", initial_depth=0.3, speed=function)
        if kind == "speed"
        else Insertion(kind="profile", depth=function)
    )
    low, high = insertion.depth_range(duration)
    grid = np.linspace(0.0, duration, 20_001)
    depth = 0.3 + function.integral(grid) if kind == "speed" else function.value(grid)
    assert low <= depth.min() + 1e-12
    assert high >= depth.max() - 1e-12
    # The largest rates here: 3 m/s of a speed, 51 m/s of a profile (2 pi f amplitude; a table has at most 4).
    error = duration / 20_000 * (3.0 if kind == "speed" else 51.0)
    assert low >= depth.min() - error
    assert high <= depth.max() + error
