"""Amplification of one step of the real steppers against the designed function of omega h; energy over a million steps."""

import numpy as np
import pytest
from scipy.linalg import eigh, sqrtm

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.collocation import collocation
from fem_needle.dynamics.engine import CREEP, DYNAMIC, Engine
from fem_needle.dynamics.massless import massless
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd
from fem_needle.motion import depth_law
from fem_needle.scene import Layer, Numerics
from fem_needle.stages import StageSolution
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import GEL, held, scene_of
from tests.stability.assembled import Assembled

RADII = (1.0, 0.8, 0.5, 0.0)
RELEASED = {"initial": {"shape": "tip-displaced", "tip_deflection": 1e-3}, "loads": ()}
MODELS = {
    "elements": lambda scene: FiniteElementNeedle(scene, elements=2),
    "modes": lambda scene: AssumedModeNeedle(scene, modes=2),
}


def designed(z, radius):
    """R(z) of the method whose nodes are the zeros of P_2 - alpha P_1 (Hairer and Wanner II, theorem IV.3.9)."""
    alpha = (1.0 - radius) / (1.0 + radius)
    return (12.0 + (6.0 - 2.0 * alpha) * z + (1.0 - alpha) * z**2) / (12.0 - (6.0 + 2.0 * alpha) * z + (1.0 + alpha) * z**2)


def let_go(kind, **parts):
    return scene_of(kind, held(0.1), parts.pop("layers", GEL), **(RELEASED | parts))


def amplification(plant, radius, step, *, inertia=True):
    """The matrix of one step, column by column from unit vectors of what the step carries: coordinates and momenta."""
    law, one_step = depth_law(plant.scene), np.array([[0.0, step, 1.0, 0.0]])
    stage = initial_state(plant if inertia else massless(plant), law).stage
    free = slice(plant.prescribed, plant.size)
    count, forces = plant.size - plant.prescribed, np.zeros(1)
    columns = []
    for number in range(2 * count if inertia else count):
        coordinates, momentum = np.zeros(plant.size), np.zeros(plant.size)
        (coordinates if number < count else momentum)[free][number % count] = 1.0
        engine = Engine(plant, DYNAMIC if inertia else CREEP, collocation(radius))
        engine.begin(StepEnd(stage, StageSolution(coordinates, np.zeros(plant.size), momentum, forces)), 0.1)
        engine.advance(one_step, counted=False)
        columns.append(engine.live.lateral[0, : 1 + inertia, free].ravel())
    return np.array(columns).T


def normalized(matrix, whole):
    """The same in coordinates whose squares add up to the energy: there it is normal, and its eigenvalues well-conditioned."""
    at = whole.matrices(0.1, 0.0)
    stiff, heavy = np.real(sqrtm(at.stiffness)), np.linalg.inv(np.real(sqrtm(at.mass)))
    scale = np.block([[stiff, np.zeros_like(stiff)], [np.zeros_like(stiff), heavy]])
    return scale @ matrix @ np.linalg.inv(scale)


def assert_same_set(found, expected, tolerance):
    """Every expected number has a found one beside it, and the other way round."""
    distances = np.abs(found[:, None] - expected[None, :])
    assert np.max(np.min(distances, axis=0)) < tolerance
    assert np.max(np.min(distances, axis=1)) < tolerance


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("kind", ["entry", "hub"])
@pytest.mark.parametrize("model", MODELS)
def test_a_step_amplifies_every_vibration_as_designed(model, kind, radius):
    """Modulus (numerical damping) and argument (period), from vibrations that are well resolved to those that are not at all."""
    plant = MODELS[model](let_go(kind))
    whole = Assembled(plant)
    at = whole.matrices(0.1, 0.0)
    omega = np.sqrt(eigh(at.stiffness, at.mass, eigvals_only=True))
    for turn in (0.05, 1.0, 30.0):
        step = turn / omega[0]
        found = np.linalg.eigvals(normalized(amplification(plant, radius, step), whole))
        expected = designed(1j * np.concatenate([omega, -omega]) * step, radius)
        assert_same_set(found, expected, 1e-8)
        assert np.max(np.abs(found)) < 1.0 + 1e-9
        if radius == 1.0:
            assert np.abs(found) == pytest.approx(np.ones(len(found)), abs=1e-9)


