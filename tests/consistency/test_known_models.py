"""Models that the kernel knows against the same models that it asks for their matrices: nearly dependent modes, fixed columns."""

from dataclasses import replace

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.dynamics.rests import tips_at_rest
from fem_needle.models import build_plant
from fem_needle.scene import TipLoad
from fem_needle.stress.draws import random_numbers
from fem_needle.stress.numbers import SI
from fem_needle.stress.numbers import scene_of as scene_of_numbers
from reduced_model import AssumedModeNeedle, mode_basis, project
from tests.consistency.scenes import BUZZ, LAYERS, held, moving, scene_of

CASES = {
    "moving": (scene_of("entry", moving(0.5, 0.04, 0.14), loads=(TipLoad(force=BUZZ),), duration=0.2), "dynamic"),
    "held": (scene_of("entry", held(0.12), layers=LAYERS, loads=(TipLoad(force=0.1),), duration=0.05), "dynamic"),
    "at rest": (scene_of("entry", moving(0.01, 0.02, 0.14), layers=LAYERS, loads=(TipLoad(force=0.1),)), "static"),
}


@pytest.mark.parametrize("modes", [3, 5, 8])
@pytest.mark.parametrize("name", CASES)
def test_the_kernel_finds_the_directions_itself(name, modes):
    scene, analysis = CASES[name]
    settings = {"time_step": 1e-3, "output_step": 1e-2} if analysis == "dynamic" else {"output_step": 1.0}
    runs = []
    for is_polynomial in (True, False):
        plant = AssumedModeNeedle(scene, modes=modes, basis="full-length")
        plant.is_polynomial = is_polynomial
        runs.append(simulate(plant, analysis=analysis, **settings))
    compiled, asked = runs
    largest = np.max(np.abs(asked.tip_deflection))
    assert largest > 1e-5
    assert np.max(np.abs(compiled.tip_deflection - asked.tip_deflection)) < 1e-8 * largest
    for energy in ("bending_energy", "tissue_energy"):
        most = np.max(np.abs(asked.series[energy]))
        assert np.max(np.abs(compiled.series[energy] - asked.series[energy])) < 1e-6 * most


@pytest.mark.parametrize("name", CASES)
def test_columns_that_stay_are_not_asked_for(name):
    scene, analysis = CASES[name]
    settings = {"time_step": 1e-3, "output_step": 1e-2} if analysis == "dynamic" else {"output_step": 1.0}
    needle, runs = FiniteElementNeedle(scene, elements=6), []
    for is_polynomial in (True, False):
        plant = project(needle, mode_basis(needle, 3, "inserted-length"))
        assert plant.is_polynomial
        plant.is_polynomial = is_polynomial
        runs.append(simulate(plant, analysis=analysis, **settings))
    compiled, asked = runs
    assert np.max(np.abs(compiled.tip_deflection - asked.tip_deflection)) < 1e-9 * np.max(np.abs(asked.tip_deflection))


@pytest.mark.parametrize("modes", [2, 5])
def test_a_depth_beyond_the_length_by_rounding(modes):
    """A commanded speed arrives at the whole length only to rounding; what lies behind the last piece is not the needle's."""
    scene = scene_of("entry", held(0.12), loads=(TipLoad(force=0.1),))
    plant = AssumedModeNeedle(scene, modes=modes)
    whole, beyond = tips_at_rest(plant, [(0.0, scene.needle.length), (1.0, scene.needle.length * (1.0 + 1e-15))])
    assert beyond == pytest.approx(whole, rel=1e-9)


def test_many_modes_that_are_pulled_out_keep_finite_numbers():
    """A random scene under stress: at 1e-6 of the length the bending of most combinations is nothing but rounding."""
    scene = scene_of_numbers(random_numbers(381), SI).with_values({"model": {"kind": "assumed-modes", "modes": 8}})
    run = simulate(build_plant(scene))
    assert run.depth[-1] == pytest.approx(0.0, abs=1e-15)
    assert all(np.all(np.isfinite(values)) for values in run.series.values())


class Softer:
    """Somebody's wrapper: a needle of everything that it does not say itself, in a tissue of half the stiffness."""

    def __init__(self, needle):
        self.needle = needle

    def __getattr__(self, name):
        return getattr(self.needle, name)

    def operators(self, depth, time):
        found = self.needle.operators(depth, time)
        return replace(found, tissue=0.5 * found.tissue)


def test_a_wrapper_is_asked_for_what_it_changes():
    scene, _ = CASES["held"]
    softer, soft = (
        simulate(plant, time_step=1e-3, analysis="static", output_step=1e-2)
        for plant in (
            Softer(FiniteElementNeedle(scene, elements=4)),
            FiniteElementNeedle(scene.with_value("tissue.stiffness_factor", 0.5), elements=4),
        )
    )
    assert softer.tip_deflection == pytest.approx(soft.tip_deflection, rel=1e-9)
