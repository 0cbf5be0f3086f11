import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, SceneError, SuspiciousValueWarning, banded, load_scene, run_scene, simulate
from fem_needle.scene import Guide, Initial, LateralLoad, Layer, Model, Needle, Scene, Sinusoid, Support, TipLoad, Tissue
from reduced_model import AssumedModeNeedle, ClampedFreeModes
from tests.consistency.scenes import LAYERS, held, moving, scene_of

PRINTED = Model(kind="assumed-modes", variant="as-printed")
RELEASED = Initial(shape="tip-displaced", tip_deflection=5e-4)
# length outside x1 = d: what the appendix gives for the coefficients of EI q1 and EI q2 in N1, and int phi1'' phi2''
BENDING = {0.05: (7711.210, 7711.210, 444.976), 0.10: (7334.279, 7334.279, 7072.141), 0.15: (5376.77, 5376.77, 18231.13)}


def unit_needle(variant):
    """The needle of the erratum: l = 0.2 m, rho A = EI = k = 1, one spring at the tip."""
    return AssumedModeNeedle(
        Scene(
            needle=Needle(length=0.2, bending_stiffness=1.0, mass_per_length=1.0),
            support=Support(kind="entry"),
            tissue=Tissue(kind="tip-spring", tip_stiffness=1.0),
            insertion=held(0.1),
            initial=RELEASED,
            run={"duration": 1.0},
        ),
        variant=variant,
    )


def modal(band):
    return banded.to_dense(band)[2:, 2:]


def printed_stiffness(depth):
    operators = unit_needle("as-printed").operators(depth, 0.0)
    return modal(operators.bending), modal(operators.tissue), modal(operators.positional_error), operators


@pytest.mark.parametrize(("outside", "values"), BENDING.items())
def test_bending_of_the_second_mode_in_the_row_of_the_first(outside, values):
    bending, _, error, _ = printed_stiffness(0.2 - outside)
    own, other, right = values
    assert bending[0, 0] == pytest.approx(own, rel=1e-5)
    assert (bending + error)[0, 1] == pytest.approx(other, rel=1e-5)
    assert bending[0, 1] == pytest.approx(right, rel=1e-4)


def test_the_tissue_is_one_spring_at_the_tip():
    _, tissue, error, _ = printed_stiffness(0.1)
    assert tissue[0] == pytest.approx([2.3055, 4.8461], rel=2e-5)
    assert error[0, 0] == pytest.approx(0.0, abs=1e-12)
    foundation = scene_of("entry", held(0.1), (Layer(foundation_modulus=1.0),), (), initial=RELEASED, model=PRINTED)
    operators = AssumedModeNeedle(foundation).operators(0.1, 0.0)
    assert modal(operators.tissue)[0, 0] == pytest.approx(0.05076, rel=2e-5)
    assert (modal(operators.tissue) + modal(operators.positional_error))[0, 0] == pytest.approx(2.3055, rel=2e-5)


def test_a_constant_stiffness_factor_counts():
    plant = unit_needle("as-printed")
    swollen = AssumedModeNeedle(plant.scene.with_value("tissue.stiffness_factor", 3.0))
    operators = swollen.operators(0.1, 0.0)
    assert (modal(operators.tissue) + modal(operators.positional_error))[0, 0] == pytest.approx(3.0 * 2.3055, rel=2e-5)


def test_the_row_of_the_second_mode():
    bending, tissue, error, operators = printed_stiffness(0.1)
    assert (bending + tissue + error)[1] == pytest.approx(np.zeros(2), abs=1e-9)
    velocity = modal(operators.velocity_error)
    assert velocity[0] == pytest.approx(np.zeros(2), abs=0.0)
    assert velocity[1] == pytest.approx([-0.14605522, -0.44129350], rel=1e-7)


def test_the_velocity_terms_are_right():
    """d/dt(M q') = M q'' + v phi phi' q': -2.3055, -4.8461, -10.1863 times the rate of the length outside."""
    tip = unit_needle("corrected").points(0.1).rows[-1, 2:]
    found = np.outer(tip, tip)
    assert found[np.triu_indices(2)] == pytest.approx([2.3055, 4.8461, 10.1863], rel=2e-5)
    step = 1e-6
    masses = [modal(unit_needle("corrected").operators(0.1 + s * step, 0.0).mass) for s in (1, -1)]
    assert (masses[0] - masses[1]) / (2 * step) == pytest.approx(found, rel=1e-7)


def test_coefficients_printed_in_the_appendix():
    """Constant parts of N1: that of bending is B_1^4 in front of q1 and, wrongly, of q2; that of the tissue is phi_1's own."""
    modes = ClampedFreeModes(1.0, 1)
    root, ratio = modes.roots[0], modes.slope_ratios[0]
    assert pytest.approx(root**4, rel=2e-5) == 0.2e-11 * 0.6181168280e13
    # of cosh - cos - s (sinh - sin), squared: half of each square but 1/2 (s^2 - 1) of the growing pair; times 1 - s^2 + ... = 1
    assert pytest.approx(1.000006512, rel=1e-9) == 0.2e-11 * 0.5000032560e12
    assert ratio == pytest.approx(0.7341, rel=1e-4)


