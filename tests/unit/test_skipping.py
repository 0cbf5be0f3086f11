import pytest

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.dynamics.engine import Engine
from fem_needle.dynamics.run import Integration, without_inertia
from fem_needle.exact import natural_frequencies
from fem_needle.free_response import natural_frequencies as computed_frequencies
from fem_needle.inertia_effect import inertia_effect
from fem_needle.motion import shortest_period
from fem_needle.scene import Guide, Initial, Insertion, Layer, Model, Sinusoid, Table, TipLoad
from fem_needle.skipping import RULES, unneeded_terms
from tests.consistency.scenes import BUZZ, DAMPED, GEL, held, moving, profile, relative, scene_of


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_natural_frequencies(kind):
    """sqrt((EI (beta / L)^4 + k) / rho A); the whole hub needle in tissue, half of the entry needle."""
    scene = scene_of(kind, held(0.2), GEL)
    found = computed_frequencies(FiniteElementNeedle(scene, elements=16), 0.2)[:4]
    assert found == pytest.approx(natural_frequencies(scene, 0.2, 4), rel=1e-5)


def test_rigid_and_very_stiff_guides_vibrate_alike():
    found = []
    for stiffness in ("rigid", 1e9):
        scene = scene_of("hub", held(0.1), GEL, support={"guides": [Guide(position=-0.05, stiffness=stiffness)]})
        found.append(computed_frequencies(FiniteElementNeedle(scene, elements=8), 0.1)[:3])
    assert found[0] == pytest.approx(found[1], rel=1e-3)


def test_shortest_period():
    assert shortest_period(scene_of("entry", held(0.1))) == float("inf")
    loads = [TipLoad(force=Sinusoid(amplitude=0.1, frequency=4.0))]
    insertion = Insertion(kind="profile", depth=Sinusoid(mean=0.1, amplitude=0.01, frequency=5.0))
    assert shortest_period(scene_of("entry", insertion, loads=loads)) == 0.2


def test_creep_where_the_tissue_is_viscous():
    assert without_inertia(scene_of("entry", held(0.1))) == Integration("rest")
    damped = without_inertia(scene_of("entry", held(0.1), DAMPED))
    assert (damped.kind, damped.steps) == ("creep", True)


@pytest.mark.parametrize("speed", [0.05, 0.4])
def test_the_bound_covers_what_inertia_does(speed):
    scene = scene_of("entry", moving(speed, 0.06, 0.08), duration=0.02 / speed)
    plant = FiniteElementNeedle(scene, elements=6)
    both = [
        simulate(plant, analysis=name, time_step=0.02 / speed / 400, output_step=0.002 / speed) for name in ("dynamic", "static")
    ]
    effect = relative(both[0].tip_deflection, both[1].tip_deflection)
    bound = inertia_effect(plant)
    assert effect <= bound
    assert bound < 100.0 * effect


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_the_bound_covers_what_a_jump_of_the_bevel_force_sets_ringing(kind):
    """The equilibrium jumps at the interface; however slow the needle, it is let go there."""
    layers = (Layer(end=0.1, foundation_modulus=5e3), Layer(start=0.1, foundation_modulus=2e4))
    scene = scene_of(kind, moving(0.1, 0.099, 0.101), layers, [TipLoad(bevel_coefficient=5e-6)], duration=None)
    plant = FiniteElementNeedle(scene, elements=6)
    both = [simulate(plant, analysis=name, time_step=2e-5, output_step=1e-4) for name in ("dynamic", "static")]
    effect = relative(both[0].tip_deflection, both[1].tip_deflection)
    assert 0.1 < effect <= inertia_effect(plant)
    slow = scene.with_value("insertion.speed", 1e-6)
    assert effect <= inertia_effect(FiniteElementNeedle(slow, elements=6)) < 2.0 * effect


@pytest.mark.parametrize("speed", [1e-3, 0.05, 0.4])
def test_the_rough_bound_of_slow_needles_is_a_bound(speed):
    plant = FiniteElementNeedle(scene_of("entry", moving(speed, 0.06, 0.08), duration=0.02 / speed), elements=6)
    assert inertia_effect(plant) <= inertia_effect(plant, enough=1.0) < 30.0 * inertia_effect(plant)
    assert inertia_effect(plant, enough=1e-15) == inertia_effect(plant)


def test_a_ramp_that_takes_no_time_sets_it_ringing():
    force = Table(time=[0.0, 500.0, 500.0001], value=[0.0, 0.0, 0.1])
    scene = scene_of("entry", held(0.1), GEL, [TipLoad(force=force)], duration=1000.0)
    assert 1.0 <= inertia_effect(FiniteElementNeedle(scene, elements=4)) < 1.3
    viscous = scene.with_value("tissue.layers.0.damping", 5e4)
    assert inertia_effect(FiniteElementNeedle(viscous, elements=4)) < 0.1


