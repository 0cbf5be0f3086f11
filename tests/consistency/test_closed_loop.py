"""A needle under command against the same needle with tables: what is commanded acts, when it is, and nothing else does."""

import numpy as np
import pytest

from fem_needle import Simulation, linearize, simulate
from fem_needle.scene import Guide, Insertion, LateralLoad, Layer, Sinusoid, Table, TipLoad
from tests.consistency.closed_loop_scenes import (
    DURATION,
    FLANK,
    INPUTS,
    MODELS,
    commanded,
    free_run,
    largest_differences,
    loop_scene,
    scene_for,
    steps_table,
    tip_distance,
)
from tests.consistency.scenes import BUZZ, DAMPED, held, moving

ANALYSES = ("dynamic", "quasi-static", "static")
BACK_AND_FORTH = Insertion(
    kind="speed", initial_depth=0.04, speed=Table(time=[0.0, 0.008, 0.012, 0.02], value=[2.0, 2.0, -2.0, 1.0])
)
SWAYING = [TipLoad(force=BUZZ), LateralLoad(position=-0.0123, force=Table(time=[0.0, 0.0051, 0.013], value=[0.0, 0.3, -0.1]))]
GUIDES = {"guides": [Guide(position=-0.0317, stiffness=2e3)], "hub_angle": Sinusoid(amplitude=0.01, frequency=40.0)}
SWELLING = {"stiffness_factor": Sinusoid(mean=1.5, amplitude=0.5, frequency=60.0)}
PUSH = Insertion(kind="force", initial_depth=0.048, push_force=Table(time=[0.0, 0.0073, 0.02], value=[0.5, 1.0, 0.3]))
TIP = [TipLoad(force=BUZZ)]
SCENES = {
    "entry, in and out": loop_scene(BACK_AND_FORTH, kind="entry", layers=DAMPED, loads=TIP),
    "entry, cut path": loop_scene(BACK_AND_FORTH, kind="entry", layers=DAMPED, loads=TIP, tissue={"rest_line": "cut-path"}),
    "hub, in and out": loop_scene(BACK_AND_FORTH, layers=DAMPED, loads=SWAYING, support=GUIDES),
    "hub, held, swelling": loop_scene(held(0.08), layers=DAMPED, loads=SWAYING, support=GUIDES, tissue=SWELLING),
    "entry, pushed": loop_scene(PUSH, kind="entry", layers=DAMPED, loads=TIP),
    "hub, pushed": loop_scene(PUSH, layers=DAMPED, loads=SWAYING, support={"guides": GUIDES["guides"]}),
}


def has(scene, analysis):
    """Whether a scene can be analyzed so: paths and pushes have no equilibria."""
    return analysis != "static" or (scene.tissue.rest_line == "straight" and scene.insertion.kind != "force")


def speed_of(*case):
    """Return a case of (name, analysis, model), marked where it is costly and one like it runs each time."""
    slow = ("pushed" in case[0] and case[0] != "entry, pushed") or (case[2] == "elements" and "path" in case[0])
    return pytest.param(*case, marks=pytest.mark.slow) if slow else case


CASES = [(name, analysis) for name, scene in SCENES.items() for analysis in ANALYSES if has(scene, analysis)]
QUICK = [speed_of(*case, model) for case in CASES for model in MODELS]


@pytest.mark.parametrize("name, analysis, model", QUICK)
def test_without_commands_it_is_the_run(name, analysis, model):
    plant = MODELS[model](SCENES[name])
    expected = simulate(plant, time_step=5e-4, analysis=analysis, output_step=2e-3)
    found = free_run(plant, DURATION, time_step=5e-4, analysis=analysis)
    assert found.summary["steps"] == expected.summary["steps"]
    assert {key: value for key, value in largest_differences(found, expected).items() if value > 1e-7} == {}
    assert tip_distance(found, expected) < 1e-10


