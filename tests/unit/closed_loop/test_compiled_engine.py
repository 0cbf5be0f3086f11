"""A loop on compiled steps: the same as with steps in numpy, decision for decision; no works."""

import numpy as np
import pytest

from fem_needle import SceneError, build_plant, load_scene
from fem_needle.closed_loop.lean import FORCES
from fem_needle.closed_loop.simulation import Simulation

SCENE = load_scene("steering-stiff").with_values({"numerics.elements": 6, "numerics.analysis": "dynamic"})
LAYERS = [
    {"name": "fat", "end": 0.0206, "foundation_modulus": 2e3, "damping": 20.0},
    {"name": "deep", "start": 0.0206, "foundation_modulus": 8e3, "damping": 80.0},
]
TREMBLE = {"time": [0.0, 0.04, 0.09], "value": [0.0, 2e-4, -1e-4]}
CASES = {
    "dynamic": {},
    "quasi-static": {"numerics.analysis": "quasi-static"},
    "layers": {"tissue.layers": LAYERS},
    "rate": {"actuators.lateral_force": {"rate": 30.0, "maximum": 1.0}},
    "spring guide": {"support.guides": [{"position": -0.03, "stiffness": 300.0}]},
    "rigid guide": {"support.guides": [{"position": -0.03}], "numerics.spectral_radius": 0.0},
    "trembling hub, swelling": {
        "support.hub_deflection": TREMBLE,
        "tissue.stiffness_factor": {"mean": 1.0, "amplitude": 0.1, "frequency": 5.0},
    },
    "free hub": {
        "support.hub_rotation": "free",
        "support.hub_rotational_inertia": 1e-6,
        "controller": {"kind": "none", "input": "hub_torque"},
        "scatter.entry_angle": 0.0,
    },
    "modes": {"model.kind": "assumed-modes", "numerics.elements": "auto"},
}
COMMANDS = [{"lateral_force": 0.8}, {}, {"tip_direction": -0.5, "lateral_force": -0.3}, {"lateral_force": 5.0}, {}]
DURATION = 0.02


def both(changes):
    plant = build_plant(SCENE.with_values(changes))
    return [Simulation(plant, time_step=1e-3, output_step=0.017, energies=energies) for energies in (True, False)]


@pytest.mark.parametrize("changes", CASES.values(), ids=CASES)
def test_the_same_needle(changes):
    whole, quick = both(changes)
    assert whole.has_works and not quick.has_works
    commands = [{"hub_torque": 1e-3 * index} for index in range(5)] if "controller" in changes else COMMANDS
    # Where a ramp ends inside prepared steps, the steps before it differ; the integration's own error is 2e-4 there.
    scale, bound = 0.0, 3e-5 if "actuators.lateral_force" in changes else 1e-7
    for command in commands:
        read, also = whole.step(command, DURATION), quick.step(command, DURATION)
        scale = max(scale, abs(whole.tip_deflection))
        assert quick.time == pytest.approx(whole.time, abs=1e-15)
        assert abs(quick.tip_deflection - whole.tip_deflection) < bound * scale
        assert also == pytest.approx(read, abs=1e-6)
    first, second = whole.trajectory(), quick.trajectory()
    np.testing.assert_allclose(second.tip_deflection, first.tip_deflection, rtol=0, atol=bound * scale)
    np.testing.assert_allclose(second.bending_energy, first.bending_energy, rtol=max(1e-5, 10 * bound))
    assert second.hub_force[0] == pytest.approx(first.hub_force[0], rel=1e-9)
    assert np.all(np.isnan(second.load_work))
    assert second.summary["steps"] >= 100


def test_what_was_not_expected_costs_no_accuracy():
    """Steps then end elsewhere: the difference is that of the integration, and falls with the step."""
    gaps = []
    for step in (4e-4, 2e-4):
        plant = build_plant(SCENE)
        whole, quick = (Simulation(plant, time_step=step, energies=energies) for energies in (True, False))
        for duration in (0.02, 0.0123, 0.031, 0.0077):
            for one in (whole, quick):
                one.step({"lateral_force": 40 * duration}, duration)
        gaps.append(abs(whole.tip_deflection - quick.tip_deflection))
    assert gaps[0] < 1e-3 * 0.02
    assert gaps[1] < gaps[0] / 2


def test_only_forces_may_be_commanded():
    _, quick = both({})
    assert "hub_angle" not in FORCES
    with pytest.raises(SceneError, match=r"'hub_angle'.*energies = True"):
        quick.step({"hub_angle": 0.01}, 0.01)


def test_a_loop_that_commands_the_hub_steps_the_whole_needle():
    simulation = Simulation(
        build_plant(SCENE.with_values({"controller.input": "hub_angle"})), time_step=1e-3, energies=False
    )
    assert simulation.has_works
