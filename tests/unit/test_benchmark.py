"""The benchmark: errors by their definitions, references by other ways, methods in turns, files, rivals, goals."""

from __future__ import annotations

import json
from dataclasses import replace
from time import sleep

import numpy as np
import pytest

from fem_needle.benchmark import goal_measurements
from fem_needle.benchmark.cases import CASES, cases_of
from fem_needle.benchmark.goal_measurements import Measured
from fem_needle.benchmark.goals import Goal, all_goals
from fem_needle.benchmark.growing_beam import spectral_tips
from fem_needle.benchmark.library_elements import FactoredElements, NaiveElements
from fem_needle.benchmark.methods import OWN, Method, Setting
from fem_needle.benchmark.modal_system import ModalSystem, mode_functions
from fem_needle.benchmark.picture import benchmark_picture
from fem_needle.benchmark.record import read_record, write_record
from fem_needle.benchmark.reference import growing_beam, reference_tips, stored
from fem_needle.benchmark.result import Row
from fem_needle.benchmark.rivals import load_rivals
from fem_needle.benchmark.scaling import Sizes, scaling
from fem_needle.benchmark.study import benchmark
from fem_needle.benchmark.timing import SHORTEST, take_turns
from fem_needle.errors import NeedleError, SceneError
from tests.references import entry_motion, hub_motion

S, D, M, M2, BRACHYTHERAPY = CASES


def shortened(case, duration):
    return replace(case, shortened=duration)


class Given(Method):
    """Returns tips that are given, or fails."""

    name, kind = "given", OWN

    def __init__(self, tips):
        self.tips, self.calls = tips, 0

    def settings(self, case):
        return tuple(Setting(elements=count) for count in range(1, 1 + len(self.tips)))

    def prepare(self, case, setting):
        tips = self.tips[setting.elements - 1]

        def solve():
            self.calls += 1
            if tips is None:
                raise NeedleError("too fine")
            return tips

        return solve


def test_the_error_of_d_is_relative_to_the_first_deflection():
    assert D.error(np.array([2.0, 1.0, -4.5]), np.array([2.0, 1.0, -4.0])) == 0.25


def test_the_error_of_m_is_relative_to_the_largest_deflection():
    assert M.error(np.array([2.0, 1.0, -4.5]), np.array([2.0, 1.0, -4.0])) == 0.125


def test_a_tip_that_is_no_number_has_an_infinite_error():
    assert M.error(np.array([1.0, np.nan]), np.array([1.0, 1.0])) == float("inf")


def test_tips_at_other_times_are_refused():
    with pytest.raises(ValueError, match=r"S: .*allowed \(1,\)"):
        S.error(np.zeros(2), np.ones(1))


def test_the_times_of_the_cases():
    assert [len(case.times) for case in CASES] == [1, 1001, 321, 321, 191]
    assert [D.times[1], M.times[-1]] == pytest.approx([1e-4, 3.2], rel=1e-12)


def test_cases_by_name():
    assert cases_of(["m2", "bench-s"]) == (S, M2)
    assert cases_of([]) == CASES
    with pytest.raises(SceneError, match="got 'X'; allowed S, D, M"):
        cases_of(["X"])


def test_the_reference_of_s_is_the_number_of_its_definition():
    assert reference_tips(S)[0] == pytest.approx(1.12358089445e-3, rel=1e-11)


@pytest.mark.parametrize("case", [M, M2], ids=["M", "M2"])
def test_the_spectral_reference_agrees_with_another_formulation(case):
    case = shortened(case, 0.05)
    tips = spectral_tips(growing_beam(case.scene), case.times, steps_per_radian=8.0)
    fine, coarse = (entry_motion(case.scene, 0.05, case.times, 14, steps).tip_deflection for steps in (64e3, 32e3))
    # Both follow the vibration that the start leaves behind; the other one's own change says how well they can agree.
    assert case.error(tips, fine) < 0.3 * case.error(coarse, fine) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("case", [M, M2], ids=["M", "M2"])
def test_the_spectral_reference_agrees_over_the_whole_run(case):
    fine = entry_motion(case.scene, 3.2, case.times, degree=14, steps_per_second=128e3).tip_deflection
    assert case.error(reference_tips(case), fine) < 1e-7


