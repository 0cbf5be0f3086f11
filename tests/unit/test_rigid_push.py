from math import exp, sqrt

import pytest
from scipy.optimize import brentq

from fem_needle.errors import SceneError
from fem_needle.motion import run_duration
from fem_needle.rigid_push import time_to_depth
from fem_needle.scene import Friction, Insertion, Layer
from tests.consistency.scenes import LENGTH, MASS, scene_of

NEEDLE_MASS = MASS * LENGTH


def pushed(force, layers=(), duration=None, **friction):
    insertion = Insertion(kind="force", initial_depth=0.02, push_force=force, final_depth=0.18)
    return scene_of("hub", insertion, layers, (), friction=Friction(**friction), duration=duration)


def test_a_constant_push_alone():
    """z - z_0 = 1/2 (f / m) t^2."""
    assert time_to_depth(pushed(1.0)) == pytest.approx(sqrt(2.0 * 0.16 * NEEDLE_MASS), rel=1e-3)


def test_friction_and_cutting_take_their_part():
    layers = (Layer(start=0.0, foundation_modulus=1e3, cutting_force=0.4),)
    time, end = NEEDLE_MASS / 0.3, (3.0 - 0.56 - 0.4) / 0.3
    expected = brentq(lambda t: end * (t - time * (1.0 - exp(-t / time))) - 0.16, 1e-4, 1.0)
    assert time_to_depth(pushed(3.0, layers, coulomb=0.56, viscous=0.3)) == pytest.approx(expected, rel=1e-3)


def test_a_push_below_friction_never_arrives():
    with pytest.raises(SceneError, match=r"run.duration: is required.*0.18 m within 1000 s"):
        time_to_depth(pushed(0.5, coulomb=0.56))


def test_a_push_to_a_final_depth_needs_no_duration_and_gets_several_times_what_a_rod_takes():
    assert run_duration(pushed(1.0)) > 3.0 * time_to_depth(pushed(1.0))
    assert run_duration(pushed(1.0, duration=7.0)) == 7.0
