import numpy as np
import pytest

from fem_needle.scene import Layer
from fem_needle.segments import all_one_sided, inserted_segments, interfaces, one_layer_holds, one_sided, tip_layer, tip_values

LAYERS = (
    Layer(start=0.1, foundation_modulus=3.0),
    Layer(start=0.0, end=0.04, foundation_modulus=1.0),
    Layer(start=0.04, end=0.07, foundation_modulus=2.0),
)


@pytest.mark.parametrize(
    ("depth", "expected"),
    [
        (0.0, []),
        (0.02, [(1, 0.0, 0.02, True)]),
        (0.04, [(1, 0.0, 0.04, True)]),
        (0.05, [(1, 0.0, 0.04, False), (2, 0.04, 0.05, True)]),
        (0.08, [(1, 0.0, 0.04, False), (2, 0.04, 0.07, False)]),
        (0.12, [(0, 0.1, 0.12, True), (1, 0.0, 0.04, False), (2, 0.04, 0.07, False)]),
    ],
)
def test_segments(depth, expected):
    found = [(s.layer, s.start, s.end, s.ends_at_tip) for s in inserted_segments(LAYERS, depth)]
    assert found == expected


@pytest.mark.parametrize(
    ("depth", "layer"), [(0.0, 1), (0.039, 1), (0.04, 2), (0.07, None), (0.09, None), (0.1, 0), (5.0, 0), (-0.01, None)]
)
def test_the_deeper_layer_holds_the_tip_at_an_interface(depth, layer):
    assert tip_layer(LAYERS, depth) == layer


def test_interfaces_rise_and_come_once():
    assert interfaces(LAYERS) == (0.0, 0.04, 0.07, 0.1)
    assert interfaces(()) == ()


@pytest.mark.parametrize("level", [0.04, 0.07, 0.1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_depth_on_an_interface_moves_off_it_toward_where_it_goes(level, side):
    """By two roundings of the depth, in which a landing may have missed the interface by one."""
    rounding = 1e-12 * max(level, level + side * 0.01)
    for missed in (-0.9, 0.0, 0.9):
        moved = one_sided(LAYERS, level + missed * rounding, level + side * 0.01)
        assert (moved - level) / rounding == pytest.approx(missed + 2.0 * side, abs=1e-3)


def test_elsewhere_a_depth_stays_and_no_move_goes_beyond_its_goal():
    depths = np.array([0.02, 0.04 + 2.1e-12 * 0.05, 0.04, 0.09])
    moved = all_one_sided(LAYERS, depths, np.array([0.03, 0.05, 0.04 + 1e-14, 0.08]))
    assert moved[[0, 1, 3]].tolist() == depths[[0, 1, 3]].tolist()
    assert moved[2] == 0.04 + 1e-14


def test_a_place_exactly_one_rounding_away_counts_as_the_interface():
    layers = (Layer(start=1.0, foundation_modulus=1.0),)
    assert one_sided(layers, 1.0 + 1e-12 * 2.0, 2.0) > 1.0 + 1e-12 * 2.0
    assert one_sided(layers, 1.0 + 1.01e-12 * 2.0, 2.0) == 1.0 + 1.01e-12 * 2.0


def test_values_at_many_tips():
    depths = np.array([0.0, 0.039, 0.04, 0.07, 0.09, 0.1, 5.0, -0.01])
    assert tip_values(LAYERS, depths, lambda layer: layer.foundation_modulus).tolist() == [1.0, 1.0, 2.0, 0.0, 0.0, 3.0, 3.0, 0.0]


@pytest.mark.parametrize(
    ("start", "end", "deepest", "held"), [(0.0, 0.1, 0.1, True), (0.0, 0.1, 0.11, False), (0.01, None, 0.1, False)]
)
def test_one_layer_may_hold_all(start, end, deepest, held):
    layer = Layer(start=start, end=end, foundation_modulus=1.0)
    assert one_layer_holds((layer,), deepest) is held
    assert not one_layer_holds((layer, Layer(start=1.0, foundation_modulus=1.0)), deepest)
