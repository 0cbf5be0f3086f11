"""The references against exact cases, energy balances of the strong form, and themselves.

Measured self-convergence of the tip, relative to its largest value, in the scenes of the last two tests (three layers, damping,
3 m/s, bevel force that jumps at borders): `entry`, default degree 20 and 2000 steps against 30 and 18000: 4e-5, degree 28 and
8000 steps: 5e-6. `hub`, default degree 40 and 2000 steps against 60 and 4000: 2e-5 without guide, 8e-5 with an elastic one,
3e-4 with a rigid one; degree 50 and 4000 steps: 5e-5 with a rigid one. Static tip at degree 40 against the exact solution: 7e-6
without guide, 7e-5 with a rigid one, falling as the third power.
"""

import numpy as np
import pytest
from scipy.integrate import simpson

from fem_needle.exact import ReleaseFromTipForce, exact_static
from fem_needle.scene import (
    Guide,
    Initial,
    Insertion,
    LateralLoad,
    Layer,
    Model,
    Needle,
    Run,
    Scene,
    Sinusoid,
    Support,
    Table,
    TipLoad,
    Tissue,
)
from tests.references import entry_motion, hub_motion
from tests.references.entry import GrowingBeam
from tests.references.gauss import GAUSS, RADAU, Coefficients, integrate
from tests.references.hub import WholeNeedle
from tests.references.polynomials import clamped_polynomials

NEEDLE = Needle(length=0.2, bending_stiffness=0.0256, mass_per_length=0.01016)
GEL = (Layer(start=0.0, foundation_modulus=5e3),)
LAYERS = (
    Layer(start=0.0, end=0.05, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, end=0.08, foundation_modulus=2e4),
    Layer(start=0.1, foundation_modulus=5e4, damping=20.0),
)
PUSH = (TipLoad(force=0.1),)
BUZZ = Sinusoid(mean=0.1, amplitude=0.05, frequency=30.0, phase=0.5)


def scene_of(kind, insertion, layers=GEL, loads=PUSH, **parts):
    return Scene(
        needle=parts.pop("needle", NEEDLE),
        support=Support(kind=kind, **parts.pop("support", {})),
        tissue=Tissue(layers=layers),
        insertion=insertion,
        loads=loads,
        run=Run(duration=1.0),
        **parts,
    )


def moving(speed, start=0.05, end=0.15):
    return Insertion(kind="speed", initial_depth=start, speed=speed, final_depth=end)


def held(depth):
    return Insertion(kind="hold", initial_depth=depth)


def largest_difference(one, other):
    return np.max(np.abs(one - other)) / np.max(np.abs(other))


def test_polynomials_are_orthonormal_and_clamped():
    nodes, weights = np.polynomial.legendre.leggauss(60)
    psi = clamped_polynomials((nodes + 1.0) / 2.0, 40)[0]
    assert np.einsum("g,gi,gj->ij", weights / 2.0, psi, psi) == pytest.approx(np.eye(40), abs=1e-11)
    assert np.all(clamped_polynomials(np.array(0.0), 40)[:2] == 0.0)


def test_polynomial_derivatives():
    x = np.linspace(0.05, 0.95, 7) + 1e-30j
    value, first, second = clamped_polynomials(x, 12)
    assert value.imag / 1e-30 == pytest.approx(first.real, rel=1e-10, abs=1e-10)
    assert first.imag / 1e-30 == pytest.approx(second.real, rel=1e-10, abs=1e-9)


@pytest.mark.parametrize(("method", "order"), [(GAUSS, 6), (RADAU, 5)])
def test_order_of_the_collocation(method, order):
    """A varying oscillator, (1 + t) q' = p, p' = -16 q / (1 + t)^3, against eight times finer steps."""

    def coefficients(t):
        one, zero = np.ones((t.size, 1, 1)), np.zeros((t.size, 1, 1))
        growing = (1.0 + t)[:, None, None]
        nothing = np.zeros((t.size, 1))
        return Coefficients(growing * one, zero, zero, -16.0 / growing**3, nothing, nothing)

    def end(steps):
        q, _ = integrate(method, coefficients, np.ones(1), np.zeros(1), np.array([0.0, 1.0]), [], steps)
        return q[-1, 0]

    fine = end(320)
    errors = [abs(end(steps) - fine) for steps in (10, 20, 40)]
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(rates > order - 0.4)
    assert errors[-1] < 1e-8


