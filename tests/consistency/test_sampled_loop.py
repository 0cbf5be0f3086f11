"""Loops around a needle against sampled linear systems, readings against the truth, and what is kept of a run."""

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import cont2discrete

from fem_needle import FiniteElementNeedle, Simulation, build_plant, linearize, simulate, steer
from fem_needle.closed_loop.simulation import UnstableLoopError
from fem_needle.control.model_response import model_response
from fem_needle.control.pid import Pid
from fem_needle.control.signals import output_reader
from fem_needle.errors import ComputationError
from fem_needle.export import export_run
from fem_needle.scene import LateralLoad, Layer, TipLoad
from fem_needle.trajectory import Trajectory
from reduced_model import AssumedModeNeedle
from tests.consistency.closed_loop_scenes import MODELS, loop_scene
from tests.consistency.scenes import moving
from tests.unit.control.scenes import tube

DAMPED = (Layer(start=0.0, foundation_modulus=5e3, damping=10.0),)
LOADS = [TipLoad(force=0.0), LateralLoad(position=-0.0123, force=0.0)]
TARGET = 1e-3
FEW = {
    "one mode": lambda scene: AssumedModeNeedle(scene, modes=1),
    "two modes": lambda scene: AssumedModeNeedle(scene, modes=2),
    "two elements": lambda scene: FiniteElementNeedle(scene, elements=2),
}


def pid(period, proportional, integral=0.0, derivative=0.0, filter_time=0.0):
    reader = output_reader("tip_deflection")
    return Pid("lateral_force", reader, TARGET, period, proportional, integral, derivative, filter_time)


def held_scene(**changes):
    return loop_scene(layers=DAMPED, loads=LOADS, duration=10.0).with_values(changes)


def linear(plant):
    """A, B, C from the finger to the tip."""
    model = linearize(plant, depth=0.1, axial="held")
    column = [signal.name for signal in model.inputs].index("lateral_force")
    return model.A, model.B[:, [column]], model.C[[0]]


def closed_matrix(plant, controller):
    """The map of (state, integral, filtered rate, last output) from tick to tick, and its constant part: exact ZOH."""
    system, given, seen = linear(plant)
    count, period = len(system), controller.period
    held, driven = cont2discrete((system, given, seen, np.zeros((1, 1))), period)[:2]
    smooth = controller.filter_time + period
    # One row for each of: integral, rate, output before, from (x, S, d, y_before, 1).
    output = np.hstack([seen[0], 0.0, 0.0, 0.0, 0.0])
    one = np.eye(count + 4)
    error = TARGET * one[-1] - output
    integral = one[count] + period * error
    rate = (controller.filter_time * one[count + 1] - output + one[count + 2]) / smooth
    command = controller.proportional * error + controller.integral * integral + controller.derivative * rate
    state = np.hstack([held, np.zeros((count, 4))]) + driven @ command[None, :]
    return np.vstack([state, integral, rate, output, one[-1]])


def observed(plant, controller, ticks, time_step):
    """The tips at the ticks of a loop that is closed by hand."""
    simulation = Simulation(plant, time_step=time_step, analysis="dynamic", output_step=1e3)
    state, tips = controller.begin(), [simulation.tip_deflection]
    for tick in range(ticks):
        state, command = controller.update(state, simulation.time, simulation.measurement())
        simulation.step(command, (tick + 1) * controller.period - simulation.time)
        tips.append(simulation.tip_deflection)
    return np.array(tips)


@pytest.mark.parametrize("model", FEW)
def test_a_sampled_loop_is_the_linear_system_with_a_hold(model):
    plant = FEW[model](held_scene())
    system, given, seen = linear(plant)
    gain = float((-seen @ np.linalg.solve(system, given))[0, 0])
    period = 2e-4 if model == "two elements" else 2e-3
    share = (0.01 if model == "two elements" else 0.1) / gain  # all terms act, and no vibration leaves its bounds
    controller = pid(period, share, share / period, 0.2 * period * share, 2 * period)
    found = observed(plant, controller, 30, time_step=period / 40)
    matrix = closed_matrix(plant, controller)
    state = np.zeros(len(matrix))
    state[-1] = 1.0
    expected = [0.0]
    for _ in range(30):
        state = matrix @ state
        expected.append(float(seen[0] @ state[: len(system)]))
    error = np.max(np.abs(found - expected)) / np.max(np.abs(expected))
    # A step turns the fastest vibration by 0.05, 0.2 and 0.12.
    assert error < {"one mode": 1e-6, "two modes": 1e-5, "two elements": 1e-5}[model]


