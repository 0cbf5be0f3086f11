"""The page docs/validation.md is current: what rests is computed anew each time, the rest where slow tests run."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from fem_needle import FiniteElementNeedle
from fem_needle.analysis.depth_gains import depth_gains
from fem_needle.cli import build_application
from fem_needle.exact import exact_static
from fem_needle.statics import solve_static
from reduced_model.validation import page, signs, thesis_at_rest, transients, tube_at_rest
from reduced_model.validation.cases import (
    CORRECTED,
    SKIN,
    THESIS,
    THESIS_SPRING,
    TUBE,
    TWO,
    exact_tip,
    foundation,
    resting,
    tip_spring,
)
from reduced_model.validation.section import Section, blocks, percent, prose, table
from tests.house.source import ROOT

PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
BYTES = 100_000  # of a picture, at most


def committed(title):
    """A section of the committed page, from its heading to the next."""
    (found,) = re.findall(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", PAGE, flags=re.DOTALL | re.MULTILINE)
    return found.rstrip() + "\n"


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name != "thesis")) for name in page.AT_REST])
def test_a_section_at_rest_is_current(name):
    found = page.AT_REST[name]()
    assert found.markdown == committed(found.title)
    assert all(sentence in PAGE for sentence in found.conclusions)


@pytest.mark.slow
def test_the_whole_page_is_current():
    assert page.page(page.sections()) == PAGE


def test_the_pictures_of_the_page_are_there_and_small():
    pictures = re.findall(r"\]\((pictures/\S+\.png)\)", PAGE)
    assert len(pictures) == len(page.ALL)
    for name in pictures:
        assert 0 < (ROOT / "docs" / name).stat().st_size < BYTES, name


def test_errors_are_those_of_the_solutions():
    found = thesis_at_rest.tip_errors("entry", "tip spring", (TWO, CORRECTED), (0.05, 0.15))
    elements = FiniteElementNeedle(resting(THESIS, "entry", tip_spring(THESIS_SPRING)), elements=48)
    for depth in found.depths:
        true = solve_static(elements, depth=depth).tip_deflection
        assert exact_tip(elements.scene, depth) == pytest.approx(true, rel=1e-8)
        two = solve_static(TWO.plant(elements.scene), depth=depth).tip_deflection
        assert found.of(TWO, depth) == pytest.approx(two / true - 1.0, abs=1e-8)


def test_within_a_range_the_error_is_small_and_beyond_it_is_not():
    strict, loose = tube_at_rest.ranges("`hub`, force at the tip", 2e4, TWO)
    scene = resting(TUBE, "hub", foundation(2e4))
    plant = TWO.plant(scene)
    for found in (strict, loose):
        end = found.intervals[0].end
        for depth, inside in ((end - 1e-3, True), (end + 1e-3, False)):
            error = solve_static(plant, depth=depth).tip_deflection / exact_static(scene, depth).tip_deflection - 1.0
            assert (abs(error) <= found.within) is inside
        assert found.first_number == pytest.approx((2e4 / (4 * TUBE.bending_stiffness)) ** 0.25 * end)


@pytest.mark.parametrize(("label", "elements"), [("16 elements", 16), (TWO.label, 0)])
def test_sign_changes_agree_with_the_analysis(label, elements):
    scene = resting(TUBE, "hub", foundation(5e4), (SKIN,))
    plant = FiniteElementNeedle(scene, elements=elements) if elements else TWO.plant(scene)
    gains = depth_gains(plant, np.linspace(0.01, 0.196, 16))
    expected = [change.depth for change in gains.sign_changes if change.input == "lateral_force"]
    assert signs.sign_changes(5e4, (label,)).depths[label] == pytest.approx(expected, abs=1e-7)


def test_inertia_acts_with_the_speed_and_not_without():
    slow, fast = (transients.insertion_effect(transients.FROM_REST, 5e4, 0.0, speed) for speed in (1.0, 5.0))
    assert 3.0 < fast.inertia / slow.inertia < 7.0  # a jump of speed rings in proportion to it
    assert slow.all_transients == slow.inertia  # without viscosity there is no other transient


def test_how_numbers_are_written():
    assert [percent(share) for share in (0.0, 1e-6, -0.00266, 0.0155, 1.2345, float("inf"))] == [
        "< 0.001",
        "< 0.001",
        "-0.27",
        "1.6",
        "123",
        "fails",
    ]
    assert table(["a", "b"], [["1", "2"]]) == "| a | b |\n| --- | --- |\n| 1 | 2 |"
    assert blocks("one", prose("two\n   words")) == "one\n\ntwo words"


def test_the_command_writes_page_and_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "AT_REST", {"thesis": thesis_at_rest.section})
    file = tmp_path / "new" / "validation.md"
    runner, application = CliRunner(), build_application()
    done = runner.invoke(application, ["validate", "--quick", "--out", str(file)])
    assert done.exit_code == 0, done.output
    text = file.read_text(encoding="utf-8")
    assert text.startswith("# Validation")
    assert page.ONLY_AT_REST in text
    assert committed("1 The thesis' needle at rest") in text
    assert (file.parent / "pictures" / thesis_at_rest.PICTURE).read_bytes().startswith(b"\x89PNG")
    shown = runner.invoke(application, ["validate", "--quick"])
    assert shown.output == text


def test_a_page_that_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "AT_REST", {"thesis": lambda: Section("1", "text")})
    (tmp_path / "file").write_text("in the way")
    done = CliRunner().invoke(build_application(), ["validate", "--quick", "--out", str(tmp_path / "file" / "page.md")])
    assert "cannot be written" in str(done.exception)
