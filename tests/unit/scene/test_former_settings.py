"""Settings of former versions: accepted, told, without effect."""

import numpy as np
import pytest

from fem_needle import load_scene, run_scene
from fem_needle.errors import SuspiciousValueWarning


def test_the_loop_of_before_changes_nothing():
    scene = load_scene("bench-s")
    assert scene.with_value("numerics.loop", "auto") == scene
    for loop in ("compiled", "numpy"):
        with pytest.warns(SuspiciousValueWarning, match=f"numerics.loop = '{loop}': a setting of former versions"):
            former = scene.with_value("numerics.loop", loop)
    with pytest.warns(SuspiciousValueWarning):
        found = run_scene(former, elements=4).tip_deflection
    assert np.array_equal(found, run_scene(scene, elements=4).tip_deflection)
