"""A hub that turns with the needle: rigid and static limits, the closed form in tissue, energy."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from fem_needle import FiniteElementNeedle, simulate, solve_static
from fem_needle.scene import Layer, Needle, Sinusoid, TipLoad
from tests.consistency.scenes import GEL, LAYERS, LENGTH, MASS, STIFFNESS, held, moving, rates, scene_of

INERTIA = 2e-4


def free(torque=0.0, inertia=INERTIA, **keys):
    return {"hub_rotation": "free", "hub_torque": torque, "hub_rotational_inertia": inertia, **keys}


def run_of(scene, time_step, *, output_step=1e-3, elements=8):
    plant = FiniteElementNeedle(scene, elements=elements)
    return simulate(plant, time_step=time_step, analysis="dynamic", output_step=output_step)


def test_a_stiff_needle_turns_as_a_rigid_body():
    """(I + rho A l^3 / 3) theta'' = torque."""
    needle = Needle(length=LENGTH, bending_stiffness=1e4, mass_per_length=MASS)
    scene = scene_of("hub", held(0.1), (), (), support=free(0.01), needle=needle, initial={"shape": "straight"}, duration=0.05)
    run = run_of(scene, 1e-4)
    angle = 0.01 * run.time**2 / (2.0 * (INERTIA + MASS * LENGTH**3 / 3.0))
    assert run.hub_angle == pytest.approx(angle, rel=1e-5, abs=1e-9)
    assert run.tip_deflection == pytest.approx(LENGTH * angle, rel=1e-5, abs=1e-8)


def test_a_heavy_hub_does_not_feel_the_needle():
    """I theta'' = torque as printed in the thesis: needle and tissue are nothing to an inertia of 1 kg m^2."""
    scene = scene_of("hub", held(0.1), GEL, (), support=free(0.5, 1.0), initial={"shape": "straight"}, duration=0.05)
    run = run_of(scene, 2e-4)
    assert run.hub_angle == pytest.approx(0.5 * run.time**2 / 2.0, rel=2e-3)


def test_under_entry_the_hub_turns_alone():
    """I theta'' = torque, exactly, and the needle does not notice."""
    torque = Sinusoid(amplitude=0.01, frequency=20.0)
    scene = scene_of("entry", held(0.1), GEL, support=free(torque), duration=0.05)
    run, alone = run_of(scene, 5e-4), run_of(scene_of("entry", held(0.1), GEL, duration=0.05), 5e-4)
    rate = 2.0 * np.pi * 20.0
    angle = 0.01 / INERTIA * (run.time / rate - np.sin(rate * run.time) / rate**2)
    assert run.hub_angle == pytest.approx(angle, rel=1e-7, abs=1e-12)
    assert np.array_equal(run.tip_deflection, alone.tip_deflection)


def test_a_fixed_hub_shows_the_angle_that_was_given():
    scene = scene_of("hub", held(0.1), GEL, support={"hub_angle": Sinusoid(amplitude=0.01, frequency=20.0)}, duration=0.01)
    run = run_of(scene, 1e-4)
    assert run.hub_angle == pytest.approx(0.01 * np.sin(40.0 * np.pi * run.time), abs=1e-12)


def test_torque_on_a_needle_wholly_in_tissue():
    """A beam on a foundation, pinned and turned at one end, free at the other: four exponentials and their end conditions."""
    modulus, torque, force = 5e4, 0.02, 0.1
    layers = (Layer(start=0.0, foundation_modulus=modulus),)
    scene = scene_of("hub", held(LENGTH), layers, [TipLoad(force=force)], support=free(torque))
    rest = solve_static(FiniteElementNeedle(scene, elements=64), depth=LENGTH)
    beta = (modulus / (4.0 * STIFFNESS)) ** 0.25
    roots = beta * np.array([-1 + 1j, -1 - 1j, 1 + 1j, 1 - 1j])
    start, end = np.ones(4), np.exp(roots * LENGTH)
    conditions = np.array([start, roots**2 * start, roots**2 * end, roots**3 * end])
    amplitudes = np.linalg.solve(conditions, [0.0, -torque / STIFFNESS, 0.0, -force / STIFFNESS])
    stations = np.linspace(0.0, LENGTH, 21)
    exact = (np.exp(np.outer(stations, roots)) @ amplitudes).real
    assert np.max(np.abs(rest.deflection(stations) - exact)) < 1e-6 * np.max(np.abs(exact))
    assert exact[1] > 0.0  # a positive torque turns the needle to positive deflections


def test_torque_in_layers_against_a_boundary_value_problem():
    """Hub 30 mm before layers with a gap, displaced by 1 mm, against collocation by other hands."""
    torque, depth = 0.02, 0.17
    scene = scene_of("hub", held(depth), LAYERS, support=free(torque, hub_deflection=1e-3))
    rest = solve_static(FiniteElementNeedle(scene, elements=64), depth=depth)

    borders = np.array([0.0, 0.03, 0.08, 0.11, 0.13, 0.18, LENGTH])  # hub, skin and layers along the needle
    moduli = (0.0, 5e3, 2e4, 0.0, 5e4, 0.0)
    # All six pieces at once on 0..1, each with w, w', w'', w''': the ends are where pieces meet.
    lengths = np.diff(borders)

    def slope(_, y):
        w = y.reshape(6, 4, -1)
        moved = np.concatenate([w[:, 1:], -(np.array(moduli) / STIFFNESS)[:, None, None] * w[:, :1]], axis=1)
        return (moved * lengths[:, None, None]).reshape(24, -1)

    def ends(left, right):
        first, last = left.reshape(6, 4), right.reshape(6, 4)
        hub = [first[0, 0] - 1e-3, first[0, 2] + torque / STIFFNESS]
        return np.concatenate([hub, (last[:-1] - first[1:]).ravel(), [last[-1, 2], last[-1, 3] + 0.1 / STIFFNESS]])

    found = solve_bvp(slope, ends, np.linspace(0.0, 1.0, 11), np.zeros((24, 11)), tol=1e-9)
    assert found.status == 0
    tips = found.y[:, -1].reshape(6, 4)[:, 0]
    assert rest.deflection(borders[1:]) == pytest.approx(tips, rel=1e-5, abs=1e-9)


def test_the_torque_bends_the_same_way_at_rest_and_in_slow_motion():
    """Damped until it rests: statics and dynamics agree."""
    layers = (Layer(start=0.0, foundation_modulus=5e4, damping=500.0),)
    parts = {"initial": {"shape": "straight"}, "numerics": {"spectral_radius": 0.0}}
    scene = scene_of("hub", held(0.15), layers, support=free(0.02, 1e-6), duration=1.0, **parts)
    run = run_of(scene, 2e-3, output_step=0.1)
    rest = solve_static(FiniteElementNeedle(scene, elements=8), depth=0.15)
    assert run.tip_deflection[-1] == pytest.approx(rest.tip_deflection, rel=1e-6)


@pytest.mark.parametrize("insertion", [held(0.1), moving(2.0, 0.08, 0.1)], ids=["held", "moving"])
def test_ledger_under_a_torque(insertion):
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=5.0),)
    scene = scene_of("hub", insertion, layers, support=free(Sinusoid(amplitude=0.05, frequency=60.0), 1e-5), duration=0.01)
    found = [run_of(scene, step, elements=8) for step in (1e-4, 5e-5)]
    residuals = [run.summary["relative_energy_residual"] for run in found]
    assert residuals[-1] < 1e-6
    assert insertion.kind == "hold" or rates(residuals)[0] > 1.8
    assert abs(found[-1].load_work[-1]) > 0.1 * np.max(found[-1].kinetic_energy)
