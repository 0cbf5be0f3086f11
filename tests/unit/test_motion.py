import numpy as np
import pytest

from fem_needle.motion import depth_law, landing_times, run_duration
from fem_needle.scene import Insertion, Layer, Sinusoid, Table, TipLoad
from tests.consistency.scenes import LAYERS, held, moving, profile, scene_of

SPEEDS = Insertion(kind="speed", initial_depth=0.05, speed=Table(time=[0.0, 1.0, 2.0], value=[0.0, 0.04, -0.04]))
LAWS = {
    "hold": held(0.1),
    "constant": moving(0.05, 0.02, 0.1),
    "table of speeds": SPEEDS,
    "wave of speeds": Insertion(kind="speed", initial_depth=0.05, speed=Sinusoid(mean=0.01, amplitude=0.05, frequency=0.7)),
    "profile": profile([0.0, 0.5, 1.0, 2.0], [0.02, 0.1, 0.1, 0.03]),
    "wave": Insertion(kind="profile", depth=Sinusoid(mean=0.1, amplitude=0.04, frequency=0.9)),
}


def law_of(name):
    return depth_law(scene_of("entry", LAWS[name], duration=2.0))


@pytest.mark.parametrize("name", LAWS)
def test_speed_and_acceleration_are_the_derivatives(name):
    law, step = law_of(name), 1e-6
    for time in (0.123, 0.77, 1.31, 1.57):
        depths = [law.depth(time + i * step) for i in (-1, 0, 1)]
        assert law.speed(time) == pytest.approx((depths[2] - depths[0]) / (2 * step), abs=1e-7)
        speeds = [law.speed(time + i * step) for i in (-1, 1)]
        assert law.acceleration(time) == pytest.approx((speeds[1] - speeds[0]) / (2 * step), abs=1e-6)


def test_rest_at_the_final_depth():
    law = law_of("constant")
    assert law.depth(1.6) == pytest.approx(0.1)
    assert law.depth(5.0) == 0.1
    end = law.rests_from
    assert end == pytest.approx(1.6)
    assert [law.before(end).speed, law.after(end).speed] == [0.05, 0.0]


def test_both_sides_of_a_kink():
    law = law_of("profile")
    assert [law.before(0.5).speed, law.after(0.5).speed] == pytest.approx([0.16, 0.0])
    assert [law.before(1.0).speed, law.after(1.0).speed] == pytest.approx([0.0, -0.07])
    assert law.before(1.0).depth == law.after(1.0).depth == pytest.approx(0.1)


def test_landings_at_kinks_and_crossings():
    loads = [TipLoad(force=Table(time=[0.3, 1.9, 7.0], value=[0.0, 1.0, 0.0]))]
    scene = scene_of("entry", LAWS["profile"], LAYERS, loads, duration=2.0)
    found = landing_times(scene, depth_law(scene), 2.0, 2e-7)
    crossings = [0.5 * 3 / 8, 0.5 * 6 / 8, 1 + 2 / 7, 1 + 5 / 7]  # 50 and 80 mm, in and out
    expected = sorted([0.3, 0.5, 1.0, 1.9, *crossings])
    # 100 mm, an interface, is reached and held from 0.5 to 1.0 s.
    assert list(found) == pytest.approx(expected)


def test_crossings_of_a_wave():
    law = depth_law(scene_of("hub", LAWS["wave"], duration=2.0))
    times = np.array(sorted(law.crossings(0.12, 2.0)))
    first = np.arcsin(0.5) / (2 * np.pi * 0.9)
    expected = [first, 0.5 / 0.9 - first, first + 1 / 0.9, 1.5 / 0.9 - first]
    assert times == pytest.approx(expected, abs=1e-12)


def test_duration():
    assert run_duration(scene_of("entry", LAWS["constant"], duration=7.0)) == 7.0
    assert run_duration(scene_of("entry", LAWS["constant"], duration=None)) == pytest.approx(1.6)


def test_layers_that_start_at_the_surface_are_no_landing_under_hub():
    scene = scene_of("hub", LAWS["constant"], (Layer(foundation_modulus=1e3),), duration=1.0)
    assert landing_times(scene, depth_law(scene), 1.0, 0.0) == ()
