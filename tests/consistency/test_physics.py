"""Sign-change depths, scaling laws, reversal, and what the automatic analysis may leave out."""

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_needle import FiniteElementNeedle, run_scene, simulate, solve_static
from fem_needle.exact import exact_static
from fem_needle.scene import Insertion, LateralLoad, Layer, Needle, Scene, Sinusoid, Table, TipLoad
from tests.consistency.scenes import GEL, PUSH, held, moving, profile, relative, scene_of

TUBE = Needle(length=0.2, bending_stiffness=0.01572, mass_per_length=0.004)


@pytest.mark.parametrize(
    ("modulus", "depth"), [(2e3, 145.72), (5e3, 92.30), (1e4, 68.67), (2e4, 52.14), (5e4, 36.90), (5e4, 165.7)]
)
def test_depth_at_which_a_force_at_the_skin_turns_the_tip_round(modulus, depth):
    layers = (Layer(foundation_modulus=modulus),)
    plant = FiniteElementNeedle(
        scene_of("hub", held(0.1), layers, [LateralLoad(position=0.0, force=1.0)], needle=TUBE), elements=40
    )
    root = brentq(lambda z: solve_static(plant, depth=z).tip_deflection, (depth - 3) * 1e-3, (depth + 3) * 1e-3)
    assert root * 1e3 == pytest.approx(depth, abs=0.1)


def scaled(scene: Scene, length: float = 1.0, force: float = 1.0, time: float = 1.0) -> Scene:
    """The same scene in other units of length, force and time."""
    needle = scene.needle
    layers = [
        Layer(
            start=layer.start * length,
            end=None if layer.end is None else layer.end * length,
            foundation_modulus=layer.foundation_modulus * force / length**2,
            damping=layer.damping * force * time / length**2,
        )
        for layer in scene.tissue.layers
    ]
    loads = []
    for load in scene.loads:
        wave = load.force
        if isinstance(wave, Sinusoid):
            wave = Sinusoid(
                mean=wave.mean * force, amplitude=wave.amplitude * force, frequency=wave.frequency / time, phase=wave.phase
            )
        else:
            wave = wave * force
        loads.append(
            load.model_copy(update={"force": wave} | ({"position": load.position * length} if load.kind == "lateral" else {}))
        )
    insertion = scene.insertion
    return scene_of(
        "hub",
        moving(insertion.speed * length / time, insertion.initial_depth * length, insertion.final_depth * length),
        layers,
        loads,
        needle=Needle(
            length=needle.length * length,
            bending_stiffness=needle.bending_stiffness * force * length**2,
            mass_per_length=needle.mass_per_length * force * time**2 / length**2,
        ),
        duration=scene.run.duration * time,
    )


LAW = scene_of(
    "hub",
    moving(2.0, 0.08, 0.1),
    (Layer(start=0.0, end=0.09, foundation_modulus=5e3, damping=10.0), Layer(start=0.09, foundation_modulus=2e4)),
    [TipLoad(force=Sinusoid(mean=0.1, amplitude=0.05, frequency=80.0)), LateralLoad(position=-0.0123, force=0.2)],
    duration=0.01,
)


@pytest.mark.parametrize("analysis", ["dynamic", "static"])
@pytest.mark.parametrize(("length", "force", "time"), [(0.5, 1.0, 1.0), (1.0, 40.0, 1.0), (1.0, 1.0, 8.0), (0.25, 3.0, 0.5)])
def test_units_do_not_matter(length, force, time, analysis):
    if analysis == "static" and length == 1.0 and force == 1.0:
        pytest.skip("equilibria know no time")
    original = simulate(FiniteElementNeedle(LAW, elements=6), time_step=1e-4, analysis=analysis, output_step=1e-3)
    other = scaled(LAW, length, force, time)
    found = simulate(FiniteElementNeedle(other, elements=6), time_step=1e-4 * time, analysis=analysis, output_step=1e-3 * time)
    assert relative(found.tip_deflection / length, original.tip_deflection) < 1e-8
    assert relative(found.push_force / force, original.push_force) < 1e-6
    assert relative(found.boundary_energy / (force * length), original.boundary_energy) < 1e-6


