"""Pushed needles: against closed forms, a rigid rod integrated by other means, and their own balances."""

from dataclasses import dataclass
from math import exp, log

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.scene import Friction, Guide, Insertion, Layer, Model, Sinusoid, Table, TipLoad
from fem_needle.scene_file import load_scene
from tests.consistency.scenes import GEL, LENGTH, MASS, rates, scene_of

NEEDLE_MASS = MASS * LENGTH
SKIN = 0.03

CAPSULE = (Layer(start=SKIN, foundation_modulus=5e3, puncture_force=2.3, cutting_force=0.5),)


def pushed(force, depth=0.02, **keys):
    return Insertion(kind="force", initial_depth=depth, push_force=force, **keys)


def run_of(scene, time_step, *, analysis="dynamic", output_step=1e-3, elements=2):
    plant = FiniteElementNeedle(scene, elements=elements)
    return simulate(plant, time_step=time_step, analysis=analysis, output_step=output_step)


def axial_residual(run):
    return float(np.max(np.abs(run.axial_energy_residual)) / np.max(run.axial_kinetic_energy))


# Constant push and viscous friction from rest: v = v_end (1 - exp(-t / T)), T = m / mu.

VISCOUS = 0.3
TIME = NEEDLE_MASS / VISCOUS


def viscous_speed(push, time):
    return push / VISCOUS * (1.0 - np.exp(-time / TIME))


def viscous_way(push, time):
    return push / VISCOUS * (time - TIME * (1.0 - np.exp(-time / TIME)))


def test_constant_push_against_viscous_friction():
    scene = scene_of("hub", pushed(1.0), (), (), friction=Friction(viscous=VISCOUS), duration=0.02)
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        run = run_of(scene, step)
        errors.append(float(np.max(np.abs(run.speed - viscous_speed(1.0, run.time)))))
        assert axial_residual(run) < 1e-12
    assert errors[-1] < 1e-8
    assert min(rates(errors)) > 3.8
    assert run.depth[-1] - 0.02 == pytest.approx(viscous_way(1.0, 0.02), rel=1e-8)
    assert run.friction_dissipation[-1] == pytest.approx(1.0 * (run.depth[-1] - 0.02) - run.axial_kinetic_energy[-1], rel=1e-9)


def test_a_ramp_breaks_away_when_it_exceeds_friction():
    """Push 2 t against 0.5 N: at rest to the last bit until 0.25 s, then z = z_0 + 2 (t - 0.25)^3 / (6 m)."""
    ramp = Table(time=[0.0, 1.0], value=[0.0, 2.0])
    scene = scene_of("hub", pushed(ramp), (), (), friction=Friction(coulomb=0.5), duration=0.28)
    run = run_of(scene, 3e-3, output_step=1e-2)
    holds = run.time < 0.25 + 1e-9
    assert np.count_nonzero(holds) == 26
    assert np.all(run.depth[holds] == 0.02)
    assert np.all(run.speed[holds] == 0.0)
    moved = 2.0 * (run.time[~holds] - 0.25) ** 3 / (6.0 * NEEDLE_MASS)
    assert run.depth[~holds] - 0.02 == pytest.approx(moved, rel=1e-6)


# A sinusoid pushes to and fro against Coulomb friction: sticking, sliding, sticking.

BUZZ = Sinusoid(amplitude=1.0, frequency=5.0)
HOLDING, SLOWING = 0.5, 2.0


@dataclass(frozen=True)
class Rigid:
    """Depth and number of changes between moving in, resting and moving out."""

    depth: float
    changes: int


def rigid_rod(duration, depth=0.1):
    """Integrate m v' = f - sign(v) 0.5 - 2 v from rest, piece by piece: while it slides with events, while it rests by roots."""
    time, changes = 0.0, 0
    while time < duration:
        force = BUZZ.value(time)
        if abs(force) <= HOLDING + 1e-12:
            grid = np.linspace(time, duration, 20001)
            beyond = np.abs(BUZZ.value(grid)) > HOLDING
            if not beyond.any():
                break
            first = int(np.argmax(beyond))
            time = brentq(lambda t: abs(BUZZ.value(t)) - HOLDING, grid[first - 1], grid[first], xtol=1e-15)
            force, changes = BUZZ.value(time + 1e-9), changes + 1
        direction = np.sign(force)

        def rate(now, state, direction=direction):
            return [state[1], (BUZZ.value(now) - direction * HOLDING - SLOWING * state[1]) / NEEDLE_MASS]

        def stops(now, state, direction=direction, start=time):
            return state[1] * direction + (1e-12 if now < start + 1e-4 else 0.0)

        stops.terminal, stops.direction = True, -1
        found = solve_ivp(rate, (time, duration), [depth, 0.0], method="DOP853", rtol=1e-12, atol=1e-14, events=stops)
        time, depth = float(found.t[-1]), float(found.y[0, -1])
        changes += found.status == 1
    return Rigid(depth, changes)


