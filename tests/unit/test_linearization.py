"""Linear models against differences of the nonlinear equations, exact frequencies, statics and reciprocity."""

import numpy as np
import pytest
from scipy.linalg import eigh

from fem_needle import FiniteElementNeedle, SceneError, banded, load_scene, solve_static
from fem_needle.errors import ComputationError, NeedleError
from fem_needle.exact import natural_frequencies
from fem_needle.ledger import axial_momentum, configuration_force
from fem_needle.linear.depth_rates import kinetic_matrix_rates, numerical_rate, smooth_range
from fem_needle.linear.linearization import linearize, with_lateral_force
from fem_needle.linear.small_motion import operating_point
from fem_needle.loads import LoadCase, load_case
from fem_needle.motion import Instant
from fem_needle.path import straight_path
from fem_needle.scene import Friction, Guide, LateralLoad, Layer, Model, TipLoad
from fem_needle.stages import StageSolution, evaluate_stage, internal_force, momentum
from reduced_model import AssumedModeNeedle
from tests.consistency.scenes import GEL, LENGTH, held, relative, scene_of

LAYERS = (
    Layer(start=0.0, end=0.0437, foundation_modulus=5e3, damping=5.0),
    Layer(start=0.05, foundation_modulus=2e4, damping=20.0),
)
FRICTION = Friction(coulomb=0.3, viscous=0.2, coulomb_per_length=1.0, viscous_per_length=2.0)
LATERAL = [TipLoad(force=0.1), LateralLoad(position=-0.0123, force=0.3)]
SPRINGS = {"guides": [Guide(position=-0.0317, stiffness=1e3), Guide(position=-0.0291, stiffness=5e3)], "hub_angle": 0.01}
PINS = {"guides": [Guide(position=-0.025), Guide(position=-0.05)], "hub_deflection": 1e-3}
FREE_HUB = {"hub_rotation": "free", "hub_rotational_inertia": 1e-5, "hub_torque": 0.01}
DEPTH = 0.0911
SCENES = {
    "entry": scene_of("entry", held(0.1), LAYERS, friction=FRICTION),
    "entry, fixed-frame": scene_of("entry", held(0.1), LAYERS, friction=FRICTION, model=Model(kinematics="fixed-frame")),
    "hub": scene_of("hub", held(0.1), LAYERS, LATERAL, friction=FRICTION),
    "hub, springs": scene_of("hub", held(0.1), LAYERS, LATERAL, support=SPRINGS, friction=FRICTION),
    "free hub": scene_of("hub", held(0.1), LAYERS, LATERAL, support=FREE_HUB),
}


ENTRY = scene_of("entry", held(0.1), LAYERS, friction=FRICTION)
HOMOGENEOUS = scene_of("entry", held(0.1), GEL, friction=FRICTION, initial={"shape": "straight"})
PLANTS = {name: lambda scene=scene: plant_of(scene) for name, scene in SCENES.items()} | {
    "hub, springs elsewhere": lambda: plant_of(SCENES["hub, springs"], 4),
    "modes of the full length": lambda: AssumedModeNeedle(ENTRY, modes=2),
    "modes of the inserted length": lambda: AssumedModeNeedle(ENTRY, modes=2, basis="inserted-length"),
    "modes at a hub": lambda: AssumedModeNeedle(SCENES["hub"], modes=3),
    "modes, corrected": lambda: AssumedModeNeedle(fixed(ENTRY), modes=2, variant="corrected"),
    "modes, as printed": lambda: AssumedModeNeedle(fixed(HOMOGENEOUS), modes=2, variant="as-printed"),
}


def fixed(scene):
    return scene.with_value("model.kinematics", "fixed-frame")


def plant_of(scene, elements=3):
    return FiniteElementNeedle(scene, elements=elements)


def forces_of(plant, points, case, coordinates):
    """All point forces: guides with a stiffness answer to the deflection, the kink's flexibility included."""
    guides = points.guides
    soft = points.flexibility[:guides, :guides] + np.diag(points.guide_compliance)
    gap = points.rows[:guides] @ coordinates + points.flexibility[:guides, guides:] @ case.forces
    return np.concatenate([-np.linalg.solve(soft, gap), case.forces]) if guides else case.forces


