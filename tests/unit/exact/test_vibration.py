"""Frequencies and the release from a tip force."""

import mpmath as mp
import numpy as np
import pytest

from fem_needle.errors import SceneError
from fem_needle.exact import ReleaseFromTipForce, clamped_free_roots, exact_static, natural_frequencies
from fem_needle.scene import Guide, Initial, Insertion, Layer, Needle, Run, Scene, Support, TipLoad, Tissue

NEEDLE = Needle(length=0.2, bending_stiffness=0.0256, mass_per_length=0.01016)


GEL = (Layer(start=0.0, foundation_modulus=520.0),)


def held(kind, depth, layers=GEL, **parts):
    return Scene(
        needle=NEEDLE,
        support=parts.pop("support", Support(kind=kind)),
        tissue=Tissue(layers=layers),
        insertion=Insertion(kind="hold", initial_depth=depth),
        run=Run(duration=0.1),
        **parts,
    )


def release(depth=0.1, deflection=1e-3, **parts):
    return held("entry", depth, initial=Initial(shape="tip-displaced", tip_deflection=deflection), **parts)


def test_roots_to_machine_precision():
    with mp.workdps(80):
        expected = [
            float(mp.findroot(lambda x: mp.cos(x) + mp.sech(x), (i - mp.mpf("0.5")) * mp.pi + (0.3 if i == 1 else 0)))
            for i in range(1, 31)
        ]
    assert clamped_free_roots(30) == pytest.approx(expected, rel=3e-16)


def test_roots_far_out():
    assert clamped_free_roots(5000)[-1] == pytest.approx(4999.5 * np.pi, rel=1e-15)


def test_static_limit_of_the_modes():
    """Sum of phi_i(L)^2 / (rho A omega_i^2) is the static compliance of the tip."""
    scene = held("entry", 0.1, loads=[TipLoad(force=1.0)])
    omega = natural_frequencies(scene, 0.1, 20000)
    assert np.sum(40.0 / (0.01016 * omega**2)) == pytest.approx(exact_static(scene, 0.1).tip_deflection, rel=1e-13)


def test_hub_in_one_tissue_or_none():
    """The same needle, clamped at the hub, wholly in or out."""
    omega_in = natural_frequencies(held("hub", 0.2), 0.2, 5)
    omega_out = natural_frequencies(held("hub", 0.0), 0.0, 5)
    assert omega_in == pytest.approx(natural_frequencies(held("entry", 0.2), 0.2, 5), rel=1e-14)
    assert omega_in**2 - omega_out**2 == pytest.approx(520.0 / 0.01016, rel=1e-9)


@pytest.mark.parametrize(
    "scene",
    [
        held("hub", 0.1),
        held("entry", 0.1, layers=[Layer(start=0.02, foundation_modulus=520.0)]),
        held("hub", 0.0, support=Support(kind="hub", guides=[Guide(position=-0.03)])),
    ],
)
def test_not_uniform_is_refused(scene):
    with pytest.raises(SceneError, match="uniform"):
        natural_frequencies(scene, scene.insertion.initial_depth, 3)


@pytest.mark.parametrize("modulus", [0.0, 520.0, 1e6])
def test_release_starts_from_the_static_shape(modulus):
    layers = [Layer(start=0.0, foundation_modulus=modulus)]
    case = ReleaseFromTipForce(release(layers=layers))
    assert case.tip_deflection(0.0) == pytest.approx(1e-3, rel=1e-12)
    loaded = held("entry", 0.1, layers=layers, loads=[TipLoad(force=case.force)])
    assert exact_static(loaded, 0.1).tip_deflection == pytest.approx(1e-3, rel=1e-13)


def test_release_is_even_in_time_and_bounded():
    case = ReleaseFromTipForce(release())
    time = np.linspace(0.0, 0.1, 501)
    tip = case.tip_deflection(time)
    assert tip.shape == time.shape
    assert np.max(np.abs(tip[1:])) < tip[0]
    assert np.min(tip) < -0.9 * tip[0]
    assert case.tip_deflection(-time[:7]) == pytest.approx(tip[:7], rel=1e-13)


@pytest.mark.parametrize(
    ("scene", "word"),
    [
        (held("entry", 0.1), "initial.shape"),
        (release(loads=[TipLoad(force=0.1)]), "loads"),
        (release(layers=[Layer(start=0.0, foundation_modulus=520.0, damping=1.0)]), "damping"),
    ],
)
def test_other_cases_are_refused(scene, word):
    with pytest.raises(SceneError, match=word):
        ReleaseFromTipForce(scene)
