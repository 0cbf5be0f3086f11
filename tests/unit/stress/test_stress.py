"""The stress table: each of its figures can fail, and the same seed gives the same scene."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from fem_needle.models import build_plant
from fem_needle.stress import Figure, Numbers, StressRow, StressTable, Trial, examine, fine, random_numbers, scene_of, trial
from fem_needle.stress.cases import cases
from fem_needle.stress.numbers import OTHER, LayerNumbers

HELD = Numbers(steps=3, outputs=3)
THERE_AND_BACK = Numbers(
    support="entry", analysis="static", times=(0.0, 1e-3, 2e-3), depths=(0.1, 0.05, 0.1), time_step=5e-4, steps=4, outputs=4
)


def names(found: Trial) -> set[str]:
    return {figure.name for figure in found.figures}


def test_a_sound_program_passes_every_check():
    found = examine("there and back", THERE_AND_BACK, None)
    assert names(found) == {"finite", "energy", "mirror", "units", "way back", "force sum", "exact"}
    assert not found.failed and found.announced == ""


def test_many_modes_over_a_short_part_do_not_turn_on_the_last_digits():
    """Seed 1253 once moved its tip by 1.3e-3: the mass of the last combination of modes that was kept was right to 2e-2."""
    found = examine("seed 1253", random_numbers(1253), 8, brief=True)
    assert [figure.value < 1e-6 for figure in found.figures if figure.name == "mirror and units"] == [True]


@pytest.mark.parametrize("figure", ["energy", "mirror", "units", "way back", "force sum", "exact"])
def test_a_wrong_answer_is_seen(monkeypatch, figure):
    """Each figure notices a run that is made wrong in what it looks at."""
    actual, runs = trial.simulate, []

    def wrong(plant, **settings):
        run = actual(plant, **settings)
        runs.append(run)
        if figure == "energy":
            run.summary["relative_energy_residual"] = 0.02
        elif figure == "force sum":
            run.series["hub_force"] = run.hub_force * 1.001
        elif figure == "way back" and len(run.time) > 2:
            run.series["tip_deflection"] = run.tip_deflection * (1.0 + 1e-6 * run.time / run.time[-1])
        elif figure in {"mirror", "units"} and len(runs) == 1:
            run.series["tip_deflection"] = run.tip_deflection * (1.0 + 1e-6)
        return run

    monkeypatch.setattr(trial, "simulate", wrong)
    if figure == "exact":
        automatic = trial.run_scene

        def bent(*arguments, **settings):
            run = automatic(*arguments, **settings)
            run.series["tip_deflection"] = run.tip_deflection * 1.01
            return run

        monkeypatch.setattr(trial, "run_scene", bent)
    found = examine("wrong", THERE_AND_BACK, None)
    assert found.failed and figure in found.why()


def test_a_number_that_is_none_fails(monkeypatch):
    actual = trial.simulate

    def broken(plant, **settings):
        run = actual(plant, **settings)
        run.series["push_force"] = np.full_like(run.time, np.nan)
        return run

    monkeypatch.setattr(trial, "simulate", broken)
    assert examine("nan", HELD, None).why().startswith("finite")


def test_a_traceback_is_a_crash_and_a_message_is_not(monkeypatch):
    assert "nothing inserted could bend" in examine(
        "refused", replace(HELD, support="entry", depths=(0.0,), initial_shape="tip-displaced"), None
    ).announced

    def crash(*_, **__):
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr(trial, "simulate", crash)
    found = examine("crash", HELD, None)
    assert found.failed and found.why() == "ZeroDivisionError: float division by zero"


def test_a_run_that_distrusts_itself_must_only_be_finite():
    lost = replace(HELD, times=(0.0, 0.5, 1.0), depths=(0.1, 0.0, 0.1), time_step=0.05, steps=20, outputs=5)
    found = examine("lost", lost, None)
    assert "energies miss" in found.announced and names(found) == {"finite"}


def test_seeds_give_scenes_again():
    assert random_numbers(7) == random_numbers(7) != random_numbers(8)


def test_other_units_are_the_same_needle():
    numbers = random_numbers(7)
    here, there = (scene_of(numbers), scene_of(numbers, OTHER))
    decay = [s.tissue.layers[0].foundation_modulus * s.needle.length**4 / s.needle.bending_stiffness for s in (here, there)]
    assert decay[0] == pytest.approx(decay[1], rel=1e-14)
    wave = [(s.needle.bending_stiffness / s.needle.mass_per_length) ** 0.5 / s.needle.length**2 for s in (here, there)]
    period = [s.run.duration * rate for s, rate in zip((here, there), wave, strict=True)]
    assert period[0] == pytest.approx(period[1], rel=1e-14)


def test_the_table_counts_and_says_what_failed():
    good, bad = Figure("tip", 1e-12, 1e-9), Figure("tip", 1e-6, 1e-9)
    row = StressRow("meshes", "fine", (Trial("a", (good,)), Trial("b", (bad,)), Trial("c", announced="refused")))
    table = StressTable((row,), 0, 0, long=False)
    assert row.cells() == ("meshes", "fine", "3", "1", "1", "tip 1.0e-06 (allowed 1e-09)")
    assert table.failures == 1
    assert "FAILED b: tip 1e-06 > 1e-09" in table.page()


@pytest.mark.parametrize("elements", [10, 1000])
def test_the_fine_mesh_case_uses_the_plant_of_its_elements(monkeypatch, elements):
    made = []

    def noted(scene):
        plant = build_plant(scene)
        made.append(plant.describe()["elements"])
        return plant

    monkeypatch.setattr(fine, "build_plant", noted)
    (found,) = fine.fine_mesh(elements)
    assert made == [elements] and not found.failed


def test_forces_too_large_are_warned_of_and_the_case_notices_if_not(monkeypatch):
    assert not any(found.failed for found in fine.small_deflections())
    monkeypatch.setattr(fine, "suspicious", lambda scene: ())
    assert any(found.failed for found in fine.small_deflections())


def test_few_steps_keep_their_energy():
    (found,) = fine.many_steps(2000)
    assert not found.failed and found.figures[0].value < 1e-10


def test_every_range_is_a_row():
    rows = {case.name for case in cases(0, 0, long=False)}
    assert {"foundation modulus", "jump between layers", "time step", "random scenes, 8 modes"} <= rows
    assert len(rows) == 20


@pytest.fixture
def stress(command_line, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: command_line("stress", *arguments)


def test_the_command_shows_a_table_and_fails_with_it(stress, monkeypatch, tmp_path):
    row = StressRow("meshes", "fine", (Trial("b", (Figure("tip", 1e-6, 1e-9),)),))
    monkeypatch.setattr("fem_needle.stress.stress", lambda *_, **__: StressTable((row,), 3, 5, long=True))
    status, out, err = stress("--out", "page.md")
    assert status == 1 and "meshes" in out
    assert "1 failures" in err and "b: tip 1e-06 > 1e-09" in err
    page = (tmp_path / "page.md").read_text()
    assert "`fem-needle stress --long --scenes 3 --out" in page and "3 random scenes of each model, the first with seed 5" in page


@pytest.mark.parametrize(("option", "value", "least"), [("--scenes", "-1", 0), ("--seed", "-2", 0), ("--processes", "0", 1)])
def test_impossible_options(stress, option, value, least):
    status, _, err = stress(option, value)
    assert status == 2 and f"{option}: too few (got {value}; allowed from {least} on)" in err


@pytest.mark.slow
def test_the_command_runs_its_cases_in_processes(stress):
    status, out, err = stress("--scenes", "1", "--processes", "2")
    assert status == 0, err
    assert "random scenes, finite elements" in out


BESIDE_AN_INTERFACE = Numbers(
    support="entry",
    length=2.0,
    bending_stiffness=32.6,
    mass_per_length=3.6e-4,
    layers=(LayerNumbers(0.0, 1.0801346243046999, 252.6, 3.6), LayerNumbers(1.0801346243046999, None, 1.5e6)),
    times=tuple(0.0038505937915509028 * number for number in range(19)),
    depths=tuple((1.0801346243036998, 1.080136466150124)[number % 2] for number in range(19)),
    bevel_coefficient=1.6e-6,
    time_step=0.0038505937915509028,
    steps=18,
    analysis="quasi-static",
)
TWINS = ((-0.05, inf), (-0.05 * (1.0 + 1e-9), inf))
TWIN_GUIDES = replace(HELD, guides=TWINS, times=(0.0, 1e-3), depths=(0.1, 0.101), elements=1)


@pytest.mark.parametrize("numbers", [BESIDE_AN_INTERFACE, TWIN_GUIDES], ids=["a few ulps after a kink", "twin guides"])
def test_scenes_that_once_crashed(numbers):
    """An interface crossed 1e-12 m after a kink: a step of no length; a rigid guide within a nanometre of another: singular."""
    assert examine("once", numbers, None).crash == ""


def test_guides_that_leave_no_freedom():
    """Three rigid guides on the three coordinates of one element: nothing can ring."""
    guides = ((-0.06, inf), (-0.04, inf), (-0.02, inf))
    held = Numbers(guides=guides, times=(0.0, 0.01, 0.02), depths=(0.1, 0.11, 0.1), elements=1, analysis="auto")
    assert examine("held", held, None).crash == ""


def test_in_brief_a_scene_is_turned_round_and_put_in_other_units_at_once(monkeypatch):
    assert names(examine("brief", THERE_AND_BACK, None, brief=True)) == {"finite", "energy", "mirror and units", "force sum"}
    actual, runs = trial.simulate, []

    def wrong(plant, **settings):
        run = actual(plant, **settings)
        runs.append(run)
        run.series["tip_deflection"] = run.tip_deflection * (1.0 + 1e-6 * len(runs))
        return run

    monkeypatch.setattr(trial, "simulate", wrong)
    assert "mirror and units" in examine("wrong", THERE_AND_BACK, None, brief=True).why()
