from itertools import pairwise

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, banded, load_scene, run_scene, simulate, solve_static
from fem_needle.exact import exact_static
from fem_needle.free_response import natural_frequencies
from fem_needle.scene import Guide, Initial, Insertion, LateralLoad, Layer, Model, TipLoad
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import BUZZ, DAMPED, GEL, LAYERS, NEEDLE, held, moving, scene_of
from tests.reduced.two_modes import TwoModes, integral, mode

THESIS = (Layer(start=0.0, foundation_modulus=520.0),)
# z, mass matrix entries int phi1^2, int phi1 phi2, int phi2^2 for a length of 0.2 m
MASS = {
    0.20: (1.0, 0.0, 1.0),
    0.15: (0.30411016, 0.37651274, 0.71832349),
    0.10: (0.050759781, 0.14605522, 0.44129350),
    0.05: (0.0019759139, 0.0091897295, 0.042915754),
    0.02: (2.28712339e-05, 1.29265676e-04, 7.30862e-04),
}


def modal(band):
    return banded.to_dense(band)[2:, 2:]


def tip_error(scene, depth, **settings):
    found = solve_static(AssumedModeNeedle(scene, **settings), depth=depth).tip_deflection
    return found / exact_static(scene, depth).tip_deflection - 1.0


@pytest.mark.parametrize(("depth", "entries"), MASS.items())
def test_the_mass_matrix_of_the_appendix(depth, entries):
    operators = AssumedModeNeedle(scene_of("entry", held(0.1), THESIS)).operators(depth, 0.0)
    found = modal(operators.mass) / NEEDLE.mass_per_length
    digits = 1e-6 if depth == 0.02 else 2e-8  # half a unit of the last one that is printed
    assert found[np.triu_indices(2)] == pytest.approx(entries, rel=digits, abs=1e-8 * entries[0])


def test_integrals_against_textbook_modes():
    plant = AssumedModeNeedle(scene_of("entry", held(0.1), THESIS, model=Model(kinematics="material")))
    for depth in (0.0213, 0.1, 0.1931):
        found = plant.operators(depth, 0.0)
        mass = NEEDLE.mass_per_length
        for name, scale, orders in (("mass", mass, (0, 0)), ("convection", mass, (0, 1)), ("centrifugal", mass, (1, 1))):
            expected = scale * integral(*orders, depth)  # the textbook form cancels near the clamp
            assert modal(getattr(found, name)) == pytest.approx(expected, rel=1e-7), name
        expected = NEEDLE.bending_stiffness * integral(2, 2, depth)
        assert modal(found.bending) == pytest.approx(expected, abs=1e-12 * np.max(expected))


@pytest.mark.parametrize(("depth", "error"), [(0.05, -0.0145), (0.1, -0.266), (0.15, -0.225), (0.2, -1.55)])
def test_static_tip_error_of_two_modes(depth, error):
    assert 100.0 * tip_error(scene_of("entry", held(depth), THESIS), depth) == pytest.approx(error, rel=0.01)


@pytest.mark.parametrize(("modulus", "error"), [(5e3, -0.077), (5e4, -0.30)])
def test_two_modes_are_worse_in_stiff_tissue(modulus, error):
    scene = scene_of("entry", held(0.2), (Layer(start=0.0, foundation_modulus=modulus),))
    assert tip_error(scene, 0.2) == pytest.approx(error, rel=0.02)


@pytest.mark.parametrize("modes", [2, 3, 5, 12, 30])
@pytest.mark.parametrize("depth", [1e-5, 1e-4, 1e-3, 0.01, 0.03])
@pytest.mark.parametrize("modulus", [520.0, 5e4])
def test_full_length_modes_work_on_a_short_inserted_part(modes, depth, modulus):
    """The more modes the better, down to rounding: a set of nearly parallel functions costs nothing."""
    scene = scene_of("entry", held(0.1), (Layer(start=0.0, foundation_modulus=modulus),))
    bound = max(1e-7, abs(tip_error(scene, depth)) if modes > 2 else 2e-4)
    assert abs(tip_error(scene, depth, modes=modes)) < bound


