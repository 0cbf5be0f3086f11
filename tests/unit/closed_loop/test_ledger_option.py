"""Who still asks for a loop without energies is told that there is none."""

import numpy as np
import pytest

from fem_needle import Simulation, build_plant, load_scene, steer
from fem_needle.closed_loop.repeating import repeat

SCENE = load_scene("steering").with_values({"numerics.elements": 4, "run.duration": 0.4, "numerics.time_step": 0.02})


@pytest.mark.parametrize("energies", [True, False])
def test_the_ledger_is_always_there(energies):
    with pytest.warns(DeprecationWarning, match="energies does nothing any more") as caught:
        simulation = Simulation(build_plant(SCENE), energies=energies)
    assert caught[0].filename == __file__
    simulation.step({"lateral_force": 0.1}, 0.1)
    assert np.all(np.isfinite(simulation.trajectory().load_work))
    with pytest.warns(DeprecationWarning, match="energies"):
        run = steer(SCENE, energies=energies)
    assert run.summary["relative_energy_residual"] is not None
    with pytest.warns(DeprecationWarning, match="energies"):
        study = repeat(SCENE, 1, processes=1, energies=energies)
    assert study.repetitions[0].summary["relative_energy_residual"] is not None
