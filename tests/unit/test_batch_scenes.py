"""Which scenes the loop over many runs knows, and what stands in a run's row."""

import numpy as np
import pytest

from fem_needle import simulate_many
from fem_needle.batch import columns as at
from fem_needle.batch.rows import row_of
from fem_needle.batch.spectrum import is_uniform
from fem_needle.exact import exact_static
from fem_needle.scene import Initial, LateralLoad, Layer, Sinusoid, Table, TipLoad
from tests.consistency.scenes import GEL, LAYERS, held, moving, profile, scene_of

UNIFORM = scene_of("entry", moving(0.5, 0.04, 0.14), duration=0.2)
TWO = Sinusoid(amplitude=0.1, frequency=20.0)
OTHERS = {
    "hub": scene_of("hub", moving(0.5, 0.04, 0.14), duration=0.2),
    "mesh": UNIFORM.with_value("numerics.mesh", [0.0, 0.1, 0.2]),
    "cut path": UNIFORM.with_value("tissue.rest_line", "cut-path"),
    "swelling": UNIFORM.with_value("tissue.stiffness_factor", {"mean": 1.0, "amplitude": 0.1, "frequency": 1.0}),
    "tip spring": scene_of("entry", held(0.1), (), tissue={"kind": "tip-spring", "tip_stiffness": 50.0}),
    "layers": scene_of("entry", moving(0.5, 0.04, 0.14), LAYERS, duration=0.2),
    "speed that varies": UNIFORM.with_value("insertion.speed", {"time": [0.0, 1.0], "value": [0.5, 0.6]}),
    "profile": scene_of("entry", profile([0.0, 1.0], [0.05, 0.1])),
    "hardly inserted": scene_of("entry", moving(0.5, 1e-4, 0.1), duration=0.1),
    "numerical damping": UNIFORM.with_value("numerics.spectral_radius", 0.5),
    "creep": UNIFORM.with_values({"numerics.analysis": "quasi-static", "tissue.layers.0.damping": 5.0}),
    "modes of the full length": UNIFORM.with_value("model", {"kind": "assumed-modes"}),
    "corrected modes": UNIFORM.with_value(
        "model", {"kind": "assumed-modes", "basis": "inserted-length", "static_corrections": True}
    ),
    "a table of a force": scene_of("entry", held(0.1), loads=[TipLoad(force=Table(time=[0.0, 1.0], value=[0.0, 1.0]))]),
    "a turning bevel": scene_of("entry", held(0.1), loads=[TipLoad(force=0.1, direction=TWO)]),
    "two sinusoids": scene_of("entry", held(0.1), loads=[TipLoad(force=TWO), TipLoad(force=TWO)]),
    "a finger": scene_of("hub", held(0.1), loads=[LateralLoad(position=-0.01, force=0.1)]),
}


@pytest.mark.parametrize("name", OTHERS)
def test_scenes_that_are_left_to_the_other_loops(name):
    assert is_uniform(UNIFORM)
    assert not is_uniform(OTHERS[name])


@pytest.mark.parametrize(
    "scene",
    [
        scene_of("entry", held(0.1), ()),
        scene_of("entry", held(0.1), loads=[TipLoad(force=0.1), TipLoad(force=TWO)]),
        UNIFORM.with_value("model", {"kind": "assumed-modes", "basis": "inserted-length"}),
    ],
    ids=["no tissue", "a constant and a sinusoid", "modes of the inserted length"],
)
def test_scenes_that_it_knows(scene):
    assert is_uniform(scene)


def test_the_numbers_of_a_row():
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=3.0),)
    loads = [TipLoad(force=0.1), TipLoad(bevel_coefficient=1e-5), TipLoad(force=Sinusoid(mean=0.2, amplitude=0.3, frequency=2.0))]
    scene = scene_of("entry", moving(0.5, 0.04, 0.14), layers, loads, duration=0.4, tissue={"stiffness_factor": 1.5})
    row = row_of(scene)
    assert row[[at.MODULUS, at.VISCOSITY, at.DEPTH, at.SPEED]] == pytest.approx([7.5e3, 3.0, 0.04, 0.5])
    assert row[at.FORCE] == pytest.approx(0.1 + 1e-5 * 7.5e3 + 0.2)
    assert row[[at.AMPLITUDE, at.FREQUENCY, at.ARRIVAL, at.DURATION]] == pytest.approx([0.3, 4.0 * np.pi, 0.2, 0.4])
    assert row[at.OUTPUT_STEP] == pytest.approx(0.4 / 200)
    assert np.isnan(row[at.START])
    assert row_of(scene_of("entry", held(0.1), initial=Initial(shape="straight")))[at.START] == 0.0


@pytest.mark.parametrize("shape", ["straight", "tip-displaced"])
def test_a_needle_let_go_in_viscous_tissue_comes_to_its_equilibrium(shape):
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=40.0),)
    initial = Initial(shape=shape, tip_deflection=1e-3 if shape == "tip-displaced" else None)
    scene = scene_of("entry", held(0.1), layers, initial=initial, duration=0.2).with_value("numerics.output_step", 0.04)
    run = simulate_many(scene, time_step=1e-3, vibrations=4)
    assert run.tip_deflection[0, 0] == pytest.approx(1e-3 if shape == "tip-displaced" else 0.0, rel=0.05, abs=2e-5)
    assert run.final_tip_deflection[0] == pytest.approx(exact_static(scene, 0.1).tip_deflection, rel=1e-5)


def test_a_held_needle_under_a_constant_force_swings_about_its_equilibrium():
    """From straight, undamped: all vibrations, and the mean over many periods is the equilibrium."""
    scene = scene_of("entry", held(0.1), GEL, initial=Initial(shape="straight"), duration=1.0)
    scene = scene.with_value("numerics.output_step", 1e-4)
    run = simulate_many(scene)
    rest = exact_static(scene, 0.1).tip_deflection
    assert abs(run.tip_deflection[0, 0]) < 1e-9 * rest
    assert np.mean(run.tip_deflection[0]) == pytest.approx(rest, rel=5e-3)
    assert np.max(run.tip_deflection[0]) == pytest.approx(2.0 * rest, rel=0.1)
