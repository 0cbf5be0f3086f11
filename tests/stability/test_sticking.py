"""Sticking and sliding: against an independent integration, closed forms of one degree, refinement of step and mesh, reversal."""

from functools import cache
from itertools import pairwise
from math import sqrt

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.exact import exact_static
from fem_needle.scene import Friction, Insertion, Layer, Sinusoid, Table, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import GEL, LENGTH, MASS, STIFFNESS, profile, rates, scene_of
from tests.stability.assembled import Pushed

VISCOUS = (Layer(start=0.0, foundation_modulus=5e3, damping=5.0),)
SWING = Sinusoid(amplitude=1.2, frequency=40.0)
DURATION = 0.03
MODELS = {
    "elements, hub": ("hub", lambda scene: FiniteElementNeedle(scene, elements=2)),
    "elements, entry": ("entry", lambda scene: FiniteElementNeedle(scene, elements=1)),
    "modes, entry": ("entry", lambda scene: AssumedModeNeedle(scene, modes=2)),
}


def pushed(force, depth=0.1, **keys):
    return Insertion(kind="force", initial_depth=depth, push_force=force, **keys)


def swinging(name):
    """A push to and fro on a bent needle: it rests, goes in, rests, goes out, rests, goes in."""
    kind, make = MODELS[name]
    friction = Friction(coulomb=0.5, viscous=1.0)
    return make(scene_of(kind, pushed(SWING), VISCOUS, [TipLoad(force=1.0)], friction=friction, duration=DURATION))


@cache
def true_motion(name):
    """Depths at which it rests, and depth and tip at the end."""
    whole = Pushed(swinging(name))
    phases = whole.slid(DURATION)
    rests = [state[-2] for _, state, direction in phases if direction != 0]
    time, state, _ = phases[-1]
    return np.array(rests), whole.tip(state, state[-2], time)


@pytest.mark.parametrize("name", ["elements, hub", *(pytest.param(name, marks=pytest.mark.slow) for name in list(MODELS)[1:])])
def test_sticking_and_sliding_under_refinement(name):
    """Where it sticks, and where it is at the end, through three rests: as an integration by other means says."""
    plant, (rests, tip), errors = swinging(name), true_motion(name), []
    assert len(rests) == 3
    for steps in (1, 2):  # between two outputs
        step = DURATION / 100 / steps
        run = simulate(plant, time_step=step, analysis="dynamic", output_step=DURATION / 100)
        errors.append(np.max(np.abs([run.depth[46] - rests[0], run.depth[86] - rests[1], run.depth[-1] - rests[2]])))
        still = run.speed == 0.0
        assert np.count_nonzero(np.diff(still.astype(int)) == -1) == 3  # it breaks away three times, whatever the step
        assert np.ptp(run.depth[(run.time > 0.0128) & (run.time < 0.014)]) == 0.0
        assert run.summary["steps"] < 100 * steps + 10  # and no chatter: a step or two more for each stop and start
    assert errors[-1] < 1e-9
    assert rates(errors)[0] > 2.0  # four, but for vibrations of the elements that these steps do not resolve
    assert run.tip_deflection[-1] == pytest.approx(tip, rel=2e-6)


# One degree of freedom: m v' = f - 0.5, f a triangle of height 0.8 N after 20 ms.

HEIGHT, RISE, HOLDING = 0.8, 0.02, 0.5


def stop_of_the_rod():
    """With s the slope, D = (height - holding) / s: v = 0 again (1 + sqrt 2) D after the top."""
    slope, mass = HEIGHT / RISE, MASS * LENGTH
    lead = (HEIGHT - HOLDING) / slope
    late = (1.0 + sqrt(2.0)) * lead
    way = slope / mass * (lead**3 / 6.0 + lead**2 * late / 2.0 + lead * late**2 / 2.0 - late**3 / 6.0)
    return RISE + late, way


