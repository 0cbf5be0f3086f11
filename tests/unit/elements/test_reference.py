import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fem_needle.elements.assembly import assembled, write
from fem_needle.elements.reference import BUBBLE_ENERGY, KEPT, reference_element


def polynomials(degree):
    """The shapes by their defining conditions: value and slope at the ends, and a bubble that has none of them."""
    conditions = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 1, 1], [0, 1, 2, 3]], dtype=float)
    cubic = [Polynomial(column) for column in np.linalg.inv(conditions).T]
    bubble = [16 * Polynomial([0, 1]) ** 2 * Polynomial([1, -1]) ** 2] if degree == 4 else []
    return [*cubic[:2], *bubble, *cubic[2:]]


def integral(one, other, power=0):
    whole = (one * other * Polynomial([0, 1]) ** power).integ()
    return whole(1.0) - whole(0.0)


@pytest.mark.parametrize("degree", [3, 4])
def test_what_is_kept_is_what_scikit_fem_assembles(degree):
    for name, matrix in assembled(degree).items():
        assert np.max(np.abs(getattr(reference_element(degree), name) - matrix)) <= 1e-15 * np.max(np.abs(matrix))


def test_the_file_is_written_as_it_is_kept(tmp_path):
    write(tmp_path / "reference.json")
    assert len((tmp_path / "reference.json").read_text().splitlines()) == len(KEPT.read_text().splitlines())


@pytest.mark.parametrize("degree", [3, 4])
def test_matrices_against_polynomial_integrals(degree):
    element, shapes = reference_element(degree), polynomials(degree)
    for i, first in enumerate(shapes):
        for j, second in enumerate(shapes):
            assert element.bending[i, j] == pytest.approx(integral(first.deriv(2), second.deriv(2)), rel=1e-12, abs=1e-12)
            assert element.mass[i, j] == pytest.approx(integral(first, second), rel=1e-12, abs=1e-15)
            for p in (0, 1):
                assert element.drag[p, i, j] == pytest.approx(integral(first, second.deriv(), p), rel=1e-12, abs=1e-14)
            for p in (0, 1, 2):
                assert element.slip[p, i, j] == pytest.approx(integral(first.deriv(), second.deriv(), p), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_shapes_and_derivatives(degree, derivative):
    places = np.linspace(0.0, 1.0, 9)
    expected = [shape.deriv(derivative)(places) if derivative else shape(places) for shape in polynomials(degree)]
    assert reference_element(degree).unit_shapes(places, derivative) == pytest.approx(np.array(expected), abs=1e-12)


def test_energy_of_the_bubble():
    bubble = polynomials(4)[2].deriv(2)
    assert pytest.approx(integral(bubble, bubble), rel=1e-14) == BUBBLE_ENERGY


def test_counts():
    assert [reference_element(3).stride, reference_element(3).count] == [2, 4]
    assert [reference_element(4).stride, reference_element(4).count] == [3, 5]


@pytest.mark.parametrize("degree", [3, 4])
def test_slopes_scale_with_the_length(degree):
    scale = reference_element(degree).slope_scale(0.25)
    assert scale[[0, -2]].tolist() == [1.0, 1.0]
    assert scale[[1, -1]].tolist() == [0.25, 0.25]
