"""Static finite elements against the exact solution of every scene: order and absolute error, along the whole needle.

Where a layer ends inside an element the fourth derivative jumps there: with quartic elements the error then depends on where in
the element the jump lies and scatters from mesh to mesh, so the order is taken over the three doublings from 8 to 64.
"""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, solve_static
from fem_needle.exact import exact_static
from fem_needle.scene import Guide, LateralLoad, Layer, TipLoad
from tests.consistency.scenes import LENGTH, characteristic_modulus, held, rates, relative, scene_of, static_scenes

STATIONS = np.linspace(0.0, LENGTH, 201)
MESHES = (8, 16, 32, 64)
ROUND_OFF = 1e-8  # measured: up to 2e-9 at 128 elements; a coarser error below this says nothing about the order
SCENES = static_scenes()
SMOOTH = (
    "entry",
    "entry stiff",
    "hub stiff",
    "force at a node",
    "force beside a node",
    "elastic guides and a force in one element",
)


def errors(scene, degree, derivative=0):
    """Largest error over the stations on each mesh, over the largest value."""
    depth = scene.insertion.first_depth
    exact = exact_static(scene, depth)
    expected = (exact.deflection, exact.slope)[derivative](STATIONS)
    plants = [FiniteElementNeedle(scene, elements=count, degree=degree) for count in MESHES]
    return [relative(solve_static(plant, depth=depth).deflection(STATIONS, derivative), expected) for plant in plants]


@pytest.mark.parametrize("name", SCENES)
def test_cubic_elements_are_of_fourth_order(name):
    found = errors(SCENES[name], 3)
    observed = rates(found)
    assert min(observed) > 3.1  # 8 elements do not resolve the stiffest tissue yet
    assert observed[-1] > 3.85
    assert found[-1] < 6e-6


@pytest.mark.parametrize("name", SCENES)
def test_quartic_elements_reach_a_millionth_at_order_four(name):
    found = errors(SCENES[name], 4)
    observed = rates(found, floor=ROUND_OFF)
    assert found[-1] < 1e-7
    assert min(observed) > 2.0
    assert np.mean(observed) > 3.4
    assert all(quartic < 1.2 * cubic for quartic, cubic in zip(found, errors(SCENES[name], 3), strict=True))


@pytest.mark.parametrize("name", SMOOTH)
def test_quartic_elements_are_faster_where_the_tissue_is_smooth(name):
    assert min(rates(errors(SCENES[name], 4), floor=ROUND_OFF)) > 4.3


@pytest.mark.parametrize("name", SCENES)
def test_reactions(name):
    scene = SCENES[name]
    depth = scene.insertion.first_depth
    rest, exact = solve_static(FiniteElementNeedle(scene, elements=64), depth=depth), exact_static(scene, depth)
    forces = [*exact.guide_forces, exact.tissue_force, exact.hub_force, exact.tip_force, exact.lateral_force]
    largest = max(abs(force) for force in forces)
    assert rest.guide_forces == pytest.approx(exact.guide_forces, abs=1e-5 * largest)
    assert rest.tissue_force == pytest.approx(exact.tissue_force, abs=1e-5 * largest)
    assert rest.hub_force == pytest.approx(exact.hub_force, abs=1e-5 * largest)
    assert rest.hub_moment == pytest.approx(exact.hub_moment, abs=1e-5 * largest * LENGTH)
    balance = rest.hub_force + rest.tissue_force + rest.point_forces.sum()
    assert balance == pytest.approx(0.0, abs=1e-8 * largest)


@pytest.mark.parametrize("name", ["entry layers", "rigid guide in an element", "elastic guides and a force in one element"])
def test_slope_along_the_needle(name):
    found = errors(SCENES[name], 4, derivative=1)
    assert found[-1] < 2e-6
    assert np.mean(rates(found)) > 3.0


