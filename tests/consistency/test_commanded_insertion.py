"""Commanded speeds and pushes: where the tip gets, why the run ends there, and the same as tables."""

import numpy as np
import pytest

from fem_needle import Simulation, simulate
from fem_needle.scene import Insertion, LateralLoad, Table, TipLoad
from tests.consistency.closed_loop_scenes import FLANK, MODELS, commanded, free_run, loop_scene, steps_table, tip_distance
from tests.consistency.scenes import DAMPED

PLAIN = Insertion(kind="speed", initial_depth=0.045, speed=Table(time=[0.0, 1.0], value=[1.0, 1.0]))
TIP = [TipLoad(force=0.1)]
TRAIN = [(0.003, 2.0), (0.0071, -1.5), (0.0152, 0.0), (0.0183, 3.0)]
# Integral of 1, 2, -1.5, 0 and 3 m/s from 45 mm on.
DEPTH = 0.045 + 0.003 + 2 * 0.0041 - 1.5 * 0.0081 + 3 * 0.0017
KINDS = {
    "entry": {"kind": "entry", "loads": TIP, "layers": DAMPED},
    "hub": {"layers": DAMPED},
    "cut path": {"kind": "entry", "loads": TIP, "layers": DAMPED, "tissue": {"rest_line": "cut-path"}},
}
ANALYSES = ("dynamic", "quasi-static", "static")
ALL = [(kind, analysis) for kind in ("entry", "hub") for analysis in ANALYSES] + [
    ("cut path", "quasi-static"),
    pytest.param("cut path", "dynamic", marks=pytest.mark.slow),
]


def speeds(train):
    return [(time, {"speed": value}) for time, value in train]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("kind, analysis", ALL)
def test_a_train_of_speeds_is_a_table_with_steep_flanks(kind, analysis, model):
    """In and out over an interface at 50 mm; the momentum stays where the speed jumps."""
    scene = loop_scene(PLAIN, **KINDS[kind])
    table = scene.with_value("insertion.speed", steps_table(1.0, TRAIN, 0.02))
    # A run with a cut path also lands at the depths of all kinks of a table: other steps, equal in the limit of short ones.
    step = 5e-5 if (kind, analysis) == ("cut path", "dynamic") else 2e-4
    settings = {"time_step": step, "analysis": analysis, "output_step": 2e-3}
    expected = simulate(MODELS[model](table), **settings)
    found = commanded(MODELS[model](scene), speeds(TRAIN), 0.02, **settings)
    assert found.depth[-1] == pytest.approx(DEPTH, rel=1e-14)
    # Speeds of the table lag by half a flank: 1.5e-9 m of some centimeters.
    assert found.depth == pytest.approx(expected.depth, abs=4 * FLANK)
    finer = simulate(MODELS[model](table), **settings | {"time_step": step / 2}) if step == 5e-5 else expected
    assert tip_distance(found, expected) < max(2e-5, 2.0 * tip_distance(expected, finer))
    assert found.summary["relative_energy_residual"] < max(1e-7, 3.0 * expected.summary["relative_energy_residual"])


def test_a_commanded_speed_lands_where_the_needle_cuts_again():
    """At 2 m/s to 51 mm, back to 49 mm, in again: uncut tissue begins at 51 mm, amid what would be one step."""
    plant = MODELS["modes"](loop_scene(PLAIN, **KINDS["cut path"]))
    simulation = Simulation(plant, time_step=1.0, analysis="quasi-static", output_step=1.0)
    for speed, duration in ((2.0, 0.003), (-1.0, 0.002)):
        simulation.step({"speed": speed}, duration)
    before = simulation.steps
    simulation.step({"speed": 1.0}, 0.005)
    assert simulation.steps - before == 3  # to the interface at 50 mm, to 51 mm, to the end
    assert simulation.depth == pytest.approx(0.054, rel=1e-14)


