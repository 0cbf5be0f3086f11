import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fem_needle import FiniteElementNeedle, banded
from fem_needle.elements.shapes import ElementShapes
from fem_needle.piecewise import FITTED_DEGREE, FITTED_ERROR, fitted_polynomials
from tests.consistency.scenes import held, scene_of
from tests.references import piecewise

UNEVEN = np.array([0.0, 0.01, 0.035, 0.04, 0.1, 0.2])


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize("nodes", [UNEVEN, np.linspace(0.0, 1.0, 41)])
def test_elements_are_their_polynomials(nodes, degree):
    shapes = ElementShapes(nodes, degree)
    found = shapes.polynomials()
    assert found.coefficients.shape == (len(nodes) - 1, degree + 1, degree + 1)
    assert found.stride == degree - 1
    for derivative in range(3):
        assert np.max(piecewise.misses(found, shapes, derivative)) < 1e-13
    # The integral of the bubble's square, power by power, cancels: sixteen times sixteen to 0.4.
    assert np.max(piecewise.mass_misses(found, banded.to_dense(shapes.interval_integrals("mass").band))) < 1e-12


@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_a_needle_has_the_polynomials_of_its_mesh(kind):
    needle = FiniteElementNeedle(scene_of(kind, held(0.1)), elements=7)
    found = needle.shapes.polynomials()
    assert found is needle.mesh.polynomials()
    assert found.nodes[-1] == (1.0 if kind == "entry" else needle.scene.needle.length)


def functions_of(*polynomials):
    def values(places, derivative):
        return np.array([polynomial.deriv(derivative)(places) for polynomial in polynomials])

    return values


def test_polynomials_are_fitted_on_one_piece():
    highest = Polynomial.fromroots(np.linspace(0.05, 0.95, FITTED_DEGREE)) * 1e6
    functions = functions_of(Polynomial([1.0]), Polynomial([0.0, 1.0]), highest)
    found = fitted_polynomials(functions, np.array([0.0, 1.0]))
    assert found.nodes.tolist() == [0.0, 1.0]
    assert found.stride == 0
    coefficients = found.coefficients[0]
    assert coefficients[:2].tolist() == np.eye(2, FITTED_DEGREE + 1).tolist()
    assert coefficients[2] == pytest.approx(highest.coef, rel=1e-9)


def waves(number):
    """Sines and cosines with a phase, and what grows and falls as fast."""

    def values(places, derivative):
        phase, scale = number * places + 0.3, float(number) ** derivative
        grown, fallen = np.exp(number * (places - 1)), (-1.0) ** derivative * np.exp(-number * places)
        return scale * np.array([np.sin(phase + derivative * np.pi / 2), grown, fallen])

    return values


@pytest.mark.parametrize("breaks", [np.array([0.0, 1.0]), np.array([0.0, 0.03, 0.4, 1.0])])
@pytest.mark.parametrize("number", [0.1, 1.0, 3.0, 6.0])
def test_as_many_pieces_as_waves_need(number, breaks):
    found = fitted_polynomials(waves(number), breaks)
    pieces = len(found.nodes) - 1
    assert set(breaks) <= set(found.nodes)
    assert pieces <= len(breaks) - 1 + number / 1.1  # degree 12 holds 1.2 radians
    places = np.random.default_rng(4).uniform(size=400)
    for derivative in range(3):
        expected = waves(number)(places, derivative)
        missing = np.max(np.abs(piecewise.rows(found, 3, places, derivative) - expected), axis=1)
        assert np.all(missing < 1.5 * FITTED_ERROR * np.max(np.abs(expected), axis=1))


@pytest.mark.parametrize("number", [3.0, 6.0])
def test_one_piece_less_would_not_do(number):
    found = fitted_polynomials(waves(number), np.array([0.0, 1.0]))
    fewer = np.linspace(0.0, 1.0, len(found.nodes) - 1)
    assert len(fitted_polynomials(waves(number), fewer).nodes) > len(found.nodes)


def test_functions_that_round_do_not_hide_those_that_turn():
    def values(places, derivative):
        return np.vstack([waves(6.0)(places, derivative), 1e-9 * np.random.default_rng(7).uniform(size=(1, len(places))) + 1.0])

    breaks = np.array([0.0, 0.4, 1.0])
    alone, together = (fitted_polynomials(functions, breaks) for functions in (waves(6.0), values))
    assert np.array_equal(together.nodes, alone.nodes)
    assert np.array_equal(together.coefficients[:, :3], alone.coefficients)


def test_a_jump_of_the_second_derivative_at_a_break():
    def values(places, derivative):
        beyond = np.maximum(places - 0.3, 0.0)
        return np.array([[beyond**2, 2 * beyond, 2.0 * (places > 0.3)][derivative]])

    found = fitted_polynomials(values, np.array([0.0, 0.3, 1.0]))
    assert found.nodes.tolist() == [0.0, 0.3, 1.0]
    assert np.max(np.abs(found.coefficients[0])) == 0.0
    assert found.coefficients[1, 0, :3] == pytest.approx([0.0, 0.0, 0.49], rel=1e-14)
    assert np.max(np.abs(found.coefficients[1, 0, 3:])) < 1e-8  # what rounding leaves cancels between the powers


def test_rounding_is_no_reason_for_more_pieces():
    """Noise of 1e-9 does not fall with the size of the pieces."""
    random = np.random.default_rng(5)

    def values(places, derivative):
        return waves(1.0)(places, derivative) + 1e-9 * random.uniform(-1.0, 1.0, (3, len(places)))

    assert len(fitted_polynomials(values, np.linspace(0.0, 1.0, 33)).nodes) == 33
