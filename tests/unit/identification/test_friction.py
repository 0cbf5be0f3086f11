"""Friction from a rising push: against the closed form of the motion, coverage, and the simulated experiment."""

import numpy as np
import pytest

from fem_needle import SceneError, load_scene
from fem_needle.identification import (
    friction_run,
    identify_friction,
    needle_mass,
    repeat_friction_experiment,
    spread,
    tell_sliding,
)
from fem_needle.identification.friction import depth_noise

COULOMB, VISCOUS, MASS, RATE = 0.56, 0.3, 2e-3, 0.25
BREAK_AWAY = COULOMB / RATE  # s
INTERVAL = 5e-3


def pushed(duration=2.8, coulomb=COULOMB, viscous=VISCOUS, sign=1.0):
    """Return times, depths, pushes and speeds of m v' = r t - mu_s - mu_v v from where r t exceeds mu_s, solved."""
    time = np.arange(0.0, duration, INTERVAL)
    since, lag = np.maximum(time - coulomb / RATE, 0.0), MASS / viscous
    speed = RATE / viscous * (since - lag * (1.0 - np.exp(-since / lag)))
    depth = RATE / viscous * (0.5 * since**2 - lag * since + lag**2 * (1.0 - np.exp(-since / lag)))
    return time, 0.08 + sign * depth, sign * RATE * time, sign * speed


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_without_noise_both_coefficients_are_found(sign):
    time, depth, force, _ = pushed(sign=sign)
    found = identify_friction(time, depth, force, mass=MASS)
    assert (found.coulomb.value, found.viscous.value) == pytest.approx((COULOMB, VISCOUS), rel=3e-4)
    last, first = (sign * force for force in found.break_away)
    assert last < COULOMB < first < last + 0.03  # the filter blends 50 ms on both sides: 25 mN


def test_forgetting_the_mass_shifts_the_coulomb_force_by_the_inertia():
    time, depth, force, _ = pushed()
    found = identify_friction(time, depth, force, mass=0.0)
    assert found.coulomb.value - COULOMB == pytest.approx(MASS * RATE / VISCOUS, rel=0.02)


def test_sticking_samples_would_pull_the_coulomb_force_down():
    """Why they are told apart: in the regression over all samples the force at rest counts as friction at speed 0."""
    time, depth, force, speed = pushed()
    told = tell_sliding(time, depth)
    moves = speed > 0.0
    assert not np.any(told.sliding & ~moves)
    assert np.all(speed[told.sticking] < 0.02 * speed.max())
    blended = (np.abs(time - BREAK_AWAY) < 0.07) | (time < 0.06) | (time > time[-1] - 0.06)
    assert np.array_equal(told.sliding[~blended], moves[~blended])
    assert np.array_equal(told.sticking[~blended], ~moves[~blended])
    naive = np.linalg.lstsq(np.column_stack([np.ones_like(time), speed]), force, rcond=None)[0]
    assert naive[0] < 0.6 * COULOMB


def test_noise_alone_is_no_motion():
    random = np.random.default_rng(4)
    time, depth, _, _ = pushed()
    resting = (time > 0.06) & (time < BREAK_AWAY - 0.1)
    for _ in range(20):
        told = tell_sliding(time, depth + 2e-5 * random.standard_normal(time.size))
        assert np.all(told.sticking[resting])


def test_the_noise_of_a_depth():
    time, depth, _, _ = pushed()
    noise = 2e-5 * np.random.default_rng(6).standard_normal(time.size)
    assert depth_noise(depth + noise) == pytest.approx(2e-5, rel=0.15)
    assert depth_noise(depth) < 1e-7


