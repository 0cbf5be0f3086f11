"""The page on steering: what is computed from the printed table by hand, a few loops, and, slow, the whole page."""

import math
from pathlib import Path

import numpy as np
import pytest

from reduced_model.steering import comparison, table_iv
from reduced_model.steering.closed_loops import Loop, findings
from reduced_model.steering.page import page, sections
from reduced_model.thesis_data import TABLE_IV

PAGE = Path(__file__).parents[2] / "docs" / "steering.md"


def row(uncontrolled, controlled):
    return table_iv.Row("", table_iv.Insertions(np.array(uncontrolled)), table_iv.Insertions(np.array(controlled)))


def test_improvement_is_that_of_the_mean_magnitudes():
    """Means of 3 and 1.5: signs do not count."""
    assert row([2.0, -4.0], [-1.0, 2.0]).improvement == pytest.approx(0.5)
    assert row([2.0, 2.0], [-2.2, 2.2]).improvement == pytest.approx(-0.1)


def test_the_printed_improvements_are_those_of_the_printed_means():
    for printed in TABLE_IV:
        found = row([printed.uncontrolled], [printed.controlled])
        assert 100 * found.improvement == pytest.approx(printed.improvement, abs=0.01)


def test_the_one_sided_test_by_hand():
    """t = difference of means / sqrt(s^2 2 / n), here 1 / sqrt(2 / 3), with 4 degrees of freedom; p by its density."""
    found = row([2.0, 3.0, 4.0], [1.0, 2.0, 3.0])
    t = 1.0 / math.sqrt(2.0 / 3.0)
    fine = np.linspace(0.0, t, 20_001)
    density = 3.0 / 8.0 * (1.0 + fine**2 / 4.0) ** -2.5
    assert found.p_value == pytest.approx(0.5 - np.trapezoid(density, fine), abs=1e-8)
    assert row([1.0, 2.0, 3.0], [2.0, 3.0, 4.0]).p_value > 0.5  # a larger mean with the robot


def test_what_cannot_be_right_is_read_off_the_printed_table():
    text = " ".join(table_iv.impossible())
    for said in ("12 pixels in one row and 15", "12 against 11", "p above 0.5, not 0.046", "0.04 in another row", "no scale"):
        assert said in text


@pytest.mark.slow
def test_repetitions_differ_and_are_the_same_again():
    scene = table_iv.scene_of(10.0).with_value("numerics.elements", 3)
    errors = table_iv.insertions(scene, repetitions=2).errors
    assert errors[0] != errors[1]
    np.testing.assert_array_equal(table_iv.insertions(scene, repetitions=2).errors, errors)


@pytest.mark.slow
def test_a_wrong_model_is_the_needle_s_not_the_controller_s():
    believed, softer = (comparison.outcome("none", name, 0.06) for name in ("as believed", "k x 0.5"))
    assert abs(softer.error) > 1.3 * abs(believed.error)  # the bevel's force stays, the tissue gives way
    assert comparison.outcome("inverse dynamics", "as believed", 0.12).text.startswith("stops at")


def test_findings_follow_from_the_runs():
    """With the roles exchanged every verdict turns round."""

    class Run:
        def __init__(self, tips):
            self.time, self.tip_deflection = np.linspace(0.0, 1.0, len(tips)), np.array(tips)

    def said(opened, ideal, pid):
        cases = ("thesis-open-loop", opened), ("thesis-inverse-dynamics", ideal), ("thesis-pid", pid)
        return findings([Loop(case, model, Run(tips)) for case, tips in cases for model in ("one", "other")])

    grows, vanishes, swings = [1.0, 2.0, -2.0, 2.0, 2.0, 2.0], [1.0, 2.0, 0.5, 0.1, 0.0, 0.0], [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
    as_said = said(grows, vanishes, swings)
    assert [": holds" in as_said[number] for number in (0, 1, 3)] == [True, True, True]
    turned = said(vanishes[::-1], grows, vanishes)
    assert ["does not hold" in turned[number] for number in (1, 3)] == [True, True]


@pytest.mark.long
def test_the_page_is_current():
    """Minutes: every number of docs/steering.md."""
    assert page(sections()) == PAGE.read_text(encoding="utf-8")
