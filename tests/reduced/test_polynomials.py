"""Modes, corrections and columns as polynomials on pieces: the same functions, to rounding."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, banded
from fem_needle.piecewise import FITTED_DEGREE, fitted_polynomials
from fem_needle.scene import Guide, LateralLoad
from reduced_model import AssumedModeNeedle, mode_basis, natural_mode_basis, project
from reduced_model.shapes import joined
from tests.consistency.scenes import LAYERS, PUSH, characteristic_modulus, held, moving, scene_of
from tests.references import piecewise

ENTRY = scene_of("entry", moving(0.02, 0.05, 0.18), LAYERS)
HUB = scene_of(
    "hub",
    moving(0.02, 0.05, 0.1),
    LAYERS,
    [*PUSH, LateralLoad(position=-0.0312, force=0.3)],
    support={"guides": [Guide(position=-0.03)], "hub_deflection": 2e-3, "hub_angle": 0.01},
)
BARE = scene_of("hub", held(0.1), LAYERS)
MANY = [1, 2, 3, 4, 5, 6, 7, 8, 30]


def shapes_of(scene, modes, basis="full-length", corrected=False):
    return AssumedModeNeedle(scene, modes=modes, basis=basis, static_corrections=corrected).shapes


def mass_of(shapes):
    return banded.to_dense(shapes.interval_integrals("mass").band)


@pytest.mark.parametrize("modes", MANY)
@pytest.mark.parametrize(
    ("scene", "basis"),
    [(ENTRY, "full-length"), (ENTRY, "inserted-length"), (BARE, "full-length")],
    ids=["full", "inserted", "hub"],
)
def test_modes_are_their_polynomials(scene, basis, modes):
    shapes = shapes_of(scene, modes, basis)
    found = shapes.polynomials()
    assert found is shapes.polynomials()
    assert found.coefficients.shape == (len(found.nodes) - 1, modes + 2, FITTED_DEGREE + 1)
    assert found.stride == 0
    assert max(np.max(piecewise.misses(found, shapes, order)) for order in (0, 1)) < 5e-14
    assert np.max(piecewise.misses(found, shapes, 2)) < 2e-13
    assert np.max(piecewise.mass_misses(found, mass_of(shapes))) < 1e-14
    panels = len(shapes.breaks) - 1
    assert len(found.nodes) - 1 <= panels + 0.84 * np.pi * modes  # a piece for 1.2 radians of the last mode


def test_the_clamp_moves_exactly():
    shapes = shapes_of(BARE, 3)
    found = shapes.polynomials()
    starts, sizes = found.nodes[:-1], np.diff(found.nodes)
    assert np.array_equal(found.coefficients[:, 0, 0], np.ones(len(sizes)))
    assert np.array_equal(found.coefficients[:, 1, :2], np.column_stack([starts, sizes]))
    assert not found.coefficients[:, 0, 1:].any()
    assert not found.coefficients[:, 1, 2:].any()


def test_two_hundred_modes():
    shapes = shapes_of(BARE, 200)
    found = shapes.polynomials()
    assert len(found.nodes) - 1 <= 600
    for order, error in ((0, 5e-13), (1, 5e-13), (2, 1e-12)):  # the modes' own rounding
        assert np.max(piecewise.misses(found, shapes, order, 40)) < error


# A correction is what the modes miss of a response, scaled up: so is the rounding of both, in the shapes as in the polynomials.
ROUNDING = {"soft": 1e-9, "stiff": 1e-11, "inserted": 1e-7, "hub": 1e-7}
CORRECTED = {
    "soft": (ENTRY, "full-length"),
    "stiff": (ENTRY.with_values({"tissue.layers": [{"foundation_modulus": characteristic_modulus(12.0)}]}), "full-length"),
    "inserted": (ENTRY, "inserted-length"),
    "hub": (HUB, "full-length"),
}


@pytest.mark.parametrize("modes", [2, 5, 8, 30])
@pytest.mark.parametrize("name", CORRECTED)
def test_corrections_are_their_polynomials(name, modes):
    scene, basis = CORRECTED[name]
    shapes = shapes_of(scene, modes, basis, corrected=True)
    assert shapes.size > modes + 2
    found = shapes.polynomials()
    for order in range(3):
        misses = piecewise.misses(found, shapes, order, 100)
        assert np.max(misses[: modes + 2]) < 2e-13
        assert np.max(misses[modes + 2 :]) < ROUNDING[name]
    assert np.max(piecewise.mass_misses(found, mass_of(shapes))) < ROUNDING[name]


@pytest.mark.parametrize("name", ["inserted", "hub"])
def test_responses_of_finite_elements_are_not_divided(name):
    scene, basis = CORRECTED[name]
    corrections = shapes_of(scene, 2, basis, corrected=True).sets[2]
    assert len(corrections.responses) >= 4
    for response in corrections.responses:
        shapes = joined(corrections.span, [response])
        found = fitted_polynomials(shapes.values, shapes.breaks)
        assert np.array_equal(found.nodes, shapes.breaks)
        for order, error in ((0, 1e-14), (1, 1e-13), (2, 1e-11)):  # second derivatives of 64 elements lose 64^2 of their digits
            assert np.max(piecewise.misses(found, shapes, order, 100)) < error


@pytest.mark.parametrize("kind", ["hub", "entry"])
@pytest.mark.parametrize("elements", [5, 40])
def test_projected_columns_are_polynomials_on_the_elements(kind, elements):
    needle = FiniteElementNeedle(scene_of(kind, held(0.1), LAYERS), elements=elements)
    projected = project(needle, natural_mode_basis(needle, 4, 0.1))
    found = projected.polynomials()
    assert found is projected.polynomials()
    assert found.coefficients.shape == (elements, 6, 5)
    assert (found.stride, found.nodes is needle.mesh.nodes) == (0, True)
    columns = np.array([projected.reconstruct(unit, 0.1) for unit in np.eye(6)])
    places = found.nodes[-1] * np.random.default_rng(6).uniform(size=200)
    for order in range(3):
        expected = needle.mesh.evaluate(columns, places, order)
        largest = np.maximum(np.max(np.abs(expected), axis=1), np.max(np.abs(columns), axis=1))
        assert np.all(np.abs(piecewise.rows(found, 6, places, order) - expected) < 1e-11 * largest[:, None])
    full = banded.to_dense(needle.mesh.interval_integrals("mass").band)
    assert np.max(piecewise.mass_misses(found, columns @ full @ columns.T)) < 1e-13


def test_moving_columns_are_none():
    needle = FiniteElementNeedle(ENTRY, elements=8)
    assert project(needle, mode_basis(needle, 2)).polynomials() is None
    assert project(needle, mode_basis(needle, 2, "inserted-length")).polynomials() is not None
