"""What integrators, statics and ledger take for granted of any plant."""

import numpy as np
import pytest

from fem_needle import banded, solve_static
from fem_needle.statics import depth_derivative
from tests.contract.plants import CASES

DEPTHS = (0.0821, 0.1, 0.1177)  # the second lies at a node of none, the surface of the third in another element
TIME = 0.11
STEP = 1e-6


@pytest.fixture(params=CASES, name="case")
def _case(request):
    return CASES[request.param]


def dense(band, plant):
    return np.zeros((plant.size, plant.size)) if band is None else banded.to_dense(band)


def matrices(plant, depth, time=TIME):
    found = plant.operators(depth, time)
    names = ("mass", "bending", "tissue", "convection", "centrifugal", "damping", "drag", "slip", "tissue_rate")
    return {name: dense(getattr(found, name), plant) for name in names}


def random_vectors(plant, count=2):
    """Vectors of the size of shapes: nodes move some millimetres."""
    return np.random.default_rng(5).normal(0.0, 1e-3, (count, plant.size))


def central(function, depth, step=STEP):
    return (function(depth + step) - function(depth - step)) / (2.0 * step)


@pytest.mark.parametrize("depth", DEPTHS)
def test_symmetry_and_definiteness(case, depth):
    plant = case.plant
    found = matrices(plant, depth)
    for name in ("mass", "bending", "tissue", "centrifugal", "damping", "slip", "tissue_rate"):
        assert found[name] == pytest.approx(found[name].T, abs=1e-13 * np.max(np.abs(found[name])) + 1e-300)
    free = slice(plant.prescribed, None)
    stiffness = found["bending"] + found["tissue"]
    assert np.min(np.linalg.eigvalsh(found["mass"][free, free])) > 0.0
    assert np.min(np.linalg.eigvalsh(stiffness[free, free])) > 0.0
    for name in ("tissue", "damping", "slip", "centrifugal"):
        eigenvalues = np.linalg.eigvalsh(found[name])
        assert np.min(eigenvalues) >= -1e-12 * np.max(eigenvalues)


def test_power_lost_in_the_tissue_is_never_negative(case):
    """q'.C q' + 2 v q'.D q + v^2 q.E q is an integral of a square."""
    plant = case.plant
    found = matrices(plant, 0.1)
    joint = np.block([[found["damping"], found["drag"]], [found["drag"].T, found["slip"]]])
    eigenvalues = np.linalg.eigvalsh(joint)
    assert np.min(eigenvalues) >= -1e-12 * np.max(eigenvalues)
    assert np.max(eigenvalues) > 0.0


def test_kinetic_energy_is_never_negative(case):
    plant = case.plant
    found = matrices(plant, 0.1)
    joint = np.block([[found["mass"], found["convection"]], [found["convection"].T, found["centrifugal"]]])
    eigenvalues = np.linalg.eigvalsh(joint)
    assert np.min(eigenvalues) >= -1e-12 * np.max(eigenvalues)


def test_swelling_rate(case):
    plant = case.plant
    slope = central(lambda time: matrices(plant, 0.1, time)["tissue"], TIME)
    assert matrices(plant, 0.1)["tissue_rate"] == pytest.approx(slope, rel=1e-6, abs=1e-6 * np.max(np.abs(slope)))
    assert np.max(np.abs(slope)) > 0.0


@pytest.mark.parametrize("depth", DEPTHS)
def test_stiffness_rate(case, depth):
    plant = case.plant
    vector = random_vectors(plant)[0]

    def product(at):
        found = matrices(plant, at)
        return (found["bending"] + found["tissue"]) @ vector

    expected = central(product, depth)
    found = plant.stiffness_rate_product(vector, depth, TIME)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-7 * max(np.max(np.abs(expected)), 1e-12))
    assert np.max(np.abs(expected)) > 0.0


