"""Integrals over parts of elements: exact to 1e-12 wherever the cut lies, and inexact where the points are too few."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fem_needle import banded
from fem_needle.elements import integrals
from fem_needle.elements.integrals import interval_integrals
from fem_needle.elements.mesh import LineMesh

NODES = np.linspace(0.0, 0.2, 5)
CUTS = {
    "at nodes": (0.05, 0.15),
    "in one element": (0.061, 0.083),
    "in two elements": (0.061, 0.117),
    "over whole elements": (0.013, 0.19),
    "just after a node": (0.05 + 1e-12, 0.15 + 1e-12),
    "just before a node": (0.05 - 1e-12, 0.15 - 1e-12),
    "a sliver": (0.05 - 1e-12, 0.05 + 1e-12),
    "from the start": (0.0, 0.117),
    "to the end": (0.117, 0.2),
    "everything": (0.0, 0.2),
    "nothing": (0.07, 0.07),
}


def shapes(mesh, element):
    """Shapes of one element as polynomials of the place in it."""
    places = np.linspace(0.0, 1.0, mesh.degree + 1)
    values = mesh.shapes_in(element, places)
    vandermonde = np.linalg.inv(np.vander(places, increasing=True))
    return [Polynomial(vandermonde @ row) for row in values]


def expected(mesh, kind, power, start, end):
    """Exact integral by antiderivatives of polynomials."""
    result = np.zeros((mesh.size, mesh.size))
    for element in range(mesh.elements):
        node, length = mesh.nodes[element], mesh.lengths[element]
        low, high = np.clip((np.array([start, end]) - node) / length, 0.0, 1.0)
        position = Polynomial([node, length])
        for i, one in enumerate(shapes(mesh, element)):
            for j, other in enumerate(shapes(mesh, element)):
                product = {
                    "mass": one * other,
                    "drag": position**power * one * other.deriv() / length,
                    "slip": position ** (2 * power) * one.deriv() * other.deriv() / length**2,
                    "bending": one.deriv(2) * other.deriv(2) / length**4,
                }[kind]
                whole = product.integ()
                first = mesh.reference.stride * element
                result[first + i, first + j] += length * (whole(high) - whole(low))
    return result


def found(mesh, kind, power, start, end):
    band = banded.zeros(mesh.size, mesh.half_bandwidth)
    interval_integrals(mesh, kind, power).add(start, end, 1.0, band)
    return banded.to_dense(band)


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize(("kind", "power"), [("mass", 0), ("drag", 0), ("drag", 1), ("slip", 0), ("slip", 1), ("bending", 0)])
@pytest.mark.parametrize("cut", CUTS)
def test_integral_over_an_interval(cut, kind, power, degree):
    mesh = LineMesh(NODES, degree)
    start, end = CUTS[cut]
    whole = np.max(np.abs(expected(mesh, kind, power, 0.0, 0.2)))
    assert found(mesh, kind, power, start, end) == pytest.approx(expected(mesh, kind, power, start, end), abs=1e-12 * whole)


def test_a_sliver_is_as_large_as_it_is():
    """2e-12 wide: relative to itself, not to the whole element."""
    mesh = LineMesh(NODES, 4)
    row = mesh.row(0.05)
    sliver = found(mesh, "mass", 0, 0.05 - 1e-12, 0.05 + 1e-12)
    assert sliver == pytest.approx(2e-12 * np.outer(row, row), abs=1e-16)
    assert np.max(sliver) == pytest.approx(2e-12, rel=1e-4)


def test_parts_add_up():
    mesh = LineMesh(np.linspace(0.0, 1.0, 8), 4)
    parts = sum(found(mesh, "slip", 1, *ends) for ends in [(0.0, 0.123), (0.123, 0.5), (0.5, 0.501), (0.501, 1.0)])
    assert parts == pytest.approx(found(mesh, "slip", 1, 0.0, 1.0), abs=1e-12 * np.max(np.abs(parts)))


@pytest.mark.parametrize(
    ("degree", "kind", "power", "exact"), [(4, "slip", 1, 5), (4, "mass", 0, 5), (3, "mass", 0, 4), (3, "bending", 0, 2)]
)
def test_too_few_points_are_inexact(monkeypatch, degree, kind, power, exact):
    """A product of degree d needs (d + 1) / 2 points: one fewer and the test above fails."""
    mesh = LineMesh(NODES, degree)
    start, end = CUTS["in one element"]
    reference = expected(mesh, kind, power, start, end)

    def error(points):
        place, weight = np.polynomial.legendre.leggauss(points)
        monkeypatch.setattr(integrals, "gauss_rule", lambda _: ((place + 1.0) / 2.0, weight / 2.0))
        return np.max(np.abs(found(mesh, kind, power, start, end) - reference)) / np.max(np.abs(reference))

    assert error(exact) < 1e-12
    assert error(exact - 1) > 1e-10