@pytest.mark.slow
def test_the_kept_reference_agrees_with_an_independent_solution():
    tips = np.array(stored()["tip_deflection"])
    other = hub_motion(BRACHYTHERAPY.scene, 9.5, BRACHYTHERAPY.times, degree=40, steps_per_second=1000.0).tip_deflection
    coarser = hub_motion(BRACHYTHERAPY.scene, 9.5, BRACHYTHERAPY.times, degree=32, steps_per_second=1000.0).tip_deflection
    # Polynomials meet the guide and the layers' border slowly: what they differ by among themselves bounds what they tell.
    assert BRACHYTHERAPY.error(tips, other) < 3 * BRACHYTHERAPY.error(coarser, other) < 1e-3


def test_the_kept_reference_is_at_the_times_of_the_case():
    assert np.allclose(stored()["time"], BRACHYTHERAPY.times, rtol=0, atol=1e-12)
    assert stored()["difference"] < 1e-6


def test_modes_are_orthonormal_and_stiff_as_they_should_be():
    found = mode_functions(8)
    roots = np.diag(found.bending) ** 0.25
    assert np.allclose(roots[:3], [1.8751040687, 4.6940911330, 7.8547574382], rtol=1e-9)
    assert np.allclose(np.abs(found.tip), 2.0, rtol=1e-9)
    assert np.allclose(found.bending - np.diag(np.diag(found.bending)), 0.0, atol=1e-7 * found.bending[-1, -1])


@pytest.mark.parametrize(
    ("method", "case", "setting", "error"),
    [
        (NaiveElements(), S, Setting(elements=4), 2e-6),
        (FactoredElements(), shortened(D, 0.01), Setting(elements=16, time_step=1e-5), 5e-3),
        (NaiveElements(), shortened(M, 0.1), Setting(elements=4, time_step=1e-2), 1e-6),
        (ModalSystem(), shortened(D, 0.01), Setting(modes=5, tolerance=1e-6, variant="DOP853"), 4e-4),
        (ModalSystem(), shortened(M, 0.1), Setting(modes=4, tolerance=1e-6, variant="Radau"), 2e-3),
    ],
    ids=["S naive", "D factored once", "M naive", "D modes", "M modes"],
)
def test_libraries_solve_the_same_problem(method, case, setting, error):
    true = reference_tips(case)
    assert 0.01 * error < case.error(method.prepare(case, setting)(), true) < error


def test_calls_take_turns():
    order = []

    def call(name):
        return lambda: (sleep(SHORTEST), order.append(name))

    timings = take_turns([call("a"), call("b")], [0.9, 0.9], rounds=3)
    assert order == ["a", "b"] * 3
    assert [timing.rounds for timing in timings] == [3, 3]


def test_a_slow_call_is_timed_less_often(monkeypatch):
    monkeypatch.setattr("fem_needle.benchmark.timing.SLOW", 0.001)
    calls = []
    (timing,) = take_turns([lambda: (sleep(SHORTEST), calls.append(1))], [5.0], rounds=4)
    assert (len(calls), timing.rounds) == (2, 2)


def test_a_first_call_that_compiles_does_not_count():
    (timing,) = take_turns([lambda: sleep(SHORTEST)], [5.0], rounds=4)
    assert (timing.rounds, timing.highest < 1.0) == (4, True)


def test_a_call_that_fails_in_its_turn_stops_no_other():
    def fail():
        raise NeedleError("too slow")

    failed, timed = take_turns([fail, lambda: sleep(SHORTEST)], [0.1, 0.1], rounds=3)
    assert (failed, timed.rounds) == (None, 3)


def test_after_a_failure_nothing_finer_is_tried():
    true = reference_tips(S)
    study = benchmark([S], [Given([1.1 * true, None, true])], repeats=2)
    first, second = study.rows
    assert first.error == pytest.approx(0.1)
    assert (first.rounds, first.lowest <= first.median <= first.highest) == (2, True)
    assert (second.error, second.median, second.note) == (None, None, "too fine")


def row(error, median, **values):
    return Row(**{"case": "S", "method": "m", "kind": OWN, "setting": Setting(), "error": error, "median": median} | values)


def test_answers_and_steps_are_measured_in_their_units(monkeypatch):
    monkeypatch.setattr(goal_measurements, "ROUNDS", 1)
    monkeypatch.setattr(goal_measurements, "NAIVE", Setting(elements=4, time_step=0.8))
    answer = goal_measurements.whole_answer("bench-s", {})
    milliseconds = float(answer.note.split(" ms")[0])
    assert answer.value == pytest.approx(1e-3 * milliseconds / goal_measurements.naive_step().value, rel=1e-2)
    changes = {"numerics.analysis": "dynamic", "numerics.time_step": 1e-2, "numerics.elements": 2}
    step = goal_measurements.time_per_step("bench-m", changes)
    steps, rest = step.note.split(" steps in ")
    assert int(steps) == 320
    assert step.value == pytest.approx(1e3 * float(rest.split(" ms")[0]) / 320, rel=1e-2)


