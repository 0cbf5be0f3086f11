"""The kink against the clamped-clamped beam under a point force, solved from its boundary and jump conditions."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fem_needle.elements.kink import kink, kink_compliance, kink_shift_rate
from fem_needle.elements.reference import reference_element

PLACES = (0.1, 0.37, 0.5, 0.82)


def clamped_beam(a):
    """Coefficients of the two cubics: clamped ends, w, w', w'' continuous at a, w''' jumps by -1... as EI w'''' = force."""
    unknown = np.zeros((8, 8))
    right = np.zeros(8)

    def row(x, derivative):
        return [Polynomial.basis(n).deriv(derivative)(x) if derivative else x**n for n in range(4)]

    unknown[0, :4], unknown[1, :4] = row(0.0, 0), row(0.0, 1)
    unknown[2, 4:], unknown[3, 4:] = row(1.0, 0), row(1.0, 1)
    for derivative in range(4):
        unknown[4 + derivative] = [*(-np.array(row(a, derivative))), *row(a, derivative)]
    right[7] = 1.0
    solution = np.linalg.solve(unknown, right)
    return Polynomial(solution[:4]), Polynomial(solution[4:])


@pytest.mark.parametrize("a", PLACES)
@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_shape_without_the_bubble(a, derivative):
    left, right = clamped_beam(a)
    x = np.array([0.03, 0.2, 0.45, 0.6, 0.95])
    expected = (
        np.where(x <= a, left.deriv(derivative)(x), right.deriv(derivative)(x))
        if derivative
        else np.where(x <= a, left(x), right(x))
    )
    assert kink(x, a, 3, derivative) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("a", PLACES)
def test_what_the_bubble_shares_is_taken_off(a):
    """The rest is orthogonal in energy to every shape of the quartic element."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    element = reference_element(4)
    total = np.zeros(5)
    for low, high in ((0.0, a), (a, 1.0)):
        x = low + (high - low) * (nodes + 1.0) / 2.0
        total += element.unit_shapes(x, 2) @ (kink(x, a, 4, 2) * weights * (high - low) / 2.0)
    assert total == pytest.approx(np.zeros(5), abs=1e-13)


@pytest.mark.parametrize("degree", [3, 4])
def test_compliance_is_the_shape_at_the_other_place(degree):
    for a in PLACES:
        for b in PLACES:
            assert kink_compliance(a, b, degree) == pytest.approx(float(kink(b, a, degree)), abs=1e-16)
            assert kink_compliance(a, b, degree) == kink_compliance(b, a, degree)


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize(("a", "b"), [(0.1, 0.37), (0.82, 0.5), (0.3, 0.3)])
def test_rate_of_a_common_shift(degree, a, b):
    step = 1e-5
    expected = (kink_compliance(a + step, b + step, degree) - kink_compliance(a - step, b - step, degree)) / (2.0 * step)
    assert kink_shift_rate(a, b, degree) == pytest.approx(expected, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize("place", [0.0, 1.0])
def test_nothing_at_a_node(degree, place):
    assert kink_compliance(place, place, degree) == pytest.approx(0.0, abs=1e-18)
    assert kink(np.linspace(0, 1, 5), place, degree) == pytest.approx(np.zeros(5), abs=1e-18)


def test_largest_in_the_middle():
    """1/192 of the clamped-clamped beam, of which the bubble holds 1/204.8."""
    assert kink_compliance(0.5, 0.5, 3) == pytest.approx(1 / 192)
    assert kink_compliance(0.5, 0.5, 4) == pytest.approx(1 / 192 - 1 / 204.8)
