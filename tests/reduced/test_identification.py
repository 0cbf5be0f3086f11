"""The page docs/identification_thesis.md is current, and what it says in words is so in numbers."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from reduced_model.identification import bending, friction, page, stiffness
from reduced_model.thesis_data import APPENDIX_B, TABLE_I, TABLE_II
from tests.house.source import ROOT

FILE = ROOT / "docs" / "identification_thesis.md"
QUICK = {name: compute for name, compute in page.SECTIONS.items() if name != "friction"}


@pytest.mark.parametrize("name", QUICK)
def test_a_section_is_current(name):
    found = QUICK[name]()
    (committed,) = re.findall(
        rf"^## {re.escape(found.title)}\n.*?(?=^## |\Z)", FILE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    assert found.markdown == committed.rstrip() + "\n"


@pytest.mark.slow
def test_the_whole_page_is_current(tmp_path):
    (written,) = page.write_page(tmp_path / "page.md")
    assert written.read_text(encoding="utf-8") == FILE.read_text(encoding="utf-8")


@pytest.mark.slow
def test_twenty_experiments_give_table_one_back():
    """Means and deviations of the thesis lie in the intervals of twenty repetitions; each is much better."""
    found = friction.repetitions()
    for one, mean, deviation in (
        (found.coulomb, TABLE_I.coulomb, TABLE_I.coulomb_deviation),
        (found.viscous, TABLE_I.viscous, TABLE_I.viscous_deviation),
    ):
        low, high = one.mean.interval(0.99)
        assert low < mean < high
        small, large = one.deviation_interval(0.99)
        assert small < deviation < large
    errors = np.sqrt(np.mean(found.errors**2, axis=0))
    assert np.all(errors < 0.3 * np.array([TABLE_I.coulomb_deviation, TABLE_I.viscous_deviation]))


def test_a_point_stiffness_has_many_meanings():
    moduli = [modulus for _, modulus in stiffness.meanings()]
    assert moduli[0] == pytest.approx(520.0)
    assert all(modulus > 5.0 * moduli[0] for modulus in moduli[1:])


def test_the_curl_is_several_of_its_errors():
    assert all(stiffness.curl_errors(row) > 3.5 for row in TABLE_II)
    assert stiffness.softening().verdict == "softens"


def test_what_the_linear_formula_leaves_out():
    """The needle bent furthest for its length as an elastica: theta'' = -a cos theta gives 3 w / L = a / 1.03."""

    def end(load, start):
        def rate(_, state):
            return [state[1], -load * np.cos(state[0]), np.sin(state[0])]

        return solve_ivp(rate, (0.0, 1.0), [0.0, start, 0.0], rtol=1e-8, atol=1e-10).y[:, -1]

    def deflection(load):
        return end(load, brentq(lambda start: end(load, start)[1], 0.0, 2.0 * load))[2]

    largest = max(1e-1 * row.deflection / row.length for row in APPENDIX_B)
    assert largest == pytest.approx(0.17, abs=0.01)
    load = brentq(lambda load: deflection(load) - largest, 0.1, 1.0, xtol=1e-4)
    assert load / (3.0 * largest) == pytest.approx(1.03, abs=0.005)


def test_the_contradiction_needs_no_printed_modulus():
    assert bending.fit().contradictions(0.98) == ("load", "length")