class Nonlinear:
    """Accelerations (v', q'') from momenta and forces of the ledger; matrices' rates by differences of the momenta."""

    def __init__(self, plant, point, push, changes=None):
        self.plant, self.push, self.changes = plant, push, changes
        self.last = None
        self.direction = np.sign(point.speed)  # of sliding: friction has no derivative where it turns round

    def case(self, depth):
        known = load_case(self.plant.scene, depth, 0.0)
        forces = known.forces if self.changes is None else known.forces + self.changes
        return LoadCase(forces, 0.0 * forces, known.clamp, 0.0 * known.clamp, 0.0 * known.clamp)

    def at(self, depth, speed, coordinates, velocities):
        stage = self.last = evaluate_stage(self.plant, Instant(0.0, depth, speed, 0.0), self.case(depth), self.last)
        forces = forces_of(self.plant, stage.points, stage.case, coordinates)
        return stage, StageSolution(coordinates, velocities, momentum(stage, coordinates, velocities), forces)

    def momenta(self, depth, speed, coordinates, velocities):
        stage, state = self.at(depth, speed, coordinates, velocities)
        scene = self.plant.scene
        own = scene.needle.mass_per_length * scene.needle.length * speed
        lateral = axial_momentum(stage, coordinates, velocities) if self.plant.axial_force_acts else 0.0
        return np.array([own + lateral, *state.momentum])

    def __call__(self, depth, speed, coordinates, velocities):
        plant, scene, clamped = self.plant, self.plant.scene, self.plant.prescribed
        stage, state = self.at(depth, speed, coordinates, velocities)
        friction = scene.friction
        resisting = self.direction * (friction.coulomb + friction.coulomb_per_length * depth)
        resisting += (friction.viscous + friction.viscous_per_length * depth) * speed
        lateral = internal_force(stage, coordinates, velocities) + stage.points.rows.T @ state.forces
        along = configuration_force(plant, stage, state) if plant.axial_force_acts else 0.0
        force = np.array([self.push - resisting + along, *lateral])
        step = 1e-5
        ahead, behind = (
            self.momenta(depth + sign * step * speed, speed, coordinates + sign * step * velocities, velocities)
            for sign in (1, -1)
        )
        force -= (ahead - behind) / (2 * step)
        mass = np.zeros((len(force), len(force)))
        for column in range(len(force)):
            units = np.eye(len(force))[column]
            mass[:, column] = self.momenta(depth, speed + units[0], coordinates, velocities + units[1:])
        mass -= self.momenta(depth, speed, coordinates, velocities)[:, None]
        keep = np.r_[0, 1 + clamped : len(force)]
        return np.linalg.solve(mass[np.ix_(keep, keep)], force[keep])


def state_of(plant, point):
    clamped = plant.prescribed
    return np.concatenate([[point.depth], point.coordinates[clamped:], [point.speed], point.velocities[clamped:]])


def rates(plant, nonlinear, point, state):
    half, clamped = len(state) // 2, plant.prescribed
    coordinates, velocities = point.coordinates.copy(), point.velocities.copy()
    coordinates[clamped:], velocities[clamped:] = state[1:half], state[half + 1 :]
    return nonlinear(state[0], state[half], coordinates, velocities)


@pytest.mark.parametrize("speed", [0.0, -3.0])
@pytest.mark.parametrize("name", PLANTS)
def test_the_derivatives_are_those_of_the_nonlinear_equations(name, speed):
    plant = PLANTS[name]()
    model = linearize(plant, depth=DEPTH, speed=speed)
    point = model.operating_point
    nonlinear = Nonlinear(plant, point, point.push_force)
    state = state_of(plant, point)
    half = len(state) // 2
    assert rates(plant, nonlinear, point, state)[0] == pytest.approx(0.0, abs=1e-4)  # the push keeps the speed
    found = model.A[half:]
    for column, unit in enumerate(np.eye(2 * half)):
        step = 1e-5 if column < half else 1e-3
        far, high, low, back = (rates(plant, nonlinear, point, state + number * step * unit) for number in (2, 1, -1, -2))
        expected = (8 * (high - low) - (far - back)) / (12 * step)
        weight = np.sqrt(np.diag(model.second_order.mass))  # rows in comparable units
        error = np.max(np.abs(weight * (found[:, column] - expected)))
        assert error < 2e-5 * np.max(np.abs(weight * expected)) + 1e-6, column


