"""Bending stiffness from weights: exact data, coverage, and the rows of Appendix B."""

import numpy as np
import pytest

from fem_needle import SceneError
from fem_needle.identification import compare_printed, identify_bending, section_moment
from reduced_model.thesis_data import APPENDIX_B, NEEDLE_DIAMETER, PRINTED_GRAVITY, bending_stiffness, square_section_modulus

STIFFNESS = 0.01572
LENGTHS, LOADS = (grid.ravel() for grid in np.meshgrid([0.10, 0.14, 0.18], [0.1, 0.2, 0.3, 0.4]))
DEFLECTIONS = LOADS * LENGTHS**3 / (3.0 * STIFFNESS)
PRINTED = np.array([row.youngs_modulus for row in APPENDIX_B])


def appendix_b():
    columns = np.array([(1e-2 * row.length, PRINTED_GRAVITY * row.mass, 1e-3 * row.deflection) for row in APPENDIX_B]).T
    return identify_bending(*columns)


def test_exact_data():
    found = identify_bending(LENGTHS, LOADS, DEFLECTIONS)
    assert found.stiffness.value == pytest.approx(STIFFNESS)
    assert found.by_row == pytest.approx(np.full(12, STIFFNESS))
    assert found.power_law.values[1:] == pytest.approx([1.0, 3.0])
    moment = section_moment("tube", 1.27e-3, 1.0e-3)
    assert found.youngs_modulus(moment).value == pytest.approx(STIFFNESS / (np.pi / 64 * (1.27e-3**4 - 1e-12)))


def test_the_stiffness_is_the_mean_of_the_rows_and_its_error_theirs():
    random = np.random.default_rng(1)
    found = identify_bending(LENGTHS, LOADS, DEFLECTIONS * np.exp(0.05 * random.standard_normal(12)))
    assert found.stiffness.value == pytest.approx(found.by_row.mean())
    assert found.stiffness.standard_error == pytest.approx(np.std(found.by_row, ddof=1) / np.sqrt(12))


def test_intervals_cover_the_truth():
    random, held, refused = np.random.default_rng(7), 0, 0
    for _ in range(400):
        found = identify_bending(LENGTHS, LOADS, DEFLECTIONS * np.exp(0.05 * random.standard_normal(12)))
        low, high = found.youngs_modulus(section_moment("solid", 1.27e-3)).interval()
        held += low < STIFFNESS / (np.pi * 1.27e-3**4 / 64) < high
        refused += bool(found.contradictions())
    assert 0.90 <= held / 400 <= 0.99
    assert refused / 400 < 0.15  # two intervals of 95 %


def test_sections():
    t = NEEDLE_DIAMETER
    assert section_moment("solid", t) == pytest.approx(1.277e-13, rel=1e-3)
    assert section_moment("square", t) / section_moment("solid", t) == pytest.approx(16.0 / (3.0 * np.pi))
    assert section_moment("tube", t, 1.0e-3) == pytest.approx(section_moment("solid", t) - section_moment("solid", 1.0e-3))
    for wrong in (("round", t), ("solid", 0.0), ("tube", 1e-3, 1e-3), ("tube", 1e-3), ("solid", 1e-3, 5e-4)):
        with pytest.raises(SceneError, match="section: "):
            section_moment(*wrong)


def test_appendix_b_gives_no_section_of_steel():
    """Intervals, not only means: as a square 194 GPa, whose interval holds steel by chance, as what the needle is, not."""
    found = appendix_b()
    assert found.stiffness.value == pytest.approx(0.042, abs=5e-4)
    moduli = {
        section: found.youngs_modulus(section_moment(section, NEEDLE_DIAMETER, bore))
        for section, bore in (("square", 0.0), ("solid", 0.0), ("tube", 1.0e-3))
    }
    assert [1e-9 * one.value for one in moduli.values()] == pytest.approx([194.0, 330.0, 535.0], rel=5e-3)
    holds = {name: one.interval()[0] < 200e9 < one.interval()[1] for name, one in moduli.items()}
    assert holds == {"square": True, "solid": False, "tube": False}
    assert found.stiffness.interval()[0] > 0.0256  # Table III


def test_appendix_b_is_no_cantilever_at_all():
    """Whatever EI and section, deflections go with load^1 and length^3; here with about load^0.8 and length^0.6."""
    found = appendix_b()
    assert found.contradictions() == ("load", "length")
    assert found.power_law.estimate("length").p_value(3.0) < 5e-3


def test_the_inconsistent_row_of_appendix_b():
    """Printed moduli against the formula: one ratio for all rows but the first, which is 7 % off."""
    computed = np.array([square_section_modulus(row) for row in APPENDIX_B])
    found = compare_printed(computed, 1e9 * PRINTED)
    assert found.outliers() == (0,)
    assert abs(found.studentized_residuals[0]) > 20.0
    assert np.max(np.abs(found.studentized_residuals[1:])) < 1.0
    assert compare_printed(computed[1:], 1e9 * PRINTED[1:]).outliers() == ()


def test_the_first_row_of_appendix_b_is_also_the_oddest_by_its_deflection():
    """Without the printed moduli: the longest needle deflects less than a shorter one under the same weight."""
    found = appendix_b().power_law
    assert int(np.argmax(np.abs(found.studentized_residuals))) == 0
    assert found.studentized_residuals[0] < -2.5
    assert found.outliers() == ()  # among twelve rows that alone would not convict it


def test_one_length_has_no_power_law():
    found = identify_bending(np.full(4, 0.1), LOADS[:4] + np.arange(4), np.ones(4))
    assert found.power_law is None
    assert found.contradictions() == ()


def test_the_thesis_formula_is_that_of_the_fit():
    assert appendix_b().by_row == pytest.approx([bending_stiffness(row) for row in APPENDIX_B])


def test_wrong_input():
    with pytest.raises(SceneError, match="deflection: needs 3 positive"):
        identify_bending([0.1, 0.1, 0.1], [1.0, 1.0, 1.0], [1e-3, 0.0, 1e-3])
    with pytest.raises(SceneError, match="length: "):
        identify_bending([0.1, 0.1], [1.0, 1.0, 1.0], [1e-3, 1e-3, 1e-3])
    with pytest.raises(SceneError, match="2 or more"):
        identify_bending([0.1], [1.0], [1e-3])
    with pytest.raises(SceneError, match="computed, printed"):
        compare_printed([1.0, 2.0], [1.0, -2.0])
