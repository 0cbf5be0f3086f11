"""Numbers of a scene fitted to simulated measurements: sensitivities, recovery, coverage, refusals."""

import numpy as np
import pytest

from fem_needle import SceneError, load_scene, run_scene
from fem_needle.identification.fit import identify, whiteness
from fem_needle.identification.measurements import Measurements
from fem_needle.identification.result import columns, plain
from fem_needle.identification.static_model import Place, static_problem, value_at

LAYERED = load_scene("brachytherapy").with_values(
    {
        "numerics.elements": 6,
        "numerics.analysis": "static",
        "loads": [
            {"kind": "lateral", "position": -0.005, "force": 0.5},
            {"kind": "tip", "bevel_coefficient": 2e-5, "direction": 0.7},
            {"kind": "tip", "force": 0.05},
        ],
        "support.hub_deflection": 1e-3,
        "tissue.stiffness_factor": 1.2,
    }
)
MODULI = ["tissue.layers.0.foundation_modulus", "tissue.layers.1.foundation_modulus"]
FREE = LAYERED.with_values(
    {"support.guides": [], "needle": {"length": 0.2, "bending_stiffness": 0.0157, "mass_per_length": 0.004}}
)
DEPTHS = np.linspace(0.02, 0.1, 20)
NOISE = 2e-6  # m
MODELS = {"elements": {}, "modes": {"model.kind": "assumed-modes", "model.modes": 4, "numerics.elements": "auto"}}


def tips(scene, depths=DEPTHS):
    places = [Place(depth, 0.0, np.array([scene.needle.length])) for depth in depths]
    problem = static_problem(scene, places, [MODULI[0]])
    return problem.answers(problem.start)[0]


def data(values, depths=DEPTHS):
    return Measurements({"depth": depths, "tip_deflection": values})


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize(
    ("scene", "path"),
    [
        *((LAYERED, path) for path in MODULI),
        (LAYERED, "loads.0.force"),
        (LAYERED, "loads.1.bevel_coefficient"),
        (LAYERED, "loads.2.force"),
        (LAYERED, "support.hub_deflection"),
        (LAYERED, "support.hub_angle"),
        (FREE, "needle.bending_stiffness"),
        (FREE, MODULI[1]),
    ],
)
def test_sensitivities_are_those_of_differences(scene, path, model):
    """At stations on both sides of the finger, where a force bends the inside of an element, and in both layers."""
    scene = scene.with_values(model)
    places = [Place(depth, 0.0, np.array([0.1, 0.15, 0.1949, 0.2])) for depth in (0.01, 0.05, 0.09)]
    value = value_at(scene, path)
    step = 1e-4 * (abs(value) or 1.0)

    def answers(value):
        problem = static_problem(scene.with_value(path, value), places, [path])
        return problem.answers(problem.start)

    difference = (answers(value + step)[0] - answers(value - step)[0]) / (2 * step)
    exact = answers(value)[1][:, 0]
    assert np.max(np.abs(exact - difference)) < 1e-7 * np.max(np.abs(difference))
    moved = static_problem(scene, places, [path]).answers(np.array([value + step]))[0]  # built once, moved
    np.testing.assert_allclose(moved, answers(value + step)[0], rtol=1e-7, atol=1e-12)


def test_exact_data_give_the_values_back():
    start = LAYERED.with_values({MODULI[0]: 1e3, MODULI[1]: 9e4})
    found = identify(start, MODULI, data(tips(LAYERED)))
    assert [one.value for one in found.parameters] == pytest.approx([5e3, 2e4], rel=1e-6)
    assert value_at(found.scene, MODULI[1]) == found[MODULI[1]].value
    assert np.max(np.abs(found.residuals)) < 1e-12
    assert found.evaluations < 30


@pytest.mark.slow
def test_the_intervals_cover_the_truth_as_often_as_they_say():
    """200 data sets: of 95 % intervals between 90 and 99 % hold the true modulus."""
    random, true, hits = np.random.default_rng(5), tips(LAYERED), np.zeros(2)
    for _ in range(200):
        found = identify(LAYERED, MODULI, data(true + NOISE * random.standard_normal(len(true))))
        hits += [one.interval[0] <= value <= one.interval[1] for one, value in zip(found.parameters, (5e3, 2e4), strict=True)]
    assert np.all((hits >= 180) & (hits <= 198))


def test_what_is_reported():
    random = np.random.default_rng(2)
    measured = data(tips(LAYERED) + NOISE * random.standard_normal(len(DEPTHS)))
    found = identify(LAYERED, MODULI, measured, held_back=0.25)
    assert found.linear.deviation == pytest.approx(NOISE, rel=0.5)
    assert found.prediction.rows == 5
    assert found.prediction.inside >= 0.8
    assert found.prediction.rms < 3.0
    assert 0.01 < found.whiteness.p_value <= 1.0
    assert found.correlation[0, 0] == pytest.approx(1.0)
    content = plain(found)
    assert [one["path"] for one in content["parameters"]] == MODULI
    assert content["rows"] == 15
    table = columns(found)
    assert table["depth [m]"] == DEPTHS[:15].tolist()
    np.testing.assert_allclose(np.add(table["fitted [SI]"], table["residual [SI]"]), measured["tip_deflection"][:15])
    given = identify(LAYERED, MODULI, measured, deviations={"tip_deflection": NOISE})
    assert given.linear.degrees_of_freedom == np.inf
    assert given[MODULI[0]].standard_error > 0.0


def test_a_wrong_model_shows_in_the_residuals():
    """Finite elements' tips in stiff tissue, fitted by two modes: biased, and the residuals are not white."""
    truth = FREE.with_values({"tissue.layers": [{"foundation_modulus": 2e4}], "loads": [{"kind": "tip", "force": 0.1}]})
    found = identify(truth, ["tissue.layers.0.foundation_modulus"], data(tips(truth)), "assumed-modes")
    assert abs(found.parameters[0].value / 2e4 - 1.0) > 0.01
    assert found.whiteness.p_value < 1e-3