@pytest.mark.parametrize("depth", [0.03, 0.1, 0.15])
def test_static_start_of_entry(depth):
    beam = GrowingBeam(scene_of("entry", held(depth), layers=LAYERS), 24)
    tip = beam.tip @ beam.start()[0]
    assert tip == pytest.approx(exact_static(beam.scene, depth).tip_deflection, rel=1e-6)


def test_static_start_of_entry_in_one_tissue_is_exact():
    beam = GrowingBeam(scene_of("entry", held(0.1)), 20)
    tip = beam.tip @ beam.start()[0]
    assert tip == pytest.approx(exact_static(beam.scene, 0.1).tip_deflection, rel=1e-11)


@pytest.mark.parametrize(
    ("guides", "tolerance"), [([], 1e-5), ([Guide(position=-0.03, stiffness=1e3)], 1e-4), ([Guide(position=-0.03)], 2e-4)]
)
def test_static_start_of_hub(guides, tolerance):
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=0.2)]
    support = {"guides": guides, "hub_deflection": 1e-3, "hub_angle": 0.01}
    scene = scene_of("hub", held(0.08), LAYERS, loads, support=support)
    motion = hub_motion(scene, 1e-3, [0.0, 1e-3], steps_per_second=1e4)
    rest = exact_static(scene, 0.08)
    stations = np.linspace(0.0, 0.2, 21)
    assert largest_difference(motion.deflection(stations)[0], rest.deflection(stations)) < tolerance
    assert largest_difference(motion.deflection(stations)[1], rest.deflection(stations)) < 2.0 * tolerance


@pytest.mark.parametrize(("kind", "solve", "tolerance"), [("entry", entry_motion, 1e-8), ("hub", hub_motion, 1e-4)])
def test_rate_at_the_start_is_that_of_the_statics(kind, solve, tolerance):
    scene = scene_of(kind, moving(0.5))
    motion = solve(scene, 1e-4, [0.0, 1e-4], steps_per_second=1e5)
    step = 1e-4
    tips = [exact_static(scene, 0.05 + i * step).tip_deflection for i in (-2, -1, 1, 2)]
    slope = (tips[0] - 8.0 * tips[1] + 8.0 * tips[2] - tips[3]) / (12.0 * step)
    assert motion.tip_velocity[0] == pytest.approx(0.5 * slope, rel=tolerance)


@pytest.mark.parametrize(
    ("kind", "solve", "layers", "depth"),
    [("entry", entry_motion, GEL, 0.1), ("hub", hub_motion, (), 0.0), ("hub", hub_motion, GEL, 0.2)],
)
def test_release(kind, solve, layers, depth):
    initial = Initial(shape="tip-displaced", tip_deflection=1e-3)
    scene = scene_of(kind, held(depth), layers, loads=(), initial=initial)
    time = np.linspace(0.0, 0.03, 301)
    motion = solve(scene, 0.03, time, degree=30, steps_per_second=1e5)
    assert motion.tip_deflection[0] == pytest.approx(1e-3, rel=1e-12)
    assert largest_difference(motion.tip_deflection, ReleaseFromTipForce(scene).tip_deflection(time)) < 2.5e-4


def test_gauss_keeps_the_energy_of_a_held_needle():
    initial = Initial(shape="tip-displaced", tip_deflection=1e-3)
    motion = entry_motion(scene_of("entry", held(0.1), LAYERS[1:2], (), initial=initial), 0.02, np.linspace(0, 0.02, 21))
    assert motion.energy == pytest.approx(np.full(21, motion.energy[0]), rel=1e-11)
    assert np.ptp(motion.tip_deflection) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "solve"), [("entry", entry_motion), ("hub", hub_motion)])
def test_slow_insertion_follows_the_statics(kind, solve):
    scene = scene_of(kind, moving(0.01), LAYERS)
    time = np.linspace(0.0, 12.0, 13)
    motion = solve(scene, 12.0, time)
    expected = [exact_static(scene, depth).tip_deflection for depth in motion.depth]
    assert motion.depth[-1] == pytest.approx(0.15)
    # both the interface jumps and the inertia and damping of 10 mm/s are of this size
    assert largest_difference(motion.tip_deflection, np.array(expected)) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("speed", [3.0, -3.0])
