"""The stiffness of tissue at a point: a 2 x 2 matrix from forces in several directions, and whether it is that of a spring.

Applied force f = K d + f_0 with the displacement d of the point, z along the needle's deflection and x across (the tissue answers
with -f). A spring stores energy, the work over a closed path is zero: K must be symmetric. Its antisymmetric part is a curl,

    K = (K + K^T) / 2 + (K - K^T) / 2,   curl = k_xz - k_zx,   work put in over a closed path = (k_zx - k_xz) times the area

that the path encloses, run through from x to z.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.errors import SceneError
from fem_needle.identification.least_squares import Estimate, LinearFit, weighted_least_squares

Array = NDArray[np.float64]

ENTRIES = ("k_xx", "k_xz", "k_zx", "k_zz")
OFFSETS = ("f_x", "f_z")
CURL = {"k_xz": 1.0, "k_zx": -1.0}
ANISOTROPY = {"k_xx": 1.0, "k_zz": -1.0}
DIRECTIONS = 8
EXPONENT, LEVEL = "exponent", "level"


@dataclass(frozen=True, eq=False)
class StiffnessMatrix:
    """A stiffness matrix.

    Attributes
    ----------
    matrix
        [[k_xx, k_xz], [k_zx, k_zz]] [N/m].
    """

    matrix: Array

    @property
    def symmetric(self) -> Array:
        """The part that stores energy."""
        return 0.5 * (self.matrix + self.matrix.T)

    @property
    def antisymmetric(self) -> Array:
        """The part that no spring has."""
        return 0.5 * (self.matrix - self.matrix.T)

    @property
    def curl(self) -> float:
        """k_xz - k_zx [N/m]."""
        return float(self.matrix[0, 1] - self.matrix[1, 0])

    @property
    def relative_curl(self) -> float:
        """Magnitude of the curl relative to k_zz."""
        return abs(self.curl / float(self.matrix[1, 1]))

    @property
    def principal(self) -> Array:
        """Principal stiffnesses of the symmetric part, rising (2,) [N/m]: all positive in tissue that resists."""
        return np.asarray(np.linalg.eigvalsh(self.symmetric), dtype=np.float64)

    def closed_path_work(self, area: float) -> float:
        """Return the work [J] put in over one turn around an area [m^2], from x to z positive; 0 for every spring."""
        return -self.curl * area


@dataclass(frozen=True, eq=False)
class StiffnessFit:
    """A stiffness matrix identified.

    Attributes
    ----------
    stiffness
        The matrix.
    covariance
        Of k_xx, k_xz, k_zx, k_zz (4, 4).
    fit
        The regression behind it, of forces or of displacements, all x components before all z components.
    """

    stiffness: StiffnessMatrix
    covariance: Array
    fit: LinearFit

    def combination(self, factors: Mapping[str, float]) -> Estimate:
        """Return the estimate of a sum of factors times entries, such as ``{"k_zz": 1.0}`` [N/m]."""
        row = np.array([factors.get(name, 0.0) for name in ENTRIES])
        value, variance = row @ self.stiffness.matrix.ravel(), row @ self.covariance @ row
        return Estimate(float(value), float(np.sqrt(variance)), self.fit.degrees_of_freedom)

    @property
    def curl(self) -> Estimate:
        """k_xz - k_zx [N/m]; its ``p_value()`` is that of a spring with such errors of measurement."""
        return self.combination(CURL)

    @property
    def anisotropy(self) -> Estimate:
        """k_xx - k_zz [N/m]: 0 in homogeneous isotropic tissue."""
        return self.combination(ANISOTROPY)


@dataclass(frozen=True, eq=False)
class Softening:
    """How a stiffness depends on the force, k = c f^n.

    Attributes
    ----------
    exponent
        n: 0 of a linear spring, negative where the tissue softens.
    fit
        Of log k = log c + n log f.
    """

    exponent: Estimate
    fit: LinearFit

    @property
    def verdict(self) -> Literal["softens", "stiffens", "linear"]:
        """Whether n is below or above 0 with 95 % confidence, or neither."""
        low, high = self.exponent.interval()
        return "softens" if high < 0.0 else "stiffens" if low > 0.0 else "linear"

    @property
    def tangent_share(self) -> float:
        """Tangent stiffness df/dd over the secant k = f/d: 1 / (1 - n)."""
        return 1.0 / (1.0 - self.exponent.value)


def identify_stiffness(
    displacement: ArrayLike, force: ArrayLike, *, noise_in: Literal["force", "displacement"] = "force"
) -> StiffnessFit:
    """Return the stiffness matrix by least squares.

    Noise in what stands on the right of a regression makes its coefficients too small. So what is measured worse is the
    left-hand side: with noise in the force f = K d + f_0 is fitted, with noise in the displacement d = C (f - f_0) and K = C^-1,
    whose covariance follows from dK = -K dC K.

    Parameters
    ----------
    displacement, force
        Of the point, and applied to the tissue there, (n, 2): components x and z [m], [N].
    noise_in
        Which of the two is measured worse.

    Raises
    ------
    SceneError
        If sizes disagree, all displacements or forces have one direction, or the compliance cannot be inverted.
    """
    moved, applied = np.asarray(displacement, dtype=float), np.asarray(force, dtype=float)
    if moved.ndim != 2 or moved.shape[1] != 2 or moved.shape != applied.shape:
        raise SceneError(f"displacement, force: need two columns each (got shapes {moved.shape} and {applied.shape})")
    if noise_in == "force":
        fit = _two_rows(moved, applied)
        return StiffnessFit(StiffnessMatrix(fit.values[:4].reshape(2, 2)), fit.covariance[:4, :4], fit)
    if noise_in != "displacement":
        raise SceneError(f"noise_in: got {noise_in!r}; allowed 'force', 'displacement'")
    fit = _two_rows(applied, moved)
    try:
        matrix = np.asarray(np.linalg.inv(fit.values[:4].reshape(2, 2)), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise SceneError("the compliance matrix cannot be inverted: some force moves nothing") from None
    change = -np.kron(matrix, matrix.T)
    return StiffnessFit(StiffnessMatrix(matrix), change @ fit.covariance[:4, :4] @ change.T, fit)


def eight_directions(magnitude: float, repetitions: int = 1) -> Array:
    """Return forces (8 repetitions, 2) [N] of one magnitude in eight directions, 45 degrees apart."""
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return np.tile(magnitude * np.column_stack((np.cos(angles), np.sin(angles))), (repetitions, 1))


def identify_softening(force: ArrayLike, stiffness: ArrayLike, deviations: ArrayLike | None = None) -> Softening:
    """Return how stiffness depends on force.

    Parameters
    ----------
    force, stiffness
        Magnitudes of the forces (n,) [N], and the (secant) stiffness found with each [N/m].
    deviations
        Standard deviations of the stiffnesses (n,), up to a common factor; default: in proportion to them.

    Raises
    ------
    SceneError
        If there are fewer than three forces, or a number is not positive.
    """
    forces, values = np.asarray(force, dtype=float), np.asarray(stiffness, dtype=float)
    if forces.shape != values.shape or not (np.all(forces > 0.0) and np.all(values > 0.0)):
        raise SceneError("force, stiffness: need positive numbers, as many of the one as of the other")
    matrix = np.column_stack((np.ones_like(forces), np.log(forces)))
    weights = None if deviations is None else (values / np.asarray(deviations, dtype=float)) ** 2
    fit = weighted_least_squares(matrix, np.log(values), (LEVEL, EXPONENT), weights=weights)
    return Softening(fit.estimate(EXPONENT), fit)


def _two_rows(given: Array, answer: Array) -> LinearFit:
    """Fit both components of answer = A given + offset together: their errors are of one size."""
    both = np.column_stack((np.kron(np.eye(2), given), np.kron(np.eye(2), np.ones((len(given), 1)))))
    return weighted_least_squares(both, answer.T.ravel(), (*ENTRIES, *OFFSETS))
