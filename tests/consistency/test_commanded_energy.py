"""The energy ledger where commands jump: what is booked at the jump, and how fast the residual falls with the step."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.scene import Guide, Insertion, LateralLoad, Layer, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.closed_loop_scenes import INPUTS, MODELS, commanded, loop_scene, scene_for
from tests.consistency.scenes import DAMPED, moving

CREEPING = (Layer(start=0.0, foundation_modulus=5e3, damping=50.0),)
END = 0.04
JUMPING = [name for name in INPUTS if name != "push_force"]


def residual(plant, name, analysis, step):
    shares = np.random.default_rng(3).uniform(-1.0, 1.0, 4)
    train = [(0.01 * index, {name: INPUTS[name][1] * float(share)}) for index, share in enumerate(shares)]
    run = commanded(plant, train, END, time_step=step, analysis=analysis, output_step=END / 4)
    return run.summary["relative_energy_residual"]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ["dynamic", "static"])
@pytest.mark.parametrize("name", JUMPING)
def test_at_a_held_depth_nothing_is_missing_but_rounding(name, analysis, model):
    """Gauss nodes keep quadratic invariants, equilibria have no error in time: what a jump does is booked to the last digit."""
    plant = MODELS[model](scene_for(name, layers=CREEPING, duration=END))
    assert residual(plant, name, analysis, 2e-3) < 1e-11


@pytest.mark.parametrize("model", MODELS)
def test_guides_beside_a_force_that_jumps(model):
    """In one element: the force moves the kink, the kink the guide's spring; pinned by a second one."""
    guides = {"guides": [Guide(position=-0.013, stiffness=2e3), Guide(position=-0.0451, stiffness=1e5)]}
    plant = MODELS[model](loop_scene(layers=CREEPING, duration=END, support=guides))
    for name in ("lateral_force", "hub_deflection"):
        assert residual(plant, name, "dynamic", 2e-3) < 1e-11
        assert residual(plant, name, "static", 2e-3) < 1e-11


def order(plant, name, analysis, coarse, ratio=4.0):
    found = [residual(plant, name, analysis, step) for step in (coarse, coarse / ratio)]
    return np.log(found[0] / found[1]) / np.log(ratio), found[1]


@pytest.mark.parametrize("name", ["lateral_force", "tip_direction", "hub_deflection"])
def test_while_modes_move_the_residual_falls_with_the_order_of_the_method(name):
    """Order 4 with inertia, order 3 (Radau) without it: no hole in the ledger, with any input."""
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.0)]
    scene = loop_scene(moving(0.5, 0.05, 0.07), layers=CREEPING, loads=loads, duration=END)
    plant = AssumedModeNeedle(scene, modes=2)
    found, last = order(plant, name, "dynamic", 5e-4, 2.0)
    assert found > 3.3 and last < 1e-5
    found, last = order(plant, name, "quasi-static", 2.5e-4, 2.0)
    assert found > 2.3 and last < 3e-2


# A beam that creeps, c w_t + EI w_yyyy = 0, answers over x = (EI t / c)^(1/4): to a force F at its end with w ~ F x^3 / EI,
# energy F^2 t^(3/4); to a moment with the angle M x / EI, energy M^2 t^(1/4). What is shorter than a step is damped away by the
# L-stable method and stands in no ledger.
@pytest.mark.parametrize("name, power", [("tip_direction", 0.75), ("hub_deflection", 0.25)])
def test_creep_after_a_jump_is_resolved_as_the_continuum_allows(name, power):
    """The residual of elements falls slowly, by the power of the step that the creeping beam itself has."""
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.0)]
    plant = FiniteElementNeedle(loop_scene(layers=CREEPING, loads=loads, duration=END), elements=12)
    assert order(plant, name, "quasi-static", 5e-4)[0] == pytest.approx(power, abs=0.1)


@pytest.mark.parametrize("push", [0.5, 0.7, 0.9, 1.1])
def test_a_creeping_push_over_an_interface(push):
    """A step that ends there ends in the layer behind: not a node, with a quarter of the step's weight, in the one ahead."""
    insertion = Insertion(kind="force", initial_depth=0.06, push_force=push)
    plant = MODELS["modes"](loop_scene(insertion, kind="entry", layers=DAMPED, duration=0.018))
    run = simulate(plant, time_step=2e-4, analysis="quasi-static", output_step=2e-3)
    first = int(np.searchsorted(run.depth, 0.08))
    assert np.max(np.abs(run.energy_residual[first - 1 : first + 1])) < 1e-4 * run.tissue_energy[first - 1]
