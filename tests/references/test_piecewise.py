"""The references on pieces, with bevel, cut path and push: against closed forms, the other references, and themselves.

Measured in three layers, damping, 3 m/s, a bevel force that jumps: degrees 16 and 24 differ by 6e-10 at steps of 0.025 ms,
steps of 0.1 and 0.025 ms by 1.3e-4: every jump starts vibrations of all frequencies.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_needle.exact import exact_static
from fem_needle.scene import Friction, Guide, Initial, Insertion, LateralLoad, Layer, Needle, Sinusoid, Table, TipLoad
from tests.references import entry_motion, hub_motion, piecewise_motion, pushed_motion
from tests.references.gauss import RADAU
from tests.references.piecewise_motion import Motor
from tests.references.piecewise_needle import local_functions
from tests.references.test_references import BUZZ, GEL, LAYERS, NEEDLE, PUSH, held, largest_difference, moving, scene_of

BEVEL = (TipLoad(bevel_coefficient=1e-6),)
LIGHT = Needle(length=0.2, bending_stiffness=0.0256, mass_per_length=1e-7)  # without inertia, as good as
MASS = NEEDLE.mass_per_length * NEEDLE.length


def cut(scene):
    return scene.with_value("tissue.rest_line", "cut-path")


def test_functions_of_a_piece():
    x = np.linspace(0.05, 0.95, 7) + 1e-30j
    value, first, second = local_functions(x, 14)
    assert value.imag / 1e-30 == pytest.approx(first.real, rel=1e-10, abs=1e-10)
    assert first.imag / 1e-30 == pytest.approx(second.real, rel=1e-10, abs=1e-9)
    ends = local_functions(np.array([0.0, 1.0]), 14)
    corners = np.concatenate([ends[:2, 0], ends[:2, 1]])
    assert np.array_equal(corners, np.eye(4, 14))
    nodes, weights = np.polynomial.legendre.leggauss(30)
    bubbles = local_functions((nodes + 1.0) / 2.0, 14)[0][:, 4:]
    gram = (bubbles * weights[:, None]).T @ bubbles
    norms = np.sqrt(np.diag(gram))
    assert gram / np.outer(norms, norms) == pytest.approx(np.eye(10), abs=1e-12)


# Statics, and the other references.


@pytest.mark.parametrize("guides", [[], [Guide(position=-0.03, stiffness=1e3)], [Guide(position=-0.03)]])
def test_static_start_between_breaks_is_exact(guides):
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.2)]
    support = {"guides": guides, "hub_deflection": 1e-3, "hub_angle": 0.01}
    scene = scene_of("hub", held(0.13), LAYERS, loads, support=support)
    motor = Motor(scene, [-0.03, -0.005, 0.0, 0.05, 0.08, 0.1], 16)
    assert motor.start(0.13, 0.0)[0][motor.tip] == pytest.approx(exact_static(scene, 0.13).tip_deflection, rel=1e-9)


@pytest.mark.parametrize("depth", [0.03, 0.06, 0.08, 0.09, 0.12])
def test_a_bevel_pushes_by_the_layer_at_the_tip(depth):
    """a k of the deeper layer at a border, nothing in a gap."""
    motor = Motor(scene_of("entry", held(depth), LAYERS, BEVEL), [0.0], 24)
    modulus = {0.03: 5e3, 0.06: 2e4, 0.08: 0.0, 0.09: 0.0, 0.12: 5e4}[depth]
    expected = exact_static(scene_of("entry", held(depth), LAYERS, [TipLoad(force=1e-6 * modulus)]), depth).tip_deflection
    assert motor.start(depth, 0.0)[0][motor.tip] == pytest.approx(expected, rel=1e-6, abs=1e-15)


def test_a_bevel_that_is_turned_pushes_by_its_cosine():
    turned = [TipLoad(bevel_coefficient=2e-6, direction=Table(time=[0.0, 0.02], value=[0.5, -0.5]))]
    ramp = [TipLoad(force=Table(time=[0.0, 0.02], value=[5e-3, -5e-3]))]
    time = np.linspace(0.0, 0.03, 11)
    by_bevel, by_force = (piecewise_motion(scene_of("entry", moving(1.0), GEL, loads), time, 10, 2e4) for loads in (turned, ramp))
    assert largest_difference(by_bevel, by_force) < 1e-12
    assert by_force[0] * by_force[-1] < 0.0


def test_one_piece_agrees_with_the_growing_beam():
    scene = scene_of("entry", moving(3.0, 0.05, 0.13), loads=[TipLoad(force=BUZZ)])
    time = np.linspace(0.0, 0.025, 21)  # still on its way: no kink leaves vibrations that only steps resolve
    expected = entry_motion(scene, 0.025, time, steps_per_second=4e4).tip_deflection
    assert largest_difference(piecewise_motion(scene, time, 14, 4e4), expected) < 1e-7


def test_pieces_agree_with_the_whole_needle():
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=BUZZ)]
    scene = scene_of("hub", moving(1.0, 0.05, 0.07), GEL, loads, support={"guides": [Guide(position=-0.03, stiffness=2e3)]})
    time = np.linspace(0.0, 0.03, 16)
    expected = hub_motion(scene, 0.03, time, degree=36, steps_per_second=2e4).tip_deflection
    assert largest_difference(piecewise_motion(scene, time, 12, 2e4), expected) < 2e-4


def test_a_border_between_equal_layers_changes_nothing():
    """It becomes a break on the way: the motion goes over to the new pieces without loss."""
    halves = (Layer(start=0.0, end=0.06, foundation_modulus=5e3), Layer(start=0.06, foundation_modulus=5e3))
    time = np.linspace(0.0, 0.025, 16)
    whole, parted = (
        piecewise_motion(scene_of("entry", moving(3.0, 0.04, 0.12), layers, [TipLoad(force=BUZZ)]), time, 14, 4e4)
        for layers in (GEL, halves)
    )
    assert largest_difference(parted, whole) < 1e-7


@pytest.mark.slow
def test_a_bevel_in_layers_converges():
    """The difference of degrees is far below what the steps leave, and that falls at least with their first power."""
    scene = scene_of("entry", moving(3.0, 0.02, 0.13), LAYERS, [*PUSH, *BEVEL])
    time = np.linspace(0.0, 0.05, 26)
    coarse, finer, finest = (piecewise_motion(scene, time, 12, steps, RADAU) for steps in (5e3, 1e4, 2e4))
    higher = piecewise_motion(scene, time, 18, 1e4, RADAU)
    assert largest_difference(higher, finer) < 1e-7
    assert largest_difference(finest, finer) < 0.5 * largest_difference(finer, coarse)
    assert largest_difference(finest, entry_motion(scene, 0.05, time, degree=24, steps_per_second=4e4).tip_deflection) < 1e-3


# Cut path.


def test_a_displaced_straight_needle_rests_in_its_path():
    """A hub at h, tissue from the tip on: the tip cuts r = h, so that w = h leaves every spring at rest."""
    layers = (Layer(start=0.05, foundation_modulus=5e4, damping=50.0),)
    parts = {"support": {"hub_deflection": 2e-3}, "initial": Initial(shape="straight")}
    scene, time = scene_of("hub", moving(1.0, 0.05, 0.15), layers, (), **parts), np.linspace(0.0, 0.1, 21)
    assert piecewise_motion(cut(scene), time, 10, 2e3) == pytest.approx(np.full(21, 2e-3), rel=1e-9)
    assert np.ptp(piecewise_motion(scene, time, 10, 2e3)) > 1e-3


@pytest.mark.slow
def test_a_constant_tip_force_steers_with_constant_curvature():
    """F / (beta EI) far from both ends, beta = (k / 4EI)^(1/4)."""
    stiff = (Layer(start=0.0, foundation_modulus=5e5),)
    scene = cut(scene_of("entry", moving(0.1, 0.02, 0.18), stiff, needle=LIGHT))
    tips = piecewise_motion(scene, np.linspace(0.0, 1.6, 81), 20, 400.0, RADAU)
    curvature = np.diff(tips, 2) / (0.1 * 0.02) ** 2
    beta = (5e5 / (4.0 * 0.0256)) ** 0.25
    assert curvature[-20:] == pytest.approx(0.1 / (beta * 0.0256), rel=1e-3)


@pytest.mark.parametrize("kind", ["entry", pytest.param("hub", marks=pytest.mark.slow)])
def test_a_loop_returns_to_the_same_tip(kind):
    """In to 100 mm, out to 70 mm, in again and beyond: the old path holds; later the tip is that of a way straight in."""
    layers = (Layer(start=0.0, end=0.085, foundation_modulus=2e4), Layer(start=0.085, foundation_modulus=5e4))
    loop = Insertion(kind="profile", depth=Table(time=[0.0, 0.4, 0.7, 1.0, 1.3], value=[0.06, 0.1, 0.07, 0.1, 0.13]))
    tips = piecewise_motion(cut(scene_of(kind, loop, layers, needle=LIGHT)), np.linspace(0.0, 1.3, 14), 14, 400.0, RADAU)
    assert tips[10] == pytest.approx(tips[4], rel=1e-7)
    assert tips[7] == pytest.approx(tips[1], rel=1e-7)
    way = cut(scene_of(kind, moving(0.1, 0.06, 0.13), layers, needle=LIGHT))
    assert tips[13] == pytest.approx(piecewise_motion(way, np.linspace(0.0, 0.7, 8), 14, 400.0, RADAU)[7], rel=1e-6)
    assert np.ptp(tips) > 0.1 * np.max(np.abs(tips))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_cut_path_converges_with_inertia(kind):
    first = Layer(start=0.0, end=0.08, foundation_modulus=2e4, damping=30.0)
    layers = (first, Layer(start=0.1, foundation_modulus=5e4, damping=20.0))
    loop = Insertion(kind="profile", depth=Table(time=[0.0, 0.04, 0.06, 0.09, 0.12], value=[0.06, 0.1, 0.07, 0.1, 0.13]))
    scene, time = cut(scene_of(kind, loop, layers)), np.linspace(0.0, 0.12, 25)
    coarse, finer, finest = (piecewise_motion(scene, time, *how) for how in ((10, 1.5e3), (12, 3e3), (14, 6e3)))
    assert largest_difference(finer, finest) < min(1e-4, 0.5 * largest_difference(coarse, finer))


# Push.


def pushed(force, depth=0.06):
    return Insertion(kind="force", initial_depth=depth, push_force=force)


def test_a_constant_push_against_viscous_friction():
    """v = v_end (1 - exp(-t / T)), T = m / mu."""
    scene = scene_of("hub", pushed(1.0), GEL, (), friction=Friction(viscous=0.3))
    time = np.linspace(0.0, 0.02, 11)
    way = (time - MASS / 0.3 * (1.0 - np.exp(-time * 0.3 / MASS))) / 0.3
    assert pushed_motion(scene, time, 8, 5e3).depth - 0.06 == pytest.approx(way, rel=1e-9, abs=1e-15)


def test_a_ramp_breaks_away_when_it_exceeds_friction_and_cutting():
    """Push 2 t against 0.5 N: at rest until 0.25 s, then (t - 0.25)^3 / (3 m)."""
    layers = (Layer(start=0.0, foundation_modulus=5e3, cutting_force=0.2),)
    scene = scene_of("entry", pushed(Table(time=[0.0, 1.0], value=[0.0, 2.0])), layers, (), friction=Friction(coulomb=0.3))
    time = np.array([0.0, 0.1, 0.24, 0.26, 0.28])
    way = np.maximum(time - 0.25, 0.0) ** 3 / (3.0 * MASS)
    assert pushed_motion(scene, time, 8, 1e3).depth - 0.06 == pytest.approx(way, rel=1e-9, abs=1e-15)


def test_a_membrane_stops_a_needle_that_is_too_weak_and_a_ramp_pierces_it():
    """0.5 N reach 70 mm; 0.9 N are needed there, of a push that rises from 0.5 N at 50 ms by 10 N/s."""
    layers = (Layer(start=0.0, end=0.07, foundation_modulus=5e3), Layer(start=0.07, foundation_modulus=5e3, puncture_force=0.9))
    push = Table(time=[0.0, 0.05, 0.15], value=[0.5, 0.5, 1.5])
    time = np.linspace(0.0, 0.11, 12)
    depth = pushed_motion(scene_of("hub", pushed(push), layers, ()), time, 8, 1e3).depth
    assert np.sqrt(2.0 * 0.01 * MASS / 0.5) < time[1]
    assert depth[1:10] == pytest.approx(0.07, abs=1e-15)
    after = time[10:] - 0.09
    assert depth[10:] - 0.07 == pytest.approx((0.45 * after**2 + 10.0 / 6.0 * after**3) / MASS, rel=1e-9)


def test_a_needle_goes_back_in_without_cutting():
    """A cosine pushes against 0.1 N and 0.5 N of cutting: in, out from -0.1 N on, and in again behind the deepest point."""
    layers = (Layer(start=0.0, foundation_modulus=5e3, cutting_force=0.5),)
    push = Sinusoid(amplitude=1.0, frequency=50.0, phase=np.pi / 2)
    scene = scene_of("hub", pushed(push), layers, (), friction=Friction(coulomb=0.1))
    turn, stops, depths = 100.0 * np.pi, [0.0], [0.06]
    for resistance, latest in ((0.6, 0.01), (-0.1, 0.019), (0.1, 0.01)):
        start = np.arccos(-0.1) / turn if len(stops) == 2 else stops[-1]

        def speed(t, start=start, resistance=resistance):
            return ((np.sin(turn * t) - np.sin(turn * start)) / turn - resistance * (t - start)) / MASS

        stops.append(brentq(speed, start + 1e-3, start + latest, xtol=1e-16))
        span = stops[-1] - start
        way = (np.cos(turn * start) - np.cos(turn * stops[-1])) / turn**2 - np.sin(turn * start) * span / turn
        depths.append(depths[-1] + (way - 0.5 * resistance * span**2) / MASS)
    assert depths[1] > depths[3] > depths[2]
    assert pushed_motion(scene, np.array(stops), 8, 2e3).depth == pytest.approx(depths, abs=1e-10)


@pytest.mark.parametrize(
    ("kind", "steps", "allowed"), [("entry", 1e4, 1e-3), pytest.param("hub", 2e4, 2e-5, marks=pytest.mark.slow)]
)
def test_deflection_and_depth_share_their_energy(kind, steps, allowed):
    """Nothing is lost but what friction takes; the bent, swinging needle moves itself."""
    swinging = {"initial": Initial(shape="tip-displaced", tip_deflection=1e-2), "friction": Friction(coulomb=0.02)}
    scene, time = scene_of(kind, pushed(0.1), GEL, [TipLoad(force=0.3)], **swinging), np.linspace(0.0, 0.01, 6)
    found = pushed_motion(scene, time, 8, steps)
    total = found.energy - 0.08 * (found.depth - 0.06) - 0.3 * found.tip_deflection
    assert np.all(np.diff(found.depth) > 0.0)
    assert total == pytest.approx(np.full(6, total[0]), abs=allowed * np.max(found.energy))
    alone = 0.06 + 0.5 * 0.08 * time[-1] ** 2 / MASS
    assert abs(found.depth[-1] - alone) > 3e-4
    work = 0.5 * MASS * (2.0 * (found.depth[-1] - alone) / time[-1]) ** 2  # of A, about
    assert work > 5.0 * allowed * np.max(found.energy)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_push_through_layers_converges(kind):
    layers = (
        Layer(start=0.0, end=0.07, foundation_modulus=5e3, damping=5.0, cutting_force=0.2),
        Layer(start=0.07, foundation_modulus=2e4, damping=20.0, cutting_force=0.4, puncture_force=0.5),
    )
    friction = Friction(coulomb=0.3, viscous=2.0, coulomb_per_length=1.0)
    scene = scene_of(kind, pushed(Sinusoid(mean=0.5, amplitude=1.5, frequency=30.0)), layers, friction=friction)
    time = np.linspace(0.0, 0.05, 11)
    coarse, fine = (pushed_motion(scene, time, *how) for how in ((8, 1e3), (10, 2e3)))
    assert largest_difference(coarse.depth, fine.depth) < 1e-5
    assert largest_difference(coarse.tip_deflection, fine.tip_deflection) < 1e-3
    assert np.max(fine.depth) > 0.072
    assert np.min(np.diff(fine.depth)) < 0.0