@pytest.mark.parametrize("model", MODELS)
def test_a_limited_rate_of_the_speed_is_a_table(model):
    scene = loop_scene(PLAIN, **KINDS["entry"]).with_value("actuators.speed", {"rate": 500.0, "minimum": -1.0})
    table = {"time": [0.0, 0.004, 0.006, 0.01, 0.015, 0.02], "value": [1.0, 1.0, 2.0, 2.0, -0.5, -0.5]}
    settings = {"time_step": 2e-4, "analysis": "dynamic", "output_step": 1e-3}
    expected = simulate(MODELS[model](scene.with_value("insertion.speed", table)), **settings)
    found = commanded(MODELS[model](scene), speeds([(0.004, 2.0), (0.01, -0.5)]), 0.02, **settings)
    assert found.depth == pytest.approx(expected.depth, rel=1e-13)
    assert found.speed == pytest.approx(expected.speed, abs=1e-9)
    # The scene does not land where the needle turns round; the loop does, and has one step more.
    assert tip_distance(found, expected) < 1e-7


@pytest.mark.parametrize("kind", ["entry", "hub"])
@pytest.mark.parametrize("model", MODELS)
def test_where_a_commanded_speed_ends_the_run(model, kind):
    parts = KINDS["entry"] if kind == "entry" else {"layers": DAMPED, "loads": [*TIP, LateralLoad(position=-0.02, force=0.0)]}
    insertion = Insertion(kind="speed", initial_depth=0.045, speed=0.01, final_depth=0.06)
    plant = MODELS[model](loop_scene(insertion, duration=5.0, **parts))
    contact, reason = (0.2, "full-length") if kind == "entry" else (0.18, "hub-contact")
    free = MODELS[model](loop_scene(PLAIN, **parts))

    def ended(plant, *train):
        run = commanded(plant, speeds(train), 9.0, time_step=0.05, analysis="static", output_step=0.5)
        return run.summary["stop_reason"], run.time[-1], run.depth[-1]

    assert ended(plant, (0.5, 0.02)) == ("final-depth", pytest.approx(1.0), pytest.approx(0.06, rel=1e-14))
    assert ended(plant, (2.0, 0.02)) == ("final-depth", pytest.approx(2.0), pytest.approx(0.06, rel=1e-14))
    assert ended(plant, (0.5, -0.01)) == ("withdrawn", pytest.approx(5.5), pytest.approx(0.0, abs=1e-16))
    assert ended(free, (0.0, 0.05)) == (reason, pytest.approx((contact - 0.045) / 0.05), pytest.approx(contact, rel=1e-14))


@pytest.mark.parametrize("start, speed, reason", [(0.0, -0.01, "withdrawn"), (0.2, 0.01, "full-length")])
def test_no_step_beyond_an_end_where_the_needle_already_is(start, speed, reason):
    insertion = Insertion(kind="speed", initial_depth=start, speed=Table(time=[0.0, 1.0], value=[0.0, 0.0]))
    simulation = Simulation(MODELS["elements"](loop_scene(insertion, **KINDS["entry"])), time_step=0.01, analysis="static")
    simulation.step({"speed": speed}, 0.005)
    assert (simulation.stop_reason, simulation.time, simulation.depth) == (reason, 0.0, start)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rate", [None, 0.1])
