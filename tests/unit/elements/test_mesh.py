import numpy as np
import pytest

from fem_needle.elements.mesh import LineMesh

UNEVEN = np.array([0.0, 0.1, 0.35, 0.4, 1.0])


def interpolated(mesh, polynomial):
    """Coordinates of a polynomial: value and slope at the nodes, the bubble's amplitude from the fourth derivative."""
    coordinates = np.zeros(mesh.size)
    stride = mesh.reference.stride
    coordinates[::stride][: mesh.elements + 1] = polynomial(mesh.nodes)
    coordinates[1::stride][: mesh.elements + 1] = polynomial.deriv()(mesh.nodes)
    if mesh.degree == 4:  # 16 x^2 (1 - x)^2 has the leading coefficient 16
        coordinates[2::3] = polynomial.coef[4] * mesh.lengths**4 / 16.0 if len(polynomial.coef) > 4 else 0.0
    return coordinates


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_a_polynomial_of_the_degree_is_represented_exactly(degree, derivative):
    mesh = LineMesh(UNEVEN, degree)
    polynomial = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7, -1.5][: degree + 1])
    coordinates, places = interpolated(mesh, polynomial), np.linspace(0.0, 1.0, 37)
    expected = polynomial.deriv(derivative)(places) if derivative else polynomial(places)
    assert mesh.evaluate(coordinates, places, derivative) == pytest.approx(expected, abs=1e-10)
    rows = np.array([mesh.row(place, derivative) for place in places])
    assert rows @ coordinates == pytest.approx(expected, abs=1e-10)


def test_several_functions_at_once():
    mesh = LineMesh(np.linspace(0.0, 1.0, 4), 4)
    coordinates = np.random.default_rng(1).normal(size=(2, mesh.size))
    together = mesh.evaluate(coordinates, np.array([0.2, 0.9]))
    assert together == pytest.approx(np.array([mesh.evaluate(row, np.array([0.2, 0.9])) for row in coordinates]))


@pytest.mark.parametrize(
    ("position", "expected"),
    [(0.0, (0, 0.0)), (0.1, (1, 0.0)), (0.225, (1, 0.5)), (1.0, (3, 1.0)), (1.5, (3, 1.0)), (-0.2, (0, 0.0))],
)
def test_locate(position, expected):
    element, place = LineMesh(UNEVEN).locate(position)
    assert (element, place) == (expected[0], pytest.approx(expected[1]))


def test_sizes():
    assert [LineMesh(np.linspace(0.0, 2.0, 6), 3).size, LineMesh(np.linspace(0.0, 2.0, 6), 4).size] == [12, 17]
    assert [LineMesh(np.linspace(0.0, 2.0, 6), 3).half_bandwidth, LineMesh(np.linspace(0.0, 2.0, 6), 4).half_bandwidth] == [3, 4]
    assert LineMesh(np.linspace(0.0, 2.0, 6), 4).nodes[-1] == 2.0
