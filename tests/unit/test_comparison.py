"""Comparisons: figures against direct solutions, ranges against closed forms, the same terms on both sides."""

from __future__ import annotations

import numpy as np
import pytest

from fem_needle import ComputationError, FiniteElementNeedle, SceneError, load_scene, run_scene, solve_static
from fem_needle.cli.compare_table import EARLY, _depths, _in_the_run, _numbers
from fem_needle.comparison import runs
from fem_needle.comparison.at_rest import compared_depths, relative_difference
from fem_needle.comparison.ranges import Interval, described, intervals_within
from fem_needle.comparison.study import compare
from fem_needle.finite_element_model import ELEMENT_CHOICES
from fem_needle.models import build_plant

SHORT = {"insertion.final_depth": 0.06, "numerics.output_step": 1.0}
PUSHED = {"insertion.final_depth": 0.0205, "numerics.time_step": 5e-5}


@pytest.fixture(scope="module")
def held():
    """Two and three modes of the thesis' needle at rest, at four depths."""
    return compare(load_scene("bench-s"), modes=(2, 3), depths=(0.05, 0.1, 0.15, 0.2), within=0.002)


@pytest.fixture(scope="module")
def pushed():
    return compare(load_scene("thesis-open-loop").with_values(PUSHED), modes=(2,), variant="corrected", elements=8)


def two_modes(scene):
    return build_plant(scene.with_values({"model.kind": "assumed-modes", "model.modes": 2}))


def test_the_tip_errors_of_two_modes_are_those_of_the_thesis_needle(held):
    assert np.allclose(100 * held.models[0].chosen.tip, [-0.0145, -0.266, -0.225, -1.55], rtol=0.01)


def test_the_shape_error_is_a_ratio_of_norms_over_the_inserted_part(held):
    scene = load_scene("bench-s")
    stations = np.linspace(0.1, 0.2, 4001)
    plants = (FiniteElementNeedle(scene, elements=32), two_modes(scene))
    true, found = (solve_static(plant, depth=0.1).deflection(stations) for plant in plants)
    norm = np.sqrt(np.trapezoid((found - true) ** 2, stations) / np.trapezoid(true**2, stations))
    assert held.models[0].chosen.shape[1] == pytest.approx(norm, rel=1e-5)


def test_frequencies_that_a_model_has_not_are_none(held):
    two, three = (model.answer.chosen.frequencies[1] for model in held.models)
    assert np.isnan(two).tolist() == [False, False, True]
    assert not np.isnan(three).any()
    first = held.models[0].chosen.frequency[:, 0]
    assert (first[:-1] > 0.0).all()  # a restricted needle is stiffer
    assert abs(first[-1]) < 1e-8  # at full depth in one layer these modes are the natural ones


def test_a_held_needle_is_compared_at_rest_alone(held):
    assert held.reference.run is None
    assert [model.run for model in held.models] == [None, None]
    assert [answer.unknowns for answer in held.answers] == [24, 2, 3]
    assert held.largest_tip_error == max(np.max(np.abs(model.curve.tip)) for model in held.models)


def test_the_range_ends_where_a_direct_solution_crosses_the_error(held):
    scene = load_scene("bench-s")
    plants = (FiniteElementNeedle(scene, elements=32), two_modes(scene))

    def error(depth):
        true, found = (solve_static(plant, depth=depth).tip_deflection for plant in plants)
        return abs(found / true - 1)

    ranges = held.models[0].ranges
    assert len(ranges) > 1
    inner = [(part.end, 1e-4) for part in ranges[:-1]] + [(part.start, -1e-4) for part in ranges[1:]]
    for edge, outward in inner:
        assert error(edge) <= 0.002 < error(edge + outward)
    number = (520.0 / (4 * 0.0256)) ** 0.25
    assert ranges[0].number_end == pytest.approx(number * ranges[0].end, rel=1e-12)


def test_the_finite_elements_agree_with_themselves():
    found = compare(load_scene("thesis").with_values(SHORT), model="fem", elements=4)
    (model,) = found.models
    assert found.largest_tip_error == 0.0
    assert not model.curve.tip.any()
    assert not model.curve.shape.any()
    assert not model.curve.frequency.any()
    assert not model.run.shape.any()
    assert set(model.run.energies.values()) == {0.0}
    assert [(part.start, part.end) for part in model.ranges] == [(0.02, 0.06)]


@pytest.mark.slow
def test_both_sides_have_the_kinematics_that_the_variant_implies(pushed):
    assert pushed.kinematics == "fixed-frame"
    runs = [answer.run.run for answer in pushed.answers]
    assert [run.plant.scene.model.kinematics for run in runs] == ["fixed-frame", "fixed-frame"]
    assert [run.plant.scene.model.variant for run in runs] == ["conservative", "corrected"]
    values = PUSHED | {"model.kinematics": "fixed-frame"}
    direct = run_scene(load_scene("thesis-open-loop").with_values(values), elements=8)
    assert np.array_equal(direct.tip_deflection, runs[0].tip_deflection)


