"""Studies of made-up answers whose order is known, and what `converge` refuses."""

import csv
import json
from io import StringIO

import numpy as np
import pytest

from fem_needle import ConvergenceStudy, FiniteElementNeedle, SceneError, converge, load_scene, simulate
from fem_needle.convergence.exact_reference import ExactReference
from fem_needle.convergence.refinement import Level
from fem_needle.convergence.rows import RowMaker, best_reference, gathered
from fem_needle.models import ChosenPlant
from fem_needle.study_files import csv_bytes

TIMES = np.linspace(0.0, 1.0, 5)
WAVE = np.cos(3.0 * TIMES)  # the largest is 1
BENCH = load_scene("bench-s")


class Plant:
    """As much of a model as the rows ask for."""

    scene = BENCH


def levels(errors, sizes, round_off=0.0):
    """Answers WAVE + error, at all times alike."""
    return tuple(
        Level(1.0 / size, size, Plant(), TIMES, WAVE + error, np.ones(3) + error, round_off, 0.1)
        for error, size in zip(errors, sizes, strict=True)
    )


def rows(found, theory=None, exact=False):
    reference = ExactReference("exact: made up", WAVE, np.ones(3)) if exact else None
    evidence = gathered(found, reference, None)
    best = best_reference(evidence, theory)
    maker = RowMaker(evidence, best, theory, "")
    return best, [maker.row(index) for index in range(len(found))]


SIZES = np.array([0.5, 0.3, 0.15, 0.1])
ERRORS = 0.02 * SIZES**3


@pytest.mark.parametrize("exact", [True, False])
def test_rows_of_a_known_order_at_unequal_ratios(exact):
    reference, found = rows(levels(ERRORS, SIZES), 3.0, exact)
    largest = 1.0 if exact else 1.0 + ERRORS[-1]  # without an exact answer that of the finest row
    assert [row.error for row in found] == pytest.approx(ERRORS / largest, rel=1e-6)
    assert [row.shape_error for row in found] == pytest.approx(ERRORS, rel=1e-6)
    assert [row.observed_order for row in found[2:]] == pytest.approx([3.0, 3.0], rel=1e-6)
    assert found[1].observed_order == (pytest.approx(3.0, rel=1e-6) if exact else None)
    assert [row.richardson_tip for row in found[2:]] == pytest.approx([WAVE[-1]] * 2, rel=1e-9)
    assert [row.grid_convergence_index for row in found[2:]] == pytest.approx(1.25 * ERRORS[2:], rel=1e-4)
    assert [row.coarse_grid_convergence_index for row in found[2:]] == pytest.approx(1.25 * ERRORS[1:3], rel=1e-4)
    assert [row.asymptotic for row in found[2:]] == [True, True]
    assert {row.note for row in found} == {""}
    assert reference.text.startswith("exact" if exact else "Richardson extrapolation of 6.66667 and 10 with order 3.00")


def test_without_theory_two_orders_that_agree_are_asymptotic():
    sizes = 0.5 ** np.arange(5)
    _, found = rows(levels(0.02 * sizes**2, sizes))
    assert [row.asymptotic for row in found] == [None, None, None, True, True]


def test_a_lucky_order_does_not_shrink_the_index():
    _, found = rows(levels(0.02 * SIZES**3, SIZES), 2.0)
    assert found[2].observed_order == pytest.approx(3.0, rel=1e-6)
    assert found[2].asymptotic is False
    difference = (ERRORS[1] - ERRORS[2]) / 1.0
    assert found[2].grid_convergence_index == pytest.approx(1.25 * difference / (2.0**2 - 1.0), rel=1e-4)


def test_an_error_that_changes_its_sign_is_said():
    sizes = 0.5 ** np.arange(4)
    _, found = rows(levels(0.01 * (-1.0) ** np.arange(4) * sizes**2, sizes))
    assert [row.note for row in found] == ["", "", "oscillates", "oscillates"]
    assert [row.observed_order for row in found[2:]] == pytest.approx([2.0, 2.0], rel=1e-6)
    assert found[-1].richardson_tip == pytest.approx(WAVE[-1], rel=1e-9)


def test_divergence_is_said_and_nothing_is_extrapolated():
    reference, found = rows(levels([1e-3, 2e-3, 4e-3, 8e-3], 0.5 ** np.arange(4)))
    assert [row.note for row in found] == ["", "", "diverges", "diverges"]
    assert found[-1].observed_order == pytest.approx(-1.0)
    assert (found[-1].error, found[-1].richardson_tip, found[-1].grid_convergence_index) == (None, None, None)
    assert "no order" in reference.text


@pytest.mark.parametrize("exact", [True, False])
def test_round_off_leaves_no_order(exact):
    sizes = 0.5 ** np.arange(6)
    errors = 0.1 * sizes**4 + np.array([0.0, 0.0, 0.0, 1e-3, -2e-3, 1e-3])  # noise on the three finest
    noise = [0.0, 0.0, 0.0, 1e-3, 2e-3, 1e-3]
    found = tuple(Level(**(vars(level) | {"round_off": size})) for level, size in zip(levels(errors, sizes), noise, strict=True))
    reference, made = rows(found, 4.0, exact)
    assert [row.note for row in made] == ["", "", ""] + ["round-off"] * 3
    assert [row.observed_order for row in made[3:]] == [None] * 3
    assert made[2].observed_order == pytest.approx(4.0, rel=1e-6)
    assert exact or reference.text.startswith("Richardson extrapolation of 2 and 4 ")


