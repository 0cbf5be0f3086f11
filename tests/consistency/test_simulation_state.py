"""Copies of needles under way: they go on with the same numbers to the last bit, whatever was done in between."""

import copy
import pickle

import numpy as np
import pytest

from fem_needle import Simulation, load_scene
from fem_needle.dynamics.model import is_known
from fem_needle.models import build_plant
from fem_needle.scene import Guide, Insertion, Layer, Sinusoid, Table, TipLoad
from fem_needle.shipped import shipped_names
from reduced_model import AssumedModeNeedle
from tests.consistency.closed_loop_scenes import MODELS, loop_scene
from tests.consistency.scenes import DAMPED, held, moving

BEVEL = [TipLoad(bevel_coefficient=2e-6), TipLoad(force=0.1)]
RIGID_AND_SOFT = {"guides": [Guide(position=-0.0317), Guide(position=-0.012, stiffness=2e3)]}
CAPSULE = (
    Layer(start=0.0, end=0.0485, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.0485, foundation_modulus=2e4, puncture_force=0.3, cutting_force=0.05),
)
SENSORS = [
    {"kind": "tip-imaging", "period": 7e-4, "noise": 1e-5, "delay": 1.6e-3, "dropped_fraction": 0.2},
    {"kind": "base-force", "period": 1.1e-3, "noise": 1e-3},
    {"kind": "needle-shape", "period": 2e-3, "stations": 4, "noise": 1e-5},
    {"kind": "tissue-deformation", "period": 9e-4, "noise": 1e-6, "decay_length": 0.02},
]
SPEEDS = Insertion(kind="speed", initial_depth=0.0475, speed=Table(time=[0.0, 1.0], value=[1.0, 1.0]))
PUSH = Insertion(kind="force", initial_depth=0.048, push_force=0.6)
FORCES = [
    {"lateral_force": 0.2},
    {},
    {"lateral_force": -0.1, "tip_direction": 0.4},
    {"lateral_force": 0.15},
    {},
    {"tip_direction": -1.0},
]
RATED = {"actuators.lateral_force": {"rate": 60.0, "maximum": 0.25}}
TURNS = [{"speed": value} for value in (2.0, -1.5, -1.5, 0.0, 3.0, 1.0)]
PUSHES = [{"push_force": value} for value in (0.2, 1.2, -0.8, -0.8, 0.05, 1.5)]
CUTS = {"rest_line": "cut-path"}
# Scene, analysis, commands.
CASES = {
    "held, equilibria": (loop_scene(held(0.1)), "static", FORCES),
    "moving, equilibria": (loop_scene(moving(1.0, 0.04, 0.06), loads=None), "static", FORCES),
    "held, inertia": (loop_scene(held(0.1), layers=DAMPED), "dynamic", FORCES),
    "rated, guides": (loop_scene(SPEEDS, layers=DAMPED, support=RIGID_AND_SOFT).with_values(RATED), "dynamic", FORCES),
    "guides creep": (loop_scene(SPEEDS, layers=DAMPED, support=RIGID_AND_SOFT), "quasi-static", FORCES),
    "swelling": (
        loop_scene(SPEEDS, layers=DAMPED, tissue={"stiffness_factor": Sinusoid(mean=1.5, amplitude=0.5, frequency=60.0)}),
        "dynamic",
        TURNS,
    ),
    "speeds, equilibria": (loop_scene(SPEEDS, layers=DAMPED), "static", TURNS),
    "speeds, entry": (loop_scene(SPEEDS, kind="entry", layers=DAMPED, loads=BEVEL), "quasi-static", TURNS),
    "cut path": (loop_scene(SPEEDS, kind="entry", layers=DAMPED, loads=BEVEL, tissue=CUTS), "dynamic", TURNS),
    "cut path, creep, hub": (loop_scene(SPEEDS, layers=DAMPED, tissue=CUTS), "quasi-static", TURNS),
    "push": (loop_scene(PUSH, layers=CAPSULE), "dynamic", PUSHES),
    "push, creep, entry": (loop_scene(PUSH, kind="entry", layers=CAPSULE, loads=BEVEL), "quasi-static", PUSHES),
    "push, cut path, guide": (
        loop_scene(PUSH, layers=CAPSULE, tissue=CUTS, support={"guides": [Guide(position=-0.02, stiffness=2e3)]}),
        "dynamic",
        PUSHES,
    ),
    "sensors": (loop_scene(SPEEDS, layers=DAMPED).with_value("sensors", SENSORS), "dynamic", FORCES),
    "sensors, push": (loop_scene(PUSH, layers=CAPSULE).with_value("sensors", SENSORS), "dynamic", PUSHES),
}
COSTLY = {"push, cut path, guide", "cut path"}
RUNS = [
    pytest.param(case, model, marks=pytest.mark.slow) if model == "elements" and case in COSTLY else (case, model)
    for case in CASES
    for model in MODELS
]


def simulation_of(name, model):
    scene, analysis, commands = CASES[name]
    return Simulation(MODELS[model](scene), time_step=3e-4, analysis=analysis, output_step=1.3e-3), commands


