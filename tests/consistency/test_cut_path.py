"""The rest line that the tip cuts: closed loops, closed forms, exact integrals, order in step and mesh."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.path import straight_path
from fem_needle.scene import Insertion, Layer, Needle, Table, TipLoad
from tests.consistency.scenes import LENGTH, PUSH, STIFFNESS, held, moving, profile, rates, relative, scene_of

CUT = {"tissue": {"rest_line": "cut-path"}}
FIRM = (Layer(start=0.0, foundation_modulus=5e4),)
FIRM_DAMPED = (Layer(start=0.0, foundation_modulus=5e4, damping=500.0),)
BORDER = (Layer(start=0.0, end=0.07, foundation_modulus=2e4), Layer(start=0.08, foundation_modulus=5e4))


def run_of(scene, time_step, *, analysis="quasi-static", output_step=0.02, elements=16):
    plant = FiniteElementNeedle(scene, elements=elements)
    return simulate(plant, time_step=time_step, analysis=analysis, output_step=output_step)


def tip_at(run, depth, time):
    (row,) = np.flatnonzero(np.isclose(run.time, time, rtol=0.0, atol=1e-9))
    assert run.depth[row] == pytest.approx(depth, abs=1e-12)
    return run.tip_deflection[row]


# In, out, in again, and beyond.

LOOP = profile([0.0, 0.4, 0.6, 0.9, 1.2], [0.06, 0.1, 0.07, 0.1, 0.13])


@pytest.mark.parametrize("layers", [FIRM, BORDER], ids=["one layer", "a gap"])
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_loop_returns_to_the_same_tip(kind, layers):
    run = run_of(scene_of(kind, LOOP, layers, duration=1.2, **CUT), 0.02, output_step=0.1)
    first = tip_at(run, 0.1, 0.4)
    assert tip_at(run, 0.07, 0.6) == pytest.approx(tip_at(run, 0.07, 0.1), rel=5e-3)  # within a piece of the path
    assert tip_at(run, 0.1, 0.9) == pytest.approx(first, rel=1e-9)
    straight = run_of(scene_of(kind, moving(0.1, 0.06, 0.13), layers, duration=0.7, **CUT), 0.02, output_step=0.1)
    assert run.tip_deflection[-1] == pytest.approx(straight.tip_deflection[-1], rel=1e-3)


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_a_slow_loop_with_inertia_and_viscosity_returns(kind):
    """Held at both ends until it is at rest: the tip stands where it stood."""
    rests = profile([0.0, 0.1, 0.8, 0.9, 1.6, 1.7, 2.4], [0.08, 0.09, 0.09, 0.08, 0.08, 0.09, 0.09])
    # Vibrations that the steps do not resolve must die out: Radau's method.
    scene = scene_of(kind, rests, FIRM_DAMPED, duration=2.4, numerics={"spectral_radius": 0.0}, **CUT)
    run = run_of(scene, 5e-3, analysis="dynamic", output_step=0.1, elements=8)
    assert tip_at(run, 0.09, 2.4) == pytest.approx(tip_at(run, 0.09, 0.8), rel=1e-9)
    assert np.ptp(run.tip_deflection) > 0.01 * run.tip_deflection[-1]


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_the_path_remembers_the_tip_and_nothing_on_the_way_out(kind):
    run = run_of(scene_of(kind, LOOP, FIRM, duration=1.2, **CUT), 0.02, output_step=0.02)
    assert run.path_position[0] == run.path_position[1] == 0.06
    assert (run.path_deflection[0], run.path_position[-1]) == (0.0, pytest.approx(0.13))
    assert run.path_deflection[1] == pytest.approx(run.tip_deflection[0], rel=1e-12)
    assert np.all(np.diff(run.path_position) >= 0.0)
    new = (run.time <= 0.4 + 1e-9) | (run.time >= 0.9 - 1e-9)
    cut = np.interp(run.depth[new], run.path_position[1:], run.path_deflection[1:])
    assert cut == pytest.approx(run.tip_deflection[new], rel=1e-3)


def test_a_held_needle_cuts_nothing():
    straight = run_of(scene_of("hub", held(0.1), FIRM, duration=0.1), 0.02)
    cut = run_of(scene_of("hub", held(0.1), FIRM, duration=0.1, **CUT), 0.02)
    assert np.max(np.abs(cut.tip_deflection - straight.tip_deflection)) < 1e-13 * straight.tip_deflection[0]
    assert cut.path_position.size == 0


# Closed forms.


@pytest.mark.parametrize("analysis", ["quasi-static", "dynamic"])
def test_a_displaced_straight_needle_feels_no_tissue(analysis):
    """A hub held at h from depth 0 on: the tip cuts r = h, so that w = h leaves every spring at rest."""
    support = {"hub_deflection": 2e-3}
    insertion = moving(0.1, 0.0, 0.15)
    cut = scene_of("hub", insertion, FIRM, (), support=support, duration=1.5, initial={"shape": "straight"}, **CUT)
    run = run_of(cut, 0.02, analysis=analysis, output_step=0.1)
    scale = 5e4 * 2e-3 * 0.15
    assert run.tip_deflection == pytest.approx(2e-3, rel=1e-9)
    assert np.max(np.abs(run.tissue_force)) < 1e-9 * scale
    assert run.path_deflection[1:] == pytest.approx(2e-3, rel=1e-9)
    straight = run_of(cut.with_value("tissue.rest_line", "straight"), 0.02, analysis=analysis)
    assert np.max(np.abs(straight.tissue_force)) > 0.01 * scale


def test_a_stiff_displaced_needle_feels_only_what_was_not_cut():
    """EI = 1e5 N m^2 stays at h: the springs over the initial 40 mm rest on the axis, those beyond on the needle."""
    needle = Needle(length=LENGTH, bending_stiffness=1e5, mass_per_length=0.01)
    scene = scene_of(
        "hub", moving(0.1, 0.04, 0.14), FIRM, (), support={"hub_deflection": 2e-3}, duration=1.0, needle=needle, **CUT
    )
    run = run_of(scene, 0.05, output_step=0.1)
    assert run.tissue_force == pytest.approx(-5e4 * 2e-3 * 0.04, rel=1e-4)
    assert run.tissue_energy == pytest.approx(0.5 * 5e4 * 4e-6 * 0.04, rel=1e-4)


@pytest.mark.parametrize("kind", ["entry", pytest.param("hub", marks=pytest.mark.slow)])
def test_a_constant_tip_force_steers_with_constant_curvature(kind):
    """Far from both ends the path is r'' = F / (beta EI), beta = (k / 4EI)^(1/4).

    With r of constant curvature, w = r + B e^(beta x) sin(beta x), x = y - z, meets EI w'''' + k (w - r) = 0, w = r, w'' = 0 and
    EI w''' = -F at the tip for B = -F / (2 beta^3 EI) and r'' = -2 beta^2 B.
    """
    stiff = (Layer(start=0.0, foundation_modulus=5e5),)
    scene = scene_of(kind, moving(0.1, 0.02, 0.18), stiff, duration=1.6, **CUT)
    run = run_of(scene, 0.01, elements=24)
    curvature = np.diff(run.tip_deflection, 2) / (0.1 * 0.02) ** 2
    beta = (5e5 / (4.0 * STIFFNESS)) ** 0.25
    assert curvature[-20:] == pytest.approx(PUSH[0].force / (beta * STIFFNESS), rel=1e-3)
    y = 0.18 - np.linspace(0.0, 0.05, 11)  # the bow of the needle beside its path
    offset = run.deflection(y + LENGTH - 0.18)[-1] - np.interp(y, run.path_position, run.path_deflection)
    bow = -PUSH[0].force / (2 * beta**3 * STIFFNESS) * np.exp(beta * (y - 0.18)) * np.sin(beta * (y - 0.18))
    assert np.max(np.abs(offset - bow)) < 1e-2 * np.max(np.abs(bow))


# Integrals.


def cut_path():
    """A path that jumps at 40 mm to 1 mm, with two cubic pieces."""
    path = straight_path(0.04)
    path = path.extended([0.04, 0.05, 0.06, 0.0703], [1e-3, 1.2e-3, 1.1e-3, 1.6e-3])
    return path.extended([0.0703, 0.08, 0.0917], [1.6e-3, 1.7e-3, 2.2e-3])


@pytest.mark.parametrize("depth", [0.0917, 0.08, 0.065])
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_integrals_see_the_jump_exactly(kind, depth):
    plant = FiniteElementNeedle(scene_of(kind, held(depth), BORDER), elements=7)
    coordinates = np.random.default_rng(3).normal(0.0, 1e-3, plant.size)
    path = cut_path()
    terms = plant.rest_terms(path, depth, -np.inf, np.inf)

    def modulus(y):
        return next((layer.foundation_modulus for layer in BORDER if layer.holds(y)), 0.0)

    def load(y):
        shape = plant.deflection(coordinates, np.zeros(1), depth, np.array([y + LENGTH - depth]))[0]
        return modulus(y) * float(path.value(np.array(y))) * shape

    width = depth if kind == "entry" else LENGTH
    nodes = depth - width * np.linspace(1.0, 0.0, 8)
    cuts = np.unique(np.clip([0.0, depth, *nodes, 0.04, 0.0703, 0.07, 0.08], 0.0, depth))
    parts = [(a, b) for a, b in pairwise(cuts) if b - a > 1e-12]

    def integral(function):
        return sum(quad(function, a + 1e-15, b - 1e-15, epsabs=0.0, epsrel=1e-12)[0] for a, b in parts if function((a + b) / 2))

    def constant(y):
        return 0.5 * modulus(y) * float(path.value(np.array(y))) ** 2

    assert float(coordinates @ terms.load) == pytest.approx(integral(load), rel=1e-10)
    assert terms.constant == pytest.approx(integral(constant), rel=1e-10)


@pytest.mark.parametrize("depth", [0.0861, 0.0653, 0.0917])
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_rates_of_the_integrals(kind, depth):
    """Derivatives by the depth, against differences; on the deepest point from behind."""
    plant = FiniteElementNeedle(scene_of(kind, held(depth), BORDER), elements=7)
    path, step = cut_path(), 1e-6
    end = 0.0917 if depth == 0.0917 else np.inf  # in front of it stands the front, not the path
    values = [plant.rest_terms(path, depth - shift * step, -np.inf, end) for shift in (0, 1, 2, 3)]
    weights = np.array([11 / 6, -3.0, 1.5, -1 / 3]) / step
    load = sum(w * v.load for w, v in zip(weights, values, strict=True))
    constant = sum(w * v.constant for w, v in zip(weights, values, strict=True))
    terms = plant.rest_terms(path, depth, -np.inf, np.inf)
    assert relative(terms.load_rate, load) < 1e-6
    assert terms.constant_rate == pytest.approx(constant, rel=1e-6)


def test_a_split_of_the_path_changes_nothing():
    plant = FiniteElementNeedle(scene_of("hub", held(0.09), BORDER), elements=7)
    path = cut_path()
    whole = plant.rest_terms(path, 0.0917, -np.inf, np.inf)
    parts = plant.rest_terms(path, 0.0917, -np.inf, 0.0651) + plant.rest_terms(path, 0.0917, 0.0651, np.inf)
    assert relative(parts.load, whole.load) < 1e-13
    assert parts.constant == pytest.approx(whole.constant, rel=1e-13)


# Step and mesh.

GLIDE = Insertion(kind="profile", depth=Table(time=[0.0, 1.0], value=[0.05, 0.12]))


@cache
def final_tip(kind, time_step, elements, analysis="quasi-static"):
    layers = FIRM if analysis == "quasi-static" else FIRM_DAMPED
    scene = scene_of(kind, GLIDE, layers, duration=1.0, **CUT)
    return run_of(scene, time_step, analysis=analysis, output_step=1.0, elements=elements).tip_deflection[-1]


@pytest.mark.parametrize("kind", ["entry", pytest.param("hub", marks=pytest.mark.slow)])
def test_order_in_time(kind):
    """Smooth after the jump, which leaves second order at least."""
    steps = (0.2, 0.1, 0.05, 0.025)
    reference = final_tip(kind, 0.00625, 4)
    errors = [abs(final_tip(kind, step, 4) / reference - 1.0) for step in steps]
    assert errors[-1] < 1e-5
    assert np.mean(rates(errors)) > 1.8


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_two_decades_of_steps(kind):
    reference = final_tip(kind, 5e-4, 8)
    errors = [abs(final_tip(kind, step, 8) / reference - 1.0) for step in (0.2, 0.02, 0.002)]
    assert errors[-1] < 1e-7
    assert np.mean(rates(errors, 10.0)) > 1.8


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_independence_of_the_mesh(kind):
    reference = final_tip(kind, 0.05, 200)
    errors = [abs(final_tip(kind, 0.05, count) / reference - 1.0) for count in (4, 8, 16, 32)]
    assert max(errors[2:]) < 5e-8
    assert errors[2] < 0.1 * errors[0]  # further on the differences are roundings


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_slow_motion_with_viscosity_tends_to_the_elastic_one(kind):
    """Inertia and viscosity are small at 70 mm/s: c v / (k times a characteristic length) is about 2 %."""
    assert final_tip(kind, 0.02, 8, "dynamic") == pytest.approx(final_tip(kind, 0.02, 8), rel=2e-2)


# Energy.

TURNING = profile([0.0, 0.004, 0.006, 0.01], [0.07, 0.075, 0.072, 0.08])
SWELLS = {"tissue": {"rest_line": "cut-path", "stiffness_factor": Table(time=[0.0, 0.02], value=[1.0, 2.0])}}


@pytest.mark.parametrize("kind", ["entry", "hub"])
@pytest.mark.parametrize(
    ("insertion", "parts"),
    [(TURNING, CUT), pytest.param(moving(1.0, 0.07, 0.08), SWELLS, marks=pytest.mark.slow)],
    ids=["turns", "swells"],
)
@pytest.mark.parametrize(
    "analysis",
    ["dynamic", "quasi-static"],
)
def test_ledger(kind, insertion, parts, analysis):
    """A needle that turns in its path, and one in a tissue that swells: the residual falls with the step."""
    layers = FIRM_DAMPED if analysis == "dynamic" else FIRM
    scene = scene_of(kind, insertion, layers, [TipLoad(force=0.1)], duration=0.01, **parts)
    found = []
    for step in (1e-4, 5e-5):
        run = run_of(scene, step, analysis=analysis, output_step=1e-3, elements=12)
        found.append(run.summary["relative_energy_residual"])
    assert found[-1] < (5e-6 if analysis == "dynamic" else 1e-9)
    assert rates(found)[0] > 2.0
    if parts is SWELLS:
        assert abs(run.tissue_work[-1]) > 1e-3 * np.max(run.tissue_energy)
