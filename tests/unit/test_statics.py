import numpy as np
import pytest

from fem_needle import ComputationError, FiniteElementNeedle, run_scene, solve_static
from fem_needle.scene import Guide, LateralLoad, Layer, Table, TipLoad
from fem_needle.statics import check_force_sum
from tests.consistency.scenes import GEL, STIFFNESS, held, scene_of


def test_cantilever_from_the_hub():
    """Tip force and lateral force superpose: F l^3 / 3EI + P a^2 (3 l - a) / 6EI."""
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.1234, force=0.3)]
    plant = FiniteElementNeedle(scene_of("hub", held(0.05), (), loads), elements=3)
    a = 0.2 - 0.05 - 0.1234
    expected = (0.1 * 0.2**3 / 3 + 0.3 * a**2 * (0.6 - a) / 6) / STIFFNESS
    assert solve_static(plant, depth=0.05).tip_deflection == pytest.approx(expected, rel=1e-11)


def test_a_hardly_inserted_needle():
    rest = solve_static(FiniteElementNeedle(scene_of("entry", held(0.1)), elements=3), depth=1e-8)
    assert rest.tip_deflection == 0.0
    assert (rest.hub_force, rest.tissue_force) == (-0.1, 0.0)
    assert check_force_sum(rest, rest.plant.points(0.01)) is rest


def test_loads_are_taken_at_the_time():
    loads = [TipLoad(force=Table(time=[0.0, 1.0], value=[0.0, 0.2]))]
    plant = FiniteElementNeedle(scene_of("entry", held(0.1), GEL, loads), elements=4)
    tips = [solve_static(plant, depth=0.1, time=time).tip_deflection for time in (0.0, 0.25, 1.0)]
    assert tips[0] == 0.0
    assert tips[1] / tips[2] == pytest.approx(0.25, rel=1e-12)


def test_the_hub_moves_a_free_needle_rigidly():
    scene = scene_of("hub", held(0.0), (), (), support={"hub_deflection": 2e-3, "hub_angle": 0.01})
    rest = solve_static(FiniteElementNeedle(scene, elements=3), depth=0.0)
    assert rest.tip_deflection == pytest.approx(2e-3 + 0.01 * 0.2, rel=1e-11)
    assert abs(rest.hub_force) < 1e-9


def test_a_rigid_guide_holds_and_pushes_against_the_tip():
    """A propped cantilever with an overhang, pin at a, force at the end: the reaction is -F (3 l / a - 1) / 2."""
    plant = FiniteElementNeedle(scene_of("hub", held(0.05), (), support={"guides": [Guide(position=-0.0317)]}), elements=3)
    rest = solve_static(plant, depth=0.05)
    a = 0.15 - 0.0317
    assert rest.guide_forces[0] == pytest.approx(-0.1 * (3 * 0.2 / a - 1) / 2, rel=1e-9)
    assert abs(rest.deflection(np.array([a]))[0]) < 1e-14


def test_an_unbalanced_state_is_refused():
    rest = solve_static(FiniteElementNeedle(scene_of("hub", held(0.1)), elements=4), depth=0.1)
    wrong = type(rest)(
        **{name: getattr(rest, name) for name in rest.__dataclass_fields__} | {"tissue_force": rest.tissue_force * 1.01}
    )
    with pytest.raises(ComputationError, match=r"do not balance at time 0 s, depth 0.1 m"):
        check_force_sum(wrong, rest.plant.points(0.1))


def test_a_depth_beyond_the_needle_shows_no_nonsense():
    """Round-off beyond the tip is the tip."""
    plant = FiniteElementNeedle(scene_of("entry", held(0.2)), elements=4)
    near = solve_static(plant, depth=0.2 * (1 + 1e-15)).tip_deflection
    assert near == pytest.approx(solve_static(plant, depth=0.2).tip_deflection, rel=1e-9)


def test_the_surface_carries_the_tip_force_of_a_needle_that_is_hardly_inserted():
    scene = scene_of("entry", held(1e-9), numerics={"analysis": "static"})
    run = run_scene(scene)
    assert run.hub_force == pytest.approx(-0.1) and np.all(run.hub_moment == 0.0)


def test_a_bevel_that_is_hardly_inserted_feels_the_layer_at_its_tip():
    """Matrices are those of the smallest depth, 2e-7 m here; the tip is still in the layer in front of it."""
    layers = (Layer(end=1e-7, foundation_modulus=1e3), Layer(start=1e-7, foundation_modulus=5e4))
    scene = scene_of("entry", held(5e-8), layers, (TipLoad(bevel_coefficient=1e-5),), numerics={"analysis": "static"})
    assert run_scene(scene).hub_force == pytest.approx(-1e-2)
