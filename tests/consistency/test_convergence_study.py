"""Studies of whole scenes show the orders of theory."""

import numpy as np
import pytest

from fem_needle import converge, load_scene
from fem_needle.scene import Layer, Sinusoid, TipLoad
from tests.consistency.scenes import held, scene_of

NO_ORDER = {"round-off", "limited by the time step", "limited by the elements"}


@pytest.mark.parametrize(("degree", "values"), [(3, (4, 8, 16, 32)), (4, (1, 2, 4, 8))])
def test_the_static_tip_has_twice_the_order_of_the_energy(degree, values):
    """2 (degree - 1) against the exact solution, row by row; the index bounds the error in every one."""
    study = converge(load_scene("bench-s"), values=values, degree=degree)
    expected = 2 * (degree - 1)
    assert study.theoretical_order == expected
    for row in study.rows[1:]:
        assert row.observed_order == pytest.approx(expected, abs=0.15)
        assert row.error < row.grid_convergence_index
        assert row.richardson_tip == pytest.approx(study.reference_tip, rel=row.error)
    assert [row.asymptotic for row in study.rows] == [None, True, True, True]


def test_round_off_ends_the_orders():
    study = converge(load_scene("bench-s"), values=(2, 4, 32, 64, 128))
    assert [row.note for row in study.rows] == ["", "", "round-off", "round-off", "round-off"]
    assert [row.observed_order for row in study.rows[2:]] == [None] * 3
    assert study.observed_order == pytest.approx(6.0, abs=0.1)


def test_a_layer_that_ends_inside_elements_costs_an_order():
    """Where in the element it ends changes from mesh to mesh and the error with it: the envelope falls as h^5, not as h^6."""
    layers = (Layer(start=0.0, end=0.05 * np.sqrt(3.0), foundation_modulus=2e5),)
    study = converge(scene_of("entry", held(0.1), layers), values=tuple(range(6, 46)))
    assert study.theoretical_order == 5.0
    errors, counts = np.array([row.error for row in study.rows]), np.arange(6.0, 46.0)
    assert np.max(errors[-10:]) > 10.0 * max(row.round_off for row in study.rows)
    fifth, sixth = (np.max((errors * counts**power).reshape(4, 10), axis=1) for power in (5.0, 6.0))
    assert np.max(fifth) < 1.3 * np.min(fifth)
    assert sixth[-1] > 3.0 * sixth[0]


def test_the_order_is_six_again_where_the_layer_ends_at_a_node():
    layers = (Layer(start=0.0, end=0.05, foundation_modulus=2e5),)
    study = converge(scene_of("entry", held(0.1), layers), values=(4, 8, 16))
    assert study.theoretical_order == 6.0
    assert study.observed_order == pytest.approx(6.0, abs=0.2)


def test_a_moving_needle_without_inertia_is_compared_with_exact_statics():
    study = converge(load_scene("thesis"), values=(4, 8, 16), degree=3)
    assert (study.analysis, study.reference[:5]) == ("static", "exact")
    assert study.observed_order == pytest.approx(4.0, abs=0.15)


def test_time_steps_of_a_gentle_load_are_of_fourth_order():
    """One element: every vibration is resolved; the load begins with an even function of time and excites hardly any."""
    load = TipLoad(force=Sinusoid(mean=0.1, amplitude=0.05, frequency=400.0, phase=np.pi / 2))
    scene = scene_of("entry", held(0.1), loads=[load], duration=0.0025).with_values(
        {"numerics.output_step": 2.5e-4, "numerics.analysis": "dynamic"}
    )
    study = converge(scene, "time-step", (4e-5, 2e-5, 1e-5, 5e-6), elements=1)
    assert study.reference.startswith("Richardson extrapolation")
    assert study.theoretical_order == 4.0
    assert study.observed_order == pytest.approx(4.0, abs=0.3)
    assert converge(scene.with_value("numerics.spectral_radius", 0.0), "time-step", elements=1).theoretical_order == 3.0


def test_a_released_needle_is_compared_with_the_sum_over_modes():
    """Vibrations that mesh or steps miss arrive out of phase: order 2 over cubic elements, 6/5 over time steps.

    They are missed one by one, so that orders scatter; both are far from the 4 of a smooth motion.
    """
    scene = load_scene("bench-d").with_value("run.duration", 0.02)
    study = converge(scene, values=(2, 4, 8), degree=3, time_step=1.25e-5)
    assert study.reference.startswith("exact: sum over modes")
    assert study.theoretical_order == 2.0
    orders = [row.observed_order for row in study.rows if row.note not in NO_ORDER and row.observed_order]
    assert np.mean(orders) == pytest.approx(2.0, abs=0.5)
    steps = converge(scene, "time-step", (1e-4, 5e-5, 2.5e-5), elements=24)
    assert steps.theoretical_order == pytest.approx(1.2)
    assert steps.observed_order == pytest.approx(1.2, abs=0.4)


@pytest.mark.parametrize(("name", "basis"), [("bench-s", "inserted-length"), ("misra-2010", "full-length")])
def test_modes_under_a_tip_force_are_of_third_order(name, basis):
    scene = load_scene(name).with_values({"model.kind": "assumed-modes", "model.basis": basis})
    study = converge(scene, "modes", (16, 32, 64))
    assert study.reference.startswith("exact")
    assert study.theoretical_order == 3.0
    assert [row.observed_order for row in study.rows[1:]] == pytest.approx([3.0, 3.0], abs=0.1)


def test_modes_of_a_released_needle_are_of_third_order():
    changes = {"model.kind": "assumed-modes", "model.basis": "inserted-length", "run.duration": 0.01}
    study = converge(load_scene("bench-d").with_values(changes), "modes", (1, 2, 4), time_step=1e-5)
    assert study.theoretical_order == 3.0
    assert study.observed_order == pytest.approx(3.0, abs=0.3)


def test_theory_is_silent_where_modes_do_not_fit():
    scene = load_scene("bench-s").with_value("model.kind", "assumed-modes")
    assert converge(scene, "modes", (2, 3)).theoretical_order is None
    corrected = scene.with_values({"model.basis": "inserted-length", "model.static_corrections": True})
    study = converge(corrected, "modes", (2, 3))
    assert study.theoretical_order is None
    assert [row.note for row in study.rows] == ["round-off"] * 2  # the static response to the tip force is among the shapes
