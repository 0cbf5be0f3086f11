from functools import partial

import numpy as np
import pytest

from fem_needle.collocation import collocation, gauss

# Made anew for each test, not taken from the cache.
METHODS = {
    **{f"rho {rho}": partial(collocation.__wrapped__, rho) for rho in (0.0, 0.3, 0.5, 1.0)},
    **{f"gauss {n}": partial(gauss.__wrapped__, n) for n in (1, 2, 3)},
}
ORDERS = {"rho 0.0": 3, "rho 0.3": 3, "rho 0.5": 3, "rho 1.0": 4, "gauss 1": 2, "gauss 2": 4, "gauss 3": 6}


def stability(method, z):
    """R(z) of y' = lambda y, z = lambda h: from the stages 1 + z A, R = 1 + z b (1 - z A)^-1 1."""
    matrix = np.linalg.inv(method.inverse)
    ones = np.ones(len(method.nodes))
    return 1.0 + z * method.weights @ np.linalg.solve(np.eye(len(ones)) - z * matrix, ones)


@pytest.mark.parametrize("name", METHODS)
def test_quadrature_order(name):
    method, order = METHODS[name](), ORDERS[name]
    errors = [abs(method.weights @ method.nodes**p - 1.0 / (p + 1)) for p in range(order + 1)]
    assert max(errors[:order]) < 1e-14
    assert errors[order] > 1e-4


@pytest.mark.parametrize("name", METHODS)
def test_stability_function_has_the_order(name):
    method, order = METHODS[name](), ORDERS[name]
    errors = [abs(stability(method, z) - np.exp(z)) for z in (0.1, 0.05)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=0.12)


@pytest.mark.parametrize("rho", [0.0, 0.25, 0.5, 0.9, 1.0])
def test_spectral_radius_at_infinity_and_a_stability(rho):
    method = collocation.__wrapped__(rho)
    assert abs(stability(method, 1e9)) == pytest.approx(rho, abs=1e-6)
    axis = np.geomspace(1e-3, 1e6, 400)
    assert max(abs(stability(method, 1j * w)) for w in axis) < 1.0 + 1e-12
    assert max(abs(stability(method, -w + 1j * w)) for w in axis) < 1.0


def test_the_ends_of_the_family_are_gauss_and_radau():
    assert collocation(1.0).nodes == pytest.approx(0.5 + np.array([-1, 1]) * np.sqrt(3) / 6, abs=1e-15)
    assert collocation(0.0).nodes == pytest.approx([1 / 3, 1.0], abs=1e-15)
    assert collocation(0.0).nodes[1] == 1.0


@pytest.mark.parametrize("name", METHODS)
def test_the_polynomial_of_a_step(name):
    """Value at the end and slopes at both ends of the polynomial through 0 at the start and given values at the nodes."""
    method = METHODS[name]()
    polynomial = np.polynomial.Polynomial([0.0, 0.7, -1.3, 0.4][: len(method.nodes) + 1])
    values = polynomial(method.nodes)
    assert method.end @ values == pytest.approx(polynomial(1.0))
    assert method.start_slope @ values == pytest.approx(polynomial.deriv()(0.0))
    assert method.end_slope @ values == pytest.approx(polynomial.deriv()(1.0))
    assert method.inverse @ values == pytest.approx(polynomial.deriv()(method.nodes))


@pytest.mark.parametrize("name", METHODS)
def test_the_polynomial_through_start_nodes_and_end(name):
    """Its derivatives at both ends from its values; a node at the end counts once, its own weight is then 0."""
    method = METHODS[name]()
    places = np.concatenate([[0.0], method.nodes, [1.0]])
    degree = len(np.unique(places)) - 1
    polynomial = np.polynomial.Polynomial([0.3, 0.7, -1.3, 0.4, 0.9, -0.2][: degree + 1])
    slopes = method.power_slopes @ polynomial(places)
    assert slopes == pytest.approx([polynomial.deriv()(0.0), polynomial.deriv()(1.0)])