def test_the_second_mode_grows_without_bound():
    """Its equation is M22 q2'' - M22 q2' + ... = 0 without stiffness: per second it grows by e at least."""
    layers = (Layer(foundation_modulus=520.0),)
    plant = AssumedModeNeedle(scene_of("entry", held(0.1), layers, (), initial=RELEASED, model=PRINTED))
    operators = plant.operators(0.1, 0.0)
    mass, rate = modal(operators.mass), modal(operators.velocity_error)
    stiffness = modal(operators.bending) + modal(operators.tissue) + modal(operators.positional_error)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, rate)]])
    assert np.max(np.linalg.eigvals(system).real) > 0.5
    right = AssumedModeNeedle(plant.scene.with_value("model.variant", "corrected")).operators(0.1, 0.0)
    assert right.positional_error is None


def test_running_the_printed_equations_warns_and_breaks_the_energy():
    values = {"model.kind": "assumed-modes", "model.variant": "as-printed", "numerics.time_step": 5e-5}
    scene = load_scene("thesis-open-loop").with_values(values)
    with pytest.warns(SuspiciousValueWarning, match="second mode|spring at the tip"):
        run = run_scene(scene)
    assert "second mode has no stiffness" in run.summary["warnings"][0]
    assert any("spring at the tip" in text for text in run.summary["warnings"])
    assert run.summary["relative_energy_residual"] > 0.1
    assert run.summary["variant"] == "as-printed"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"model.modes": 3}, "two modes"),
        ({"model.basis": "inserted-length"}, "full length"),
        ({"model.static_corrections": True}, "static_corrections"),
        ({"tissue.stiffness_factor": {"mean": 1.0, "amplitude": 0.1, "frequency": 1.0}}, "swelling"),
        ({"tissue.rest_line": "cut-path"}, "cut path"),
        ({"tissue.layers.0.damping": 1.0}, "undamped"),
        ({"tissue.layers.0.end": 0.15}, "undamped"),
        ({"numerics.analysis": "quasi-static"}, "no equilibrium"),
        ({"initial.shape": "equilibrium", "initial.tip_deflection": None}, "no equilibrium"),
    ],
)
def test_what_the_printed_equations_cannot_have(values, message):
    scene = scene_of("entry", held(0.1), (Layer(foundation_modulus=520.0),), (), initial=RELEASED, model=PRINTED)
    with pytest.raises(SceneError, match=message):
        AssumedModeNeedle(scene.with_values(values))


def test_two_modes_cannot_obey_two_rigid_guides():
    scene = scene_of("hub", held(0.1), support={"guides": [Guide(position=-0.03), Guide(position=-0.02)]})
    with pytest.raises(SceneError, match="2 rigid guides"):
        AssumedModeNeedle(scene)
    assert AssumedModeNeedle(scene, modes=3).modes == 3


FEATURES = {
    "guides": scene_of(
        "hub",
        moving(0.5, 0.08, 0.12),
        LAYERS,
        [TipLoad(force=0.1), LateralLoad(position=-0.01, force=0.2)],
        support={"guides": [Guide(position=-0.0317, stiffness=1e3), Guide(position=-0.0291)], "hub_angle": 0.01},
        duration=None,
    ),
    "hub motion": scene_of(
        "hub",
        moving(0.5, 0.08, 0.12),
        LAYERS,
        support={"hub_deflection": Sinusoid(mean=0.0, amplitude=1e-3, frequency=10.0)},
        duration=None,
    ),
    "free hub": scene_of(
        "hub",
        held(0.1),
        LAYERS,
        support={"hub_rotation": "free", "hub_torque": 2e-3, "hub_rotational_inertia": 1e-6},
        duration=0.05,
    ),
    "cut path": scene_of("entry", moving(0.05, 0.05, 0.1), LAYERS, tissue={"rest_line": "cut-path"}, duration=None),
    "swelling": scene_of(
        "entry", held(0.12), LAYERS, tissue={"stiffness_factor": Sinusoid(mean=1.5, amplitude=0.5, frequency=8.0)}, duration=0.1
    ),
    "tip spring": scene_of(
        "entry", moving(0.5, 0.08, 0.12), (), tissue={"kind": "tip-spring", "tip_stiffness": 520.0}, duration=None
    ),
    "bevel": scene_of("entry", moving(0.5, 0.04, 0.1), LAYERS, [TipLoad(bevel_coefficient=1e-6)], duration=None),
}


@pytest.mark.parametrize("name", FEATURES)
def test_everything_that_the_elements_take(name):
    """Twelve modes with static corrections follow the elements through every feature of a scene."""
    scene = FEATURES[name]
    settings = {"time_step": 2e-4 if name == "guides" else 1e-3, "analysis": "dynamic", "output_step": 5e-3}
    if name in {"cut path", "bevel"}:
        settings |= {"time_step": 2e-2, "analysis": "quasi-static", "output_step": 2e-2}
    plant = AssumedModeNeedle(scene, modes=12, static_corrections=True)
    expected = simulate(FiniteElementNeedle(scene, elements=24), **settings)
    found = simulate(plant, **settings)
    scale = np.max(np.abs(expected.tip_deflection))
    assert np.max(np.abs(found.tip_deflection - expected.tip_deflection)) < 2e-3 * scale
