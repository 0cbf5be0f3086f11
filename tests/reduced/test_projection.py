import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, banded, simulate, solve_static
from fem_needle.scene import LateralLoad, Layer, Model, TipLoad
from reduced_model import AssumedModeNeedle, FixedBasis, mode_basis, natural_mode_basis, project, snapshot_basis
from tests.consistency.scenes import held, moving, scene_of

LAYERS = (
    Layer(start=0.0, end=0.0437, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, foundation_modulus=2e4, damping=1.0),
)
NAMES = ("mass", "bending", "tissue", "convection", "centrifugal", "damping", "drag", "slip")


def closed_forms(kind, kinematics, basis):
    scene = scene_of(kind, held(0.1), LAYERS, model=Model(kinematics=kinematics))
    return scene, AssumedModeNeedle(scene, modes=3, basis=basis)


@pytest.mark.parametrize(
    ("kind", "kinematics", "basis"),
    [
        ("entry", "material", "full-length"),
        ("entry", "fixed-frame", "full-length"),
        ("entry", "material", "inserted-length"),
        ("entry", "fixed-frame", "inserted-length"),
        ("hub", "material", "full-length"),
    ],
)
@pytest.mark.parametrize("depth", [0.0631, 0.1, 0.1777])
def test_projection_agrees_with_the_closed_forms(kind, kinematics, basis, depth):
    scene, expected = closed_forms(kind, kinematics, basis)
    fem = FiniteElementNeedle(scene, elements=96)
    found = project(fem, mode_basis(fem, 3, basis))
    left, right = expected.operators(depth, 0.0), found.operators(depth, 0.0)
    for name in NAMES:
        wanted, got = getattr(left, name), getattr(right, name)
        scale = operator_scale(left, name)
        wanted = np.zeros((5, 5)) if wanted is None else banded.to_dense(wanted)
        got = np.zeros((5, 5)) if got is None else banded.to_dense(got)
        free = slice(2, None)  # the clamp's own coordinate counts an angle, or one by depth fraction
        assert np.max(np.abs((got - wanted)[free, free])) < 1e-8 * scale, name
    points, others = expected.points(depth), found.points(depth)
    assert others.rows[:, 2:] == pytest.approx(points.rows[:, 2:], abs=1e-9 * np.max(np.abs(points.rows[:, 2:])))
    slopes = np.max(np.abs(points.row_rates[:, 2:]), initial=0.0)
    assert others.row_rates[:, 2:] == pytest.approx(points.row_rates[:, 2:], abs=1e-8 * max(slopes, 10.0))


def operator_scale(operators, name):
    """The largest entry of the matrix, or of what it would be made of where it vanishes."""
    matrix = getattr(operators, name)
    if matrix is not None and np.max(np.abs(matrix)) > 0.0:
        return np.max(np.abs(banded.to_dense(matrix)[2:, 2:]))
    base = operators.damping if name in {"drag", "slip"} else operators.mass
    waves = {"drag": 1, "slip": 2, "convection": 1, "centrifugal": 2}[name]
    return np.max(np.abs(banded.to_dense(base)[2:, 2:])) * 40.0**waves


def test_statics_and_a_run_agree_with_the_closed_forms():
    scene = scene_of("entry", moving(2.0, 0.03, 0.06), LAYERS, duration=None)
    fem = FiniteElementNeedle(scene, elements=64)
    projected, expected = project(fem, mode_basis(fem, 2)), AssumedModeNeedle(scene, modes=2)
    rest, wanted = (solve_static(plant, depth=0.05) for plant in (projected, expected))
    assert rest.tip_deflection == pytest.approx(wanted.tip_deflection, rel=1e-9)
    settings = {"time_step": 2e-4, "analysis": "dynamic", "output_step": 3e-3}
    run, reference = simulate(projected, **settings), simulate(expected, **settings)
    assert run.tip_deflection == pytest.approx(reference.tip_deflection, rel=1e-7, abs=1e-9 * reference.tip_deflection.max())
    assert run.summary["relative_energy_residual"] == pytest.approx(reference.summary["relative_energy_residual"], rel=1e-2)


def test_reconstruction_gives_coordinates_of_the_elements():
    scene = scene_of("entry", held(0.1), LAYERS)
    fem = FiniteElementNeedle(scene, elements=48)
    projected = project(fem, mode_basis(fem, 4))
    rest = solve_static(projected, depth=0.1)
    coordinates = projected.reconstruct(rest.coordinates, 0.1)
    assert coordinates.shape == (fem.size,)
    stations = np.linspace(0.0, 0.2, 11)
    expected = fem.deflection(coordinates, rest.point_forces, 0.1, stations)
    assert rest.deflection(stations) == pytest.approx(expected, abs=1e-15)
    assert fem.points(0.1).rows[-1] @ coordinates == pytest.approx(rest.tip_deflection, rel=1e-12)


def test_all_coordinates_as_a_basis_give_the_elements_back():
    scene = scene_of("hub", held(0.1), LAYERS)
    fem = FiniteElementNeedle(scene, elements=6)
    columns = np.eye(fem.size)[:, fem.prescribed :]
    whole = solve_static(project(fem, FixedBasis(columns)), depth=0.1)
    assert whole.tip_deflection == pytest.approx(solve_static(fem, depth=0.1).tip_deflection, rel=1e-9)


def test_natural_modes_keep_the_frequencies_and_converge():
    from fem_needle.free_response import natural_frequencies

    scene = scene_of("hub", held(0.1), LAYERS, [TipLoad(force=0.1), LateralLoad(position=-0.02, force=0.2)])
    fem = FiniteElementNeedle(scene, elements=30)
    true = solve_static(fem, depth=0.1).tip_deflection
    errors = []
    for count in (3, 6, 12):
        reduced = project(fem, natural_mode_basis(fem, count, 0.1))
        wanted = natural_frequencies(fem, 0.1)[:count]
        assert natural_frequencies(reduced, 0.1) == pytest.approx(wanted, rel=1e-8)
        errors.append(abs(solve_static(reduced, depth=0.1).tip_deflection / true - 1.0))
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]


def test_snapshots_catch_the_run_that_they_are_taken_from():
    scene = scene_of("hub", moving(0.01, 0.05, 0.15), LAYERS, duration=None, numerics={"analysis": "static"})
    fem = FiniteElementNeedle(scene, elements=24)
    run = simulate(fem)
    error = []
    for count in (2, 4, 7):
        reduced = project(fem, snapshot_basis(fem, run, count, 0.1))
        tips = [[solve_static(plant, depth=z).tip_deflection for z in (0.06, 0.09, 0.12, 0.145)] for plant in (reduced, fem)]
        error.append(np.max(np.abs(np.array(tips[0]) / tips[1] - 1.0)))
    assert error[0] > 5.0 * error[1] > 25.0 * error[2]
    with pytest.raises(SceneError, match="fewer independent shapes"):
        snapshot_basis(fem, run, fem.size - 2, 0.1)
    with pytest.raises(SceneError, match="coordinates"):
        snapshot_basis(FiniteElementNeedle(scene, elements=5), run, 2, 0.1)