@pytest.mark.parametrize("step", [7e-3, 1e-3, 1e-4])
def test_a_rigid_needle_stops_where_the_closed_form_says(step):
    """Over two decades of steps; the push goes on falling to zero and to -0.49 N, and nothing moves by a bit."""
    stop, way = stop_of_the_rod()
    push = Table(time=[0.0, RISE, 2 * RISE, 3 * RISE], value=[0.0, HEIGHT, 0.0, -0.49])
    assert stop < 2 * RISE
    scene = scene_of("hub", pushed(push, 0.02), (), (), friction=Friction(coulomb=HOLDING), duration=3 * RISE)
    run = simulate(FiniteElementNeedle(scene, elements=1), time_step=step, analysis="dynamic", output_step=RISE / 4)
    rests = run.time > stop
    assert np.count_nonzero(rests) >= 3
    assert np.all(run.speed[rests] == 0.0)
    assert np.ptp(run.depth[rests]) == 0.0
    assert run.depth[-1] - 0.02 == pytest.approx(way, rel=1e-7)


# Left alone in viscous tissue it comes to rest: friction then holds exactly A, which has an exact value.


def left_alone(kind, elements, step):
    push = Table(time=[0.0, 0.01, 0.02, 0.05], value=[0.0, 1.5, 0.0, 0.0])
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=40.0),)
    friction = Friction(coulomb=0.5, viscous=2.0)
    scene = scene_of(kind, pushed(push), layers, [TipLoad(force=1.0)], friction=friction, duration=0.3)
    plant = FiniteElementNeedle(scene, elements=elements)
    return scene, simulate(plant, time_step=step, analysis="dynamic", output_step=0.05)


@pytest.mark.parametrize("kind", ["entry", pytest.param("hub", marks=pytest.mark.slow)])
def test_a_stuck_needle_holds_its_residual_force(kind):
    """Depth, force and tip of the stuck needle converge over elements; the force to A of the exact static solution there."""
    found = []
    for elements in (2, 4, 8):
        scene, run = left_alone(kind, elements, 5e-4)
        assert run.speed[-1] == 0.0
        found.append((run.depth[-1], run.tip_deflection[-1], run.friction_force[-1]))
    exact = exact_static(scene.with_value("insertion", {"kind": "hold", "initial_depth": found[-1][0]}), found[-1][0])
    if kind == "entry":
        force = float(exact.bending_moment(LENGTH - found[-1][0])) ** 2 / (2.0 * STIFFNESS)
    else:
        force = -0.5 * 5e3 * float(exact.deflection(LENGTH - found[-1][0])) ** 2
    assert abs(force) > 1e-5
    errors = np.abs(np.array(found)[:, 1:] / [exact.tip_deflection, force] - 1.0)
    assert np.all(errors[2] < [1e-5, 1e-4])
    assert np.all(errors[2] < errors[0])
    depths = np.array(found)[:, 0] - 0.1
    assert abs(depths[2] / depths[1] - 1.0) < 1e-5
    assert abs(depths[2] - depths[1]) < 0.1 * abs(depths[1] - depths[0])


# Cycles of a prescribed motion: in, hold, out, hold, three times.

CYCLE = ([0.0, 1.0, 1.5, 2.5, 3.0], [0.06, 0.1, 0.1, 0.06, 0.06])
TIMES = [3.0 * number + time for number in range(3) for time in CYCLE[0][:-1]] + [9.0]
DEPTHS = CYCLE[1][:-1] * 3 + [0.06]