def test_a_fast_loop_decays_as_the_poles_of_the_continuous_one():
    """P control, T -> 0: what is left over from the poles of A - B P C falls with T."""
    plant = FEW["one mode"](held_scene())
    system, given, seen = linear(plant)
    gain = float((-seen @ np.linalg.solve(system, given))[0, 0])
    proportional = 1.0 / gain
    closed = system - proportional * given @ seen
    poles = np.linalg.eigvals(closed)
    rest = float((-seen @ np.linalg.solve(closed, given))[0, 0]) * proportional * TARGET
    errors = []
    for period in (1e-4, 5e-5):
        tips = observed(plant, pid(period, proportional), round(0.02 / period), time_step=period)
        times = period * np.arange(len(tips))
        basis = np.stack([np.exp(poles[0].real * times) * wave(poles[0].imag * times) for wave in (np.cos, np.sin)], axis=1)
        start = np.array([-rest, poles[0].real * rest / abs(poles[0].imag)])
        start[1] *= np.sign(poles[0].imag)
        errors.append(np.max(np.abs(tips - rest - basis @ start)) / rest)
    assert errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


def radius(plant, controller):
    """The largest eigenvalue of a proportional loop: of the needle's own states."""
    count = len(linear(plant)[0])
    return float(np.max(np.abs(np.linalg.eigvals(closed_matrix(plant, controller)[:count, :count]))))


@pytest.mark.parametrize("model", ["one mode", "two modes"])
def test_the_critical_gain_is_that_of_the_sampled_loop(model):
    plant = FEW[model](held_scene())
    system, given, seen = linear(plant)
    gain = float((-seen @ np.linalg.solve(system, given))[0, 0])
    period, low, high = 1e-3, 0.0, 100.0 / gain
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius(plant, pid(period, middle)) < 1.0 else (low, middle)
    below, above = pid(period, 0.95 * low), pid(period, 1.05 * low)
    assert radius(plant, below) < 1.0 < radius(plant, above)
    tips = observed(plant, below, 200, time_step=period / 8)
    assert np.ptp(tips[-40:]) < 0.7 * np.ptp(tips[:40])
    tips = observed(plant, above, 200, time_step=period / 8)
    assert np.ptp(tips[-40:]) > 1.5 * np.ptp(tips[:40])


def test_a_loop_that_grows_ends_with_what_there_was():
    plant = FEW["one mode"](held_scene())
    system, given, seen = linear(plant)
    gain = float((-seen @ np.linalg.solve(system, given))[0, 0])
    with pytest.raises(UnstableLoopError, match="half the needle's length") as caught:
        observed(plant, pid(2e-3, 10.0 / gain), 3000, time_step=2e-4)
    partial = caught.value.partial
    assert partial.summary["stop_reason"] == "unstable"
    assert abs(partial.tip_deflection[-1]) > 0.1 and abs(partial.tip_deflection[0]) < 1e-12
    assert len(partial.signals["command_lateral_force"]) == len(partial.time)


SIGN_CHANGE = {"kind": "hold", "initial_depth": 0.11}


@pytest.mark.parametrize("kind", ["fem", "assumed-modes"])
def test_beyond_the_sign_change_plain_control_drives_the_tip_away(kind):
    """The gain is that of 50 mm; at 110 mm a finger at the skin moves the tip the other way. Scheduled gains turn with it."""
    model = {"kind": kind} | ({"modes": 4} if kind == "assumed-modes" else {})
    sensors = [{"kind": "tip-imaging", "period": 0.01}, {"kind": "encoder", "period": 0.01}]
    changes = {
        "model": model,
        "numerics": {"analysis": "static"} | ({"elements": 12} if kind == "fem" else {}),
        "target": {"lateral": TARGET},
        "sensors": sensors,
    }
    runs = {}
    for schedule in ("none", "model-gain"):
        insertion = {"kind": "speed", "initial_depth": 0.05, "speed": 0.2, "final_depth": 0.12}
        controller = {"kind": "pid", "period": 0.01, "schedule": schedule}
        scene = tube(controller, insertion=insertion, run={"duration": 3.0}, **changes)
        try:
            runs[schedule] = steer(scene)
        except ComputationError as error:
            runs[schedule] = error.partial
    known = model_response(build_plant(scene), "lateral_force", depths=(0.05, 0.12))
    expected = {"fem": pytest.approx(0.0923, abs=2e-4), "assumed-modes": pytest.approx(0.0923, abs=6e-3)}[kind]
    assert [expected] == list(known.sign_changes)
    errors = {schedule: np.abs(run.tip_deflection - TARGET) for schedule, run in runs.items()}
    plain, scheduled = errors["none"], errors["model-gain"]
    beyond = runs["none"].depth >= known.sign_changes[0]
    assert np.all(np.diff(plain[beyond][5:]) > 0.0) and plain[-1] > 10 * TARGET
    assert scheduled[-1] < 1e-3 * TARGET