@pytest.mark.parametrize("loads", [[], [{"kind": "tip", "bevel_coefficient": 2e-5}]], ids=["displaced hub", "bevel"])
def test_stiffness_and_modulus_together_are_refused_by_name(loads):
    """Only k / EI enters where the hub is moved and no force is known, and under the bevel law."""
    hub = 1e-3 if not loads else 0.0
    scene = FREE.with_values({"loads": loads, "support.hub_deflection": hub, "tissue.layers": [{"foundation_modulus": 5e3}]})
    paths = ["needle.bending_stiffness", "tissue.layers.0.foundation_modulus"]
    with pytest.raises(SceneError, match=r"needle\.bending_stiffness and tissue\.layers\.0\.foundation_modulus apart"):
        identify(scene, paths, data(tips(scene)))


def test_shapes_are_fitted_too():
    stations = (120.0, 160.0, 200.0)
    places = [Place(depth, 0.0, 1e-3 * np.array(stations)) for depth in (0.05, 0.09)]
    problem = static_problem(LAYERED, places, [MODULI[0]])
    table = problem.answers(problem.start)[0].reshape(2, 3)
    columns = {"depth": np.array([0.05, 0.09])} | {
        f"deflection_at_{station:g}": table[:, number] for number, station in enumerate(stations)
    }
    start = LAYERED.with_values({MODULI[0]: 2e3, "loads.0.force": 0.1})
    found = identify(start, [MODULI[0], "loads.0.force"], Measurements(columns))
    assert [one.value for one in found.parameters] == pytest.approx([5e3, 0.5], rel=1e-6)
    assert [one.is_log for one in found.parameters] == [True, False]
    assert [(row.depth, row.column) for row in found.rows[2:4]] == [(0.05, "deflection_at_200"), (0.09, "deflection_at_120")]


def test_friction_from_the_push_of_a_run():
    speeds = {"time": [0.0, 0.5, 1.0], "value": [0.005, 0.04, 0.01]}
    scene = load_scene("thesis").with_values(
        {"insertion.speed": speeds, "insertion.final_depth": None, "run.duration": 1.0, "numerics.analysis": "static"}
    )
    scene = scene.with_values({"friction.coulomb": 0.56, "friction.viscous": 0.3, "numerics.elements": 4})
    run = run_scene(scene, output_step=0.05)
    measured = Measurements({"time": run.time[1:-1], "push_force": run.push_force[1:-1]})
    start = scene.with_values({"friction.coulomb": 0.3, "friction.viscous": 1.0})
    found = identify(start, ["friction.coulomb", "friction.viscous"], measured)
    assert [one.value for one in found.parameters] == pytest.approx([0.56, 0.3], rel=1e-6)


@pytest.mark.slow
def test_a_modulus_from_a_vibration():
    """A needle let go: its run needs no time steps, and a fit must not give it any."""
    scene = load_scene("release").with_value("numerics.elements", 3)
    run = run_scene(scene, output_step=scene.duration / 100)
    measured = Measurements({"time": run.time[1:-1], "tip_deflection": run.tip_deflection[1:-1]})
    path = "tissue.layers.0.foundation_modulus"
    true = value_at(scene, path)
    found = identify(scene.with_value(path, 1.02 * true), [path], measured)
    assert found[path].value == pytest.approx(true, rel=1e-4)


def test_a_layer_has_a_number_or_a_name():
    path = "tissue.layers.prostate region.foundation_modulus"
    found = identify(LAYERED.with_value(MODULI[1], 9e4), [path], data(tips(LAYERED)))
    assert found[path].value == pytest.approx(2e4, rel=1e-6)


def test_whiteness_by_hand():
    """Four residuals 1, -1, 1, -1: r_1 = -3/4, Q = 4 x 6 x (9/16) / 3 = 4.5 with one lag, p = P(chi2_1 > 4.5) = 0.0339."""
    found = whiteness(np.array([1.0, -1.0, 1.0, -1.0]))
    assert (found.first_correlation, found.lags) == (pytest.approx(-0.75), 1)
    assert found.p_value == pytest.approx(0.0338949, abs=1e-6)


@pytest.mark.parametrize(
    ("paths", "columns", "options", "message"),
    [
        ([], {}, {}, "one or more different paths"),
        (["tissue.layers.7.foundation_modulus"], {}, {}, "is no number of the scene"),
        (MODULI, {"tip_angle": DEPTHS}, {}, "no column that could be fitted"),
        (MODULI, {"deflection_at_300": DEPTHS, "depth": DEPTHS}, {}, "no arc length of the needle"),
        (MODULI, {"depth": 3 * DEPTHS, "tip_deflection": DEPTHS}, {}, "depth out of range"),
        (MODULI, {"tip_deflection": DEPTHS}, {}, "need a column 'time"),
        (MODULI, None, {"bounds": {MODULI[0]: (1.0, 2.0)}}, "starts outside its bounds"),
        (MODULI, None, {"bounds": {"needle.length": (0.1, 0.2)}}, "is not among the parameters"),
        (MODULI, None, {"held_back": 1.0}, "held_back"),
        (MODULI, None, {"deviations": {"tip_deflection": -1.0}}, "must be positive"),
    ],
)
def test_what_is_impossible_is_said(paths, columns, options, message):
    measured = data(tips(LAYERED)) if columns is None else Measurements(columns or {"depth": DEPTHS, "tip_deflection": DEPTHS})
    with pytest.raises(SceneError, match=message):
        identify(LAYERED, paths, measured, **options)
