import pytest

from fem_needle.axial import cutting_force, friction_force
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