def test_stiffer_tissue_with_a_tip_force_and_with_a_bevel():
    """On a long foundation the tip goes as k^(-3/4) under a force and as k^(1/4) under the bevel law."""
    moduli = 1e6, 2e6

    def ratio(load):
        layers = [(Layer(foundation_modulus=modulus),) for modulus in moduli]
        plants = [FiniteElementNeedle(scene_of("entry", held(0.2), layer, [load]), elements=64) for layer in layers]
        soft, stiff = (solve_static(plant, depth=0.2).tip_deflection for plant in plants)
        return np.log2(stiff / soft)

    assert ratio(TipLoad(force=0.1)) == pytest.approx(-0.75, abs=1e-5)
    assert ratio(TipLoad(bevel_coefficient=1e-6)) == pytest.approx(0.25, abs=1e-5)


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_retract_and_insert_again(kind):
    """Elastic and slow, nothing is remembered: equal depths have equal tips, equal energies and equal push with opposite work."""
    insertion = profile([0.0, 1.0, 2.0, 3.0], [0.05, 0.12, 0.04, 0.12])
    layers = (Layer(start=0.0, end=0.08, foundation_modulus=5e3), Layer(start=0.08, foundation_modulus=2e4))
    run = simulate(
        FiniteElementNeedle(scene_of(kind, insertion, layers, duration=3.0), elements=8),
        time_step=0.02,
        analysis="static",
        output_step=0.05,
    )
    first, second = np.argmin(np.abs(run.time - 1.0)), np.argmin(np.abs(run.time - 3.0))
    assert run.depth[first] == pytest.approx(run.depth[second], abs=1e-12)
    assert run.tip_deflection[first] == pytest.approx(run.tip_deflection[second], rel=1e-9)
    assert run.boundary_energy[first] == pytest.approx(run.boundary_energy[second], rel=1e-6)
    exact = [exact_static(run.scene, depth).tip_deflection for depth in run.depth]
    assert relative(run.tip_deflection, np.array(exact)) < 1e-4


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_mirrored_scene_has_mirrored_deflections(kind):
    one, other = (
        simulate(
            FiniteElementNeedle(scene_of(kind, moving(2.0, 0.08, 0.1), loads=[TipLoad(force=force)], duration=0.01), elements=6),
            time_step=1e-4,
        )
        for force in (0.1, -0.1)
    )
    assert other.tip_deflection == pytest.approx(-one.tip_deflection, rel=1e-12)
    assert other.push_force == pytest.approx(one.push_force, rel=1e-9)


def test_auto_leaves_out_inertia_only_where_the_tip_does_not_notice():
    """The bound that is promised covers the difference to the run with inertia."""
    scene = scene_of("entry", moving(0.2, 0.05, 0.1), duration=0.25)
    automatic = run_scene(scene, tolerance=1e-2, output_step=0.01)
    assert automatic.summary["analysis"] == "quasi-static"
    assert "inertia" in [skipped["term"] for skipped in automatic.summary["skipped"]]
    dynamic = run_scene(scene, analysis="dynamic", elements=automatic.summary["elements"], time_step=2e-4, output_step=0.01)
    difference = relative(automatic.tip_deflection, dynamic.tip_deflection)
    assert 1e-9 < difference < 1e-2


FAST = {
    "speed": scene_of("entry", moving(3.0, 0.05, 0.15), duration=1 / 30),
    "load": scene_of("entry", held(0.15), loads=[TipLoad(force=Sinusoid(amplitude=0.1, frequency=30.0))], duration=0.1),
    "jump of speed": scene_of("entry", profile([0.0, 0.1, 0.2], [0.1, 0.1, 0.15]), duration=0.2),
    "jerked hub": scene_of(
        "hub", held(0.1), support={"hub_deflection": Table(time=[0.0, 0.002], value=[0.0, 1e-3])}, duration=0.01
    ),
}


@pytest.mark.parametrize("name", FAST)
def test_fast_scenes_are_dynamic(name):
    found = run_scene(FAST[name], tolerance=1e-5, elements=4, time_step=1e-3, output_step=1e-2)
    assert found.summary["analysis"] == "dynamic"


def test_a_released_needle_is_dynamic():
    scene = scene_of("entry", held(0.1), loads=[], initial={"shape": "straight"}, duration=0.01)
    assert run_scene(scene, elements=4, time_step=1e-3).summary["analysis"] == "dynamic"


def test_refinement_meets_the_tolerance():
    """Automatic settings against a run with steps and elements far finer."""
    gentle = Insertion(kind="profile", depth=Sinusoid(mean=0.1, amplitude=-0.02, frequency=10.0, phase=np.pi / 2))
    scene = scene_of("entry", gentle, GEL, PUSH, duration=0.05)
    automatic = run_scene(scene, tolerance=1e-4, analysis="dynamic", output_step=0.005)
    fine = run_scene(scene, analysis="dynamic", elements=32, time_step=2.5e-5, output_step=0.005)
    error = relative(automatic.tip_deflection, fine.tip_deflection)
    assert error < 1e-4
    assert error < automatic.summary["error_estimate"]