@pytest.mark.parametrize("depth", DEPTHS)
def test_kinetic_rate(case, depth):
    plant = case.plant
    velocities, coordinates = random_vectors(plant)
    speed = 2.0

    def energy(at):
        found = matrices(plant, at)
        moving = 0.5 * velocities @ found["mass"] @ velocities + speed * velocities @ found["convection"] @ coordinates
        return moving + 0.5 * speed**2 * coordinates @ found["centrifugal"] @ coordinates

    expected = central(energy, depth)
    found = plant.kinetic_rate(velocities, coordinates, depth, speed)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-8 * energy(depth))


@pytest.mark.parametrize("depth", DEPTHS)
def test_point_rates(case, depth):
    plant = case.plant
    points = plant.points(depth)
    rows, flexibility = (
        central(lambda at, name=name: getattr(plant.points(at), name), depth) for name in ("rows", "flexibility")
    )
    scale = np.max(np.abs(points.row_rates)) + 1.0
    assert points.row_rates == pytest.approx(rows, abs=1e-6 * scale)
    assert points.flexibility_rate == pytest.approx(flexibility, abs=1e-6 * np.max(np.abs(points.flexibility)) * 1e3 + 1e-300)
    assert points.flexibility == pytest.approx(points.flexibility.T, abs=1e-20)
    assert np.min(np.linalg.eigvalsh(points.flexibility)) > -1e-18


