"""Numbers that the thesis prints, as printed, in the units of its tables."""

from __future__ import annotations

from typing import NamedTuple

PRINTED_GRAVITY = 9.89  # m/s^2: Table III and Appendix B
NEEDLE_DIAMETER = 1.27e-3  # m: t of Appendix B


class BendingTest(NamedTuple):
    """A row of Appendix B: a needle held horizontally, a weight at its end.

    Attributes
    ----------
    length
        Effective length [cm]; the table says mm.
    deflection
        Of the tip [mm].
    mass
        Of the weight [kg].
    youngs_modulus
        As printed [GPa].
    """

    length: float
    deflection: float
    mass: float
    youngs_modulus: float


APPENDIX_B = (
    BendingTest(19.3, 10.08, 0.024, 242.19),
    BendingTest(18.2, 11.7, 0.024, 188.59),
    BendingTest(17.1, 11.0, 0.024, 165.90),
    BendingTest(16.1, 10.3, 0.024, 147.40),
    BendingTest(19.3, 18.3, 0.033, 196.78),
    BendingTest(18.2, 17.5, 0.033, 172.87),
    BendingTest(17.1, 16.7, 0.033, 150.55),
    BendingTest(16.1, 16.7, 0.033, 125.66),
    BendingTest(19.3, 33.3, 0.083, 272.22),
    BendingTest(18.2, 32.5, 0.083, 234.13),
    BendingTest(17.1, 30.0, 0.083, 210.37),
    BendingTest(16.1, 25.8, 0.083, 203.90),
)


class FrictionTable(NamedTuple):
    """Table I: means and standard deviations over the experiments, mu_s [N] and mu_v [N s/m]; no unit is printed."""

    coulomb: float
    viscous: float
    coulomb_deviation: float
    viscous_deviation: float


TABLE_I = FrictionTable(0.56, 0.3, 0.0374, 0.0447)
FRICTION_REPETITIONS = 20


class TissueTest(NamedTuple):
    """A column of Table II: the stiffness matrix [N/mm by its size; no unit is printed] under a force [N].

    Means over places in the tissue, and their standard deviations.
    """

    force: float
    k_xx: float
    k_zz: float
    k_xz: float
    k_zx: float
    deviation_xx: float
    deviation_zz: float
    deviation_xz: float
    deviation_zx: float


TABLE_II = (
    TissueTest(1.1, 1.26, 1.01, 0.04, -0.10, 0.08, 0.11, 0.08, 0.06),
    TissueTest(1.2, 0.82, 0.81, 0.04, -0.10, 0.54, 0.15, 0.07, 0.10),
    TissueTest(1.3, 1.10, 0.69, 0.01, -0.11, 0.11, 0.18, 0.09, 0.09),
    TissueTest(1.4, 1.03, 0.60, 0.001, -0.11, 0.12, 0.19, 0.08, 0.09),
    TissueTest(1.5, 0.96, 0.52, -0.005, -0.11, 0.12, 0.18, 0.08, 0.09),
)
TISSUE_REPETITIONS = 20


class InsertionTest(NamedTuple):
    """A row of Table IV, with the probability of the text beside it.

    Attributes
    ----------
    speed
        Of the insertion [mm/s]; 0 by hand.
    controller
        "incremental" or "proportional".
    uncontrolled, controlled
        Mean errors of ten insertions [pixels].
    improvement
        As printed [%].
    probability
        Of a one-sided t-test, as printed (1).
    """

    speed: float
    controller: str
    uncontrolled: float
    controlled: float
    improvement: float
    probability: float


TABLE_IV = (
    InsertionTest(5.0, "incremental", 22.0, 8.0, 63.63, 0.016),
    InsertionTest(10.0, "incremental", 12.0, 6.0, 50.0, 0.015),
    InsertionTest(10.0, "proportional", 15.0, 4.0, 73.33, 0.04),
    InsertionTest(15.0, "incremental", 11.0, 12.0, -9.09, 0.046),
    InsertionTest(0.0, "incremental", 22.0, 17.0, 22.72, 0.032),
)
REPETITIONS = 10


def square_section_modulus(row: BendingTest, gravity: float = PRINTED_GRAVITY) -> float:
    """Return E = 4 m g L^3 / (w t^4) [Pa], the formula of Appendix B: that of a square section of side t."""
    length, deflection = 1e-2 * row.length, 1e-3 * row.deflection
    return 4.0 * row.mass * gravity * length**3 / (deflection * NEEDLE_DIAMETER**4)


def bending_stiffness(row: BendingTest, gravity: float = PRINTED_GRAVITY) -> float:
    """Return EI = m g L^3 / (3 w) [N m^2], whatever the section."""
    return row.mass * gravity * (1e-2 * row.length) ** 3 / (3e-3 * row.deflection)