@pytest.mark.parametrize("kinematics", ["material", pytest.param("fixed-frame", marks=pytest.mark.slow)])
def test_many_full_length_modes_travel_from_a_shallow_depth(kinematics):
    scene = scene_of("entry", moving(3.0, 1e-3, 0.03), DAMPED, model=Model(kinematics=kinematics), duration=None)
    settings = {"time_step": 2e-5, "analysis": "dynamic", "output_step": 1e-3}
    expected = simulate(FiniteElementNeedle(scene, elements=16), **settings).tip_deflection
    errors = []
    for modes in (2, 5, 30):
        run = simulate(AssumedModeNeedle(scene, modes=modes), **settings)
        errors.append(np.max(np.abs(run.tip_deflection - expected)) / np.max(np.abs(expected)))
        assert run.summary["relative_energy_residual"] < 1e-5
    assert errors[0] > 3.0 * errors[1]
    assert errors[2] < 1e-5


@pytest.mark.parametrize("basis", ["full-length", "inserted-length"])
def test_inserted_modes_converge_with_the_third_power(basis):
    """What mode i adds to the tip falls as phi_i(l)^2 / (EI beta_i^4): the sum of the rest as N^-3."""
    scene = scene_of("entry", held(0.2), (Layer(start=0.0, foundation_modulus=5e3),))
    errors = [abs(tip_error(scene, 0.2, modes=modes, basis=basis)) for modes in (6, 12, 24, 48)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(3.0, abs=0.1)
    assert np.all(np.diff(np.abs(orders - 3.0)) < 0.0)


def test_full_length_modes_converge_faster_than_any_power_behind_the_tip():
    """Up to z < l the modes are one half of a larger interval: no boundary condition is forced upon the tip."""
    scene = scene_of("entry", held(0.1), (Layer(start=0.0, foundation_modulus=5e3),))
    errors = [abs(tip_error(scene, 0.1, modes=modes)) for modes in (2, 4, 6, 8)]
    assert all(coarse > 30.0 * fine for coarse, fine in pairwise(errors))


@pytest.mark.parametrize("basis", ["full-length", "inserted-length"])
@pytest.mark.parametrize("layers", [THESIS, LAYERS], ids=["homogeneous", "layers"])
@pytest.mark.parametrize("depth", [0.03, 0.1, 0.17])
def test_static_corrections_mend_the_statics(basis, layers, depth):
    scene = scene_of("entry", moving(0.01, 0.02, 0.18), layers, duration=None)
    plain = abs(tip_error(scene, depth, basis=basis))
    mended = abs(tip_error(scene, depth, basis=basis, static_corrections=True))
    assert mended < max(2e-3 * plain, 1e-8)


@pytest.mark.parametrize("static_corrections", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("basis", ["full-length", "inserted-length"])
def test_modes_converge_to_the_elements_in_motion(basis, kinematics, static_corrections):
    layers = (Layer(start=0.0, foundation_modulus=5e3, damping=2.0),)
    model = Model(kinematics=kinematics)
    scene = scene_of("entry", moving(4.0, 0.1, 0.2), layers, [TipLoad(force=BUZZ)], model=model, duration=None)
    settings = {"time_step": 1e-4, "analysis": "dynamic", "output_step": 1e-3}
    expected = simulate(FiniteElementNeedle(scene, elements=16), **settings).tip_deflection
    errors = []
    for modes in (2, 4, 8):
        plant = AssumedModeNeedle(scene, modes=modes, basis=basis, static_corrections=static_corrections)
        tips = simulate(plant, **settings).tip_deflection
        errors.append(np.max(np.abs(tips - expected)) / np.max(np.abs(expected)))
    if static_corrections:  # two modes do at once what eight alone do not
        assert errors[0] < 1e-4
        assert errors[2] < errors[0]
    else:
        assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


@pytest.mark.parametrize("support", ["entry", "hub"])
def test_frequencies_of_modes_lie_above_and_converge(support):
    scene = scene_of(support, held(0.12), LAYERS)
    true = natural_frequencies(FiniteElementNeedle(scene, elements=32), 0.12)[:2]
    errors = [natural_frequencies(AssumedModeNeedle(scene, modes=modes), 0.12)[:2] / true - 1.0 for modes in (3, 6, 12)]
    assert np.all(errors[-1] > -1e-6)
    assert np.all(np.abs(errors[0]) > np.abs(errors[2]))
    assert np.max(errors[2]) < 2e-3


@pytest.mark.parametrize("variant", ["conservative", "corrected"])
@pytest.mark.parametrize("tissue", ["foundation", pytest.param("tip-spring", marks=pytest.mark.slow)])
def test_a_push_against_an_independent_integration(variant, tissue):
    scene = pushed(variant, tissue, friction=True)
    plant = AssumedModeNeedle(scene)
    run = simulate(plant, time_step=1e-5, output_step=1e-3)
    reference = TwoModes(0.0256, 0.01016, **modulus_of(tissue), tip_force=0.02, axial=variant == "conservative")
    tips, depths, speeds = reference.push(run.coordinates[0, 2:], 0.08, run.time, 3.0, 0.56, 0.3)
    assert np.max(np.abs(run.tip_deflection - tips)) < 1e-6 * np.max(np.abs(tips))
    assert run.depth == pytest.approx(depths, rel=1e-7)
    assert run.speed == pytest.approx(speeds, rel=1e-6, abs=1e-9)


def pushed(variant, tissue, *, friction):
    values = {"model.variant": variant, "model.kinematics": "fixed-frame", "run.duration": 3e-3, "insertion.initial_depth": 0.08}
    values |= {"insertion.final_depth": None, "loads": [{"kind": "tip", "force": 0.02}]}
    if tissue == "tip-spring":
        values |= {"tissue.kind": "tip-spring", "tissue.layers": None, "tissue.tip_stiffness": 520.0}
    if not friction:
        values |= {"friction": None}
    return load_scene("thesis-open-loop").with_values(values)


def modulus_of(tissue):
    return {"modulus": 520.0} if tissue == "foundation" else {"spring": 520.0}


def test_a_prescribed_motion_against_an_independent_integration():
    scene = scene_of("entry", moving(2.0, 0.06, 0.09), THESIS, model=Model(variant="corrected"), duration=None)
    run = simulate(AssumedModeNeedle(scene), time_step=1e-5, analysis="dynamic", output_step=1e-3)
    reference = TwoModes(0.0256, 0.01016, 520.0, tip_force=0.1)
    first = run.coordinates[0, 2:]
    step = 1e-6
    ahead, behind = (solve_static(AssumedModeNeedle(scene), depth=0.06 + s * step).coordinates[2:] for s in (1, -1))
    tips = reference.moved(first, 2.0 * (ahead - behind) / (2.0 * step), lambda t: (0.06 + 2.0 * t, 2.0), run.time)
    assert np.max(np.abs(run.tip_deflection - tips)) < 1e-6 * np.max(np.abs(tips))


@pytest.mark.parametrize("kinematics", ["material", pytest.param("fixed-frame", marks=pytest.mark.slow)])
@pytest.mark.parametrize("tissue", ["foundation", "tip-spring"])
def test_energy_minus_work_is_constant(tissue, kinematics):
    scene = pushed("conservative", tissue, friction=False).with_value("model.kinematics", kinematics)
    run = simulate(AssumedModeNeedle(scene), time_step=1e-5, output_step=1e-3)
    drift = total_energy(run) - run.push_work - run.load_work
    assert np.max(np.abs(drift - drift[0])) < 1e-8 * np.max(run.kinetic_energy + run.bending_energy + run.tissue_energy)


def total_energy(run):
    axial = 0.5 * NEEDLE.mass_per_length * NEEDLE.length * run.speed**2
    return run.kinetic_energy + run.bending_energy + run.tissue_energy + axial


def test_without_the_axial_force_energy_drifts():
    scene = pushed("corrected", "foundation", friction=False)
    run = simulate(AssumedModeNeedle(scene), time_step=1e-5, output_step=1e-3)
    drift = total_energy(run) - run.push_work - run.load_work
    lateral = np.max(run.kinetic_energy + run.bending_energy + run.tissue_energy)
    assert np.max(np.abs(drift - drift[0])) > 0.1 * lateral
    assert run.summary["relative_energy_residual"] < 1e-4  # the lateral ledger still closes: A is in it


@pytest.mark.slow
def test_the_open_loop_of_the_thesis():
    values = {"model.kind": "assumed-modes", "model.variant": "corrected", "numerics.time_step": 3e-5}
    run = run_scene(load_scene("thesis-open-loop").with_values(values))
    assert run.summary["max_abs_tip_deflection"] == pytest.approx(1.2e-3, rel=0.05)
    assert run.depth[-1] == 0.18
    assert 0.02 < run.time[-1] < 0.03


@pytest.mark.parametrize("modes", [3, 5])
def test_more_modes_are_pushed_like_the_elements(modes):
    """Nearly parallel modes leave noise in the push's iteration, which must neither stop nor fling the needle."""
    scene = load_scene("thesis-open-loop").with_values({"run.duration": 1e-3, "insertion.final_depth": None})
    settings = {"time_step": 1e-5, "output_step": 2e-4}
    expected = simulate(FiniteElementNeedle(scene, elements=12), **settings)
    run = simulate(AssumedModeNeedle(scene, modes=modes), **settings)
    assert run.depth[1:] - 0.02 == pytest.approx(expected.depth[1:] - 0.02, rel=1e-3)
    assert run.summary["stop_reason"] == "duration"


@pytest.mark.parametrize("step", [2e-4, pytest.param(5e-5, marks=pytest.mark.slow)])
@pytest.mark.parametrize("modes", [3, 12, 30])
def test_full_length_modes_are_stable_at_coarse_steps(modes, step):
    """Combinations of modes that a step does not resolve grow with the depth: they must be damped."""
    scene = scene_of("entry", moving(2.0, 0.02, 0.06), GEL, duration=None)
    settings = {"time_step": step, "analysis": "dynamic", "output_step": 2e-3}
    expected = simulate(FiniteElementNeedle(scene, elements=12), **settings).tip_deflection
    run = simulate(AssumedModeNeedle(scene, modes=modes), **settings)
    assert np.max(np.abs(run.tip_deflection - expected)) < 1e-4 * np.max(np.abs(expected))
    assert run.summary["relative_energy_residual"] < 1e-5
    assert "spectral_radius" in run.summary["warnings"][0]


def test_three_modes_travel_far_at_a_coarse_step():
    scene = scene_of("entry", moving(0.05, 0.005, 0.18), GEL, duration=None, initial=Initial(shape="straight"))
    settings = {"time_step": 5e-3, "analysis": "dynamic", "output_step": 0.1}
    expected = simulate(FiniteElementNeedle(scene, elements=12), **settings).tip_deflection
    run = simulate(AssumedModeNeedle(scene, modes=3), **settings)
    assert np.max(np.abs(run.tip_deflection - expected)) < 1e-2 * np.max(np.abs(expected))


@pytest.mark.parametrize("step", [2e-4, 5e-5])
def test_modes_under_a_rigid_guide_stay_calm_as_the_step_falls(step):
    scene = scene_of("hub", moving(1.0, 0.04, 0.07), GEL, support={"guides": [Guide(position=-0.025)]}, duration=None)
    settings = {"time_step": step, "analysis": "dynamic", "output_step": 6e-3}
    expected = simulate(FiniteElementNeedle(scene, elements=16), **settings)
    run = simulate(AssumedModeNeedle(scene, modes=12, static_corrections=True), **settings)
    assert run.summary["relative_energy_residual"] < 1e-6
    assert np.max(np.abs(run.tip_deflection - expected.tip_deflection)) < 1e-4 * np.max(np.abs(expected.tip_deflection))
    assert run.hub_force[1:] == pytest.approx(expected.hub_force[1:], abs=0.02 * np.max(np.abs(expected.hub_force)))


@pytest.mark.parametrize("make", [lambda s: FiniteElementNeedle(s, elements=12), lambda s: AssumedModeNeedle(s, modes=8)])
def test_equilibria_feel_no_viscosity(make):
    damped = (Layer(start=0.0, foundation_modulus=5e3, damping=30.0),)
    runs = [
        simulate(make(scene_of("hub", moving(1.0, 0.04, 0.08), layers, duration=None)), analysis="static", output_step=0.01)
        for layers in (damped, GEL)
    ]
    for name in ("tip_deflection", "hub_force", "hub_moment", "tissue_force"):
        found, expected = (getattr(run, name) for run in runs)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12), name
    assert np.all(runs[0].tissue_dissipation == 0.0)


def test_corrections_of_a_needle_that_is_drawn_out():
    stiff = (Layer(start=0.0, foundation_modulus=5e4),)
    loads = [LateralLoad(position=-0.02, force=0.1)]
    push = Insertion(kind="force", initial_depth=0.12, push_force=-3.0)
    scene = scene_of("hub", push, stiff, loads, duration=0.1)
    for depth in (0.03, 0.05, 0.08):
        tips = [
            solve_static(plant, depth=depth).tip_deflection
            for plant in (AssumedModeNeedle(scene, modes=2, static_corrections=True), FiniteElementNeedle(scene, elements=24))
        ]
        assert tips[0] == pytest.approx(tips[1], rel=0.03)


def test_corrections_in_very_stiff_tissue_warn():
    scene = scene_of("entry", held(0.1), (Layer(start=0.0, foundation_modulus=1e8),))
    assert "lose their digits" in AssumedModeNeedle(scene, static_corrections=True).warnings[0]
    assert AssumedModeNeedle(scene, static_corrections=True, basis="inserted-length").warnings == ()
    assert AssumedModeNeedle(scene).warnings == ()
    exact_still = scene_of("entry", held(0.1), (Layer(start=0.0, foundation_modulus=2e6),))
    assert abs(tip_error(exact_still, 0.1, static_corrections=True)) < 1e-6


def test_modes_of_the_reference_are_the_textbook_ones():
    assert mode(0.2) == pytest.approx(np.array([2.0, -2.0]) / np.sqrt(0.2), rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"modes": 0}, "allowed 1 to 200"),
        ({"modes": 201}, "allowed 1 to 200"),
        ({"basis": "half-length"}, "basis"),
        ({"variant": "wrong"}, "variant"),
    ],
)
def test_impossible_settings(settings, message):
    with pytest.raises(SceneError, match=message):
        AssumedModeNeedle(scene_of("entry", held(0.1)), **settings)


def test_fixed_frame_variants_need_entry():
    with pytest.raises(SceneError, match="is fixed-frame"):
        AssumedModeNeedle(scene_of("hub", held(0.1)), variant="corrected")


def test_a_run_warns_outside_the_range_of_two_modes():
    scene = load_scene("bench-m").with_values({"model.kind": "assumed-modes", "numerics.analysis": "quasi-static"})
    warned = run_scene(scene)
    assert any("assumed modes miss" in text for text in warned.summary["warnings"])
    assert warned.summary["error_estimate"] > 2e-3
    quiet = run_scene(scene.with_value("numerics.tolerance", 0.02))
    assert quiet.summary["warnings"] == []
