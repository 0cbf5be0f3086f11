"""A loop that asks for nothing but the tip: the same decisions and tips as with whole equilibria, and no works."""

import numpy as np
import pytest

from fem_needle import SceneError, build_plant, load_scene
from fem_needle.closed_loop.response_engine import ResponseEngine, why_no_response
from fem_needle.closed_loop.simulation import Simulation
from fem_needle.run_job import time_stepper

SCENE = load_scene("steering-stiff").with_values({"tissue.layers.0.damping": 0.0, "numerics.elements": 8})
LAYERED = SCENE.with_values(
    {
        "tissue.layers": [
            {"name": "fat", "end": 0.05, "foundation_modulus": 2e3},
            {"name": "deep", "start": 0.05, "foundation_modulus": 8e3},
        ],
        "actuators.lateral_force": {"maximum": 1.0, "rate": 4.0},
    }
)
COMMANDS = [{"lateral_force": 0.8}, {"lateral_force": -0.3}, {}, {"lateral_force": 5.0}, {"tip_direction": -0.5}, {}]
MODELS = {"elements": {}, "modes": {"model.kind": "assumed-modes", "numerics.elements": "auto"}}


def both(scene):
    return [Simulation(build_plant(scene), time_step=0.5, output_step=0.7, energies=energies) for energies in (True, False)]


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("scene", [SCENE, LAYERED], ids=["one layer", "layers, rate"])
def test_tips_and_readings_are_those_of_whole_equilibria(scene, model):
    whole, quick = both(scene.with_values(model))
    assert isinstance(quick._engine, ResponseEngine)
    for command in COMMANDS:
        read, also = whole.step(command, 0.61), quick.step(command, 0.61)
        assert quick.tip_deflection == pytest.approx(whole.tip_deflection, abs=1e-4 * 5e-3)  # of the largest: 1e-4 of a curve
        assert also["depth"] == read["depth"]
        assert abs(also["tip_deflection"] - read["tip_deflection"]) < 1.01 * 2e-4  # a pixel, where rounding goes the other way
    first, second = whole.trajectory(), quick.trajectory()
    np.testing.assert_allclose(second.tip_deflection, first.tip_deflection, rtol=1e-9, atol=1e-12)  # equilibria at samples
    np.testing.assert_allclose(second.bending_energy, first.bending_energy, rtol=1e-9)
    np.testing.assert_allclose(second.hub_force, first.hub_force, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(second.command_lateral_force, first.command_lateral_force, atol=1e-12)
    assert np.all(np.isnan(second.load_work))
    assert second.summary["relative_energy_residual"] is None
    assert [one for one in second.summary["skipped"] if one["term"] == "works and the energy balance"]
    assert second.summary["effort"] == pytest.approx(first.summary["effort"], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"tissue.layers.0.damping": 10.0}, "viscosity"),
        ({"numerics.analysis": "dynamic"}, "inertia"),
        ({"tissue.stiffness_factor": {"mean": 1.0, "amplitude": 0.1, "frequency": 1.0}}, "vary in time"),
        ({"controller": {"kind": "none", "input": "speed"}}, "speed"),
    ],
)
def test_what_gains_do_not_know(changes, reason):
    scene = SCENE.with_values(changes)
    plant = build_plant(scene)
    assert reason in why_no_response(scene, time_stepper(plant, scene, scene.numerics.analysis))
    assert not isinstance(Simulation(plant, time_step=0.1, energies=False)._engine, ResponseEngine)


def test_where_nothing_is_quicker_the_works_are_computed():
    swelling = {"tissue.stiffness_factor": {"mean": 1.0, "amplitude": 0.1, "frequency": 1.0}}
    simulation = Simulation(build_plant(SCENE.with_values(swelling)), time_step=0.1, energies=False)
    simulation.step({"lateral_force": 0.1}, 0.2)
    assert simulation.has_works
    assert np.all(np.isfinite(simulation.trajectory().load_work))


def test_an_input_without_a_static_gain_is_refused():
    simulation = Simulation(build_plant(SCENE), time_step=0.1, energies=False)
    with pytest.raises(SceneError, match=r"'speed'.*energies = True"):
        simulation.step({"speed": 0.005}, 0.1)


def test_forces_at_the_base_are_computed_when_a_sensor_asks():
    sensors = [{"kind": "base-force", "period": 0.5}, {"kind": "needle-shape", "period": 1.0}]
    scene = SCENE.with_values({"sensors": sensors, "controller": {"kind": "none"}})
    whole, quick = both(scene)
    for command in COMMANDS[:3]:
        read, also = whole.step(command, 1.0), quick.step(command, 1.0)
    assert also["hub_force"] == pytest.approx(read["hub_force"], rel=1e-7)
    np.testing.assert_allclose(also["needle_shape"], read["needle_shape"], rtol=1e-9, atol=1e-12)