def buzzing(duration):
    friction = Friction(coulomb=HOLDING, viscous=SLOWING)
    return scene_of("hub", pushed(BUZZ, 0.1), GEL, (), friction=friction, duration=duration)


def changes_of(run):
    return np.count_nonzero(np.diff(np.sign(run.speed)))


@pytest.mark.parametrize("analysis", ["dynamic", pytest.param("quasi-static", marks=pytest.mark.slow)])
def test_sticking_is_the_same_for_all_steps(analysis):
    expected = rigid_rod(0.5)
    assert expected.changes > 8
    for step, allowed in ((1e-2, 1e-5), (1e-3, 1e-7)):
        run = run_of(buzzing(0.5), step, analysis=analysis, output_step=2e-3 if step < 2e-3 else 1e-2)
        assert run.depth[-1] - 0.1 == pytest.approx(expected.depth - 0.1, rel=allowed)
        assert changes_of(run) == expected.changes


@pytest.mark.slow
def test_sticking_is_the_same_over_four_decades():
    expected = rigid_rod(0.15)
    for step, allowed in ((2e-2, 1e-3), (2e-3, 1e-5), (2e-4, 1e-8), (2e-5, 1e-8), (2e-6, 1e-8)):
        run = run_of(buzzing(0.15), step, analysis="quasi-static", output_step=0.05, elements=1)
        assert run.depth[-1] - 0.1 == pytest.approx(expected.depth - 0.1, rel=allowed)


@pytest.mark.parametrize("step", [1e-4, 1e-5])
def test_a_holding_needle_does_not_drift(step):
    """The tip swings, A swings with it, the push stays below friction: the depth does not move by a bit."""
    initial = {"shape": "tip-displaced", "tip_deflection": 1e-3}
    scene = scene_of(
        "hub", pushed(Sinusoid(amplitude=0.4, frequency=50.0), 0.1), GEL, (), friction=Friction(coulomb=0.5),
        initial=initial, duration=0.01,
    )  # fmt: skip
    run = run_of(scene, step, elements=4)
    assert np.ptp(run.tip_deflection) > 1e-3
    assert np.all(run.depth == 0.1)
    assert np.all(run.speed == 0.0)
    assert run.friction_dissipation[-1] == run.push_work[-1] == 0.0


def test_cutting_works_once_on_each_depth():
    """In, out and in again: cutting takes its force times the way into uncut tissue, however often the needle passes it."""
    layers = (Layer(start=0.0, foundation_modulus=5e3, cutting_force=0.2),)
    push = Sinusoid(amplitude=1.0, frequency=10.0, phase=0.0)
    scene = scene_of("hub", pushed(push, 0.1), layers, (), friction=Friction(coulomb=0.1, viscous=3.0), duration=0.35)
    run = run_of(scene, 5e-4)
    assert np.min(run.speed) < -0.1
    assert np.count_nonzero(np.diff(np.sign(run.speed)) < 0) >= 3
    assert axial_residual(run) < 1e-9
    assert run.cutting_work[-1] == pytest.approx(0.2 * (np.max(run.depth) - 0.1), rel=1e-3)
    grows = np.diff(run.cutting_work) > 1e-12
    assert np.all(run.depth[1:][grows] >= np.maximum.accumulate(run.depth)[1:][grows] - 1e-12)


# Puncture.


def test_a_membrane_stops_a_needle_that_is_too_weak():
    """It arrives with the speed of the closed form; all its kinetic energy is lost, and it is stuck there."""
    friction = Friction(viscous=VISCOUS)
    scene = scene_of("hub", pushed(1.0), CAPSULE, (), friction=friction, duration=0.2)
    run = run_of(scene, 1e-4)
    arrival = brentq(lambda t: viscous_way(1.0, t) - (SKIN - 0.02), 1e-4, 0.1)
    assert run.summary["stop_reason"] == "stuck"
    assert (run.depth[-1], run.speed[-1], run.cutting_work[-1]) == (SKIN, 0.0, 0.0)
    assert run.time[-1] == pytest.approx(arrival, rel=1e-8)
    assert run.arrest_loss[-1] == pytest.approx(0.5 * NEEDLE_MASS * viscous_speed(1.0, arrival) ** 2, rel=1e-8)
    assert axial_residual(run) < 1e-12


