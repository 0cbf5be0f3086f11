"""Equilibria on fine meshes: the error of the tip must not grow with refinement (docs/robustness.md says why it can)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem_needle import load_scene, run_scene
from fem_needle.exact import ReleaseFromTipForce, exact_static
from fem_needle.needle import FiniteElementNeedle
from fem_needle.scene import Guide, LateralLoad
from fem_needle.statics import solve_static
from tests.consistency.scenes import LAYERS, held, scene_of

DEPTH = 0.1
LATERAL = (LateralLoad(position=-0.02, force=0.3), LateralLoad(position=-0.005, force=-0.2))
GUIDED = {"guides": (Guide(position=-0.03, stiffness=2e3), Guide(position=-0.01, stiffness="rigid"))}
SCENES = {
    "benchmark S": load_scene("bench-s"),
    "layers, hub, guides": scene_of("hub", held(DEPTH), layers=LAYERS, loads=LATERAL, support=GUIDED),
    "moved hub": scene_of("hub", held(DEPTH), layers=LAYERS, support={"hub_deflection": 0.002, "hub_angle": 0.01}),
    "tip spring": scene_of("entry", held(DEPTH), layers=(), tissue={"kind": "tip-spring", "tip_stiffness": 50.0}),
}


def crowded(smallest: float) -> np.ndarray:
    """Return 200 equal elements with more between two of their nodes, growing from a size by a factor of two."""
    crowd = 0.1 + smallest * (2.0 ** np.arange(1, 40) - 1.0)
    return np.unique(np.concatenate([np.linspace(0.0, 0.2, 201), crowd[crowd < 0.1009]]))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("elements", [1000, 10_000])
def test_a_fine_mesh_keeps_its_digits(name, elements):
    scene = SCENES[name]
    rest, exact = solve_static(FiniteElementNeedle(scene, elements=elements), depth=DEPTH), exact_static(scene, DEPTH)
    assert rest.tip_deflection == pytest.approx(exact.tip_deflection, rel=1e-9)
    assert rest.hub_force == pytest.approx(exact.hub_force, rel=1e-8)
    assert rest.hub_moment == pytest.approx(exact.hub_moment, rel=1e-8)


def test_a_run_through_equilibria_keeps_them_too():
    run = run_scene(load_scene("bench-s"), elements=10_000, output_step=1.0)
    assert run.tip_deflection == pytest.approx(exact_static(load_scene("bench-s"), DEPTH).tip_deflection, rel=1e-9)
    assert run.summary["error_estimate"] < 1e-9


@pytest.mark.parametrize("degree", [3, 4])
def test_tiny_elements_beside_large_ones(degree):
    scene = SCENES["layers, hub, guides"]
    rest = solve_static(FiniteElementNeedle(scene, mesh=crowded(1e-9), degree=degree), depth=DEPTH)
    assert rest.tip_deflection == pytest.approx(exact_static(scene, DEPTH).tip_deflection, rel=1e-6 if degree == 3 else 1e-9)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("degree", [3, 4])
def test_flexibility_and_stiffness_are_the_same_equations(name, degree):
    plant = FiniteElementNeedle(SCENES[name], elements=7, degree=degree)
    operators = plant.operators(DEPTH, 0.0)
    stiff = replace(operators, beam=None)
    right = np.random.default_rng(1).normal(size=(plant.size - plant.prescribed, 2))
    answers, support = operators.stiffness_factorization.solve_supported(right)
    expected, expected_support = stiff.stiffness_factorization.solve_supported(right)
    assert answers == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.max(np.abs(expected)))
    assert support == pytest.approx(expected_support, rel=1e-7, abs=1e-7 * np.max(np.abs(expected_support)))


@pytest.mark.parametrize("elements", [40, 10_000])
def test_the_bending_energy_keeps_its_digits(elements):
    """At rest the energies are half the work of the load: w F / 2."""
    scene = load_scene("bench-s")
    run = run_scene(scene, elements=elements, output_step=1.0)
    energy = run.bending_energy[0] + run.tissue_energy[0]
    assert energy == pytest.approx(0.5 * 0.1 * run.tip_deflection[0], rel=1e-9)


def test_a_held_vibration_keeps_its_phase_on_a_fine_mesh():
    """300 elements, no power of two: the entries of K are rounded; a thousand radians would show 1e-4 of it."""
    scene = load_scene("bench-d").with_values({"run.duration": 1.0, "numerics.output_step": 0.01})
    run = run_scene(scene, elements=300)
    exact = ReleaseFromTipForce(scene).tip_deflection(run.time)
    assert np.max(np.abs(run.tip_deflection - exact)) / np.max(np.abs(exact)) < 1e-6


@pytest.mark.parametrize("analysis", ["dynamic", "quasi-static"])
def test_time_steps_on_a_fine_mesh_keep_their_digits(analysis):
    """The element stiffness 12 EI / h^3 would cost 3e-3 of the tip on 1000 elements."""
    scene = load_scene("bench-m2").with_values({"run.duration": 0.05, "tissue.layers.0.damping": 5.0})
    runs = [run_scene(scene, elements=e, analysis=analysis, time_step=1e-3, output_step=0.01) for e in (60, 1000)]
    coarse, fine = (run.tip_deflection for run in runs)
    assert np.max(np.abs(coarse - fine)) < 1e-8 * np.max(np.abs(fine))
    assert runs[1].summary["warnings"] == []


def test_cosines_on_a_fine_mesh_keep_theirs():
    warned = run_scene(load_scene("bench-d"), elements=128, tolerance=5e-7).summary["warnings"]
    assert warned == ["the tolerance 5e-07 was not reached with elements = 128: see error_estimate"]


def test_equilibria_on_a_fine_mesh_keep_theirs():
    assert run_scene(load_scene("bench-s"), elements=1000, output_step=1.0).summary["warnings"] == []
