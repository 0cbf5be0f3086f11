"""Weighted least squares against hand computation, scipy and the coverage of its intervals; the filter against its formula."""

from math import inf

import numpy as np
import pytest
import scipy.stats

from fem_needle import SceneError
from fem_needle.identification import Estimate, independent_stride, weighted_least_squares, zero_phase

LINE = ("offset", "slope")


def line(x):
    return np.column_stack([np.ones_like(x), x])


def test_a_line_through_four_points_by_hand():
    """x = 0, 1, 2, 3, y = 1, 3, 4, 8: slope 11/5, offset 7/10, residual squares 9/5, covariance 9/10 (X^T X)^-1."""
    x = np.arange(4.0)
    fit = weighted_least_squares(line(x), [1.0, 3.0, 4.0, 8.0], LINE)
    assert fit.values == pytest.approx([0.7, 2.2])
    assert fit.residuals == pytest.approx([0.3, 0.1, -1.1, 0.7])
    assert fit.deviation**2 == pytest.approx(0.9)
    assert fit.covariance == pytest.approx(0.9 * np.array([[0.7, -0.3], [-0.3, 0.2]]))
    assert fit.leverage == pytest.approx([0.7, 0.3, 0.3, 0.7])
    assert fit.correlation == pytest.approx(np.array([[1.0, -0.3 / np.sqrt(0.14)], [-0.3 / np.sqrt(0.14), 1.0]]))
    # Student's t with 2 degrees of freedom in closed form: 97.5 % at 4.302652...
    reach = 4.30265273 * np.sqrt(0.18)
    assert fit.intervals()[1] == pytest.approx([2.2 - reach, 2.2 + reach])


def test_a_line_agrees_with_scipy():
    random = np.random.default_rng(3)
    x = random.uniform(0.0, 5.0, 30)
    y = 2.0 - 0.7 * x + 0.1 * random.standard_normal(30)
    fit, theirs = weighted_least_squares(line(x), y, LINE), scipy.stats.linregress(x, y)
    slope = fit.estimate("slope")
    assert (slope.value, slope.standard_error) == pytest.approx((theirs.slope, theirs.stderr))
    assert fit.estimate("offset").standard_error == pytest.approx(theirs.intercept_stderr)
    assert slope.p_value() == pytest.approx(theirs.pvalue)


def test_weights_are_repetitions():
    """A row of weight 3 is worth three rows: same values, same (X^T W X)^-1."""
    x, y, counts = np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.3, 1.4, 1.7, 4.4]), np.array([1, 3, 2, 1])
    weighted = weighted_least_squares(line(x), y, LINE, weights=counts)
    repeated = weighted_least_squares(line(np.repeat(x, counts)), np.repeat(y, counts), LINE)
    assert weighted.values == pytest.approx(repeated.values)
    shapes = (weighted.covariance / weighted.deviation**2, repeated.covariance / repeated.deviation**2)
    assert shapes[0] == pytest.approx(shapes[1])


def test_weights_are_relative_and_variances_absolute():
    x, y = np.arange(6.0), np.array([0.1, 0.9, 2.2, 2.8, 4.1, 5.2])
    relative = [weighted_least_squares(line(x), y, LINE, weights=np.full(6, w)) for w in (1.0, 7.0)]
    assert relative[0].covariance == pytest.approx(relative[1].covariance)
    known = weighted_least_squares(line(x), y, LINE, variances=np.full(6, 0.25))
    assert known.covariance == pytest.approx(0.25 * np.linalg.inv(line(x).T @ line(x)))
    assert known.degrees_of_freedom == inf
    assert known.intervals()[1] == pytest.approx(known.values[1] + 1.959964 * known.standard_errors[1] * np.array([-1.0, 1.0]))


def test_a_covariance_matrix_of_the_errors():
    """The thesis' (X^T W^-1 X)^-1 X^T W^-1 Y, W full."""
    random = np.random.default_rng(5)
    x, y, root = random.uniform(size=(9, 2)), random.uniform(size=9), random.uniform(size=(9, 9)) + np.eye(9)
    w = root @ root.T
    fit = weighted_least_squares(x, y, LINE, variances=w)
    covariance = np.linalg.inv(x.T @ np.linalg.solve(w, x))
    assert fit.covariance == pytest.approx(covariance, rel=1e-6)
    assert fit.values == pytest.approx(covariance @ x.T @ np.linalg.solve(w, y), rel=1e-6)
    diagonal = weighted_least_squares(x, y, LINE, variances=np.diag(np.diag(w)))
    assert diagonal.values == pytest.approx(weighted_least_squares(x, y, LINE, variances=np.diag(w)).values)


@pytest.mark.parametrize("how", ["weights", "variances"])
def test_intervals_cover_the_truth(how):
    """400 data sets of 8 rows with unlike errors: intervals of 95 % hold the slope in 90 to 99 % of them."""
    random, x = np.random.default_rng(11), np.linspace(0.0, 1.0, 8)
    deviations = 0.05 + 0.3 * x
    given = {how: 4.0 / deviations**2 if how == "weights" else deviations**2}
    held = 0
    for _ in range(400):
        y = 1.0 + 2.0 * x + deviations * random.standard_normal(8)
        low, high = weighted_least_squares(line(x), y, LINE, **given).estimate("slope").interval()
        held += low < 2.0 < high
    assert 0.90 <= held / 400 <= 0.99