def test_the_material_needle_stays_material():
    found = compare(load_scene("thesis").with_values(SHORT), elements=4)
    assert found.kinematics == "material"
    assert found.models[0].answer.description["modes"] == 2


def test_both_sides_take_the_same_steps_and_samples(pushed):
    first, second = (answer.run.run for answer in pushed.answers)
    assert first.summary["time_step"] == second.summary["time_step"]
    count = len(pushed.models[0].run.time)
    assert count >= min(len(first.time), len(second.time)) - 1
    assert np.array_equal(first.time[:count], second.time[:count])


def test_errors_of_a_run_are_by_the_largest_of_the_reference(pushed):
    first, second = (answer.run.run for answer in pushed.answers)
    errors, count = pushed.models[0].run, len(pushed.models[0].run.time)
    gap = second.tip_deflection[:count] - first.tip_deflection[:count]
    assert errors.largest_tip == np.max(np.abs(gap)) / np.max(np.abs(first.tip_deflection)) > 0.0
    total = [run.kinetic_energy + run.bending_energy + run.tissue_energy for run in (first, second)]
    assert errors.energies["total_energy"] == np.max(np.abs(total[1][:count] - total[0][:count])) / np.max(total[0])
    assert errors.depth_difference == np.max(np.abs(second.depth[:count] - first.depth[:count])) > 0.0


def test_a_scene_without_loads_is_bent_by_a_force_at_the_tip(pushed, held):
    assert (pushed.load.probe_force, held.load.probe_force) == (1.0, 0.0)
    depth = pushed.depths[-1]
    compliance = solve_static(two_modes(load_scene("bench-s")), depth=depth).tip_deflection / 0.1
    assert pushed.models[0].answer.chosen.tips[-1] == pytest.approx(compliance, rel=1e-9)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::fem_needle.errors.SuspiciousValueWarning")
def test_the_printed_equations_are_compared_in_the_run_alone():
    found = compare(load_scene("thesis-open-loop").with_values(PUSHED), variant="as-printed", elements=8)
    (model,) = found.models
    assert (found.load, model.curve, model.ranges, found.reference.curve) == (None, None, (), None)
    assert model.run.largest_tip > 0.0
    assert any("grows without bound" in text for text in model.answer.warnings)
    assert [shape.at_rest for shape in found.shapes] == [False, False, False]


def test_a_run_that_fails_is_infinitely_wrong(monkeypatch):
    real, calls = runs.run_along, []

    def failing(plant, course, scene):
        run, failure = real(plant, course, scene)
        calls.append(plant)
        return (run, failure) if len(calls) < 2 else (run, "the second run fails")

    monkeypatch.setattr(runs, "run_along", failing)
    found = compare(load_scene("thesis").with_values(SHORT), elements=4)
    assert found.models[0].largest_tip_error == np.inf
    assert found.models[0].answer.warnings[-1] == "the second run fails"


def test_a_reference_that_fails_is_an_error(monkeypatch):
    def failing(plant, **settings):
        raise ComputationError("the reference fails")

    monkeypatch.setattr(runs, "simulate", failing)
    with pytest.raises(ComputationError, match="reference"):
        compare(load_scene("thesis").with_values(SHORT), elements=4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"modes": (2, 2)}, "modes: a number is given twice"),
        ({"modes": (0,)}, r"model\.modes"),
        ({"model": "fem", "modes": (2, 3)}, "does not change with them"),
        ({"model": "fem", "modes": (3,)}, "does not change with them"),
        ({"model": "fem", "basis": "inserted-length"}, "model.basis: has no effect"),
        ({"depths": ()}, "depths: got none"),
        ({"depths": (0.1, 0.3)}, "depths: got 0.1, 0.3; allowed different depths above"),
        ({"within": 0.0}, "within: out of range"),
        ({"variant": "as-printed"}, "has no equilibrium"),
        ({"reference": "truth"}, r"model\.kind: unknown model"),
    ],
)
def test_impossible_comparisons_are_refused(arguments, said):
    with pytest.raises(SceneError, match=said):
        compare(load_scene("bench-s"), **arguments)


def test_intervals_end_where_a_linear_error_crosses_and_hide_in_no_gap_of_the_grid():
    """Error (z - 0.0613): within 1e-3 over 2 mm, between two points of a grid of 10 mm."""
    grid = np.linspace(0.0, 0.1, 11)
    ((start, end),) = intervals_within(lambda depth: (2.0, 2.0 + 2.0 * (depth - 0.0613)), grid, 1e-3)
    assert (start, end) == (pytest.approx(0.0603, abs=1e-4), pytest.approx(0.0623, abs=1e-4))
    assert start >= 0.0603 - 1e-12
    assert end <= 0.0623 + 1e-12


