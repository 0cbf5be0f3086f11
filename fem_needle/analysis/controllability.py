"""Controllability, observability and output controllability by means that stand up numerically.

Nothing here is a rank of powers of A: on a needle's frequencies, 10 to 1e6 rad/s, their columns differ by a hundred decades. The
system is balanced first, so that units do not matter. Then

- pencil (Popov, Belevitch, Hautus): an eigenvalue is controllable where no left eigenvector w of it has w B = 0. Shown is the
  smallest singular value of W B, with W an orthonormal basis of its left eigenvectors and the columns of B of unit length;
- staircase: an orthonormal basis of the controllable subspace, grown by A times what was new, each new direction with
  the singular value by which it stands out.

Both give singular values and the thresholds below which they are rounding. Sources: docs/analysis.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import matrix_balance
from scipy.sparse.csgraph import connected_components

from fem_needle.errors import SceneError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAFETY = 100.0  # on the rounding of a singular value decomposition, size x epsilon x norm


@dataclass(frozen=True, eq=False)
class Balanced:
    """A system in scaled states T x, inputs and outputs of unit size.

    Attributes
    ----------
    A, B, C
        Scaled matrices; columns of B and rows of C have length 1 or 0.
    scales
        T, the diagonal, powers of two.
    """

    A: Array
    B: Array
    C: Array
    scales: Array


@dataclass(frozen=True, eq=False)
class PencilTest:
    """Whether every eigenvalue can be reached from the inputs, or seen in the outputs.

    Attributes
    ----------
    eigenvalues
        One of each conjugate pair [rad/s].
    singular_values
        Of each eigenvalue: how well its least reachable (visible) eigenvector is reached (seen), 0 to 1.
    thresholds
        What rounding may make of a zero; the rounding of the eigenvector by its distance from the others.
    """

    eigenvalues: ComplexArray
    singular_values: Array
    thresholds: Array

    @property
    def holds(self) -> bool:
        """Whether all singular values are above their thresholds."""
        return bool(np.all(self.singular_values > self.thresholds))

    @property
    def failing(self) -> ComplexArray:
        """The eigenvalues at which it fails."""
        return self.eigenvalues[self.singular_values <= self.thresholds]


@dataclass(frozen=True, eq=False)
class Subspace:
    """The controllable subspace, or the observable one of the transposed system.

    Attributes
    ----------
    basis
        Orthonormal in the balanced states, shape (states, dimension).
    singular_values
        Of each direction, by which it stood out when it was found, relative to A; kept and dropped ones.
    threshold
        Between them.
    scales
        Of the balanced states.
    """

    basis: Array
    singular_values: Array
    threshold: float
    scales: Array

    @property
    def dimension(self) -> int:
        """Number of independent directions."""
        return self.basis.shape[1]

    @property
    def participation(self) -> Array:
        """How much of each state lies in the subspace: 1 all of it, 0 nothing, shape (states,)."""
        return np.asarray(np.linalg.norm(self.basis, axis=1))


@dataclass(frozen=True, eq=False)
class OutputTest:
    """Output controllability: the outputs that the inputs can move, by C on the controllable subspace and D.

    Attributes
    ----------
    singular_values
        Of [C V, D] with rows of C and columns of B of unit size, shape (outputs,).
    threshold
        What rounding may make of a zero.
    """

    singular_values: Array
    threshold: float

    @property
    def rank(self) -> int:
        """How many independent combinations of outputs can be moved; to be compared with the number of outputs."""
        return int(np.sum(self.singular_values > self.threshold))

    @property
    def holds(self) -> bool:
        """Whether every output can be moved on its own."""
        return self.rank == len(self.singular_values)


def balance(A: ArrayLike, B: ArrayLike, C: ArrayLike) -> Balanced:
    """Scale states, inputs and outputs so that no unit shows.

    States by powers of two that make the rows and columns of A equally large (LAPACK ``gebal``), then every group of states that
    A couples as a whole, so that inputs reach it as much as outputs see it; a group without inputs or outputs stays as it is.

    Raises
    ------
    SceneError
        If the shapes do not fit or a number is not finite.
    """
    system, inputs, outputs = (np.array(matrix, dtype=float, ndmin=2) for matrix in (A, B, C))
    count = len(system)
    if system.shape != (count, count) or len(inputs) != count or outputs.shape[1] != count:
        shapes = f"{system.shape}, {inputs.shape}, {outputs.shape}"
        raise SceneError(f"A, B, C: shapes do not fit (got {shapes}; allowed (n, n), (n, inputs), (outputs, n))")
    if not all(np.all(np.isfinite(matrix)) for matrix in (system, inputs, outputs)):
        raise SceneError("A, B, C: not finite (got nan or inf; allowed finite numbers)")
    _, (own, _) = matrix_balance(system, permute=False, separate=True)
    scales = _group_scales(system, _unit_columns(inputs / own[:, None]), _unit_columns((outputs * own).T).T) / own
    return Balanced(
        scales[:, None] * system / scales,
        _unit_columns(scales[:, None] * inputs),
        _unit_columns((outputs / scales).T).T,
        scales,
    )


def _group_scales(system: Array, inputs: Array, outputs: Array) -> Array:
    """Return a power of two for each group of coupled states that makes |B| and |C| equal in it."""
    number, groups = connected_components(system != 0.0, directed=False)
    scales = np.ones(len(system))
    for group in range(number):
        inside = groups == group
        entering, leaving = np.linalg.norm(inputs[inside]), np.linalg.norm(outputs[:, inside])
        if entering > 0.0 and leaving > 0.0:
            scales[inside] = 2.0 ** np.round(0.5 * np.log2(leaving / entering))
    return scales


def _unit_columns(matrix: Array) -> Array:
    lengths = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(lengths > 0.0, lengths, 1.0)


def controllable_modes(system: Balanced) -> PencilTest:
    """Return the pencil test of (A, B)."""
    return _pencil(system.A, system.B)


def observable_modes(system: Balanced) -> PencilTest:
    """Return the pencil test of (A, C), that of the transposed system."""
    return _pencil(system.A.T, system.C.T)


def _pencil(system: Array, inputs: Array) -> PencilTest:
    found = np.linalg.eigvals(system).astype(complex)
    eigenvalues = found[found.imag >= 0.0]
    eigenvalues = eigenvalues[np.argsort(np.abs(eigenvalues), kind="stable")]
    rounding = SAFETY * len(system) * float(np.finfo(float).eps)
    pairs = [_reached(system, inputs, value, rounding) for value in eigenvalues]
    return PencilTest(eigenvalues, np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs]))


def _reached(system: Array, inputs: Array, value: complex, rounding: float) -> tuple[float, float]:
    """Return the smallest singular value of W B for one eigenvalue, and what rounding of W makes of a zero."""
    left, sizes, _ = np.linalg.svd(system - value * np.eye(len(system)))
    noise = rounding * max(float(sizes[0]), np.finfo(float).tiny)
    null = min(len(sizes) - 1, int(np.sum(sizes > noise)))  # the smallest is zero by what an eigenvalue is
    vectors = left[:, null:]
    count = vectors.shape[1]
    reached = np.linalg.svd(vectors.conj().T @ inputs, compute_uv=False)
    smallest = float(reached[count - 1]) if inputs.shape[1] >= count else 0.0
    gap = float(sizes[null - 1]) if null else float(sizes[0])
    return smallest, min(1.0, noise / gap) if gap > 0.0 else rounding


def controllable_subspace(system: Balanced) -> Subspace:
    """Return an orthonormal basis of what the inputs can reach."""
    return _staircase(system.A, system.B, system.scales)


def observable_subspace(system: Balanced) -> Subspace:
    """Return an orthonormal basis of what the outputs see: the complement of the unobservable states."""
    return _staircase(system.A.T, system.C.T, 1.0 / system.scales)


def _staircase(system: Array, inputs: Array, scales: Array) -> Subspace:
    """Grow a basis from the range of B by A times its newest directions, with singular values for each decision."""
    size = max(float(np.linalg.norm(system, 2)), np.finfo(float).tiny)
    threshold = SAFETY * len(system) * float(np.finfo(float).eps)
    basis, found, newest = np.zeros((len(system), 0)), [], inputs
    while newest.shape[1] and basis.shape[1] < len(system):
        for _ in range(2):  # once more, for what rounding left
            newest = newest - basis @ (basis.T @ newest)
        directions, values, _ = np.linalg.svd(newest, full_matrices=False)
        found += values.tolist()
        kept = directions[:, values > threshold][:, : len(system) - basis.shape[1]]
        kept = np.linalg.qr(kept - basis @ (basis.T @ kept))[0] if kept.shape[1] else kept
        basis = np.hstack([basis, kept])
        newest = system @ kept / size
    return Subspace(basis, np.array(found), threshold, scales)


def output_controllability(system: Balanced, direct: ArrayLike | None = None) -> OutputTest:
    """Return how many outputs the inputs can bring anywhere at once.

    [C B, C A B, ..., D] has the range of [C V, D], V a basis of the controllable subspace. Its rank is to be compared with the
    number of outputs.

    Parameters
    ----------
    system
        Balanced.
    direct
        D, (outputs, inputs), in any units: only whether it vanishes counts; None for none.
    """
    reach = controllable_subspace(system)
    columns = [system.C @ reach.basis]
    if direct is not None:
        columns.append(_unit_columns(np.array(direct, dtype=float, ndmin=2)))
    joined = np.hstack(columns)
    outputs = len(system.C)
    values = np.zeros(outputs)
    found = np.linalg.svd(joined, compute_uv=False)
    values[: len(found)] = found[:outputs]
    return OutputTest(values, SAFETY * len(system.A) * float(np.finfo(float).eps))


def modal_coupling(system: Balanced) -> tuple[ComplexArray, Array, Array]:
    """Return eigenvalues (one of each pair), and how each input reaches and each output sees their motions.

    Returns
    -------
    tuple
        Eigenvalues; |w B| / |w|, shape (eigenvalues, inputs); |C x| / |x|, shape (eigenvalues, outputs), with left and right
        eigenvectors w and x (Hamdan and Nayfeh's measure); 0 none, 1 all.
    """
    values, right = np.linalg.eig(system.A)
    others, left = np.linalg.eig(system.A.T)
    order, other_order = _pairs(values), _pairs(others)
    reached = np.abs(left[:, other_order].T @ system.B)
    return values[order].astype(complex), reached, np.abs((system.C @ right[:, order]).T)


def _pairs(values: ComplexArray) -> NDArray[np.intp]:
    kept = np.flatnonzero(values.imag >= 0.0)
    return np.asarray(kept[np.lexsort((values[kept].imag, np.abs(values[kept])))])