@pytest.mark.parametrize("radius", [1.0, 0.0])
def test_viscous_tissue_damps_as_designed(radius):
    """Eigenvalues of the damped system, most of them complex, some overdamped."""
    plant = MODELS["modes"](let_go("entry", layers=(Layer(start=0.0, foundation_modulus=5e3, damping=8.0),)))
    whole = Assembled(plant)
    at, count = whole.matrices(0.1, 0.0), whole.count
    inverse = np.linalg.inv(at.mass)
    system = np.block([[np.zeros((count, count)), inverse], [-at.stiffness, -at.damping @ inverse]])
    roots, step = np.linalg.eigvals(system), 5e-4
    found = np.linalg.eigvals(normalized(amplification(plant, radius, step), whole))
    assert_same_set(found, designed(roots * step, radius), 1e-8)
    assert np.max(np.real(roots)) < -100.0


def test_creep_decays_as_designed():
    plant = MODELS["elements"](let_go("entry", layers=(Layer(start=0.0, foundation_modulus=5e3, damping=50.0),)))
    at = Assembled(plant).matrices(0.1, 0.0)
    decays = eigh(at.stiffness, at.damping, eigvals_only=True)
    for step in (1e-4, 1e-2):
        found = np.linalg.eigvals(amplification(plant, 0.0, step, inertia=False))
        assert_same_set(found, designed(-decays * step, 0.0), 1e-8)


@pytest.mark.parametrize("radius", RADII)
def test_tips_of_one_vibration_obey_the_designed_recurrence(radius):
    """x_(n+2) = 2 Re R x_(n+1) - |R|^2 x_n of every sample of a whole run."""
    scene = let_go("entry", duration=0.02, numerics=Numerics(spectral_radius=radius))
    plant = AssumedModeNeedle(scene, modes=1)
    at = Assembled(plant).matrices(0.1, 0.0)
    omega = float(np.sqrt(at.stiffness[0, 0] / at.mass[0, 0]))
    for count in (20, 80):
        run = simulate(plant, time_step=0.02 / count, analysis="dynamic", output_step=0.02 / count)
        x, factor = run.tip_deflection, designed(1j * omega * 0.02 / count, radius)
        missing = x[2:] - 2.0 * factor.real * x[1:-1] + abs(factor) ** 2 * x[:-2]
        assert np.max(np.abs(missing)) < 1e-11 * np.max(np.abs(x))


def test_leading_terms_of_the_design():
    """Gauss: the period is too long by (omega h)^4 / 720. Radau: 1 - |R| = (omega h)^4 / 72 a step."""
    for x in (0.1, 0.2):
        assert 1.0 - np.angle(designed(1j * x, 1.0)) / x == pytest.approx(x**4 / 720.0, rel=0.02)
        assert 1.0 - abs(designed(1j * x, 0.0)) == pytest.approx(x**4 / 72.0, rel=0.02)
    for radius in RADII:
        assert abs(designed(1e9j, radius)) == pytest.approx(radius, abs=1e-6)


MILLION = 1_000_000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "model", "steps"),
    [("entry", "elements", MILLION), ("hub", "elements", MILLION), ("hub", "modes", MILLION // 10)],
)
def test_no_energy_is_gained_over_many_steps(kind, model, steps):
    """Free, undamped, at rest depth: the drift is that of rounding."""
    scene = let_go(kind, duration=steps * 1e-5)
    run = simulate(MODELS[model](scene), time_step=1e-5, analysis="dynamic", output_step=steps * 1e-7)
    assert run.summary["steps"] >= steps
    energy = run.kinetic_energy + run.bending_energy + run.tissue_energy
    assert np.max(np.abs(energy / energy[0] - 1.0)) < 3e-10
    assert np.ptp(run.tip_deflection) > 1e-3


@pytest.mark.slow
def test_numerical_damping_only_takes_energy():
    scene = let_go("entry", duration=2.0, numerics=Numerics(spectral_radius=0.5))
    run = simulate(MODELS["elements"](scene), time_step=1e-5, analysis="dynamic", output_step=0.02)
    energy = run.kinetic_energy + run.bending_energy + run.tissue_energy
    assert np.all(np.diff(energy) <= 1e-12 * energy[0])
    assert energy[-1] < energy[0]
