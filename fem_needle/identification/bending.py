"""Bending stiffness of a needle from weights at its end: a cantilever, w = F L^3 / (3 EI).

The load's moment of the third order x = F L^3 / 3 is EI times the deflection; with errors in proportion to the deflection, EI is
the mean of the rows' own EI = x / w. Young's modulus needs a section besides: E = EI / I. What no section can mend shows in the
exponents of w = c F^a L^b, which are 1 and 3 for every cantilever, whatever it is made of.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.least_squares import Estimate, LinearFit, weighted_least_squares

Array = NDArray[np.float64]

SECTIONS = ("square", "solid", "tube")
STIFFNESS, COEFFICIENT, LOAD_EXPONENT, LENGTH_EXPONENT, RATIO = "bending stiffness", "coefficient", "load", "length", "ratio"
EXPONENTS = {LOAD_EXPONENT: 1.0, LENGTH_EXPONENT: 3.0}  # of a cantilever


@dataclass(frozen=True, eq=False)
class BendingFit:
    """Bending stiffness identified.

    Attributes
    ----------
    stiffness
        EI [N m^2].
    fit
        Of x = EI w; a row per measurement.
    by_row
        EI of each row alone (n,) [N m^2].
    power_law
        Fit of log w = log c + a log F + b log L; None where loads or lengths do not vary enough to tell.
    """

    stiffness: Estimate
    fit: LinearFit
    by_row: Array
    power_law: LinearFit | None

    def youngs_modulus(self, second_moment_of_area: float) -> Estimate:
        """Return E = EI / I [Pa] of a section that is known exactly."""
        return self.stiffness.scaled(1.0 / second_moment_of_area)

    def contradictions(self, confidence: float = 0.95) -> tuple[str, ...]:
        """Return the exponents ("load", "length") whose interval does not hold that of a cantilever."""
        if self.power_law is None:
            return ()
        found = {name: self.power_law.estimate(name).interval(confidence) for name in EXPONENTS}
        return tuple(name for name, (low, high) in found.items() if not low <= EXPONENTS[name] <= high)


def section_moment(section: str, outer: float, inner: float = 0.0) -> float:
    """Return the second moment of area I [m^4] of a section.

    Parameters
    ----------
    section
        "square": t^4 / 12; "solid": pi d^4 / 64; "tube": pi (d^4 - b^4) / 64.
    outer
        Side or diameter [m].
    inner
        Bore of a tube, and of a tube alone [m].

    Raises
    ------
    SceneError
        If the section is unknown, or a diameter impossible.
    """
    if section not in SECTIONS:
        raise SceneError(f"section: unknown (got {section!r}; allowed {', '.join(SECTIONS)})")
    if not outer > 0.0 or not 0.0 <= inner < outer or (section == "tube") != (inner > 0.0):
        found = f"got {outer:g} and {inner:g} m"
        raise SceneError(f"section: impossible diameters ({found}; allowed above 0 and, of a tube alone, a smaller bore above 0)")
    return outer**4 / 12.0 if section == "square" else pi * (outer**4 - inner**4) / 64.0


def identify_bending(length: ArrayLike, load: ArrayLike, deflection: ArrayLike) -> BendingFit:
    """Return the bending stiffness from deflections under loads at the end of a clamped needle.

    Parameters
    ----------
    length
        From clamp to load (n,) [m].
    load
        Across the needle (n,) [N]: weight, m g.
    deflection
        Of the point of the load, from the unloaded needle (n,) [m].

    Raises
    ------
    SceneError
        If a number is not positive, or there are fewer than two rows.
    """
    lengths, loads, deflections = (np.asarray(values, dtype=float) for values in (length, load, deflection))
    for name, values in (("length", lengths), ("load", loads), ("deflection", deflections)):
        if values.shape != deflections.shape or not np.all(np.isfinite(values) & (values > 0.0)):
            raise SceneError(f"{name}: needs {deflections.size} positive numbers (got {np.array2string(values, threshold=6)})")
    moments = loads * lengths**3 / 3.0
    fit = weighted_least_squares(deflections[:, None], moments, (STIFFNESS,), weights=deflections**-2.0)
    return BendingFit(fit.estimate(STIFFNESS), fit, moments / deflections, _power_law(lengths, loads, deflections))


def compare_printed(computed: ArrayLike, printed: ArrayLike) -> LinearFit:
    """Return the fit of one common ratio between computed and printed results: a row that breaks it is an outlier.

    A wrong constant changes all rows alike; a misprint one row, whose studentized residual shows it.

    Raises
    ------
    SceneError
        If sizes differ or a number is not positive.
    """
    ours, theirs = np.asarray(computed, dtype=float), np.asarray(printed, dtype=float)
    if ours.shape != theirs.shape or not (np.all(ours > 0.0) and np.all(theirs > 0.0)):
        raise SceneError("computed, printed: need positive numbers, as many of the one as of the other")
    return weighted_least_squares(np.ones((ours.size, 1)), theirs / ours, (RATIO,))


def _power_law(lengths: Array, loads: Array, deflections: Array) -> LinearFit | None:
    varies = all(np.unique(values).size > 1 for values in (lengths, loads))
    if not varies or len(lengths) <= len(EXPONENTS) + 1:
        return None
    matrix = np.column_stack((np.ones_like(lengths), np.log(loads), np.log(lengths)))
    return weighted_least_squares(matrix, np.log(deflections), (COEFFICIENT, LOAD_EXPONENT, LENGTH_EXPONENT))