def test_intervals_cover_the_truth():
    """200 experiments: filtered samples are correlated, and yet the intervals hold what they promise."""
    random = np.random.default_rng(1)
    time, depth, force, _ = pushed()
    held = np.zeros(2)
    for _ in range(200):
        noisy = depth + 2e-5 * random.standard_normal(time.size), force + 0.01 * random.standard_normal(time.size)
        low, high = identify_friction(time, *noisy, mass=MASS).fit.intervals().T
        held += (low < (COULOMB, VISCOUS)) & (high > (COULOMB, VISCOUS))
    assert np.all((held / 200 >= 0.90) & (held / 200 <= 0.99))


def test_a_needle_that_never_slides():
    time, depth, force, _ = pushed(duration=2.0)
    with pytest.raises(SceneError, match="slides in 0 independent samples"):
        identify_friction(time, depth + 1e-5 * np.random.default_rng(0).standard_normal(time.size), force, mass=MASS)


def test_sliding_at_one_speed_does_not_tell_the_coefficients_apart():
    time = np.arange(0.0, 2.0, INTERVAL)
    with pytest.raises(SceneError, match="do not tell coulomb and viscous apart"):
        identify_friction(time, 0.25 * time, np.full(time.size, 0.7), mass=MASS, threshold=0.1)


def test_the_simulated_run_obeys_the_closed_form():
    """The scene's ramp from 0.4 N on, solved: the needle slides as a rigid mass, to 0.1 um with steps of 5 ms."""
    scene = load_scene("friction-ramp")
    run = friction_run(scene)
    started = 0.2 + (COULOMB - 0.4) / RATE
    since, lag = np.maximum(run["time"] - started, 0.0), needle_mass(scene) / VISCOUS
    expected = RATE / VISCOUS * (0.5 * since**2 - lag * since + lag**2 * (1.0 - np.exp(-since / lag)))
    assert run["depth"] - 0.08 == pytest.approx(expected, abs=1e-7)


@pytest.mark.slow
def test_repeated_experiments():
    """Three repetitions; each error is within five of its own standard errors, and the seed repeats them."""
    scene = load_scene("friction-ramp")
    found = repeat_friction_experiment(scene, 3, deviations=(0.04, 0.04), seed=2)
    errors = np.array([fit.fit.standard_errors for fit in found.fits])
    assert np.all(np.abs(found.errors) < 5.0 * errors)
    assert np.ptp(found.true[:, 0]) > 0.01
    assert found.coulomb.mean.value == pytest.approx(found.estimates[:, 0].mean())
    again = repeat_friction_experiment(scene, 1, deviations=(0.04, 0.04), noise={}, seed=2)
    assert again.true == pytest.approx(found.true[:1])
    assert np.max(np.abs(again.errors)) < 1e-3  # without noise


def test_assumed_modes_slide_alike():
    """Nothing bends the needle, so that the model does not matter."""
    scene = load_scene("friction-ramp").with_values({"run.duration": 0.9, "insertion.final_depth": None})
    modes = scene.with_values({"model.kind": "assumed-modes", "model.modes": 1})
    assert friction_run(modes)["depth"] == pytest.approx(friction_run(scene)["depth"], rel=1e-9)


def test_a_scene_without_a_push():
    with pytest.raises(SceneError, match="needs a push"):
        friction_run(load_scene("thesis"))


def test_spread_by_hand():
    """1, 2, 3, 4: s = sqrt(5/3); chi-squared with 3 degrees of freedom at 2.5 and 97.5 %: 0.2158, 9.3484."""
    found = spread([1.0, 2.0, 3.0, 4.0])
    assert (found.mean.value, found.deviation) == pytest.approx((2.5, np.sqrt(5 / 3)))
    assert found.mean.interval() == pytest.approx((2.5 - 3.18245 * np.sqrt(5 / 12), 2.5 + 3.18245 * np.sqrt(5 / 12)), rel=1e-5)
    assert found.deviation_interval() == pytest.approx((np.sqrt(5 / 9.3484), np.sqrt(5 / 0.21580)), rel=1e-4)
    with pytest.raises(SceneError, match="at least 2"):
        spread([1.0])