def test_the_tip_is_read_at_the_target_whatever_the_speed_did_before(model, rate):
    """A slower speed comes into force on the way; its passage of the target is neither predicted from the old one nor missed."""
    slow = Table(time=[0.0, 1.0], value=[0.01, 0.01])
    scene = loop_scene(PLAIN.model_copy(update={"speed": slow}), **KINDS["hub"]).with_value("target.depth", 0.0471)
    if rate:
        scene = scene.with_value("actuators.speed", {"rate": rate})
    plant = MODELS[model](scene)
    found = commanded(plant, speeds([(0.05, 0.002)]), 2.0, time_step=0.1, analysis="static", output_step=1.0)
    slowing = 0.0 if rate is None else 0.008 / rate
    arrival = 0.05 + slowing + (0.0471 - 0.0455 - 0.006 * slowing) / 0.002
    assert found.summary["target_time"] == pytest.approx(arrival, rel=1e-12)
    held = loop_scene(Insertion(kind="hold", initial_depth=0.0471), **KINDS["hub"])
    there = simulate(MODELS[model](held), time_step=0.01, analysis="static").tip_deflection[0]
    assert found.summary["target_error"] == pytest.approx(there, rel=1e-9)


PUSHED = Insertion(kind="force", initial_depth=0.045, push_force=0.3)


@pytest.mark.parametrize("model", ["modes", pytest.param("elements", marks=pytest.mark.slow)])
@pytest.mark.parametrize("analysis", ["dynamic", "quasi-static"])
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_train_of_pushes_is_a_table_with_steep_flanks(kind, analysis, model):
    scene = loop_scene(PUSHED, **KINDS[kind])
    train = [(0.0031, 0.8), (0.0087, -0.4), (0.0143, 0.6)]
    settings = {"time_step": 4e-4, "analysis": analysis, "output_step": 2e-3}
    expected = simulate(MODELS[model](scene.with_value("insertion.push_force", steps_table(0.3, train, 0.02))), **settings)
    found = commanded(MODELS[model](scene), [(time, {"push_force": value}) for time, value in train], 0.02, **settings)
    assert found.depth == pytest.approx(expected.depth, rel=1e-6)
    assert found.speed == pytest.approx(expected.speed, abs=1e-5 * np.max(np.abs(expected.speed)))
    assert tip_distance(found, expected) < 1e-4
    assert found.push_work[-1] == pytest.approx(expected.push_work[-1], rel=1e-5)


@pytest.mark.parametrize("model", MODELS)
def test_a_needle_that_sticks_moves_when_it_is_pushed_harder(model):
    scene = loop_scene(PUSHED, kind="entry", loads=TIP).with_values(
        {"friction.coulomb_per_length": 5.0, "insertion.push_force": 0.1}
    )
    plant = MODELS[model](scene)
    stuck = free_run(plant, 0.01, time_step=1e-3, analysis="quasi-static")
    assert stuck.summary["stop_reason"] == "stuck"
    simulation = Simulation(plant, time_step=1e-3, analysis="quasi-static", output_step=2e-3)
    simulation.step({"push_force": 0.1}, 0.01)
    assert (simulation.stop_reason, simulation.depth) == (None, 0.045)
    simulation.step({"push_force": 0.5}, 0.01)
    # 0.5 N less friction 5 N/m on 45 mm, over 2 g, for 10 ms; friction grows and the tissue's drag holds a little back.
    rigid = 0.5 * (0.5 - 5.0 * 0.045) / (0.2 * 0.01016) * 0.01**2
    assert 0.8 * rigid < simulation.depth - 0.045 < rigid


def test_modes_whose_speed_is_commanded_from_rest_are_damped_as_those_that_move():
    """Five modes on a growing length vibrate ever wider under a method without damping: the loop must not take it."""
    still, going = (
        Insertion(kind="speed", initial_depth=0.02, speed=Table(time=[0.0, 2.0], value=[speed] * 2)) for speed in (0.0, 0.05)
    )
    runs = []
    for insertion, train in ((still, [(0.0, 0.05)]), (going, [])):
        scene = loop_scene(insertion, kind="entry", loads=TIP, duration=2.0).with_values({"model.kind": "assumed-modes"})
        plant = MODELS["modes"](scene).__class__(scene, modes=5)
        runs.append(commanded(plant, speeds(train) or [(0.0, {})], 2.0, time_step=1e-2, analysis="dynamic", output_step=0.1))
    assert tip_distance(*runs) < 1e-9
