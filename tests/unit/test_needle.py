import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, solve_static
from fem_needle.exact import ClampedTipForce
from fem_needle.frames import MaterialFrame, StretchedFrame
from tests.consistency.scenes import GEL, STIFFNESS, held, scene_of


@pytest.mark.parametrize(
    "options", [{"elements": 0}, {"elements": 1_000_001}, {"elements": 4, "degree": 5}, {"elements": 4, "degree": 2}]
)
def test_impossible_sizes_are_refused(options):
    with pytest.raises(SceneError, match=r"allowed"):
        FiniteElementNeedle(scene_of("hub", held(0.1)), **options)


def test_the_degree_is_that_of_the_scene():
    scene = scene_of("hub", held(0.1), numerics={"degree": 3})
    assert FiniteElementNeedle(scene, elements=5).describe() == {"model": "fem", "elements": 5, "degree": 3}
    assert FiniteElementNeedle(scene, elements=5, degree=4).describe()["degree"] == 4


def test_one_element_without_tissue_is_exact():
    """A cantilever under a tip force is a cubic."""
    plant = FiniteElementNeedle(scene_of("entry", held(0.1), ()), elements=1, degree=3)
    assert solve_static(plant, depth=0.1).tip_deflection == pytest.approx(0.1 * 0.1**3 / (3 * STIFFNESS), rel=1e-13)


def test_the_closed_form():
    case = ClampedTipForce(bending_stiffness=STIFFNESS, foundation_modulus=5e4, length=0.2, force=0.1)
    plant = FiniteElementNeedle(case.scene, elements=32)
    assert solve_static(plant, depth=0.2).tip_deflection == pytest.approx(case.tip_deflection, rel=1e-7)


def test_an_entry_needle_is_straight_outside():
    plant = FiniteElementNeedle(scene_of("entry", held(0.1), GEL), elements=8)
    rest = solve_static(plant, depth=0.1)
    assert np.all(rest.deflection(np.linspace(0.0, 0.1, 11)) == 0.0)
    assert np.all(rest.deflection(np.linspace(0.11, 0.2, 11)) > 0.0)


def test_slopes_of_an_entry_needle_are_by_arc_length():
    plant = FiniteElementNeedle(scene_of("entry", held(0.1), ()), elements=2)
    slope = solve_static(plant, depth=0.1).deflection(np.array([0.2]), 1)[0]
    assert slope == pytest.approx(0.1 * 0.1**2 / (2 * STIFFNESS), rel=1e-12)


@pytest.mark.parametrize("frame", [MaterialFrame(0.2), StretchedFrame()])
@pytest.mark.parametrize("y", [0.0, 0.03, 0.0999, 0.1, 0.4])
def test_frames(frame, y):
    step = 1e-7
    expected = (frame.position(y, 0.1 + step) - frame.position(y, 0.1 - step)) / (2 * step)
    if y != 0.1:  # the tip itself: a kink between what moves through the mesh and what is beyond the needle
        assert frame.position_rate(y, 0.1) == pytest.approx(expected, abs=1e-5)
    ends = (0.1, 0.2) if isinstance(frame, MaterialFrame) else (0.0, 1.0)
    assert frame.position(0.0, 0.1) == pytest.approx(ends[0])
    assert frame.position(0.1, 0.1) == pytest.approx(ends[1])
    stretched = (frame.stretch(0.1 + step) - frame.stretch(0.1 - step)) / (2 * step)
    assert frame.stretch_rate == pytest.approx(stretched, abs=1e-6)