def test_a_goal_is_met_missed_or_not_measured():
    def missing(rows):
        raise NeedleError("there is none")

    assert Goal("1", "fast", 2.0, "us", lambda rows: Measured(1.0)).row([]).met is True
    assert Goal("1", "fast", 2.0, "us", lambda rows: Measured(3.0)).row([]).met is False
    assert Goal("1", "many", 2.0, "1", lambda rows: Measured(3.0), at_least=True).row([]).met is True
    unmeasured = Goal("6", "batch", 90.0, "%", missing).row([])
    assert (unmeasured.measured, unmeasured.met, unmeasured.note) == (None, None, "there is none")


def test_every_goal_is_there():
    assert {goal.number for goal in all_goals(1)} == {"1", "2", "3", "4", "5", "6"}


def test_the_command_writes_what_it_shows(command_line, tmp_path):
    status, out, _ = command_line("benchmark", "S", "--quick", "--out", tmp_path / "b", "--record", tmp_path / "kept")
    assert status == 0
    assert "scikit-fem" in out and "closed form" in out
    found = json.loads((tmp_path / "b" / "benchmark.json").read_text())
    best = [one for one in found["rows"] if one["method"] == "finite elements" and one["setting"]["elements"] == 2]
    assert best[0]["error"] < 1e-6 and best[0]["lowest"] <= best[0]["median"] <= best[0]["highest"] and best[0]["whole"] > 0
    header, *lines = (tmp_path / "b" / "benchmark.csv").read_text().splitlines()
    assert header.startswith("case,method,kind,error [1],median [s]") and len(lines) == len(found["rows"])
    (kept,) = (tmp_path / "kept").iterdir()
    assert kept.name.startswith(found["date"][:10]) and read_record(kept).to_dict() == found
    assert (tmp_path / "b" / "benchmark.png").read_bytes() == benchmark_picture(read_record(kept))


def test_json_and_nothing_else(command_line, tmp_path):
    status, out, err = command_line("benchmark", "S", "--quick", "--json", "--out", tmp_path / "b")
    assert (status, err, json.loads(out)["cases"][0]["name"]) == (0, "", "S")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("X",), "CASES: unknown case"),
        (("--repeats", "0"), "--repeats: too few"),
        (("--repeats", "3", "--quick"), "--repeats: has no effect with --quick"),
        (("--rivals", "none"), "--rivals: no such folder"),
    ],
)
def test_wrong_input_is_told(command_line, arguments, message):
    status, _, err = command_line("benchmark", *arguments)
    assert (status, message in err, "Traceback" in err) == (2, True, False)


def test_the_scaling_has_times_and_memory(monkeypatch):
    monkeypatch.setattr("fem_needle.benchmark.scaling.STEPS", 10)
    monkeypatch.setattr("fem_needle.benchmark.scaling.NAIVE_STEPS", 10)
    rows = scaling(Sizes((10,), (0.02,), (3,), (20,), (30,), (2,)))
    assert [(one.over, one.size) for one in rows] == [
        ("elements", 10), ("elements", 10), ("duration", 0.02), ("layers", 3), ("pieces of a cut path", 20),
        ("points of a table", 30), ("runs", 2),
    ]  # fmt: skip
    assert all(one.per_step and one.memory for one in rows)


def test_a_record_that_is_none_is_refused(tmp_path):
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(SceneError, match="no benchmark"):
        read_record(tmp_path / "x.json")


def test_a_rival_that_is_not_installed_is_skipped_with_the_reason(tmp_path):
    (tmp_path / "missing.py").write_text("import surely_not_installed\n")
    (tmp_path / "there.py").write_text("PACKAGE = 'numpy'\nMETHODS = ()\n")
    found = load_rivals(tmp_path)
    assert found.skipped == (("missing", "No module named 'surely_not_installed'"),)
    assert found.packages == ("numpy",)


def test_a_script_that_is_no_rival_is_refused(tmp_path):
    (tmp_path / "other.py").write_text("x = 1\n")
    with pytest.raises(SceneError, match="is no rival"):
        load_rivals(tmp_path)


def test_a_record_of_an_impossible_place_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    study = benchmark([S], [Given([reference_tips(S)])], repeats=1)
    with pytest.raises(NeedleError, match="cannot be written"):
        write_record(study, tmp_path / "file")
