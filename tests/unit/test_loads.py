import numpy as np
import pytest

from fem_needle.loads import is_steady, load_case, second_derivative
from fem_needle.scene import LateralLoad, Sinusoid, Table, TipLoad, as_function
from tests.consistency.scenes import LAYERS, held, scene_of

WAVE = Sinusoid(mean=0.3, amplitude=0.2, frequency=1.5, phase=0.4)
RAMP = Table(time=[0.0, 1.0, 2.0], value=[0.0, 0.5, 0.0])


def test_forces_in_order_and_their_rates():
    loads = [
        LateralLoad(position=-0.01, force=WAVE),
        TipLoad(force=RAMP),
        LateralLoad(position=-0.02, force=0.7),
        TipLoad(force=0.1),
    ]
    case = load_case(scene_of("hub", held(0.1), LAYERS, loads), 0.1, 0.5)
    assert case.forces == pytest.approx([WAVE.value(0.5), 0.7, 0.25 + 0.1])
    assert case.force_rates == pytest.approx([WAVE.derivative(0.5), 0.0, 0.5])


@pytest.mark.parametrize(("depth", "modulus"), [(0.02, 5e3), (0.05, 2e4), (0.08, 0.0), (0.09, 0.0), (0.1, 5e4), (0.15, 0.0)])
def test_bevel_force_of_the_layer_at_the_tip(depth, modulus):
    """The deeper layer at an interface, nothing in a gap; the modulus swells, and the force with it."""
    swelling = {"stiffness_factor": WAVE}
    case = load_case(scene_of("entry", held(0.1), LAYERS, [TipLoad(bevel_coefficient=2e-6)], tissue=swelling), depth, 0.3)
    assert case.forces == pytest.approx([2e-6 * modulus * WAVE.value(0.3)])
    assert case.force_rates == pytest.approx([2e-6 * modulus * WAVE.derivative(0.3)])


def test_a_turned_bevel_pushes_with_the_cosine():
    """F = a k d(t) of the bevel and F(t) d(t) of a given force; the rates by the product rule."""
    loads = [TipLoad(bevel_coefficient=2e-6, direction=RAMP), TipLoad(force=WAVE, direction=-0.5)]
    case = load_case(scene_of("entry", held(0.1), LAYERS, loads), 0.02, 0.5)
    assert case.forces == pytest.approx([2e-6 * 5e3 * 0.25 - 0.5 * WAVE.value(0.5)])
    assert case.force_rates == pytest.approx([2e-6 * 5e3 * 0.5 - 0.5 * WAVE.derivative(0.5)])
    assert not is_steady(scene_of("entry", held(0.1), loads=[TipLoad(force=1.0, direction=RAMP)]))


def test_motion_of_the_hub():
    support = {"hub_deflection": WAVE, "hub_angle": RAMP}
    case = load_case(scene_of("hub", held(0.1), support=support), 0.1, 0.7)
    step = 1e-4
    values = [WAVE.value(0.7 + i * step) for i in (-1, 0, 1)]
    assert case.clamp == pytest.approx([values[1], 0.35])
    assert case.clamp_rates == pytest.approx([(values[2] - values[0]) / (2 * step), 0.5], rel=1e-5)
    assert case.clamp_accelerations == pytest.approx([(values[0] - 2 * values[1] + values[2]) / step**2, 0.0], rel=1e-5)


@pytest.mark.parametrize("time", [0.0, 0.31, 1.2])
def test_second_derivative(time):
    step = 1e-4
    expected = (WAVE.derivative(time + step) - WAVE.derivative(time - step)) / (2 * step)
    assert second_derivative(WAVE, time) == pytest.approx(expected, rel=1e-5)
    assert second_derivative(RAMP, time) == 0.0
    assert second_derivative(as_function(3.0), time) == 0.0


def test_what_is_steady():
    assert is_steady(scene_of("hub", held(0.1)))
    assert not is_steady(scene_of("hub", held(0.1), loads=[TipLoad(force=WAVE)]))
    assert not is_steady(scene_of("hub", held(0.1), support={"hub_angle": RAMP}))
    assert not is_steady(scene_of("hub", held(0.1), tissue={"stiffness_factor": RAMP}))


def test_a_needle_without_loads():
    case = load_case(scene_of("entry", held(0.1), loads=()), 0.1, 0.0)
    assert np.array_equal(case.forces, [0.0])
