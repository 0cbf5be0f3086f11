"""What a mesh does to the phases of vibrations."""

import pytest

from fem_needle import FiniteElementNeedle
from fem_needle.detuning import detuning
from fem_needle.free_response import natural_frequencies
from fem_needle.scene_file import load_scene
from tests.consistency.scenes import GEL, held, scene_of

DURATION = 1e-3


def needle(elements, **changes):
    scene = scene_of("entry", held(0.1), GEL, duration=changes.pop("duration", DURATION), **changes)
    return FiniteElementNeedle(scene, elements=elements)


def test_meshes_that_agree_are_in_tune():
    assert detuning(needle(4), needle(4)) == pytest.approx(0.0, abs=1e-12)


def test_a_finer_mesh_is_better_in_tune():
    coarse, middle, fine = needle(2), needle(4), needle(16)
    assert 0.0 < detuning(middle, fine) < detuning(coarse, fine)


def test_the_first_vibration_drifts_with_the_time():
    """Over a time so short that no vibration is off by more than two the drift is proportional to it."""
    short = [detuning(needle(4, duration=d), needle(16, duration=d)) for d in (1e-7, 2e-7)]
    assert short[1] == pytest.approx(2.0 * short[0], rel=1e-6)
    slow = [natural_frequencies(needle(count), 0.1)[0] for count in (4, 16)]
    assert short[0] >= 0.999 * abs(slow[0] - slow[1]) * 1e-7


def test_long_runs_need_more_elements():
    scene = load_scene("bench-m2")
    two, three, six = (FiniteElementNeedle(scene, elements=count) for count in (2, 3, 6))
    assert detuning(three, six) < detuning(two, six)