def test_what_is_held_fixed_limits_the_error():
    sizes = 0.5 ** np.arange(4)
    found = levels(0.1 * sizes**4 + 1e-3, sizes)
    other = Level(**(vars(found[-1]) | {"tips": found[-1].tips - 9e-4}))
    evidence = gathered(found, ExactReference("exact: made up", WAVE, None), other)
    maker = RowMaker(evidence, best_reference(evidence, 4.0), 4.0, "time step")
    made = [maker.row(index) for index in range(4)]
    assert evidence.held_error == pytest.approx(9e-4)
    assert [row.note for row in made] == ["", *["limited by the time step"] * 3]
    assert [row.observed_order for row in made] == [None] * 4


def test_runs_that_end_at_different_samples_are_compared_at_their_ends():
    short, long = levels([0.1, 0.0], [0.5, 0.25])
    short = Level(**(vars(short) | {"times": TIMES[[0, 1, 4]], "tips": short.tips[[0, 1, 4]]}))
    evidence = gathered((short, long), None, None)
    assert evidence.tips.shape == (2, 3)
    assert evidence.difference(1) == pytest.approx(0.1)


def test_a_study_in_under_ten_lines():
    study = converge(BENCH, over="elements", values=(32, 4, 8, 16), degree=3)
    assert isinstance(study, ConvergenceStudy)
    assert [row.value for row in study.rows] == [4, 8, 16, 32]
    assert (study.observed_order, study.error) == (study.rows[-1].observed_order, study.rows[-1].error)
    assert study.reference.startswith("exact")
    assert study.reference_tip == pytest.approx(1.12358089445e-3, rel=1e-11)  # the benchmark's own figure
    assert study.held == {"model": "fem", "degree": 3}


def test_columns_and_plain_data_say_the_same():
    study = converge(BENCH, values=(2, 4, 64))
    table = list(csv.DictReader(StringIO(csv_bytes(study.columns()).decode())))
    data = json.loads(json.dumps(study.to_dict()))
    assert [int(row["elements [1]"]) for row in table] == [2, 4, 64]
    assert [float(row["error [1]"]) for row in table] == [row["error"] for row in data["rows"]]
    assert table[0]["observed_order [1]"] == ""
    assert data["rows"][0]["observed_order"] is None
    assert [row["note"] for row in table] == ["", "", "round-off"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"over": "degree"}, "allowed elements, time-step, modes"),
        ({"values": (4,)}, "two or more that differ"),
        ({"values": (4, 4)}, "two or more that differ"),
        ({"values": (0, 4)}, "above 0"),
        ({"values": (4, 2_000_000)}, "numerics.elements"),
        ({"over": "time-step"}, "series of equilibria"),
        ({"over": "modes"}, "does not change"),
        ({"elements": 8}, "numerics.elements: has no effect where it is refined"),
        ({"model": "no-such"}, "unknown model"),
    ],
)
def test_what_is_refused(arguments, message):
    with pytest.raises(SceneError, match=message):
        converge(BENCH, **arguments)


def test_time_steps_that_the_outputs_make_equal_are_refused():
    scene = load_scene("bench-d").with_value("run.duration", 1e-3)
    with pytest.raises(SceneError, match=r"values: two time steps are the same \(0\.001 s gives 0\.0001 s"):
        converge(scene, "time-step", (1e-3, 1e-4), elements=2)


def test_an_interrupted_run_is_no_row(monkeypatch):
    """A run that is interrupted ends in order; a study of it would compare half a run with whole ones."""
    scene = load_scene("bench-d").with_value("run.duration", 1e-3)
    interrupted = []

    def interrupt(*arguments, **options):
        run = simulate(*arguments, **options)
        run.summary["stop_reason"] = "interrupted"
        interrupted.append(run)
        return run

    monkeypatch.setattr("fem_needle.convergence.refinement.simulate", interrupt)
    with pytest.raises(KeyboardInterrupt):
        converge(scene, values=(1, 2), time_step=1e-4)
    assert len(interrupted) == 1


class CountedInModes:
    """A family of which the studies know nothing: finite elements, as many as the scene has modes."""

    def pilot(self, scene):
        return self.build(scene)

    def build(self, scene):
        return FiniteElementNeedle(scene, elements=scene.model.modes)

    def choose(self, scene, analysis):
        return ChosenPlant(self.build(scene), None)


def test_another_model_is_studied_over_its_modes_without_code_that_knows_it(monkeypatch):
    over_elements = converge(BENCH, "elements", (2, 4, 8))
    monkeypatch.setattr("fem_needle.convergence.refinement.model_family", lambda kind: CountedInModes())
    over_modes = converge(BENCH, "modes", (2, 4, 8), model="counted")
    assert [row.error for row in over_modes.rows] == [row.error for row in over_elements.rows]
    assert over_modes.theoretical_order is None
    assert [row.asymptotic for row in over_modes.rows] == [None, None, True]
    with pytest.raises(SceneError, match="does not change"):
        converge(BENCH, "elements", (2, 4), model="counted")
