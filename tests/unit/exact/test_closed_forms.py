"""Hetenyi's closed forms against high precision and against the piecewise solution of their own scenes."""

import mpmath as mp
import numpy as np
import pytest

from fem_needle import SceneError
from fem_needle.exact import ClampedTipForce, InfiniteBeam, SemiInfiniteBeam, exact_static
from tests.consistency.scenes import LENGTH, STIFFNESS, held, scene_of


def mp_clamped_tip(stiffness, modulus, length, force):
    """The formula as Hetenyi prints it, in 60 digits."""
    with mp.workdps(60):
        ei, k, le = mp.mpf(stiffness), mp.mpf(modulus), mp.mpf(length)
        lam = (k / (4 * ei)) ** mp.mpf("0.25")
        x = lam * le
        shape = (mp.sinh(x) * mp.cosh(x) - mp.sin(x) * mp.cos(x)) / (mp.cosh(x) ** 2 + mp.cos(x) ** 2)
        return float(2 * mp.mpf(force) * lam / k * shape)


@pytest.mark.parametrize("modulus", [1e-9, 1.0, 520.0, 6399.0, 6401.0, 5e4, 1e9, 1e12])
def test_clamped_tip_force_to_round_off(modulus):
    case = ClampedTipForce(bending_stiffness=0.0256, foundation_modulus=modulus, length=0.1, force=0.1)
    assert case.tip_deflection == pytest.approx(mp_clamped_tip(0.0256, modulus, 0.1, 0.1), rel=2e-14)


@pytest.mark.parametrize("modulus", [0.0, 1.0, 520.0, 5e4, 1e9])
def test_piecewise_solution_of_clamped_tip_force(modulus):
    case = ClampedTipForce(bending_stiffness=0.0256, foundation_modulus=modulus, length=0.1, force=0.1)
    assert exact_static(case.scene, case.length).tip_deflection == pytest.approx(case.tip_deflection, rel=1e-12)


def test_bench_value():
    """The value of case S, known to twelve digits."""
    case = ClampedTipForce(bending_stiffness=0.0256, foundation_modulus=520.0, length=0.1, force=0.1)
    assert case.tip_deflection == pytest.approx(1.12358089445e-3, rel=5e-12)


def test_without_foundation_a_cantilever():
    case = ClampedTipForce(bending_stiffness=2.0, foundation_modulus=0.0, length=3.0, force=4.0)
    assert case.tip_deflection == pytest.approx(4.0 * 27.0 / 6.0, rel=1e-15)


def test_infinite_beam():
    case = InfiniteBeam(bending_stiffness=0.02, foundation_modulus=2e4, force=0.4)
    length = case.scene.needle.length
    rest = exact_static(case.scene, length)
    y = np.linspace(0.0, 0.3, 31)
    assert rest.deflection(y) == pytest.approx(case.deflection(-y), rel=1e-11, abs=1e-16)
    assert rest.hub_force == pytest.approx(0.2, rel=1e-12)


def test_semi_infinite_beam():
    case = SemiInfiniteBeam(bending_stiffness=0.02, foundation_modulus=2e4, force=0.4)
    length = case.scene.needle.length
    rest = exact_static(case.scene, length)
    x = np.linspace(0.0, 0.3, 31)
    assert rest.deflection(length - x) == pytest.approx(case.deflection(x), rel=1e-10, abs=1e-15)
    assert rest.tip_deflection == pytest.approx(case.tip_deflection, rel=1e-12)


def test_two_half_beams_make_a_whole_one():
    """Keeping the end slope at zero halves the deflection under a force at the end."""
    whole = InfiniteBeam(bending_stiffness=0.02, foundation_modulus=2e4, force=1.0)
    half = SemiInfiniteBeam(bending_stiffness=0.02, foundation_modulus=2e4, force=0.5)
    assert whole.deflection(0.0) == pytest.approx(0.5 * half.tip_deflection, rel=1e-15)


def test_a_tip_spring_joins_the_needle_s_own_stiffness():
    scene = scene_of("hub", held(0.1), layers=(), tissue={"kind": "tip-spring", "tip_stiffness": 50.0})
    rest = exact_static(scene, 0.1)
    assert rest.tip_deflection == pytest.approx(0.1 / (3.0 * STIFFNESS / LENGTH**3 + 50.0), rel=1e-12)
    assert rest.hub_force + rest.tissue_force + rest.tip_force == pytest.approx(0.0, abs=1e-13)


def test_a_free_hub_is_refused():
    scene = scene_of("hub", held(0.1), support={"hub_rotation": "free", "hub_rotational_inertia": 1e-6})
    with pytest.raises(SceneError, match=r"support\.hub_rotation: the exact solution clamps the hub"):
        exact_static(scene, 0.1)