def test_a_ramp_pierces_a_membrane_when_it_exceeds_puncture_and_friction():
    """2.3 N and 10 N/m times 30 mm: held until the push is 2.6 N, at 2.6 s, then cutting takes the place of the puncture."""
    friction = Friction(viscous=5.0, coulomb_per_length=10.0)
    ramp = Table(time=[0.0, 4.0], value=[0.0, 4.0])
    scene = scene_of("hub", pushed(ramp, final_depth=0.1), CAPSULE, (), friction=friction, duration=4.0)
    run = run_of(scene, 5e-3, output_step=0.02)
    held = run.depth == SKIN
    assert run.time[held][-1] == pytest.approx(2.6, abs=0.0201)
    assert np.all(run.depth[run.time > 2.6001] > SKIN)
    assert run.summary["stop_reason"] == "final-depth"
    assert run.cutting_work[-1] == pytest.approx(0.5 * (0.1 - SKIN), rel=1e-9)
    assert axial_residual(run) < 1e-9


def test_a_membrane_is_pierced_once():
    """A push of 3 N passes without a stop; puncture does no work."""
    scene = scene_of("hub", pushed(3.0, final_depth=0.05), CAPSULE, (), friction=Friction(viscous=VISCOUS))
    run = run_of(scene, 1e-4)
    assert run.summary["stop_reason"] == "final-depth"
    assert run.arrest_loss[-1] == 0.0
    gained = 3.0 * 0.03 - 0.5 * (0.05 - SKIN) - run.friction_dissipation[-1]
    assert run.axial_kinetic_energy[-1] == pytest.approx(gained, rel=1e-9)


# Ends.

ENDS = {
    "final-depth": ("hub", pushed(1.0, final_depth=0.05), {}, 0.05),
    "full-length": ("entry", pushed(3.0, 0.18), {}, LENGTH),
    "hub-contact": ("hub", pushed(1.0, 0.15), {"support": {"guides": [Guide(position=-0.03)]}}, LENGTH - 0.03),
    "stuck": ("hub", pushed(0.1), {"friction": Friction(coulomb=0.5)}, 0.02),
    "duration": ("hub", pushed(0.1), {"duration": 0.002}, None),
    "withdrawn": ("hub", pushed(-1.0), {}, 0.0),
}




@pytest.mark.parametrize("reason", list(ENDS))
def test_every_way_to_end(reason):
    kind, insertion, parts, depth = ENDS[reason]
    run = run_of(scene_of(kind, insertion, GEL, [TipLoad(force=0.01)], **({"duration": 0.2} | parts)), 2e-4)
    assert run.summary["stop_reason"] == reason
    if depth is None:
        assert run.time[-1] == pytest.approx(0.002)
    else:
        assert run.depth[-1] == pytest.approx(depth, abs=1e-15)
        assert run.time[-1] < 0.2


# The thesis' open-loop simulation.


def open_loop(kinematics, time_step, output_step=2.5e-5):
    scene = load_scene("thesis-open-loop").with_value("model.kinematics", kinematics).with_value("run.duration", 0.05)
    return run_of(scene, time_step, output_step=output_step, elements=12)


@pytest.mark.slow
def test_the_thesis_needle_tends_to_its_speed():
    """3 N against 0.56 N and 0.3 N s/m: 8.13 m/s (1 - exp(-t / 6.8 ms)) but for A, which is small; 18 cm after 26 ms."""
    run = open_loop("material", 2e-5, 1e-3)
    assert run.summary["stop_reason"] == "final-depth"
    driving = 3.0 - 0.56
    assert driving / VISCOUS == pytest.approx(8.13, abs=0.005)
    arrival = brentq(lambda t: viscous_way(driving, t) - 0.16, 1e-3, 0.1)
    assert run.time[-1] == pytest.approx(arrival, rel=1e-2)
    assert run.time[-1] < arrival  # A, the sleeve that the bent needle is pushed out of, helps
    assert run.time[-1] == pytest.approx(0.026, abs=2e-4)
    assert run.speed == pytest.approx(viscous_speed(driving, run.time), abs=0.15)
    assert run.speed[-1] == pytest.approx(viscous_speed(driving, run.time[-1]), rel=5e-3)
    assert run.summary["relative_energy_residual"] < 5e-4
    assert axial_residual(run) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(("kinematics", "largest"), [("material", 1.128e-3), ("fixed-frame", 1.118e-3)])
