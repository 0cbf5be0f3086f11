import pytest

from fem_needle.axial import Hold, cutting_force, entered_layers, friction_force, hold_at, membrane_at
from fem_needle.scene import Friction, Layer
from tests.consistency.scenes import held, scene_of

LAYERS = (
    Layer(start=0.0, end=0.05, foundation_modulus=1e3, cutting_force=0.4),
    Layer(start=0.06, foundation_modulus=1e3, cutting_force=0.9),
)
SCENE = scene_of(
    "hub", held(0.1), LAYERS, friction=Friction(coulomb=0.5, viscous=0.3, coulomb_per_length=2.0, viscous_per_length=7.0)
)


@pytest.mark.parametrize(("speed", "expected"), [(0.0, 0.0), (0.2, 0.7 + 0.2), (-0.2, -0.7 - 0.2)])
def test_friction(speed, expected):
    """0.5 + 2.0 * 0.1 = 0.7 N of Coulomb friction, (0.3 + 7.0 * 0.1) 0.2 = 0.2 N of viscous friction."""
    assert friction_force(SCENE, 0.1, speed) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("depth", "speed", "deepest", "expected"),
    [
        (0.02, 0.1, 0.02, 0.4),
        (0.05, 0.1, 0.05, 0.0),
        (0.06, 0.1, 0.06, 0.9),
        (0.02, 0.0, 0.02, 0.0),
        (0.02, -0.1, 0.02, 0.0),
        (0.02, 0.1, 0.03, 0.0),
    ],
)
def test_cutting_only_while_the_tip_advances_into_uncut_tissue(depth, speed, deepest, expected):
    assert cutting_force(SCENE, depth, speed, deepest) == expected


BEHIND = SCENE.with_value("tissue.layers.1.puncture_force", 2.3)
NONE, FIRST, BOTH = frozenset(), frozenset({0}), frozenset({0, 1})


# Friction is 0.5 + 2 z: 0.52 N at 10 mm, 0.62 N at 60 mm.
@pytest.mark.parametrize(
    ("depth", "deepest", "punctured", "expected"),
    [
        (0.01, 0.01, FIRST, Hold(0.52 + 0.4, 0.52, None)),
        (0.01, 0.02, FIRST, Hold(0.52, 0.52, None)),
        (0.055, 0.055, FIRST, Hold(0.61, 0.61, None)),
        (0.06, 0.06, FIRST, Hold(0.62 + 2.3, 0.62, 1)),
        (0.06, 0.06, BOTH, Hold(0.62 + 0.9, 0.62, None)),
        (0.06, 0.07, BOTH, Hold(0.62, 0.62, None)),
        (0.06 + 1e-9, 0.06 + 1e-9, BOTH, Hold(0.62 + 0.9, 0.62, None)),
    ],
)
def test_what_holds_a_resting_needle(depth, deepest, punctured, expected):
    found = hold_at(BEHIND, depth, deepest, punctured)
    assert found.inward == pytest.approx(expected.inward)
    assert found.outward == pytest.approx(expected.outward)
    assert found.membrane == expected.membrane


def test_a_membrane_is_at_the_start_of_a_layer_with_a_puncture_force():
    assert membrane_at(BEHIND, 0.06, FIRST) == 1
    assert membrane_at(BEHIND, 0.06, BOTH) is None
    assert membrane_at(BEHIND, 0.0, NONE) is None
    assert membrane_at(SCENE, 0.06, FIRST) is None


def test_a_tip_at_the_start_of_a_layer_has_not_entered_it():
    assert [entered_layers(SCENE, depth) for depth in (0.0, 0.06, 0.0600001)] == [NONE, FIRST, BOTH]