PERIOD = 0.003
SENSING = moving(0.05, 0.05, 0.06)


def readings(plant, tick, count, analysis="static"):
    """What is known at the ends of ticks under no command."""
    simulation = Simulation(plant, time_step=1e-3, analysis=analysis, output_step=1e3)
    return [(time, simulation.step({}, time - simulation.time)) for time in tick * np.arange(1, count + 1)]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ["static", "dynamic"])
def test_a_reading_is_the_tip_at_the_sensors_own_instant(analysis, model):
    """Ticks of 4.7 ms, readings every 3 ms, late by 4 ms: the reading of n 3 ms is the tip there and nowhere else."""
    shape = {"kind": "needle-shape", "period": 0.005, "stations": 5}
    sensors = [{"kind": "tip-imaging", "period": PERIOD, "delay": 0.004}, shape]
    plant = MODELS[model](loop_scene(SENSING, duration=0.05).with_value("sensors", sensors))
    run = simulate(plant, time_step=5e-4, analysis=analysis, output_step=1e-3)
    stations = np.linspace(0.0, 0.2, 5)
    close = 1e-9 if analysis == "static" else 1e-5  # with inertia the loop has other steps
    for time, reading in readings(plant, 0.0047, 10, analysis):
        arrived = int(np.floor((time - 0.004) / PERIOD + 1e-6))
        assert ("tip_deflection" in reading) == (arrived >= 0)
        if arrived >= 0:
            assert reading["tip_deflection"] == pytest.approx(run.tip_deflection[3 * arrived], rel=close)
        shown = 5 * int(np.floor(time / 0.005 + 1e-6))
        expected = plant.deflection(run.coordinates[shown], run.point_forces[shown], run.depth[shown], stations)
        assert reading["needle_shape"] == pytest.approx(expected, rel=close, abs=close * np.max(np.abs(expected)))
    assert np.min(np.abs(np.diff(run.tip_deflection[::3]))) > 10 * close * np.max(np.abs(run.tip_deflection))


@pytest.mark.slow
def test_ticks_do_not_drift():
    """After 1e4 commanded durations, each rounded, the sensor still reads at n T."""
    scene = loop_scene(moving(0.05, 0.05, 0.15), duration=2.0).with_value("sensors", [{"kind": "encoder", "period": 1e-3 / 3}])
    found = readings(MODELS["modes"](scene), 1e-4, 10_000)
    for time, reading in found[::997]:
        last = np.floor(time / (1e-3 / 3) + 1e-6) * 1e-3 / 3
        assert reading["depth"] == pytest.approx(0.05 + 0.05 * last, rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_a_steered_run_is_kept_with_its_signals(model, tmp_path):
    sensors = [{"kind": "tip-imaging", "period": 0.01, "delay": 0.015}, {"kind": "needle-shape", "period": 0.02, "stations": 3}]
    controller = {"kind": "pid", "period": 0.01, "gains": {"proportional": 50.0, "integral": 500.0}}
    scene = loop_scene(moving(0.05, 0.05, 0.06), duration=0.2).with_values({"sensors": sensors, "numerics.analysis": "static"})
    simulation = Simulation(MODELS[model](scene.with_value("controller", controller)), time_step=0.01, output_step=0.01)
    reader = Pid("lateral_force", output_reader("tip_deflection"), TARGET, 0.01, 50.0, 500.0, 0.0, 0.0)
    state = reader.begin()
    for tick in range(20):
        state, command = reader.update(state, simulation.time, simulation.measurement())
        simulation.step(command, (tick + 1) * 0.01 - simulation.time)
    run = simulation.trajectory()
    loaded = Trajectory.load(run.save(tmp_path / "run"))
    assert set(loaded.signals) == set(run.signals) == {
        "command_lateral_force", "measurement_tip_deflection", "measurement_needle_angle", "measurement_needle_shape"
    }
    for name, values in run.signals.items():
        assert np.array_equal(loaded.signals[name], values, equal_nan=True)
    assert np.isnan(run.signals["measurement_tip_deflection"][0]) and run.signals["measurement_needle_shape"].shape == (21, 3)
    export_run(loaded, "csv", tmp_path / "csv")
    export_run(loaded, "mat", tmp_path / "run.mat")
    head = (tmp_path / "csv" / "series.csv").read_text(encoding="utf-8")
    assert "command_lateral_force" in head and "measurement_tip_deflection" in head
    assert any("command_lateral_force" in key or "signals" in key for key in loadmat(tmp_path / "run.mat"))