def test_energy_balance_of_the_growing_beam(kinematics, speed):
    """E' = F d(tip)/dt - A v with the axial force A of the strong form, not of the discrete equations."""
    start, end = (0.05, 0.15) if speed > 0.0 else (0.15, 0.05)
    scene = scene_of("entry", moving(speed, start, end), loads=[TipLoad(force=BUZZ)], model=Model(kinematics=kinematics))
    time = np.linspace(0.0, 0.033, 2641)
    motion = entry_motion(scene, 0.033, time, steps_per_second=8e4)
    z, q = motion.depth[:, None], motion.coordinates
    bend = (q @ clamped_polynomials(np.array(0.0), 19)[2])[:, None] / z**2
    slope = (q @ clamped_polynomials(np.array(1.0), 19)[1])[:, None] / z
    tip, tip_rate, force = motion.tip_deflection[:, None], motion.tip_velocity[:, None], BUZZ.value(time)[:, None]
    if kinematics == "material":
        axial = 0.5 * NEEDLE.bending_stiffness * bend**2
    else:
        fixed_rate = tip_rate - speed * slope
        axial = 0.5 * NEEDLE.mass_per_length * fixed_rate**2 - 0.5 * 5e3 * tip**2 + force * slope
    work = simpson((force * tip_rate - axial * speed)[:, 0], x=time)
    assert motion.energy[-1] - motion.energy[0] == pytest.approx(work, abs=3e-5 * np.max(motion.energy))
    assert abs(simpson(axial[:, 0] * speed, x=time)) > 0.1 * np.max(motion.energy)


@pytest.mark.slow
def test_energy_balance_of_the_whole_needle():
    """E' = F u_t(tip) + P u_t at the force + 1/2 k v u^2 at the surface: the tissue takes hold of a bent needle."""
    loads = [TipLoad(force=BUZZ), LateralLoad(position=-0.01, force=0.3)]
    scene = scene_of("hub", moving(3.0), loads=loads)
    time = np.linspace(0.0, 0.033, 661)
    motion = hub_motion(scene, 0.033, time, degree=32, steps_per_second=8e4)
    needle = WholeNeedle(scene, 32)
    every, change = needle.complete(time, motion.coordinates, motion.rates)
    at_force = np.sum(needle.at(-0.01, motion.depth) * change, axis=1)
    at_surface = np.sum(needle.at(0.0, motion.depth) * every, axis=1)
    grip = 0.5 * 5e3 * 3.0 * at_surface**2
    work = simpson(BUZZ.value(time) * motion.tip_velocity + 0.3 * at_force + grip, x=time)
    assert motion.energy[-1] - motion.energy[0] == pytest.approx(work, abs=1e-4 * np.max(motion.energy))
    assert simpson(grip, x=time) > 0.1 * np.max(motion.energy)


@pytest.mark.parametrize("kinematics", ["material", pytest.param("fixed-frame", marks=pytest.mark.slow)])
def test_entry_converges(kinematics):
    loads = [TipLoad(force=BUZZ), TipLoad(bevel_coefficient=1e-6)]
    scene = scene_of("entry", moving(3.0, 0.02, 0.13), LAYERS, loads, model=Model(kinematics=kinematics))
    time = np.linspace(0.0, 0.06, 31)
    fine = entry_motion(scene, 0.06, time, degree=28, steps_per_second=6e4)
    coarse = entry_motion(scene, 0.06, time, degree=20, steps_per_second=3e4)
    assert largest_difference(coarse.tip_deflection, fine.tip_deflection) < 1e-4


@pytest.mark.parametrize(
    "guides",
    [
        [],
        pytest.param([Guide(position=-0.03, stiffness=2e3)], marks=pytest.mark.slow),
        pytest.param([Guide(position=-0.03)], marks=pytest.mark.slow),
    ],
    ids=["no guide", "elastic", "rigid"],
)
def test_hub_converges(guides):
    loads = [TipLoad(force=0.1), LateralLoad(position=-0.005, force=BUZZ), TipLoad(bevel_coefficient=1e-6)]
    hub = Table(time=[0.0, 0.027, 0.054], value=[0.0, 1e-3, 0.0])
    support = {"guides": guides, "hub_deflection": hub}
    scene = scene_of("hub", moving(3.0, 0.01, 0.13), LAYERS, loads, support=support)
    time = np.linspace(0.0, 0.054, 28)
    fine = hub_motion(scene, 0.054, time, degree=36, steps_per_second=2000 / 0.054)
    coarse = hub_motion(scene, 0.054, time, degree=24, steps_per_second=1000 / 0.054)
    assert largest_difference(coarse.tip_deflection, fine.tip_deflection) < 1e-3
