"""The exact static solution of scenes: equilibrium, reciprocity, limits, sign change."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from fem_needle.errors import SceneError
from fem_needle.exact import exact_static, tip_compliance
from fem_needle.scene import (
    Guide,
    Insertion,
    LateralLoad,
    Layer,
    Needle,
    Run,
    Scene,
    Sinusoid,
    Support,
    Table,
    TipLoad,
    Tissue,
)

NEEDLE = Needle(length=0.2, bending_stiffness=0.01572, mass_per_length=0.01)
LAYERS = (
    Layer(start=0.0, end=0.02, foundation_modulus=5e3),
    Layer(start=0.02, end=0.05, foundation_modulus=2e4),
    Layer(start=0.06, end=0.09, foundation_modulus=5e4),
)


def scene_of(kind="hub", layers=LAYERS, loads=(), guides=(), factor=1.0, **support):
    return Scene(
        needle=NEEDLE,
        support=Support(kind=kind, guides=guides, **support),
        tissue=Tissue(layers=layers, stiffness_factor=factor),
        insertion=Insertion(kind="hold", initial_depth=0.1),
        loads=loads,
        run=Run(duration=1.0),
    )


FULL = scene_of(
    loads=[
        TipLoad(force=0.1),
        LateralLoad(position=-0.01, force=-0.4),
        LateralLoad(position=-0.02, force=0.2),
    ],
    guides=[Guide(position=-0.03), Guide(position=-0.02, stiffness=2e3)],
    hub_deflection=1e-3,
    hub_angle=0.01,
)


@pytest.mark.parametrize("scene", [FULL, scene_of("entry", loads=[TipLoad(force=0.1)]), scene_of(loads=[TipLoad(force=0.2)])])
@pytest.mark.parametrize("depth", [1e-4, 0.03, 0.055, 0.1, 0.15])
def test_forces_and_moments_balance(scene, depth):
    rest = exact_static(scene, depth)
    clamp = -NEEDLE.length if scene.support.kind == "hub" else -depth  # measured from the tip
    tissue_moment = 0.0
    for layer in scene.tissue.layers:
        ends = np.array([layer.start, min(layer.end, depth)]) - depth
        if ends[1] > ends[0]:
            tissue_moment -= quad(
                lambda x, k=layer.foundation_modulus: k * (x - clamp) * rest.deflection(NEEDLE.length + x),
                *ends,
                epsabs=1e-14,
                epsrel=1e-12,
            )[0]
    points = [(load.position - depth - clamp, load.force) for load in scene.loads if load.kind == "lateral"]
    points += [
        (guide.position - depth - clamp, force) for guide, force in zip(scene.support.guides, rest.guide_forces, strict=True)
    ]
    forces = [rest.tip_force, rest.tissue_force, rest.hub_force, *(force for _, force in points)]
    assert sum(forces) == pytest.approx(0.0, abs=1e-12 * max(map(abs, forces)))
    moments = [
        rest.hub_moment,
        tissue_moment,
        -clamp * rest.tip_force,
        *(arm * force for arm, force in points),
    ]
    assert sum(moments) == pytest.approx(0.0, abs=1e-10 * max(map(abs, moments)))


def test_guides_hold():
    rest = exact_static(FULL, 0.1)
    pin, spring = (NEEDLE.length - 0.1 + guide.position for guide in FULL.support.guides)
    assert abs(rest.deflection(pin)) < 1e-16
    assert rest.guide_forces[1] == pytest.approx(-2e3 * rest.deflection(spring), rel=1e-10)


def test_clamp_and_tip():
    rest = exact_static(FULL, 0.1)
    assert rest.deflection(0.0) == pytest.approx(1e-3, rel=1e-14)
    assert rest.slope(0.0) == pytest.approx(0.01, rel=1e-14)
    assert abs(rest.bending_moment(0.2)) < 1e-12 * np.max(np.abs(rest.bending_moment(np.linspace(0, 0.2, 50))))
    assert rest.shear_force(0.2) == pytest.approx(-0.1, rel=1e-10)


def test_section_forces_are_derivatives():
    rest = exact_static(FULL, 0.1)
    s, step = np.array([0.03, 0.085, 0.11, 0.14, 0.17, 0.195]), 1e-4
    for upper, lower, factor in [
        (rest.slope, rest.deflection, 1.0),
        (rest.bending_moment, rest.slope, NEEDLE.bending_stiffness),
        (rest.shear_force, rest.bending_moment, 1.0),
    ]:
        central = (8.0 * (lower(s + step) - lower(s - step)) - (lower(s + 2 * step) - lower(s - 2 * step))) / (12 * step)
        scale = np.max(np.abs(upper(s)))
        assert factor * central == pytest.approx(upper(s), rel=1e-9, abs=1e-9 * scale)


@pytest.mark.parametrize("depth", [0.0, 0.055, 0.1])
def test_reciprocity(depth):
    """The tip moves under a force at the skin as the skin under a force at the tip."""
    guides = [Guide(position=-0.03), Guide(position=-0.05, stiffness=500.0)]
    at_skin = scene_of(loads=[LateralLoad(position=0.0, force=1.0)], guides=guides)
    at_tip = scene_of(loads=[TipLoad(force=1.0)], guides=guides)
    answer = exact_static(at_tip, depth).deflection(NEEDLE.length - depth)
    assert exact_static(at_skin, depth).tip_deflection == pytest.approx(float(answer), rel=1e-11)


def test_stiff_spring_tends_to_pin():
    def tip(stiffness):
        guides = [Guide(position=-0.03, stiffness=stiffness)]
        return exact_static(scene_of(loads=[TipLoad(force=1.0)], guides=guides), 0.1).tip_deflection

    pin = tip("rigid")
    gaps = [abs(tip(stiffness) - pin) for stiffness in (1e5, 1e6, 1e7)]
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.1)
    assert gaps[1] / gaps[2] == pytest.approx(10.0, rel=0.1)
    assert tip(1e12) == pytest.approx(pin, rel=1e-8)


def test_no_tissue_moves_with_the_hub():
    rest = exact_static(scene_of(layers=(), hub_deflection=2e-3, hub_angle=0.05), 0.1)
    s = np.linspace(0.0, 0.2, 11)
    assert rest.deflection(s) == pytest.approx(2e-3 + 0.05 * s, rel=1e-13)
    assert rest.hub_force == pytest.approx(0.0, abs=1e-14)


def test_swelling_multiplies_every_layer_and_the_bevel_force():
    factor = Sinusoid(mean=1.5, amplitude=0.5, frequency=2.0)
    loads = [TipLoad(bevel_coefficient=1e-5)]
    swollen = exact_static(scene_of(loads=loads, factor=factor), 0.08, time=0.125)  # m = 2
    layers = [layer.model_copy(update={"foundation_modulus": 2.0 * layer.foundation_modulus}) for layer in LAYERS]
    plain = exact_static(scene_of(layers=layers, loads=loads), 0.08)
    assert swollen.tip_force == pytest.approx(1.0, rel=1e-14)
    assert swollen.tip_deflection == pytest.approx(plain.tip_deflection, rel=1e-13)


@pytest.mark.parametrize(
    ("depth", "modulus"),
    [(0.0, 5e3), (0.0199, 5e3), (0.02, 2e4), (0.05, 0.0), (0.06, 5e4), (0.09, 0.0), (0.1, 0.0)],
)
def test_bevel_law_takes_the_deeper_layer(depth, modulus):
    assert exact_static(scene_of(loads=[TipLoad(bevel_coefficient=1e-5)]), depth).tip_force == pytest.approx(1e-5 * modulus)


def test_loads_at_their_time():
    tip = Table(time=[0.0, 2.0], value=[0.0, 1.0])
    varying = scene_of(loads=[TipLoad(force=tip)], hub_deflection=Table(time=[0.0, 2.0], value=[0.0, 1e-3]))
    fixed = scene_of(loads=[TipLoad(force=0.25)], hub_deflection=2.5e-4)
    assert exact_static(varying, 0.1, time=0.5).tip_deflection == pytest.approx(
        exact_static(fixed, 0.1).tip_deflection, rel=1e-13
    )


def test_tip_compliance_ignores_other_loads():
    alone = scene_of(loads=[TipLoad(force=1.0)], guides=FULL.support.guides)
    assert tip_compliance(FULL, 0.1) == pytest.approx(exact_static(alone, 0.1).tip_deflection, rel=1e-13)


def test_entry_is_zero_outside():
    rest = exact_static(scene_of("entry", loads=[TipLoad(force=0.1)]), 0.05)
    assert np.all(rest.deflection(np.linspace(0.0, 0.1499, 7)) == 0.0)
    assert rest.deflection(0.16) > 0.0
    assert exact_static(scene_of("entry", loads=[TipLoad(force=0.1)]), 0.0).tip_deflection == 0.0


@pytest.mark.parametrize("depth", [-1e-6, 0.2001])
def test_depth_off_the_needle_is_refused(depth):
    with pytest.raises(SceneError, match="depth"):
        exact_static(scene_of(), depth)


def test_hub_beyond_a_guide_is_refused():
    with pytest.raises(SceneError, match="guide"):
        exact_static(FULL, 0.175)


@pytest.mark.parametrize(
    ("modulus", "between", "expected"),
    [
        (2e3, (0.10, 0.19), 0.14572),
        (5e3, (0.05, 0.15), 0.09230),
        (1e4, (0.04, 0.12), 0.06867),
        (2e4, (0.03, 0.10), 0.05214),
        (5e4, (0.02, 0.10), 0.03690),
        (5e4, (0.10, 0.19), 0.1657),
    ],
)
def test_depth_of_the_sign_change(modulus, between, expected):
    """Beyond this depth a force at the skin moves the tip against it."""
    scene = scene_of(layers=[Layer(start=0.0, foundation_modulus=modulus)], loads=[LateralLoad(position=0.0, force=1.0)])
    found = brentq(lambda depth: exact_static(scene, depth).tip_deflection, *between, xtol=1e-12)
    assert found == pytest.approx(expected, abs=1e-4)
