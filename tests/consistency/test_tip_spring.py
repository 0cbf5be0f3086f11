"""A spring that travels with the tip, in place of tissue along the needle: closed forms."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, simulate, solve_static
from fem_needle.scene import Model, Sinusoid, TipLoad, Tissue
from tests.consistency.scenes import LENGTH, MASS, STIFFNESS, held, moving, rates, scene_of

FORCE, SPRING = 0.1, 20.0
DEPTHS = (0.02, 0.1, LENGTH)


def spring_scene(kind, insertion, stiffness=SPRING, **parts):
    return scene_of(kind, insertion, **({"loads": [TipLoad(force=FORCE)]} | parts)).with_values(
        {"tissue": {"kind": "tip-spring", "tip_stiffness": stiffness}}
    )


@pytest.mark.parametrize("stiffness", [0.0, SPRING, 1e5])
@pytest.mark.parametrize("depth", DEPTHS)
def test_statics_under_entry(depth, stiffness):
    """Cantilever and spring in parallel: F / (k_t + 3 EI / z^3)."""
    rest = solve_static(FiniteElementNeedle(spring_scene("entry", held(depth), stiffness), elements=2), depth=depth)
    assert rest.tip_deflection == pytest.approx(FORCE / (stiffness + 3.0 * STIFFNESS / depth**3), rel=1e-9)


@pytest.mark.parametrize("depth", DEPTHS)
def test_statics_under_hub_do_not_depend_on_the_depth(depth):
    rest = solve_static(FiniteElementNeedle(spring_scene("hub", held(depth)), elements=2), depth=depth)
    assert rest.tip_deflection == pytest.approx(FORCE / (SPRING + 3.0 * STIFFNESS / LENGTH**3), rel=1e-9)


def test_the_axial_force_of_equilibria():
    """A = d/dz of 1/2 F^2 / (k_t + 3 EI / z^3) = 9/2 EI w^2 / z^4 under entry: the push is -A."""
    scene = spring_scene("entry", moving(0.01, 0.1, 0.11))
    run = simulate(FiniteElementNeedle(scene, elements=4), time_step=0.05, analysis="static", output_step=0.1)
    deflection = FORCE / (SPRING + 3.0 * STIFFNESS / run.depth**3)
    assert run.push_force == pytest.approx(-4.5 * STIFFNESS * deflection**2 / run.depth**4, rel=1e-8)
    assert run.tissue_energy == pytest.approx(0.5 * SPRING * deflection**2, rel=1e-8)
    assert run.tissue_force == pytest.approx(-SPRING * deflection, rel=1e-8)
    assert run.summary["relative_energy_residual"] < 1e-9


def test_the_frequency_of_a_light_needle_on_its_spring():
    """A nearly rigid rod on a hub that turns: k_t l^2 against I + rho A l^3 / 3."""
    support = {"hub_rotation": "free", "hub_rotational_inertia": 1e-4}
    needle = {"length": LENGTH, "bending_stiffness": 1e3, "mass_per_length": MASS}
    initial = {"shape": "straight"}
    scene = spring_scene("hub", held(0.1), support=support, needle=needle, initial=initial, duration=0.1)
    run = simulate(FiniteElementNeedle(scene, elements=4), time_step=2e-4, analysis="dynamic", output_step=1e-3)
    rate = np.sqrt(SPRING * LENGTH**2 / (1e-4 + MASS * LENGTH**3 / 3.0))
    assert run.tip_deflection == pytest.approx(FORCE / SPRING * (1.0 - np.cos(rate * run.time)), abs=2e-3 * FORCE / SPRING)


@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
def test_ledger(kinematics):
    loads = [TipLoad(force=Sinusoid(mean=0.1, amplitude=0.05, frequency=30.0, phase=0.5))]
    scene = spring_scene("entry", moving(2.0, 0.08, 0.1), model=Model(kinematics=kinematics), loads=loads, duration=0.01)
    found = [
        simulate(FiniteElementNeedle(scene, elements=8), time_step=step, analysis="dynamic", output_step=1e-3)
        for step in (4e-5, 2e-5, 1e-5)
    ]
    residuals = [run.summary["relative_energy_residual"] for run in found]
    assert residuals[-1] < 1e-6
    assert min(rates(residuals, floor=1e-8), default=9.0) > 1.0


def test_what_a_tip_spring_does_not_have():
    for keys in ({"rest_line": "cut-path"}, {"layers": [{"foundation_modulus": 1.0}]}, {"tip_stiffness": -1.0}):
        with pytest.raises(ValueError, match=next(iter(keys))):
            Tissue(**({"kind": "tip-spring", "tip_stiffness": 1.0} | keys))
    with pytest.raises(ValueError, match=r"tip_stiffness: .*required"):
        Tissue(kind="tip-spring")