@pytest.mark.parametrize("kind", ["entry", "hub"])
@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
@pytest.mark.parametrize("speed", [pytest.param(0.1, marks=pytest.mark.slow), 1.0])
@pytest.mark.parametrize("damping", [pytest.param(0.0, marks=pytest.mark.slow), 2.0])
def test_the_bound_covers_a_start_from_rest(kind, kinematics, speed, damping):
    """The momentum v S q of the convective inertia jumps with the speed, also where the rates of the coordinates hardly do."""
    if kind == "hub" and kinematics == "fixed-frame":
        pytest.skip("hub is material")
    way = profile([0.0, 0.01, 0.01 + 0.03 / speed], [0.06, 0.06, 0.09])
    layers = (Layer(foundation_modulus=5e3, damping=damping),)
    scene = scene_of(kind, way, layers, duration=0.01 + 0.03 / speed, model=Model(kinematics=kinematics))
    plant = FiniteElementNeedle(scene, elements=6)
    step = scene.duration / 100
    both = [simulate(plant, analysis=name, time_step=step / 10, output_step=step) for name in ("dynamic", "quasi-static")]
    effect = relative(both[0].tip_deflection, both[1].tip_deflection)
    bound = inertia_effect(plant)
    assert effect <= bound
    assert bound < 100.0 * effect


def test_kinks_that_nearly_coincide_are_one():
    """A needle that comes to rest a rounding before the run ends leaves no sliver to take differences on."""
    scene = scene_of("entry", moving(0.1, 0.06, 0.08), duration=0.2 * (1 + 1e-13))
    clean = scene_of("entry", moving(0.1, 0.06, 0.08), duration=0.19)
    found, expected = (inertia_effect(FiniteElementNeedle(s, elements=6)) for s in (scene, clean))
    assert found < 10.0 * expected


def test_the_bound_covers_a_swinging_load():
    scene = scene_of("entry", held(0.1), loads=[TipLoad(force=Sinusoid(mean=0.1, amplitude=0.05, frequency=5.0))], duration=0.2)
    plant = FiniteElementNeedle(scene, elements=6)
    both = [simulate(plant, analysis=name, time_step=2e-4, output_step=0.01) for name in ("dynamic", "static")]
    assert relative(both[0].tip_deflection, both[1].tip_deflection) <= inertia_effect(plant) < 0.05


def test_a_start_away_from_equilibrium_cannot_do_without_inertia():
    scene = scene_of("entry", held(0.1), initial=Initial(shape="straight"))
    assert inertia_effect(FiniteElementNeedle(scene, elements=4)) == float("inf")


def test_unneeded_terms():
    names = [skipped.term for skipped in unneeded_terms(scene_of("entry", held(0.1)))]
    assert names == [term for term in RULES if term != "hub motion"]
    full = scene_of(
        "hub",
        Insertion(kind="force", initial_depth=0.1, push_force=1.0),
        [Layer(foundation_modulus=1e3, damping=1.0)],
        support={"guides": [Guide(position=-0.01)], "hub_angle": Sinusoid(mean=0.0, amplitude=0.1, frequency=1.0)},
        tissue={"stiffness_factor": Sinusoid(mean=1.0, amplitude=0.1, frequency=1.0), "rest_line": "cut-path"},
    )
    assert list(unneeded_terms(full)) == []


HALVES = (Layer(start=0.0, end=0.07, foundation_modulus=5e3), Layer(start=0.07, foundation_modulus=5e3))
MOVING = {
    kind: scene_of(kind, moving(1.0, 0.06, 0.09), loads=[TipLoad(force=BUZZ)], duration=0.03) for kind in ("entry", "hub")
}
# A term: the scene that does without it, and what puts the term in without any effect.
TWINS = {
    "needle outside the tissue": ("entry", {"needle.length": 0.4}),
    "tissue viscosity": ("entry", {"tissue.layers.0.damping": 1e-9}),
    "swelling": ("hub", {"tissue.stiffness_factor": {"time": [0.0, 1.0], "value": [1.0, 1.0]}}),
    "points between hub and tissue": (
        "hub", {"loads": [{"kind": "tip", "force": BUZZ.model_dump()}, {"kind": "lateral", "position": -0.01, "force": 0.0}]}
    ),
    "layer loop": ("entry", {"tissue.layers": [layer.model_dump() for layer in HALVES]}),
    "path memory": ("hub", {"tissue.rest_line": "cut-path", "insertion": {"kind": "hold", "initial_depth": 0.08}}),
    "hub motion": ("hub", {"support.hub_deflection": {"time": [0.0, 1.0], "value": [0.0, 1e-15]}}),
}


@pytest.mark.parametrize("term", TWINS)
def test_what_is_left_out_changes_nothing(term):
    """The same needle with the term in it, but without effect: the tips agree far below any tolerance."""
    kind, values = TWINS[term]
    lean = MOVING[kind]
    if term == "path memory":  # no path is cut while the needle is held
        lean = lean.with_value("insertion", values["insertion"])
    full = lean.with_values(values)
    assert RULES[term](lean)
    if term != "needle outside the tissue":
        assert not RULES[term](full)
    tips = [
        simulate(FiniteElementNeedle(scene, elements=12), analysis="dynamic", time_step=1e-4, output_step=1e-3).tip_deflection
        for scene in (lean, full)
    ]
    assert relative(*tips) < 1e-6


def test_every_rule_has_its_test():
    assert set(RULES) - set(TWINS) == {"insertion dynamics"}  # a push is another scene: tests/consistency/test_push.py


def test_output_is_made_where_it_is_asked_for(monkeypatch):
    """Samples between the outputs are not computed: fewer outputs, fewer of them."""
    counted = []
    original = Engine._samples
    monkeypatch.setattr(Engine, "_samples", lambda self, record: counted.extend(record) or original(self, record))
    plant = FiniteElementNeedle(MOVING["entry"], elements=4)
    for output_step, samples in ((1e-2, 4), (1e-3, 31)):
        counted.clear()
        run = simulate(plant, analysis="dynamic", time_step=1e-3, output_step=output_step)
        assert len(counted) == len(run.time) == samples