def random_scene(seed):
    """A scene drawn by a seed: support, up to three layers with gaps, up to two guides, loads, (k/4EI)^(1/4) l up to 12."""
    random = np.random.default_rng(seed)
    borders = np.sort(random.uniform(0.0, 0.19, 6)) * [0.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    layers = [
        Layer(start=borders[2 * i], end=borders[2 * i + 1], foundation_modulus=characteristic_modulus(random.uniform(1.0, 12.0)))
        for i in range(random.integers(1, 4))
    ]
    kind, depth = random.choice(["entry", "hub"]), random.uniform(0.03, 0.14)
    loads = [TipLoad(force=random.normal(0.0, 0.1)), TipLoad(bevel_coefficient=random.normal(0.0, 1e-6))]
    support = {}
    if kind == "hub":
        positions = random.uniform(depth - LENGTH, 0.0, 4) * 0.99
        loads += [LateralLoad(position=y, force=random.normal(0.0, 0.3)) for y in positions[: random.integers(0, 3)]]
        guides = [Guide(position=positions[2]), Guide(position=positions[3], stiffness=10.0 ** random.uniform(1.0, 6.0))]
        support = {"guides": guides[: random.integers(0, 3)], "hub_deflection": random.normal(0.0, 1e-3)}
    return scene_of(str(kind), held(depth), layers, loads, support=support)


def test_random_scenes():
    """Every one reaches a millionth, cubic elements fourth order; of the quartic ones the median is faster."""
    scenes = [random_scene(seed) for seed in range(30)]
    cubic, quartic = (np.array([errors(scene, degree) for scene in scenes]) for degree in (3, 4))
    assert np.max(cubic[:, -1]) < 1e-6
    assert np.max(quartic[:, -1]) < 1e-7
    resolved = cubic[:, -1] > ROUND_OFF
    assert np.count_nonzero(resolved) > 15
    assert np.min(np.log2(cubic[resolved, 0] / cubic[resolved, -1])) / 3.0 > 3.2
    assert np.median(np.log2(cubic[resolved, 1:-1] / cubic[resolved, 2:]), axis=0) == pytest.approx([4.0, 4.0], abs=0.25)
    above = quartic[:, 2] > ROUND_OFF
    assert np.median(np.log2(quartic[above, 0] / quartic[above, 2]) / 2.0) > 4.0


def test_a_point_force_without_the_kink_costs_the_accuracy(monkeypatch):
    scene = SCENES["force in a gap"]
    with_kink = errors(scene, 4)
    monkeypatch.setattr("fem_needle.needle.kink", lambda place, *rest: 0.0 * place)
    monkeypatch.setattr("fem_needle.needle.kink_compliance", lambda *places: 0.0)
    without = errors(scene, 4)
    assert without[-1] > 3.0 * with_kink[-1]


@pytest.mark.parametrize("degree", [3, 4])
@pytest.mark.parametrize("kind", ["hub", "entry"])
def test_tip_deflection_is_twice_continuously_differentiable_by_depth(kind, degree):
    """The tip as a function of the depth: its second differences converge across a node, also just beside it."""
    layers = [Layer(start=0.0, end=0.0437, foundation_modulus=2e4), Layer(start=0.05, foundation_modulus=5e4)]
    support = {"guides": [Guide(position=-0.0317)]} if kind == "hub" else {}
    plant = FiniteElementNeedle(scene_of(kind, held(0.1), layers, support=support), elements=16, degree=degree)
    node = 0.1  # hub: the surface at element 8 of 16; entry: the border at 50 mm likewise

    def second(step, middle):
        tips = [solve_static(plant, depth=middle + i * step).tip_deflection for i in (-1, 0, 1)]
        return (tips[0] - 2.0 * tips[1] + tips[2]) / step**2

    scale, jumps = abs(second(1e-3, node)), []
    for step in (4e-4, 2e-4, 1e-4):
        left, at, right = (second(step, node + side * step) for side in (-1.0, 0.0, 1.0))
        jumps.append(abs(right - left))
        assert at == pytest.approx((left + right) / 2.0, abs=5e-3 * scale)
    # A jump of the second derivative would stay as the step falls, one of the first would grow as 1 / step.
    assert jumps[1] < 0.6 * jumps[0] + 1e-3 * scale
    assert jumps[2] < 0.6 * jumps[1] + 1e-3 * scale
    near = [second(2e-4, node + shift) for shift in (-1e-12, 1e-12)]
    assert near[0] == pytest.approx(near[1], abs=1e-3 * scale)
