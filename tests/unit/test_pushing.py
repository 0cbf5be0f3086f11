from dataclasses import replace

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle
from fem_needle.collocation import collocation, gauss
from fem_needle.initial import initial_state
from fem_needle.motion import depth_law
from fem_needle.pushed_march import RunLimits, run_limits
from fem_needle.pushing import Limits, Pusher, PushState, StepMotion
from fem_needle.scene import Friction, Guide, Insertion, Layer
from fem_needle.steppers import DynamicStepper
from tests.consistency.scenes import LENGTH, scene_of

LAYERS = (Layer(start=0.05, foundation_modulus=1e3, cutting_force=0.4, puncture_force=2.3),)


def pushed(force, depth=0.05, **parts):
    insertion = Insertion(kind="force", initial_depth=depth, push_force=force)
    return scene_of("hub", insertion, LAYERS, (), friction=Friction(coulomb=0.5, coulomb_per_length=2.0), **parts)


def state_of(scene, **changes):
    plant = FiniteElementNeedle(scene, elements=2)
    depth = scene.insertion.first_depth
    state = PushState(initial_state(plant, depth_law(scene)), depth, 0.0, depth, frozenset(), 0.0)
    return Pusher(DynamicStepper(plant, collocation(1.0))), replace(state, **changes)


def test_the_nearest_level_ahead():
    limits = Limits((0.0, 0.1, 0.05))
    assert [limits.next(0.06, direction) for direction in (1, -1, 0)] == [0.1, 0.05, None]
    assert limits.next(0.1, 1) is None
    assert limits.next(0.05, -1) == 0.0


def test_levels_that_a_step_passes_nearest_first():
    limits = Limits((0.1, 0.05, 0.2))
    assert limits.between(0.05, 0.2) == [0.1, 0.2]
    assert limits.between(0.2, 0.05) == [0.1, 0.05]
    assert limits.between(0.06, 0.09) == []
    assert limits.between(0.05, 0.05) == []


def test_the_motion_of_a_step_is_one_polynomial():
    """v = 1 + 3 t: the depth is its exact integral."""
    method, start, length = gauss(2), 2.0, 0.5
    times = np.array([0.0, *(method.nodes * length), length])
    speeds = 1.0 + 3.0 * times
    motion = StepMotion(method, start, length, 0.1, speeds, 1)
    for time in times:
        assert motion.depth(start + time) == pytest.approx(0.1 + time + 1.5 * time**2, rel=1e-14)
    for number, time in enumerate(times[:3]):
        instant = motion.after(start + time)
        assert (instant.speed, instant.acceleration) == (pytest.approx(speeds[number]), pytest.approx(3.0))
    end = motion.before(start + length)
    assert (end.speed, end.acceleration) == (pytest.approx(2.5), pytest.approx(3.0))
    assert motion.layer_depth(start, start + length) > 0.1
    assert replace(motion, direction=-1).layer_depth(start, start + length) < 0.1


# At 50 mm: 0.5 + 2 * 0.05 = 0.6 N of friction; 2.3 N more at the capsule, 0.4 N more once it is pierced.
@pytest.mark.parametrize(
    ("force", "changes", "direction"),
    [
        (2.8, {}, 0),
        (2.9, {}, 0),
        (2.91, {}, 1),
        (2.8, {"axial_force": 0.2}, 1),
        (3.0, {"axial_force": -0.2}, 0),
        (0.9, {"punctured": frozenset({0})}, 0),
        (1.1, {"punctured": frozenset({0})}, 1),
        (0.7, {"punctured": frozenset({0}), "deepest": 0.06}, 1),
        (-0.5, {}, 0),
        (-0.7, {}, -1),
        (-0.7, {"axial_force": 0.2}, 0),
        (0.0, {"speed": 1e-9}, 1),
        (3.0, {"speed": -1e-9}, -1),
    ],
)
def test_when_a_needle_moves(force, changes, direction):
    pusher, state = state_of(pushed(force), **changes)
    assert pusher.direction(state) == direction


def test_where_a_push_ends():
    guide = Guide(position=-0.03)
    assert run_limits(pushed(1.0)) == RunLimits(None, LENGTH, "hub-contact")
    assert run_limits(pushed(1.0, support={"guides": [guide]})).contact == pytest.approx(0.17)
    load = {"kind": "lateral", "position": -0.05, "force": 0.1}
    both = pushed(1.0, support={"guides": [guide]}).with_value("loads", [load])
    assert run_limits(both).contact == pytest.approx(0.15)
    entry = scene_of("entry", Insertion(kind="force", initial_depth=0.05, push_force=1.0, final_depth=0.1), LAYERS, ())
    assert run_limits(entry) == RunLimits(0.1, LENGTH, "full-length")