@pytest.mark.parametrize("name", PLANTS)
def test_forces_enter_as_in_the_nonlinear_equations(name):
    plant = PLANTS[name]()
    model = linearize(plant, depth=DEPTH)
    point, loads = model.operating_point, [one for one in model.inputs if one.unit in {"N", "N m"}]
    state = state_of(plant, point)
    half = len(state) // 2
    for column, signal in enumerate(loads):
        count = len(load_case(plant.scene, DEPTH, 0.0).forces)
        changes = np.eye(count)[column - 1] if column else np.zeros(count)
        push = point.push_force + (1.0 if signal.name == "push" else 0.0)
        high = rates(plant, Nonlinear(plant, point, push, changes), point, state)
        low = rates(plant, Nonlinear(plant, point, 2 * point.push_force - push, -changes), point, state)
        expected = 0.5 * (high - low)
        assert model.B[half:, column] == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.max(np.abs(expected))), signal


def test_rigid_guides_constrain_the_motion_with_the_depth():
    """The reduced stiffness is the Hessian of the potential on the curved set that the pins leave."""
    plant, depth = plant_of(scene_of("hub", held(0.1), LAYERS, LATERAL, support=PINS), elements=8), 0.125  # pins at nodes
    model = linearize(plant, depth=depth)

    def potential(change):
        """Of the equilibrium at a depth: half the work of what was given, negative for forces."""
        rest, points = solve_static(plant, depth=depth + change), plant.points(depth + change)
        loads = load_case(plant.scene, depth, 0.0).forces
        reached = points.deflections(rest.coordinates, rest.point_forces)[points.guides :]
        return 0.5 * (rest.hub_force * plant.scene.support.hub_deflection - float(loads @ reached))

    step = 1e-4
    expected = (potential(step) - 2 * potential(0.0) + potential(-step)) / step**2
    stiffness = model.second_order.stiffness
    condensed = stiffness[0, 0] - stiffness[0, 1:] @ np.linalg.solve(stiffness[1:, 1:], stiffness[1:, 0])
    assert condensed == pytest.approx(expected, rel=1e-4)
    assert len(model.second_order.mass) == plant.size - 2 - 2 + 1


def test_frequencies_are_the_exact_ones():
    for kind, depth in (("entry", 0.1), ("entry", LENGTH), ("hub", LENGTH)):
        scene = scene_of(kind, held(depth))
        found = linearize(plant_of(scene, 16), depth=depth, axial="held").natural_frequencies
        assert found[:3] == pytest.approx(natural_frequencies(scene, depth, 3), rel=2e-7)


def test_damping_of_a_uniform_foundation():
    """M q'' + C q' + K q with C = c / rho A M: 2 zeta omega = c / rho A for every mode."""
    scene = scene_of("hub", held(LENGTH), (Layer(foundation_modulus=5e3, damping=0.2),))
    model = linearize(plant_of(scene, 8), depth=LENGTH, axial="held")
    expected = 0.2 / scene.needle.mass_per_length
    found = 2 * model.damping_ratios * model.natural_frequencies
    assert found[:5] == pytest.approx(expected, rel=1e-6)
    assert np.all(model.poles.real < 0)


@pytest.mark.parametrize("elements", [7, 16])
def test_static_gains_are_differences_of_statics(elements):
    scene = load_scene("brachytherapy").with_value("support.guides.0.position", "-31.7 mm")
    depth = 0.0634
    model = linearize(plant_of(scene, elements), depth=depth, axial="held")
    before = solve_static(plant_of(scene, elements), depth=depth)
    tip = np.array([scene.needle.length])
    changes = {"lateral_force": "loads.0.force", "hub_deflection": "support.hub_deflection", "hub_angle": "support.hub_angle"}
    for name, path in changes.items():
        after = solve_static(plant_of(scene.with_value(path, 1.0), elements), depth=depth)
        assert model.static_gain("tip_deflection", name) == pytest.approx(after.tip_deflection - before.tip_deflection, rel=1e-8)
        slopes = [float(rest.deflection(tip, 1)[0]) for rest in (before, after)]
        assert model.static_gain("tip_angle", name) == pytest.approx(slopes[1] - slopes[0], rel=1e-8)


