"""Orders and extrapolations of sequences whose order and limit are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem_needle.convergence.richardson import correction_factor, grid_convergence_index, order_from_differences, order_from_errors

LIMIT, CONSTANT = 1.7, 0.3
RATIOS = [(2.0, 2.0), (1.5, 2.0), (2.0, 1.3), (1.1, 3.0), (4.0, 1.05)]


def sequence(order, ratios, signs=(1.0, 1.0, 1.0)):
    """f + C h^p on three grids, coarse to fine, the finest with h = 1."""
    sizes = np.array([ratios[0] * ratios[1], ratios[1], 1.0])
    return LIMIT + CONSTANT * np.array(signs) * sizes**order


@pytest.mark.parametrize("ratios", RATIOS)
@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 4.0, 6.0])
def test_the_order_of_a_known_sequence(order, ratios):
    coarse, middle, fine = sequence(order, ratios)
    found = order_from_differences(middle - coarse, fine - middle, *ratios)
    assert found == pytest.approx(order, rel=1e-9)
    assert fine + correction_factor(found, ratios[1]) * (fine - middle) == pytest.approx(LIMIT, rel=1e-12)


@pytest.mark.parametrize("ratios", RATIOS)
def test_the_order_of_an_error_that_changes_its_sign(ratios):
    coarse, middle, fine = sequence(3.0, ratios, (1.0, -1.0, 1.0))
    found = order_from_differences(middle - coarse, fine - middle, *ratios)
    assert found == pytest.approx(3.0, rel=1e-9)
    value = fine + correction_factor(found, ratios[1], oscillates=True) * (fine - middle)
    assert value == pytest.approx(LIMIT, rel=1e-12)


@given(order=st.floats(-3.0, 8.0), coarse=st.floats(1.05, 5.0), fine=st.floats(1.05, 5.0), sign=st.sampled_from([1.0, -1.0]))
def test_the_order_solves_the_equation_of_celik_for_any_quotient(order, coarse, fine, sign):
    """Built from the quotient itself, divergence included; below 1e-3 the quotient of small differences loses its digits."""
    if sign > 0.0 and abs(order) < 1e-3:
        return
    quotient = fine**order * (coarse**order - sign) / (fine**order - sign)
    found = order_from_differences(sign * quotient, 1.0, coarse, fine)
    assert found == pytest.approx(order, rel=1e-6, abs=1e-6)


def test_a_constant_difference_has_order_zero_at_equal_ratios():
    assert order_from_differences(1.0, 1.0, 2.0, 2.0) == pytest.approx(0.0, abs=1e-9)


def test_differences_that_grow_have_a_negative_order():
    assert order_from_differences(1.0, 4.0, 2.0, 2.0) == pytest.approx(-2.0)


@pytest.mark.parametrize("differences", [(0.0, 1.0), (1.0, 0.0), (1e300, 1e-300)])
def test_no_order_where_there_is_none(differences):
    assert order_from_differences(*differences, 2.0, 2.0) is None


def test_the_order_of_two_errors():
    assert order_from_errors(0.3 * 3.0**2.5, 0.3, 3.0) == pytest.approx(2.5)
    assert order_from_errors(1.0, 0.0, 2.0) is None


def test_richardson_is_exact_for_a_polynomial():
    """f(h) = 5 - 3 h^2: two grids and the order give f(0)."""
    coarse, fine = 5.0 - 3.0 * 0.5**2, 5.0 - 3.0 * 0.2**2
    assert fine + correction_factor(2.0, 2.5) * (fine - coarse) == pytest.approx(5.0, rel=1e-14)


def test_the_grid_convergence_index_bounds_the_error_by_its_safety_factor():
    """The error is e / (r^p - 1) exactly, the index 1.25 times as large; it promises nothing without an order."""
    _, middle, fine = sequence(2.0, (2.0, 2.0))
    index = grid_convergence_index(abs(fine - middle) / abs(fine), 2.0, 2.0)
    assert index == pytest.approx(1.25 * CONSTANT / fine, rel=1e-12)
    assert grid_convergence_index(0.1, -1.0, 2.0) == np.inf
