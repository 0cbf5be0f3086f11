import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, solve_static
from fem_needle.exact import exact_static
from fem_needle.initial import initial_state
from fem_needle.motion import depth_law
from fem_needle.scene import Guide, Initial, LateralLoad, TipLoad
from tests.consistency.scenes import LAYERS, held, moving, scene_of


def start(scene, elements=32):
    plant = FiniteElementNeedle(scene, elements=elements)
    return plant, initial_state(plant, depth_law(scene))


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_equilibrium_with_the_rate_of_the_statics(kind):
    """v(0) dw/dz of the exact statics, at a fixed place of the needle: the tip."""
    scene = scene_of(kind, moving(1.5, 0.07, 0.1), LAYERS)
    plant, state = start(scene)
    tip = plant.points(0.07).rows[-1]
    step = 1e-5
    slope = (exact_static(scene, 0.07 + step).tip_deflection - exact_static(scene, 0.07 - step).tip_deflection) / (2 * step)
    assert tip @ state.solution.coordinates == pytest.approx(exact_static(scene, 0.07).tip_deflection, rel=1e-6)
    assert tip @ state.solution.velocities == pytest.approx(1.5 * slope, rel=1e-4)


def test_at_rest_where_the_needle_does_not_move():
    plant, state = start(scene_of("hub", held(0.07), LAYERS))
    assert np.array_equal(state.solution.coordinates, solve_static(plant, depth=0.07).coordinates)
    assert not np.any(state.solution.momentum)


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_straight(kind):
    support = {"hub_deflection": 1e-3, "hub_angle": 0.02} if kind == "hub" else {}
    scene = scene_of(kind, moving(1.0, 0.07, 0.1), LAYERS, support=support, initial=Initial(shape="straight"))
    plant, state = start(scene)
    expected = 1e-3 + 0.02 * 0.2 if kind == "hub" else 0.0
    assert plant.points(0.07).rows[-1] @ state.solution.coordinates == pytest.approx(expected, abs=1e-15)
    assert not np.any(state.solution.momentum)


@pytest.mark.parametrize("guides", [[], [Guide(position=-0.0317)], [Guide(position=-0.0317, stiffness=800.0)]])
def test_tip_displaced_is_the_scaled_static_shape(guides):
    initial = Initial(shape="tip-displaced", tip_deflection=-2e-3)
    loads = [TipLoad(force=5.0), LateralLoad(position=-0.01, force=3.0)]  # let go with all loads: they do not shape the start
    plant, state = start(scene_of("hub", held(0.07), LAYERS, loads, support={"guides": guides}, initial=initial))
    exact = exact_static(scene_of("hub", held(0.07), LAYERS, [TipLoad(force=1.0)], support={"guides": guides}), 0.07)
    nodes = plant.mesh.nodes
    expected = exact.deflection(nodes) * (-2e-3 / exact.tip_deflection)
    assert state.solution.coordinates[::3] == pytest.approx(expected, abs=1e-8)
    assert not np.any(state.solution.velocities)


def test_nothing_is_inserted():
    _, state = start(scene_of("entry", moving(0.1, 0.0, 0.1)))
    assert not np.any(state.solution.coordinates)
    assert state.solution.forces[-1] == 0.1