@pytest.mark.parametrize("rest_line", ["straight", "cut-path"])
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_cycles_dissipate_what_friction_takes(kind, rest_line):
    """2 integral (mu + mu' z) dz + mu_v v^2 t a cycle, cutting in the first one alone; the lateral state returns."""
    layers = (Layer(start=0.0, foundation_modulus=5e4, cutting_force=0.3),)
    friction = Friction(coulomb=0.4, viscous=2.0, coulomb_per_length=3.0)
    scene = scene_of(
        kind, profile(TIMES, DEPTHS), layers, friction=friction, duration=9.0, tissue={"rest_line": rest_line}
    )
    run = simulate(FiniteElementNeedle(scene, elements=4), time_step=0.05, analysis="quasi-static", output_step=0.5)
    at = [int(np.flatnonzero(np.isclose(run.time, time))[0]) for time in (0.0, 3.0, 6.0, 9.0)]
    sliding = 2.0 * (0.4 * 0.04 + 3.0 * (0.1**2 - 0.06**2) / 2.0) + 2.0 * 0.04**2 * 2.0
    assert np.diff(run.friction_dissipation[at]) == pytest.approx(np.full(3, sliding), rel=1e-9)
    assert np.diff(run.cutting_work[at]) == pytest.approx([0.3 * 0.04, 0.0, 0.0], abs=1e-12)
    assert run.tip_deflection[at[2]] == pytest.approx(run.tip_deflection[at[1]], rel=1e-9)
    assert run.tip_deflection[at[3]] == pytest.approx(run.tip_deflection[at[1]], rel=1e-9)
    energy = run.bending_energy + run.tissue_energy
    assert np.diff(energy[at[1:]]) == pytest.approx(np.zeros(2), abs=1e-9 * energy[0])
    # What the lateral state takes on the way in it gives back on the way out: the work of a cycle is friction's.
    assert np.diff(run.push_work[at[1:]]) == pytest.approx(np.full(2, sliding), rel=1e-6)
    # At 60 mm only what was never cut is around the needle: it stands where it began, also in its own path.
    assert run.tip_deflection[at[1]] == pytest.approx(run.tip_deflection[0], rel=1e-9)


# The path itself.

FIRM = (Layer(start=0.0, foundation_modulus=5e4),)


@cache
def path_of(kind, step, elements=4, *, returns=False, parts=(1.0, 0.12)):
    times, depths = [0.0, parts[0]], [0.05, parts[1]]
    if returns:
        times, depths = [*times, 1.5, 2.0], [*depths, 0.085, 0.115]  # turns where a step ended on the way in
    scene = scene_of(kind, profile(times, depths), FIRM, duration=times[-1], tissue={"rest_line": "cut-path"})
    run = simulate(FiniteElementNeedle(scene, elements=elements), time_step=step, analysis="quasi-static", output_step=0.25)
    return run.path_position, run.path_deflection


def along(path):
    return np.interp(np.linspace(0.06, 0.12, 7), path[0][1:], path[1][1:])


@pytest.mark.parametrize("kind", ["entry", pytest.param("hub", marks=pytest.mark.slow)])
def test_the_path_converges_in_step_and_mesh(kind):
    """The whole path, not its end alone."""
    paths = [along(path_of(kind, step)) for step in (1 / 16, 1 / 32, 1 / 64)]
    scale = np.max(np.abs(paths[-1]))
    changes = [np.max(np.abs(coarse - fine)) / scale for coarse, fine in pairwise(paths)]
    assert rates(changes)[0] > 1.7
    assert changes[-1] < 1e-3
    meshes = [along(path_of(kind, 1 / 16, elements)) for elements in (4, 8, 16)]
    differences = [np.max(np.abs(mesh - meshes[-1])) / scale for mesh in meshes[:-1]]
    assert differences[1] < 1e-5
    assert differences[1] < 0.2 * differences[0]


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_return_leaves_the_path_as_it_was(kind):
    """Out to 85 mm and in again to 115 mm, short of the deepest point: the path is the same, to rounding of the grid."""
    one, two = path_of(kind, 1 / 16), path_of(kind, 1 / 16, returns=True)
    for before, after in zip(one, two, strict=True):
        assert after == pytest.approx(before, rel=1e-13)


def test_a_push_at_its_threshold_does_not_move_and_just_above_it_does():
    for push, moves in ((0.5, False), (0.5 * (1.0 + 1e-9), True), (-0.5, False)):
        scene = scene_of("hub", pushed(push), GEL, (), friction=Friction(coulomb=0.5), duration=0.02)
        run = simulate(FiniteElementNeedle(scene, elements=1), time_step=1e-3, analysis="dynamic", output_step=5e-3)
        assert bool(run.depth[-1] > 0.1) is moves
        assert np.all(np.diff(run.depth) >= 0.0)