def test_a_zero_of_the_reference_parts_an_interval():
    grid = np.linspace(0.0, 0.1, 11)
    ranges = intervals_within(lambda depth: (depth - 0.0452, depth - 0.0452 + 1e-5), grid, 0.01)
    assert len(ranges) == 2
    assert ranges[0] == (0.0, pytest.approx(0.0442, abs=1e-4))
    assert ranges[1] == (pytest.approx(0.0462, abs=1e-4), 0.1)


def test_intervals_of_everything_and_nothing():
    grid = np.linspace(0.0, 0.1, 3)
    assert intervals_within(lambda depth: (1.0, 1.0), grid, 1e-3) == ((0.0, 0.1),)
    assert intervals_within(lambda depth: (1.0, 1.1), grid, 1e-3) == ()


def test_characteristic_numbers_take_the_layer_at_the_tip():
    scene = load_scene("brachytherapy")
    first, second = scene.tissue.layers
    parts = described(scene, 0.0, ((0.01, 0.05),))
    assert [(part.start, part.end) for part in parts] == [(0.01, second.start), (second.start, 0.05)]
    assert [part.layer for part in parts] == [first.name, second.name]
    for part, layer in zip(parts, (first, second), strict=True):
        wave = (layer.foundation_modulus / (4 * scene.needle.bending_stiffness)) ** 0.25
        assert (part.number_start, part.number_end) == (pytest.approx(wave * part.start), pytest.approx(wave * part.end))


def test_depths_are_those_of_the_run_or_of_the_whole_needle():
    moving, still = (compared_depths(load_scene(name), 0.0) for name in ("thesis", "bench-s"))
    assert (moving[0], moving[-1]) == (0.02, 0.18)
    assert (still[0], still[-1]) == (pytest.approx(0.004), 0.2)


def test_differences_by_zero_are_infinite_or_none():
    assert relative_difference(np.array([0.0, 1.0, 3.0]), np.array([0.0, 0.0, -2.0])).tolist() == [0.0, np.inf, 2.5]


@pytest.mark.slow
def test_a_run_that_ends_early_is_infinitely_wrong_and_says_so(monkeypatch):
    """A model that a push drives too fast agrees with the reference for as long as both go on: that is no agreement."""
    real, calls = runs.run_along, []

    def hasty(plant, course, scene):
        calls.append(plant)
        driven = plant if len(calls) < 2 else build_plant(plant.scene.with_value("insertion.push_force", 30.0))
        return real(driven, course, driven.scene)

    monkeypatch.setattr(runs, "run_along", hasty)
    found = compare(load_scene("thesis-open-loop").with_values(PUSHED), elements=8)
    (model,) = found.models
    assert model.run.largest_tip < found.largest_tip_error == np.inf
    assert "the run ends at" in model.answer.warnings[-1]
    assert {cells[2] for cells in _in_the_run(found) if "error" in cells[0] and "depth" not in cells[0]} == {EARLY}


def test_ranges_are_shown_by_layer_and_joined_over_the_depth():
    parts = (
        Interval(0.0, 0.01, "", 0.0, 0.0),
        Interval(0.01, 0.02, "fat", 0.1, 0.2),
        Interval(0.02, 0.03, "gland", 0.3, 0.4),
        Interval(0.05, 0.06, "gland", 0.6, 0.7),
    )
    assert _depths(parts) == "0.0 to 30.0, 50.0 to 60.0"
    assert _numbers(parts) == "0.100 to 0.200 (fat), 0.300 to 0.400 (gland), 0.600 to 0.700 (gland)"
    assert _numbers(parts[2:]) == "0.300 to 0.400, 0.600 to 0.700"
    assert (_numbers(parts[:1]), _numbers(()), _depths(())) == ("in no layer", "nowhere", "nowhere")


def test_models_run_in_the_steps_of_the_reference():
    """Steps over vibrations are graded behind kinks: equal ones of the same length would cost several percent of the tip."""
    found = compare(load_scene("three-layers"), modes=[2], elements=6)
    times = [answer.run.run.time for answer in found.answers]
    assert np.array_equal(times[0], times[1])
    assert found.answers[1].run.run.summary["steps"] == found.reference.run.run.summary["steps"]


def test_the_cheapest_elements_as_right_stand_beside_a_model():
    found = compare(load_scene("thesis").with_values(SHORT), modes=[5], elements=8).models[0]
    assert 1 < found.equal.elements < 8
    assert found.equal.tip_error <= found.largest_tip_error
    assert found.equal.factor == pytest.approx(found.equal.model_time / found.equal.solve_time)
    fewer = [count for count in ELEMENT_CHOICES if count < found.equal.elements]
    assert all(_error_of(count) > found.largest_tip_error for count in fewer)


def _error_of(count):
    scene = load_scene("thesis").with_values(SHORT)
    true, run = (run_scene(scene, elements=elements, analysis="quasi-static") for elements in (8, count))
    return np.max(np.abs(run.tip_deflection - true.tip_deflection)) / np.max(np.abs(true.tip_deflection))