def test_the_tip_follows_the_depth_as_the_equilibria_do():
    """A slow push moves the tip along dw/dz of the equilibria: the ratio of two transfer functions at low frequency."""
    plant = plant_of(SCENES["hub"], 8)
    model = linearize(plant, depth=DEPTH)
    slow = 1e-4
    ratio = model.transfer_function("tip_deflection", "push", slow) / model.transfer_function("depth", "push", slow)
    tips = [solve_static(plant, depth=DEPTH + step).tip_deflection for step in (1e-5, -1e-5)]
    assert ratio.real == pytest.approx((tips[0] - tips[1]) / 2e-5, rel=1e-6)


def test_transfer_functions_agree_with_the_state_space():
    model = linearize(plant_of(SCENES["hub, springs"]), depth=DEPTH)
    for omega in (20.0, 200.0):  # the state space loses digits of responses that are small because they are fast
        resolvent = np.linalg.solve(1j * omega * np.eye(len(model.A)) - model.A, model.B)
        expected = model.C @ resolvent + model.D
        for row, output in enumerate(model.outputs):
            for column, given in enumerate(model.inputs):
                found = model.transfer_function(output.name, given.name, omega)
                assert abs(found - expected[row, column]) < 1e-7 * np.max(np.abs(expected[row])), (output, given)


def test_a_hub_that_is_shaken_moves_a_stiff_needle_as_a_rigid_body():
    needle = SCENES["hub"].needle.model_copy(update={"bending_stiffness": 1e5})
    model = linearize(plant_of(scene_of("hub", held(0.1), (), (), needle=needle)), depth=0.1, axial="held")
    frequencies = np.array([1.0, 30.0])
    assert model.transfer_function("tip_deflection", "hub_deflection", frequencies) == pytest.approx(1.0, rel=1e-4)
    assert model.transfer_function("tip_deflection", "hub_angle", frequencies) == pytest.approx(LENGTH, rel=1e-4)


def test_reciprocity():
    """Tip under a lateral force = place of that force under a tip force, at any frequency."""
    plant = plant_of(SCENES["hub, springs"])
    model = linearize(plant, depth=DEPTH, axial="held")
    parts, points = model.second_order, plant.points(DEPTH)
    assert parts.mass == pytest.approx(parts.mass.T)
    assert relative(parts.stiffness, parts.stiffness.T) < 1e-14
    assert parts.rows[0] == pytest.approx(parts.forces[0][:, [one.name for one in model.inputs].index("tip_force")])
    assert points.rows.shape[0] == 4


def test_a_free_depth_without_a_bend_is_a_sliding_mass():
    """At q = 0 push and depth know nothing of the tip: z = f / (m s^2 + mu s)."""
    scene = scene_of("entry", held(0.1), GEL, (), friction=FRICTION)
    model = linearize(plant_of(scene), depth=0.1)
    weight, friction = 0.01016 * LENGTH, 0.2 + 2.0 * 0.1
    s = 3j
    assert model.transfer_function("depth", "push", 3.0) == pytest.approx(1 / (weight * s**2 + friction * s), rel=1e-12)
    assert model.transfer_function("tip_deflection", "push", 3.0) == 0.0
    with pytest.raises(ComputationError, match="held"):
        model.static_gain("depth", "push")


def test_the_base_under_entry_turns_alone():
    scene = scene_of("entry", held(0.1), support={"hub_rotation": "free", "hub_rotational_inertia": 2e-4})
    model = linearize(plant_of(scene), depth=0.1)
    assert model.transfer_function("hub_angle", "torque", 10.0) == pytest.approx(-1 / (2e-4 * 100.0), rel=1e-12)
    assert model.transfer_function("tip_deflection", "torque", 10.0) == 0.0
    assert [one.name for one in model.states].count("base_angle_rate") == 1


def test_rates_by_differences():
    layers = (Layer(start=0.0, end=0.05, foundation_modulus=1.0), Layer(start=0.05, foundation_modulus=2.0))
    scene = scene_of("hub", held(0.1), layers)
    assert numerical_rate(lambda z: np.array([np.sin(30 * z), z**3]), 0.07, scene) == pytest.approx(
        [30 * np.cos(2.1), 3 * 0.07**2], rel=1e-9
    )
    kinked = numerical_rate(lambda z: 3 * z + max(z - 0.07 - 2e-5, 0.0) ** 1, 0.07, scene)
    assert kinked == pytest.approx(3.0, rel=1e-9)  # the other side of the kink is not asked
    assert numerical_rate(lambda z: abs(z - 0.05), 0.05, scene) == pytest.approx(-1.0)  # from the shallower side
    assert smooth_range(scene, 0.05) == (0.0, 0.05)
    assert smooth_range(scene, 0.07) == (0.05, LENGTH)
    assert smooth_range(scene, LENGTH) == (0.05, LENGTH)


