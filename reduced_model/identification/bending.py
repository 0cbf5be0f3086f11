"""Appendix B of the thesis: Young's modulus of the needle from weights at its end."""

from __future__ import annotations

import numpy as np

from fem_needle.errors import ComputationError
from fem_needle.identification import BendingFit, Estimate, LinearFit, compare_printed, identify_bending, section_moment
from reduced_model.thesis_data import APPENDIX_B, NEEDLE_DIAMETER, PRINTED_GRAVITY, square_section_modulus
from reduced_model.validation.section import Section, blocks, prose, table

BORE = 1.0e-3  # m; of an 18 gauge tube: the thesis does not print it
STEEL = (190.0, 210.0)  # GPa
SECTIONS = (("square, as printed", "square", 0.0), ("solid round", "solid", 0.0), ("tube of 1.27 / 1.0 mm", "tube", BORE))


def fit() -> BendingFit:
    """Return the fit of all rows, with the thesis' value of g."""
    rows = [(1e-2 * row.length, row.mass * PRINTED_GRAVITY, 1e-3 * row.deflection) for row in APPENDIX_B]
    return identify_bending(*np.array(rows).T)


def printed() -> LinearFit:
    """Return the fit of printed to computed moduli."""
    computed = [square_section_modulus(row) for row in APPENDIX_B]
    return compare_printed(computed, [1e9 * row.youngs_modulus for row in APPENDIX_B])


def moduli() -> tuple[tuple[str, Estimate], ...]:
    """Return Young's modulus [Pa] for each section."""
    found = fit()
    return tuple((name, found.youngs_modulus(section_moment(kind, NEEDLE_DIAMETER, bore))) for name, kind, bore in SECTIONS)


def section() -> Section:
    """Return the section."""
    found = fit()
    low, high = found.stiffness.interval()
    rows = [
        [name, f"{1e-9 * one.value:.0f}", f"{1e-9 * one.interval()[0]:.0f} to {1e-9 * one.interval()[1]:.0f}", _steel(one)]
        for name, one in moduli()
    ]
    text = blocks(
        prose(f"""Twelve rows, w = m g L^3 / (3 EI): EI = {found.stiffness.value:.4f} N m^2, 95 % {low:.4f} to {high:.4f}. E
            needs the section:"""),
        table(["section", "E [GPa]", "95 % interval", f"steel, {STEEL[0]:g} to {STEEL[1]:g} GPa"], rows),
        "Residuals row by row, studentized (Student's t):",
        table(["row", "L [cm]", "w [mm]", "m [g]", "EI [N m^2]", "of w by load, length", "of the printed E"], _residuals(found)),
        "\n".join(f"- {prose(line)}" for line in _findings(found)),
    )
    return Section("4 Bending", text)


def _steel(one: Estimate) -> str:
    low, high = (1e-9 * end for end in one.interval())
    return "inside" if low < STEEL[1] and high > STEEL[0] else "excluded"


def _power_law(found: BendingFit) -> LinearFit:
    if found.power_law is None:
        raise ComputationError("a power law needs several loads and lengths")
    return found.power_law


def _residuals(found: BendingFit) -> list[list[str]]:
    columns = zip(APPENDIX_B, found.by_row, _power_law(found).studentized_residuals, printed().studentized_residuals, strict=True)
    return [
        [f"{number}", f"{row.length:g}", f"{row.deflection:g}", f"{1e3 * row.mass:g}", f"{own:.4f}", f"{law:.1f}", f"{ratio:.1f}"]
        for number, (row, own, law, ratio) in enumerate(columns, start=1)
    ]


def _findings(found: BendingFit) -> tuple[str, ...]:
    law, ratio = _power_law(found), printed()
    odd = ratio.outliers()
    names = ", ".join(str(row + 1) for row in odd)
    suspect = int(np.argmax(np.abs(law.studentized_residuals))) + 1
    load, length = ((one.value, *one.interval()) for one in (law.estimate("load"), law.estimate("length")))
    return (
        f"""Inconsistent by the printed E: row {names}, residual {ratio.studentized_residuals[odd[0]]:.0f}. The
        deflections alone, fitted by a power law of load and length, point at row {suspect} as well (residual
        {law.studentized_residuals[suspect - 1]:.1f}, the largest; among twelve rows alone no proof): the longest
        needle deflects less than a shorter one under the same weight.""",
        f"""The table contradicts itself whatever the section. Every cantilever deflects with the load to the power 1 and
        the length to the power 3; these go with {load[0]:.2f} (95 %: {load[1]:.2f} to {load[2]:.2f}) and
        {length[0]:.1f} ({length[1]:.1f} to {length[2]:.1f}). Excluded: {" and ".join(found.contradictions())}. No E,
        no bore and no g mends an exponent. A clamp that gives way lowers that of the length (to 2 where it turns, to
        0 where it shifts), an offset of the deflections that of the load; the table cannot tell which it was.""",
        """So the intervals above are those of a model that the data refuse. What is left is a stiffness of the order of
        0.04 N m^2, beside 0.0256 N m^2 of Table III.""",
        """What the formula leaves out is smaller: the deflections reach 17 % of the length, where the linear formula
        gives an EI 3 % too large; the needle's own weight counts as 3/8 of its 2 g at the end, 3 % of the lightest
        weight, if deflections were not measured from where it hangs by itself.""",
    )