def test_deflection_agrees_with_the_rows(case):
    plant, depth = case.plant, 0.1
    points = plant.points(depth)
    coordinates = random_vectors(plant)[0]
    if plant.scene.support.kind == "entry":
        coordinates[: plant.prescribed] = 0.0
    forces = np.arange(1.0, len(points.rows) + 1)
    positions = [guide.position for guide in case.scene.support.guides]
    positions += [load.position for load in case.scene.loads if load.kind == "lateral"]
    stations = np.array([*positions, depth]) + case.scene.needle.length - depth
    found = plant.deflection(coordinates, forces, depth, stations)
    assert found == pytest.approx(points.deflections(coordinates, forces), rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_derivatives_of_the_deflection(case, derivative):
    plant, depth = case.plant, 0.1
    rest = solve_static(plant, depth=depth, time=TIME)
    stations = np.array([0.111, 0.127, 0.1618, 0.189])

    def of(order, at):
        return plant.deflection(rest.coordinates, rest.point_forces, depth, at, order)

    step = 1e-6
    expected = (of(derivative, stations + step) - of(derivative, stations - step)) / (2.0 * step)
    scale = np.max(np.abs(expected))
    assert of(derivative + 1, stations) == pytest.approx(expected, rel=1e-5, abs=1e-5 * scale)


def test_a_straight_needle(case):
    plant = case.plant
    if plant.scene.support.kind == "entry":
        assert np.all(plant.straight(0.0, 0.0) == 0.0)
        return
    stations = np.linspace(0.0, case.scene.needle.length, 33)
    coordinates = plant.straight(2e-3, 0.05)
    forces = np.zeros(len(plant.points(0.1).rows))
    assert plant.deflection(coordinates, forces, 0.1, stations) == pytest.approx(2e-3 + 0.05 * stations, rel=1e-12)
    bent = banded.multiply(plant.operators(0.1, TIME).bending, coordinates)
    assert np.max(np.abs(bent)) < 1e-9


def test_total_force(case):
    """The coordinates of the function 1 deflect by 1 inside the tissue; with the mass matrix they weigh the bending part."""
    plant = case.plant
    tip = plant.points(0.1).rows[-1]
    assert tip @ plant.deflection_at_one == pytest.approx(1.0, rel=1e-13)
    ones = plant.deflection_at_one
    moved = case.scene.needle.length if plant.scene.support.kind == "hub" else 0.1
    weight = ones @ banded.multiply(plant.operators(0.1, TIME).mass, ones)
    assert weight == pytest.approx(case.scene.needle.mass_per_length * moved, rel=1e-12)
    inside = sum(layer.foundation_modulus * (min(layer.far_side, 0.1) - layer.start) for layer in case.scene.tissue.layers)
    factor = case.scene.tissue.stiffness_factor.value(TIME)
    assert ones @ banded.multiply(plant.operators(0.1, TIME).tissue, ones) == pytest.approx(inside * factor, rel=1e-11)


def test_purity(case):
    """Same inputs, same outputs; nothing that was handed out or in is altered by later use."""
    plant = case.plant
    first, points = matrices(plant, 0.1), plant.points(0.1)
    kept = {name: value.copy() for name, value in first.items()}
    rows = points.rows.copy()
    vector = random_vectors(plant)[0]
    before = vector.copy()
    for depth in (*DEPTHS, 0.1):
        plant.operators(depth, 0.3)
        plant.points(depth)
        plant.stiffness_rate_product(vector, depth, 0.3)
        plant.kinetic_rate(vector, vector, depth, 1.0)
        solve_static(plant, depth=depth, time=0.2)
    assert all(np.array_equal(first[name], kept[name]) for name in kept)
    assert np.array_equal(points.rows, rows)
    assert np.array_equal(vector, before)
    again = matrices(plant, 0.1)
    assert all(np.array_equal(again[name], kept[name]) for name in kept)


def test_reciprocity(case):
    """The deflection at one point under a force at another is the same the other way round."""
    lateral = [index for index, load in enumerate(case.scene.loads) if load.kind == "lateral"]
    if not lateral:
        pytest.skip("an entry needle has one loaded point only")
    zero = {"support.hub_angle": 0.0, "loads.0.force": 0.0, f"loads.{lateral[0]}.force": 0.0}
    found = []
    for pushed, asked in ((0, 0), (lateral[0], -1)):
        scene = case.scene.with_values(zero | {f"loads.{pushed}.force": 1.0})
        plant = case.make(scene)
        rest = solve_static(plant, depth=0.1)
        points = plant.points(0.1)
        deflections = points.deflections(rest.coordinates, rest.point_forces)
        found.append(deflections[points.guides] if asked == 0 else deflections[-1])
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert abs(found[0]) > 1e-9


def test_sum_of_forces(case):
    rest = solve_static(case.plant, depth=0.1, time=TIME)
    forces = [rest.hub_force, rest.tissue_force, *rest.point_forces]
    assert sum(forces) == pytest.approx(0.0, abs=1e-9 * max(map(abs, forces)))


def test_rigid_guides_hold_and_springs_obey(case):
    plant = case.plant
    rest = solve_static(plant, depth=0.1, time=TIME)
    points = plant.points(0.1)
    deflections = points.deflections(rest.coordinates, rest.point_forces)[: points.guides]
    assert deflections == pytest.approx(-points.guide_compliance * rest.guide_forces, abs=1e-12)


@pytest.mark.parametrize("depth", DEPTHS)
def test_derivative_of_the_statics_by_depth(case, depth):
    plant = case.plant
    rest = solve_static(plant, depth=depth, time=TIME)
    expected = central(lambda at: solve_static(plant, depth=at, time=TIME).coordinates, depth)
    found, reactions = depth_derivative(plant, rest)
    scale = np.max(np.abs(expected))
    assert found == pytest.approx(expected, abs=1e-5 * scale)
    slopes = central(lambda at: solve_static(plant, depth=at, time=TIME).guide_forces, depth)
    assert reactions == pytest.approx(slopes, rel=1e-5, abs=1e-6 * np.max(np.abs(slopes), initial=1.0))


def test_depth_at_which_the_needle_is_straight(case):
    plant = case.plant
    depth = 0.5 * plant.smallest_depth
    rest = solve_static(plant, depth=depth)
    assert np.isfinite(rest.tip_deflection)
    if plant.smallest_depth > 0.0:
        assert rest.tip_deflection == 0.0


def test_describe_names_the_model(case):
    assert case.plant.describe()["model"] == case.name