def test_the_thesis_tip_and_its_ledger(kinematics, largest):
    """The largest tips are our own figures with 12 elements, stated in docs/verification.md: here they only must not wander."""
    run = open_loop(kinematics, 1e-6)
    assert run.summary["relative_energy_residual"] < 1e-6
    assert axial_residual(run) < 1e-6
    assert np.max(np.abs(run.tip_deflection)) == pytest.approx(largest, rel=1e-3)


# Balances with everything at work.


@pytest.mark.parametrize(
    ("kind", "parts"),
    [
        pytest.param("hub", {}, marks=pytest.mark.slow),
        ("entry", {}),
        pytest.param("entry", {"model": Model(kinematics="fixed-frame")}, marks=pytest.mark.slow),
        pytest.param("hub", {"tissue": {"rest_line": "cut-path"}}, marks=pytest.mark.slow),
    ],
)
def test_both_ledgers_of_a_needle_pushed_through_layers(kind, parts):
    layers = (
        Layer(start=0.0, end=0.05, foundation_modulus=5e3, damping=5.0, cutting_force=0.2),
        Layer(start=0.05, foundation_modulus=2e4, damping=20.0, cutting_force=0.4, puncture_force=0.5),
    )
    friction = Friction(coulomb=0.1, viscous=0.3, coulomb_per_length=2.0, viscous_per_length=1.0)
    push = Sinusoid(mean=1.5, amplitude=0.5, frequency=30.0)
    insertion = pushed(push, 0.03, final_depth=0.08)
    scene = scene_of(kind, insertion, layers, [TipLoad(force=0.1)], friction=friction, duration=0.05, **parts)
    run = run_of(scene, 4e-5, elements=4)
    assert run.summary["stop_reason"] == "final-depth"
    assert axial_residual(run) < 1e-4
    assert run.summary["relative_energy_residual"] < 1e-4


def test_the_time_to_the_speed_limit_is_that_of_the_rod():
    """Half of the final speed after T log 2."""
    scene = scene_of("hub", pushed(1.0), (), (), friction=Friction(viscous=VISCOUS), duration=TIME * log(2.0))
    run = run_of(scene, 1e-4)
    assert run.speed[-1] == pytest.approx(0.5 / VISCOUS, rel=1e-9)
    assert exp(-run.time[-1] / TIME) == pytest.approx(0.5)


def test_the_start_is_shown_where_the_needle_stops_before_the_first_output():
    """A push that begins above friction and sinks below it at once."""
    sinking = Table(time=[0.0, 1e-3, 1.0], value=[0.5, 0.0, 0.0])
    insertion = Insertion(kind="force", initial_depth=0.05, push_force=sinking)
    scene = scene_of("entry", insertion, (), friction=Friction(coulomb=0.3), duration=0.04)
    run = simulate(FiniteElementNeedle(scene, elements=2), time_step=1e-3, output_step=0.02)
    assert run.time.tolist() == pytest.approx([0.0, 0.02, 0.04])
    assert run.depth[0] == 0.05 < run.depth[1] == run.depth[2]
    assert run.push_force[0] == pytest.approx(0.5)
    assert abs(run.axial_energy_residual[-1]) < 1e-6 * run.push_work[-1]


def test_a_bent_needle_that_is_pulled_out_is_straight():
    """Under `entry` the inserted part gets ever shorter, and what swings in it ever faster: that ends where it is out."""
    loads, friction = [TipLoad(force=0.1)], Friction(coulomb=0.2, viscous=2.0)
    layers = (Layer(foundation_modulus=5e3, damping=100.0),)
    scene = scene_of("entry", pushed(-1.0, 0.04), layers, loads, friction=friction, duration=0.5)
    run = run_of(scene, 1e-4, output_step=0.01, elements=4)
    assert (run.summary["stop_reason"], run.depth[-1]) == ("withdrawn", 0.0)
    assert np.max(np.abs(run.energy_residual)) < 1e-4 * np.max(run.bending_energy)
    assert run.tip_deflection[-1] == run.bending_energy[-1] == run.kinetic_energy[-1] == 0.0
    assert axial_residual(run) < 1e-5
