"""Inverse dynamics with a force on every coordinate: its motion is known, its forces are checked by what they do."""

import numpy as np
import pytest

from fem_needle import SceneError, build_plant, load_scene, steer
from fem_needle.closed_loop.fully_actuated import ErrorDynamics, IdealMotion
from fem_needle.stages import internal_force

SCENE = load_scene("thesis-inverse-dynamics").with_values({"run.duration": 0.04, "numerics.output_step": 0.002})
MODELS = {
    "modes": {"model.kind": "assumed-modes"},
    "elements": {"model.kind": "fem", "numerics.elements": 4},
    "inserted": {"model.kind": "assumed-modes", "model.basis": "inserted-length", "model.modes": 4},
}


def test_errors_decay_as_critically_damped_ones():
    """e = (e0 + (v0 + w e0) t) exp(-w t) for k_p = w^2, k_v = 2 w."""
    errors, time = ErrorDynamics(1e4, 200.0), 0.013
    decay = np.exp(-100.0 * time)
    now, rate, second = errors.at(2.0, -30.0, time)
    slope = -30.0 + 100.0 * 2.0
    assert now == pytest.approx((2.0 + slope * time) * decay, rel=1e-12)
    assert rate == pytest.approx((slope - 100.0 * (2.0 + slope * time)) * decay, rel=1e-12)
    assert second == pytest.approx(-1e4 * now - 200.0 * rate, rel=1e-12)


@pytest.mark.parametrize("changes", MODELS.values(), ids=MODELS)
def test_every_error_decays_whatever_the_model(changes):
    run = steer(SCENE.with_values(changes))
    share = (1.0 + 100.0 * run.time) * np.exp(-100.0 * run.time)
    assert run.depth == pytest.approx(0.18 - 0.16 * share, abs=1e-14)
    np.testing.assert_allclose(run.coordinates[:, 2:], share[:, None] * run.coordinates[0, 2:], rtol=0, atol=1e-14)
    assert run.summary["controller"]["variant"] == "fully-actuated"
    assert any("no actuator" in warning for warning in run.summary["warnings"])


@pytest.mark.parametrize("changes", MODELS.values(), ids=MODELS)
def test_the_forces_are_those_that_the_equations_lack(changes):
    """Integrating the plant's own equations under them gives the motion back: P(t2) - P(t1) = integral of all forces."""
    plant = build_plant(SCENE.with_values(changes))
    motion = IdealMotion(plant, ErrorDynamics(1e4, 200.0))
    start, end = 0.004, 0.0045
    nodes, weights = np.polynomial.legendre.leggauss(5)
    impulse = np.zeros(plant.size)
    for node, weight in zip(nodes, weights, strict=True):
        time = 0.5 * (start + end) + 0.5 * (end - start) * node
        state, (force, _) = motion.state(time), motion.force(time, 1e-7)
        solution = state.solution
        total = force + internal_force(state.stage, solution.coordinates, solution.velocities)
        impulse += 0.5 * (end - start) * weight * (total + state.stage.points.rows.T @ solution.forces)
    gained = motion.state(end).solution.momentum - motion.state(start).solution.momentum
    scale = np.max(np.abs(gained[2:]))
    np.testing.assert_allclose(impulse[2:], gained[2:], rtol=0, atol=1e-6 * scale)


def test_the_ledger_closes_and_the_push_is_what_the_motion_needs():
    run = steer(SCENE.with_values(MODELS["elements"]))
    assert run.summary["relative_energy_residual"] < 2e-3  # 20 steps in a time constant of 2.5 ms; falls with the step
    assert run.command_push_force == pytest.approx(run.push_force)
    # At t = 0, at rest: the mass is accelerated by k_p 160 mm, and the bent needle, a cantilever in so soft a tissue, pushes
    # itself out of its sleeve with 1/2 EI w''(0)^2, w''(0) = 3 w / z^2.
    mass = SCENE.needle.mass_per_length * SCENE.needle.length
    sleeve = 0.5 * SCENE.needle.bending_stiffness * (3 * 5e-4 / 0.02**2) ** 2
    assert run.push_force[0] == pytest.approx(mass * 1e4 * 0.16 - sleeve, rel=1e-4)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"run.duration": None, "insertion.final_depth": 0.18}, "run.duration"),
        ({"numerics.analysis": "quasi-static"}, "numerics.analysis"),
        ({"model.variant": "as-printed"}, "model.variant"),
        ({"target.depth": None}, "target.depth"),
    ],
)
def test_what_it_cannot_do_is_said(changes, text):
    with pytest.raises(SceneError, match=text):
        steer(SCENE.with_values(changes))


def test_a_prescribed_insertion_decays_laterally_alone():
    scene = SCENE.with_values(
        {"insertion": {"kind": "hold", "initial_depth": 0.1}, "model.kind": "fem", "numerics.elements": 4, "target.depth": None}
    )
    run = steer(scene)
    assert run.tip_deflection == pytest.approx(5e-4 * (1 + 100 * run.time) * np.exp(-100 * run.time), abs=1e-14)
    assert run.depth == pytest.approx(np.full(len(run.time), 0.1))
    assert "command_push_force" not in run.signals