@pytest.mark.parametrize("model", ["modes", pytest.param("elements", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name, analysis", [case for case in CASES if "pushed" not in case[0]])
def test_ends_of_steps_that_fall_on_nothing(name, analysis, model):
    """More steps than the run has: not farther from it than it is from a run with half its step."""
    plant = MODELS[model](SCENES[name])
    coarse, fine = (simulate(plant, time_step=step, analysis=analysis, output_step=2e-3) for step in (5e-4, 2.5e-4))
    pieces = np.random.default_rng(1).uniform(1e-4, 1.5e-3, 200)
    found = free_run(plant, DURATION, time_step=5e-4, analysis=analysis, pieces=pieces)
    assert found.summary["steps"] > coarse.summary["steps"]
    assert tip_distance(found, coarse) <= 1.5 * tip_distance(coarse, fine) + 1e-12


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("name", [name for name in INPUTS if name != "push_force"])
def test_a_train_of_commands_is_a_table_with_steep_flanks(name, analysis, model):
    """Commands at a held depth, where nothing but the command tells that anything has changed; jumps of the hub included."""
    path, size = INPUTS[name]
    scene = scene_for(name)
    shares = np.random.default_rng(2).uniform(-1.0, 1.0, 6)
    train = [(0.0003 + 0.0031 * index, size * float(share)) for index, share in enumerate(shares)]
    before = {"lateral_force": 0.05, "tip_direction": 1.0}.get(name, 0.0)
    table = scene.with_value(path, steps_table(before, train, DURATION))
    expected = simulate(MODELS[model](table), time_step=2e-4, analysis=analysis, output_step=2e-3)
    found = commanded(
        MODELS[model](scene), [(time, {name: value}) for time, value in train], DURATION, time_step=2e-4, analysis=analysis
    )
    assert np.ptp(found.tip_deflection) > 1e-6
    # The table moves for a flank; in it the fastest vibration of four elements turns by 1e-4, viscosity lets little move.
    assert tip_distance(found, expected) < {"dynamic": 2e-4, "quasi-static": 2e-4, "static": 1e-12}[analysis]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["lateral_force", "tip_direction"])
def test_a_train_while_the_needle_moves(name, model):
    path, size = INPUTS[name]
    scene = loop_scene(moving(1.0, 0.045, 0.065), layers=DAMPED)
    train = [(0.0031, 0.5 * size), (0.0047, -size), (0.0113, 0.2 * size)]
    before = {"lateral_force": 0.05, "tip_direction": 1.0}[name]
    plant = MODELS[model](scene.with_value(path, steps_table(before, train, DURATION)))
    expected = simulate(plant, time_step=2e-4, analysis="dynamic", output_step=2e-3)
    commands = [(time, {name: value}) for time, value in train]
    found = commanded(MODELS[model](scene), commands, DURATION, time_step=2e-4, analysis="dynamic")
    assert tip_distance(found, expected) < 1e-5


@pytest.mark.parametrize("model, length", [("modes", 1e-5), ("elements", 1e-9)])
def test_a_pulse_inside_a_step_gives_its_impulse(model, length):
    """T = 1/2 (F dt)^2 N M^-1 N^T right after it: a step of 1e-2 s must not pass over a pulse of 1e-5 s."""
    force = 1e-5 / length
    scene = loop_scene(layers=(Layer(start=0.0, foundation_modulus=5e3),), loads=[LateralLoad(position=-0.0123, force=0.0)])
    plant = MODELS[model](scene)
    pulse = [(0.003, {"lateral_force": force}), (0.003 + length, {"lateral_force": 0.0})]
    found = commanded(plant, pulse, 0.003 + 1.0001 * length, time_step=1e-2, analysis="dynamic", output_step=1.0)
    free = plant.prescribed
    row = plant.points(0.1).rows[0, free:]
    mobility = float(row @ plant.operators(0.1, 0.0).mass_factorization.solve(row))
    assert found.kinetic_energy[-1] == pytest.approx(0.5 * (force * length) ** 2 * mobility, rel=1e-3)
    assert found.kinetic_energy[0] == 0.0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ANALYSES)
def test_a_limited_rate_is_a_table(analysis, model):
    scene = loop_scene().with_value("actuators.lateral_force", {"rate": 60.0, "maximum": 0.25})
    # From 0.05 at 3 ms: at 0.25, the limit, after 3.33 ms; back from 10 ms, turned round on the way at 12 ms.
    table = {
        "time": [0.0, 0.003, 0.003 + 0.2 / 60, 0.010, 0.012, 0.012 + 0.05 / 60, DURATION],
        "value": [0.05, 0.05, 0.25, 0.25, 0.13, 0.18, 0.18],
    }
    expected = simulate(
        MODELS[model](scene.with_value("loads.1.force", table)), time_step=2e-4, analysis=analysis, output_step=1e-3
    )
    commands = [(0.003, {"lateral_force": 9.0}), (0.010, {"lateral_force": -9.0}), (0.012, {"lateral_force": 0.18})]
    found = commanded(MODELS[model](scene), commands, DURATION, time_step=2e-4, analysis=analysis, output_step=1e-3)
    differences = largest_differences(found, expected)
    assert differences["tip_deflection"] < 1e-10 and differences["load_work"] < 1e-10
    wanted = np.interp(found.time, table["time"], table["value"])
    assert found.signals["command_lateral_force"] == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_the_present_value_commanded_again_changes_nothing(model):
    plant = MODELS[model](loop_scene())
    once = commanded(plant, [(0.0, {"lateral_force": 0.2})], DURATION, time_step=2e-4, analysis="dynamic")
    again = [(0.002 * index, {"lateral_force": 0.2}) for index in range(10)]
    often = commanded(plant, again, DURATION, time_step=2e-4, analysis="dynamic")
    assert often.summary["steps"] == once.summary["steps"]
    assert often.tip_deflection.tolist() == once.tip_deflection.tolist()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["hub_deflection", "hub_angle"])
