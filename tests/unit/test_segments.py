import pytest

from fem_needle.scene import Layer
from fem_needle.segments import inserted_segments, interfaces, tip_layer

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
