"""Automatic runs of random scenes against independent solvers: the tip error is below the tolerance and below its estimate."""

import warnings

import numpy as np
import pytest

from fem_needle import run_scene
from tests.consistency.random_scenes import OUTPUTS, random_scene, true_tips

SHARE = 0.3  # of the difference of two truths: what the finer one may miss


def checked(seed, tolerance):
    scene = random_scene(seed)
    truth, uncertainty = true_tips(scene, np.linspace(0.0, scene.duration, OUTPUTS + 1))
    doubt = SHARE * uncertainty
    if doubt > 0.3 * tolerance:
        pytest.skip("the reference itself is not accurate enough")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = run_scene(scene, tolerance=tolerance)
    error = np.max(np.abs(run.tip_deflection - truth)) / np.max(np.abs(truth))
    assert error <= tolerance + doubt
    assert error <= run.summary["error_estimate"] + doubt


@pytest.mark.parametrize("seed", [2, 6])
def test_the_tolerance_is_kept(seed):
    checked(seed, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("seed", range(16))
def test_the_tolerance_is_kept_in_random_scenes(seed, tolerance):
    checked(seed, tolerance)