def test_a_hub_that_jumps_leaves_the_needle_where_it_is(name, model):
    """The tip goes by what the linear model says is immediate, its D: by nothing in many elements."""
    scene = loop_scene(loads=[], layers=(Layer(start=0.0, foundation_modulus=5e3),))
    plant = MODELS[model](scene)
    size = INPUTS[name][1]
    found = commanded(plant, [(0.0, {name: size})], FLANK, time_step=1e-4, analysis="dynamic", output_step=1.0)
    linear = linearize(plant, depth=0.1, axial="held")
    column = [signal.name for signal in linear.inputs].index(name)
    arm = {"hub_deflection": 1.0, "hub_angle": 0.2}[name]  # of a needle that turned with the hub as one piece
    immediate = linear.D[0, column] * size
    assert found.tip_deflection[-1] == pytest.approx(immediate, rel=1e-4, abs=1e-9 * size)
    assert abs(immediate) < {"elements": 0.03, "modes": 0.6}[model] * arm * size


@pytest.mark.parametrize("model", MODELS)
def test_a_hub_that_jumps_does_not_take_a_creeping_needle_along(model):
    """Without inertia viscous tissue is what holds: right after the jump the needle in it is where it was."""
    scene = loop_scene(loads=[], layers=(Layer(start=0.0, foundation_modulus=5e3, damping=5.0),))
    plant = MODELS[model](scene)
    tips = [
        commanded(plant, [(0.0, {"hub_deflection": size})], 1e-8, time_step=1e-4, analysis="quasi-static", output_step=1.0)
        for size in (1e-3, 2e-3)
    ]
    assert abs(tips[0].tip_deflection[-1]) < 0.3e-3
    assert tips[1].tip_deflection[-1] == pytest.approx(2.0 * tips[0].tip_deflection[-1], rel=1e-9)


def test_reading_the_trajectory_on_the_way_changes_nothing():
    plant = MODELS["modes"](loop_scene())
    pieces = [0.0007] * 29
    expected = free_run(plant, DURATION, time_step=2e-4, analysis="static", pieces=pieces)
    simulation = Simulation(plant, time_step=2e-4, analysis="static", output_step=2e-3)
    for piece in pieces[:-1]:
        simulation.step({}, piece)
        assert simulation.trajectory().time[-1] == simulation.time
    simulation.step({}, DURATION - simulation.time)
    assert simulation.trajectory().time.tolist() == expected.time.tolist()