def test_rates_of_the_kinetic_matrices():
    plant = plant_of(SCENES["entry"])
    mass, convection, centrifugal = kinetic_matrix_rates(plant, 0.1)
    high, low = (plant.operators(0.1 + step, 0.0) for step in (1e-4, -1e-4))
    assert mass == pytest.approx(banded.to_dense(high.mass - low.mass) / 2e-4, rel=1e-6, abs=1e-12)
    expected = banded.to_dense(high.centrifugal - low.centrifugal) / 2e-4
    assert centrifugal == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.max(np.abs(expected)))
    assert np.max(np.abs(convection)) < 1e-12 * np.max(np.abs(mass))


def test_the_push_of_the_operating_point_holds_the_axial_force():
    """At rest the push is -A; A = F^2 z^2 / (2 EI) without tissue under entry (docs/theory.md)."""
    plant = plant_of(scene_of("entry", held(0.1), ()))
    point = operating_point(plant, depth=0.1, time=0.0, speed=0.0)
    assert point.push_force == pytest.approx(-(0.1**2) * 0.1**2 / (2 * 0.0256), rel=1e-9)


def test_undamped_poles_are_the_roots_of_the_eigenproblem():
    scene = scene_of("hub", held(0.1), GEL, support={"guides": [Guide(position=-0.03)]})
    model = linearize(plant_of(scene, 8), depth=0.1, axial="held")
    parts = model.second_order
    omega = np.sqrt(eigh(parts.stiffness, parts.mass, eigvals_only=True))
    assert model.natural_frequencies[:6] == pytest.approx(omega[:6], rel=1e-7)
    assert np.max(np.abs(model.damping_ratios)) < 1e-6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"depth": 0.0}, "depth"),
        ({"depth": 0.19}, "0.1877 m"),
        ({"speed": np.inf}, "speed"),
        ({"axial": "loose"}, "'held'"),
    ],
)
def test_wrong_input(changes, message):
    with pytest.raises(SceneError, match=message):
        linearize(plant_of(SCENES["hub"]), **({"depth": 0.1} | changes))


def test_what_has_no_linear_model_is_refused():
    with pytest.raises(SceneError, match="rest_line"):
        linearize(plant_of(SCENES["hub"]), depth=0.1, path=straight_path(0.05))
    with pytest.raises(SceneError, match="guides with a stiffness"):
        linearize(plant_of(load_scene("brachytherapy"), 10), depth=0.09, speed=0.01)
    with pytest.raises(SceneError, match="tip_deflection"):
        linearize(plant_of(SCENES["hub"]), depth=0.1).transfer_function("tip", "push", 1.0)


def test_a_lateral_force_is_added_once():
    scene = with_lateral_force(SCENES["entry"].with_value("support.kind", "hub"), -0.01)
    assert [load.force for load in scene.loads if load.kind == "lateral"] == [0.0]
    assert with_lateral_force(scene, -0.01) is scene
    with pytest.raises(SceneError):
        with_lateral_force(SCENES["entry"], -0.01)


def test_python_control(monkeypatch):
    control = pytest.importorskip("control")
    model = linearize(plant_of(SCENES["hub"]), depth=DEPTH)
    system = model.to_control()
    assert isinstance(system, control.StateSpace)
    assert system.input_labels == [one.name for one in model.inputs]
    assert system.output_labels[:2] == ["tip_deflection", "tip_angle"]
    column = system.input_labels.index("tip_force")
    found = system(200j)[0, column]
    assert found == pytest.approx(complex(model.transfer_function("tip_deflection", "tip_force", 200.0)), rel=1e-6)
    monkeypatch.setattr("fem_needle.linear.model.import_module", _missing)
    with pytest.raises(NeedleError, match=r"fem-needle\[control\]"):
        model.to_control()


def _missing(name):
    raise ImportError(name)