def went_on(simulation, commands, duration=1.7e-3):
    """Readings and trajectory after some more commands, as one list of numbers."""
    told = []
    for command in commands:
        if simulation.stop_reason is None:
            told.append(simulation.step(command, duration))
    run = simulation.trajectory()
    series = [*run.series.values(), *run.signals.values(), run.station_deflection, run.path_deflection, run.guide_force]
    return told, [np.array(one) for one in series], simulation.stop_reason, simulation.steps


def assert_same(one, other):
    assert len(one[0]) == len(other[0]) and one[2:] == other[2:]
    for mine, yours in zip(one[0], other[0], strict=True):
        assert mine.keys() == yours.keys()
        for name in mine:
            assert np.array_equal(mine[name], yours[name])
    for mine, yours in zip(one[1], other[1], strict=True):
        assert np.array_equal(mine, yours, equal_nan=True)


@pytest.mark.parametrize("name, model", RUNS)
def test_copies_go_on_with_the_same_bits(name, model):
    simulation, commands = simulation_of(name, model)
    went_on(simulation, commands[:3])
    state, copied = simulation.state, simulation.copy()
    stored = pickle.dumps(simulation)
    expected = went_on(simulation, commands[3:])
    assert_same(went_on(copied, commands[3:]), expected)
    simulation.restore(state)
    went_on(simulation, commands[:2], 4e-4)  # something else
    other = copy.deepcopy(simulation)
    simulation.restore(state)
    assert_same(went_on(simulation, commands[3:]), expected)
    assert_same(went_on(pickle.loads(stored), commands[3:]), expected)
    other.restore(state)
    assert_same(went_on(other, commands[3:]), expected)


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_scene_can_be_stepped(name):
    simulation = Simulation(build_plant(load_scene(name)))
    simulation.step({}, 1e-3)
    assert simulation.time == pytest.approx(1e-3)
    assert np.isfinite(simulation.trajectory().tip_deflection).all()


@pytest.mark.parametrize("name", ["speeds, entry", "push, creep, entry", "cut path"])
def test_copies_of_needles_whose_matrices_are_asked_for(name):
    scene, analysis, commands = CASES[name]
    plant = AssumedModeNeedle(scene, modes=5)
    plant.is_polynomial = False
    assert not is_known(plant)
    simulation = Simulation(plant, time_step=3e-4, analysis=analysis, output_step=1.3e-3)
    went_on(simulation, commands[:3])
    copied, stored, state = simulation.copy(), pickle.dumps(simulation), simulation.state
    expected = went_on(simulation, commands[3:])
    assert_same(went_on(copied, commands[3:]), expected)
    assert_same(went_on(pickle.loads(stored), commands[3:]), expected)
    simulation.restore(state)
    assert_same(went_on(simulation, commands[3:]), expected)


@pytest.mark.parametrize("name", CASES)
def test_a_run_can_begin_again(name):
    simulation, commands = simulation_of(name, "modes")
    expected = went_on(simulation, commands)
    simulation.reset()
    assert (simulation.time, simulation.steps, simulation.stop_reason) == (0.0, 0, None)
    assert_same(went_on(simulation, commands), expected)


def test_a_new_seed_changes_what_sensors_read_and_nothing_else():
    simulation, commands = simulation_of("sensors", "modes")
    told, series, *_ = went_on(simulation, commands)
    tips = simulation.sampled_tips
    simulation.reset(seed=5)
    others, again, *_ = went_on(simulation, commands)
    assert np.array_equal(simulation.sampled_tips, tips) and np.array_equal(series[0], again[0])
    assert not np.array_equal(told[-1]["needle_shape"], others[-1]["needle_shape"])


def test_a_state_stays_as_it_was():
    """Rows that are shared by states are never written again, whoever goes on from where."""
    simulation, commands = simulation_of("held, inertia", "modes")
    states, lengths = [], []
    for command in commands:
        simulation.step(command, 1.7e-3)
        states.append(simulation.state)
        lengths.append(simulation.trajectory())
    copies = [simulation.copy() for _ in states]
    for one, state in zip(copies, states, strict=True):
        one.restore(state)
        one.step({"lateral_force": -0.2}, 5e-3)
    for state, before in zip(states, lengths, strict=True):
        simulation.restore(state)
        assert np.array_equal(simulation.trajectory().tip_deflection, before.tip_deflection)
        assert np.array_equal(simulation.trajectory().command_lateral_force, before.command_lateral_force)


@pytest.mark.parametrize("name", ["moving, equilibria", "rated, guides", "cut path, creep, hub", "push", "push, creep, entry"])
def test_a_look_at_the_run_changes_nothing(name):
    """Between two samples the last call is repeated for its record."""
    simulation, commands = simulation_of(name, "modes")
    watched = simulation.copy()
    expected = went_on(simulation, commands)
    for command in commands:
        watched.step(command, 1.7e-3)
        last = watched.trajectory()
        assert last.time[-1] == watched.time and last.tip_deflection[-1] == pytest.approx(
            watched.tip_deflection, rel=1e-9, abs=1e-15
        )
    assert_same(([], *went_on(watched, [])[1:]), ([], *expected[1:]))
