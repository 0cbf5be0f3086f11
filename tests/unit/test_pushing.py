import pytest

from fem_needle import FiniteElementNeedle
from fem_needle.dynamics import names as at
from fem_needle.dynamics.push import Push, RunLimits, run_limits
from fem_needle.dynamics.run import begun, integration_of
from fem_needle.scene import Friction, Guide, Insertion, Layer
from tests.consistency.scenes import LENGTH, scene_of

LAYERS = (Layer(start=0.05, foundation_modulus=1e3, cutting_force=0.4, puncture_force=2.3),)


def pushed(force, depth=0.05, **parts):
    insertion = Insertion(kind="force", initial_depth=depth, push_force=force)
    return scene_of("hub", insertion, LAYERS, (), friction=Friction(coulomb=0.5, coulomb_per_length=2.0), **parts)


# At 50 mm: 0.5 + 2 * 0.05 = 0.6 N of friction; 2.3 N more at the capsule, 0.4 N more once it is pierced.
@pytest.mark.parametrize(
    ("force", "changes", "direction"),
    [
        (2.8, {}, 0),
        (2.9, {}, 0),
        (2.91, {}, 1),
        (2.8, {at.AXIAL_FORCE: 0.2}, 1),
        (3.0, {at.AXIAL_FORCE: -0.2}, 0),
        (0.9, {at.PIERCED: 1}, 0),
        (1.1, {at.PIERCED: 1}, 1),
        (0.7, {at.PIERCED: 1, at.DEEPEST: 0.06}, 1),
        (-0.5, {}, 0),
        (-0.7, {}, -1),
        (-0.7, {at.AXIAL_FORCE: 0.2}, 0),
        (0.0, {at.PACE: 1e-9}, 1),
        (3.0, {at.PACE: -1e-9}, -1),
    ],
)
def test_when_a_needle_moves(force, changes, direction):
    scene = pushed(force)
    plant = FiniteElementNeedle(scene, elements=2)
    push = Push(begun(plant, integration_of(plant, scene, "dynamic")), scene, run_limits(scene))
    for name, value in changes.items():
        push.needle.live.axial[name] = value
    assert push.direction == direction


def test_where_a_push_ends():
    guide = Guide(position=-0.03)
    assert run_limits(pushed(1.0)) == RunLimits(None, LENGTH, "hub-contact")
    assert run_limits(pushed(1.0, support={"guides": [guide]})).contact == pytest.approx(0.17)
    load = {"kind": "lateral", "position": -0.05, "force": 0.1}
    both = pushed(1.0, support={"guides": [guide]}).with_value("loads", [load])
    assert run_limits(both).contact == pytest.approx(0.15)
    entry = scene_of("entry", Insertion(kind="force", initial_depth=0.05, push_force=1.0, final_depth=0.1), LAYERS, ())
    assert run_limits(entry) == RunLimits(0.1, LENGTH, "full-length")
