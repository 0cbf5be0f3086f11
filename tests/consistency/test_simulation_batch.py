"""Many needles stepped together: each as it would go alone."""

import numpy as np
import pytest

from fem_needle import Simulation, SimulationBatch
from fem_needle.closed_loop.simulation import UnstableLoopError
from tests.consistency.closed_loop_scenes import MODELS, loop_scene
from tests.consistency.scenes import DAMPED, held
from tests.consistency.test_simulation_state import CASES, assert_same, went_on

NAMES = ["held, inertia", "guides creep", "sensors", "moving, equilibria", "sensors, push"]


@pytest.mark.parametrize("threads", [None, 1, 3])
def test_a_batch_is_its_simulations_one_by_one(threads):
    plants = [MODELS["modes"](CASES[name][0]) for name in NAMES]
    batch = SimulationBatch(plants, threads=threads, time_step=3e-4, output_step=1.3e-3)
    alone = [Simulation(plant, time_step=3e-4, output_step=1.3e-3, repetition=number) for number, plant in enumerate(plants)]
    for index in range(4):
        commands = [CASES[name][2][index] for name in NAMES]
        told = batch.step(commands, 1.7e-3)
        for mine, one, command in zip(told, alone, commands, strict=True):
            yours = one.step(command, 1.7e-3)
            assert mine.keys() == yours.keys() and all(np.array_equal(mine[key], yours[key]) for key in mine)
    for mine, yours in zip(batch.simulations, alone, strict=True):
        assert_same(went_on(mine, []), went_on(yours, []))
    assert [run.time[-1] for run in batch.trajectories()] == [pytest.approx(4 * 1.7e-3)] * len(NAMES)


def test_one_command_for_all_and_scenes():
    scenes = [loop_scene(held(0.1), layers=DAMPED).with_value("numerics.elements", count) for count in (3, 4)]
    batch = SimulationBatch(scenes, time_step=1e-3, analysis="static")
    assert len(batch) == 2
    told = batch.step({"lateral_force": 0.2}, 2e-3)
    assert told == batch.measurements() and told[0]["tip_deflection"] != told[1]["tip_deflection"]
    batch.step()
    assert [one.time for one in batch.simulations] == [pytest.approx(3e-3)] * 2


def test_one_that_fails_is_told_when_all_have_been_stepped():
    plants = [MODELS["modes"](loop_scene(held(0.1))) for _ in range(3)]
    batch = SimulationBatch(plants, threads=2, time_step=1e-3, analysis="static")
    with pytest.raises(UnstableLoopError, match="half the needle's length"):
        batch.step([{}, {"lateral_force": 1e6}, {}], [2e-3, 2e-3, 3e-3])
    assert [one.time for one in batch.simulations] == [pytest.approx(2e-3), pytest.approx(1e-4), pytest.approx(3e-3)]


def test_one_that_has_ended_stays():
    scene = CASES["speeds, equilibria"][0]
    batch = SimulationBatch([MODELS["modes"](scene)] * 2, time_step=1e-3, analysis="static")
    batch.step([{"speed": -10.0}, {"speed": 0.0}], 0.01)
    assert [one.stop_reason for one in batch.simulations] == ["withdrawn", None]
    batch.step(duration=0.01)
    assert batch.simulations[0].time < 0.01 < batch.simulations[1].time