def test_a_combination_carries_the_correlation():
    x, y = np.arange(5.0), np.array([0.2, 0.8, 2.1, 3.3, 3.8])
    at_two = weighted_least_squares(line(x), y, LINE).combination({"offset": 1.0, "slope": 2.0})
    shifted = weighted_least_squares(line(x - 2.0), y, LINE).estimate("offset")
    assert (at_two.value, at_two.standard_error) == pytest.approx((shifted.value, shifted.standard_error))


def test_studentized_residuals_leave_their_own_row_out():
    random, x = np.random.default_rng(2), np.linspace(0.0, 1.0, 10)
    y = 1.0 + x + 0.1 * random.standard_normal(10)
    y[6] += 1.5
    fit = weighted_least_squares(line(x), y, LINE)
    for row in range(10):
        others = np.arange(10) != row
        without = weighted_least_squares(line(x[others]), y[others], LINE)
        expected = without.combination({"offset": 1.0, "slope": x[row]})
        spread = np.hypot(without.deviation, expected.standard_error)
        assert fit.studentized_residuals[row] == pytest.approx((y[row] - expected.value) / spread)
    assert fit.outliers() == (6,)


def test_chance_makes_few_outliers():
    random, x = np.random.default_rng(8), np.linspace(0.0, 1.0, 10)
    found = sum(bool(weighted_least_squares(line(x), random.standard_normal(10), LINE).outliers()) for _ in range(400))
    assert 0.02 <= found / 400 <= 0.08


def test_a_degenerate_fit_names_the_parameters():
    x = np.linspace(0.0, 1.0, 8)
    matrix = np.column_stack([x, np.ones(8), 3.0 * x, x**2])
    with pytest.raises(SceneError, match="do not tell modulus and force apart"):
        weighted_least_squares(matrix, x, ("modulus", "offset", "force", "curvature"))
    with pytest.raises(SceneError, match="say nothing of drag"):
        weighted_least_squares(np.column_stack([x, 0.0 * x]), x, ("modulus", "drag"))


def test_columns_of_unlike_size_are_no_degeneracy():
    x = np.linspace(0.0, 1.0, 8)
    fit = weighted_least_squares(line(x) * [1e-9, 1e12], 1.0 + x, LINE)
    assert fit.values == pytest.approx([1e9, 1e-12])


@pytest.mark.parametrize(
    ("matrix", "y", "options", "message"),
    [
        (np.ones((3, 2)), np.ones(4), {}, "shape"),
        (np.ones((2, 2)), np.ones(2), {}, "3 or more"),
        (np.ones((4, 2)), [1.0, 2.0, np.nan, 3.0], {}, "finite"),
        (line(np.arange(4.0)), np.ones(4), {"weights": [1.0, 1.0, 0.0, 1.0]}, "positive"),
        (line(np.arange(4.0)), np.ones(4), {"variances": np.ones(3)}, "positive numbers"),
        (line(np.arange(4.0)), np.ones(4), {"variances": -np.eye(4)}, "definite"),
        (line(np.arange(4.0)), np.ones(4), {"variances": np.ones(4), "weights": np.ones(4)}, "exclude"),
    ],
)
def test_wrong_input(matrix, y, options, message):
    with pytest.raises(SceneError, match=message):
        weighted_least_squares(matrix, y, LINE, **options)


def test_an_unknown_name():
    fit = weighted_least_squares(line(np.arange(4.0)), np.ones(4), LINE)
    with pytest.raises(SceneError, match="allowed offset, slope"):
        fit.estimate("gradient")


def test_an_estimate():
    estimate = Estimate(2.0, 0.5, 10.0)
    assert estimate.p_value(2.0) == 1.0
    low, high = estimate.interval(0.95)
    assert estimate.p_value(low) == pytest.approx(0.05) == estimate.p_value(high)
    assert estimate.scaled(-2.0) == Estimate(-4.0, 1.0, 10.0)


def test_the_filter_has_no_delay_and_half_the_power_at_the_cut_off():
    interval, cutoff = 1e-3, 20.0
    time = np.arange(4000) * interval
    inner = slice(1000, 3000)
    for frequency, share in ((2.0, 1.0), (cutoff, np.sqrt(0.5)), (200.0, 0.0)):
        wave = np.sin(2.0 * np.pi * frequency * time)
        assert zero_phase(wave, interval, cutoff)[inner] == pytest.approx(share * wave[inner], abs=1e-3)
    assert zero_phase(3.0 + 2.0 * time, interval, cutoff) == pytest.approx(3.0 + 2.0 * time, abs=1e-8)


def test_filtered_noise_is_independent_at_the_stride():
    interval, cutoff = 1e-3, 25.0
    stride = independent_stride(interval, cutoff)
    assert stride == 20
    filtered = zero_phase(np.random.default_rng(0).standard_normal(100_000), interval, cutoff)
    every = filtered[::stride]
    assert abs(np.corrcoef(every[:-1], every[1:])[0, 1]) < 0.05
    assert np.corrcoef(filtered[:-2], filtered[2:])[0, 1] > 0.9
    # Of white noise the band below the cut-off passes: cutoff over Nyquist's frequency, a little less for the soft edge.
    assert np.var(filtered) == pytest.approx(cutoff * 2.0 * interval, rel=0.1)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 500.0, 1e4])
def test_a_cut_off_out_of_range(cutoff):
    with pytest.raises(SceneError, match="below 500 Hz"):
        zero_phase(np.zeros(100), 1e-3, cutoff)


def test_a_filter_needs_samples():
    with pytest.raises(SceneError, match="more than 15 samples"):
        zero_phase(np.zeros(15), 1e-3, 10.0)
