"""Piecewise uniform beams on foundations, put together by matching conditions at the breaks.

Every piece is carried by Krylov's series over steps that are short against the wave length of the beam on
its foundation; a piece so long that its ends do not feel each other keeps such steps at both ends and the two
decaying solutions between them. The states at all breaks are the unknowns of one banded system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from fem_needle.exact.krylov import (
    LONGEST_STEP,
    characteristic_number,
    decaying_states,
    krylov_functions,
    transition_matrices,
)

_LONG = 100.0  # lambda L beyond which the two ends of a piece are independent ...
_END_STEPS = 40  # ... after this many steps: exp(-40) = 4e-18
_HALF_BAND = 5
_MIRROR = np.array([1.0, -1.0, 1.0, -1.0])


@dataclass(frozen=True)
class BeamProblem:
    """A beam with piecewise uniform foundation, point supports and point forces.

    Parameters
    ----------
    bending_stiffness
        EI [N m^2].
    breaks
        Rising positions of the ends of the pieces [m], shape (n + 1,): clamp first, free tip last.
    foundation_modulus
        k of every piece [N/m^2], shape (n,).
    point_force
        Lateral force at every break [N], shape (n + 1,); the last is the tip force, the first is ignored.
    point_stiffness
        Spring at every break [N/m], shape (n + 1,); inf is a rigid pin; the first is ignored.
    clamp_deflection, clamp_slope
        w [m] and w' [rad] at the clamp.
    """

    bending_stiffness: float
    breaks: NDArray[np.float64]
    foundation_modulus: NDArray[np.float64]
    point_force: NDArray[np.float64]
    point_stiffness: NDArray[np.float64]
    clamp_deflection: float = 0.0
    clamp_slope: float = 0.0


@dataclass(frozen=True)
class Steps:
    """The pieces of a beam cut into steps over which a state can be carried.

    Parameters
    ----------
    start, length, relative_modulus
        Left end [m], length [m] and k / EI [1/m^4] of every step, shape (m,).
    independent
        True where the ends of the step do not feel each other, shape (m,).
    point_force, point_stiffness
        Lateral force [N] and spring [N/m] (inf: pin) at the left end of every step, shape (m,).
    """

    start: NDArray[np.float64]
    length: NDArray[np.float64]
    relative_modulus: NDArray[np.float64]
    independent: NDArray[np.bool_]
    point_force: NDArray[np.float64]
    point_stiffness: NDArray[np.float64]

    @property
    def carry(self) -> NDArray[np.float64]:
        """Matrices that carry the state over each step, (m, 4, 4); unity where the ends are independent."""
        return transition_matrices(self.relative_modulus, np.where(self.independent, 0.0, self.length))


@dataclass(frozen=True)
class BeamSolution:
    """Exact static state of a `BeamProblem`.

    Parameters
    ----------
    bending_stiffness
        EI [N m^2].
    steps
        Where the states are.
    states
        (w, w', w'', w''') at the right side of the left end of every step, shape (m, 4) [m, 1, 1/m, 1/m^2].
    ends
        The same at the left side of the right end of every step.
    """

    bending_stiffness: float
    steps: Steps
    states: NDArray[np.float64]
    ends: NDArray[np.float64]

    def state(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """State at positions [m] of shape (n,), that on the right at breaks; shape (n, 4)."""
        steps = self.steps
        index = np.clip(np.searchsorted(steps.start, position, side="right") - 1, 0, steps.start.size - 1)
        x = position - steps.start[index]
        modulus, far = steps.relative_modulus[index], steps.independent[index]
        carry = transition_matrices(modulus, np.where(far, 0.0, x))
        result = np.einsum("nij,nj->ni", carry, self.states[index])
        if np.any(far):
            at = index[far]
            result[far] = _between(modulus[far], self.states[at], self.ends[at], x[far], steps.length[at])
        return result

    @property
    def foundation_force(self) -> float:
        """Lateral force of the foundation on the beam, -int k w dy [N]."""
        steps = self.steps
        functions = krylov_functions(steps.relative_modulus, np.where(steps.independent, 0.0, steps.length))
        by_series = -steps.relative_modulus * np.einsum("mi,im->m", self.states, functions[1:])
        by_shear = self.ends[:, 3] - self.states[:, 3]  # EI w'''' = -k w
        return float(self.bending_stiffness * np.sum(np.where(steps.independent, by_shear, by_series)))

    def shear_jump(self, position: float) -> float:
        """Lateral force of everything at a break on the beam, the jump of EI w''' [N]."""
        index = int(np.searchsorted(self.steps.start, position))
        beyond = self.states[index, 3] if index < self.steps.start.size else 0.0
        return float(self.bending_stiffness * (beyond - self.ends[index - 1, 3]))


def solve_beam(problem: BeamProblem) -> BeamSolution:
    """Exact static solution of EI w'''' + k w = p with matching conditions at the breaks.

    Clamp: w and w' given. Break: w, w', w'' continuous, [EI w'''] = P - k_g w, or w = 0 at a rigid pin. Tip:
    w'' = 0, EI w''' = -P + k_g w, or w = 0.

    Parameters
    ----------
    problem
        The beam.

    Returns
    -------
    BeamSolution
        Its state everywhere.
    """
    steps = _cut(problem)
    carry = steps.carry
    count, stiffness = steps.start.size, problem.bending_stiffness
    rows = np.zeros((4 * count, 8))  # 4 i - 2 + j: condition j at break i, on states i - 1 and i
    sides = np.zeros(4 * count)
    sides[:2] = problem.clamp_deflection, problem.clamp_slope
    for index in range(1, count):
        block, side = _break_conditions(steps, carry, index, stiffness)
        rows[4 * index - 2 : 4 * index + 2], sides[4 * index - 2 : 4 * index + 2] = block, side
    rows[-2:, :4], sides[-1] = _tip_conditions(problem, carry[-1])
    states = _solve_banded(rows, sides, _scale(problem))
    ends = np.einsum("mij,mj->mi", carry, states)
    far = np.flatnonzero(steps.independent)
    ends[far] = states[far + 1]  # nothing acts there: the state is continuous
    return BeamSolution(stiffness, steps, states, ends)


def _break_conditions(
    steps: Steps, carry: NDArray[np.float64], index: int, bending_stiffness: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Conditions at an inner break on the states of the steps before and after it: shapes (4, 8), (4,)."""
    block, side = np.zeros((4, 8)), np.zeros(4)
    if steps.independent[index - 1]:
        lam = characteristic_number(steps.relative_modulus[index - 1])
        decay = np.array([[2 * lam**2, 2 * lam, 1, 0], [-4 * lam**3, -2 * lam**2, 0, 1]])
        block[:2, :4], block[2:, 4:] = decay, decay * _MIRROR
        return block, side
    block[:, :4], block[:, 4:] = carry[index - 1], -np.eye(4)
    if np.isinf(steps.point_stiffness[index - 1]):
        block[:, 0] = 0.0  # w is zero there; leaving it out keeps two close pins exact
    if np.isinf(steps.point_stiffness[index]):
        block[:, 4], block[3] = 0.0, 0.0
        block[3, 4] = 1.0
        return block, side
    block[3, 4] -= steps.point_stiffness[index] / bending_stiffness
    side[3] = -steps.point_force[index] / bending_stiffness
    return block, side


def _tip_conditions(problem: BeamProblem, carry: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Two conditions at the tip on the state of the last step, shape (2, 4), and the side of the second."""
    spring, stiffness = float(problem.point_stiffness[-1]), problem.bending_stiffness
    if np.isinf(spring):
        return carry[[2, 0]], 0.0
    shear = carry[3] - spring / stiffness * carry[0]
    return np.array([carry[2], shear]), -float(problem.point_force[-1]) / stiffness


def _scale(problem: BeamProblem) -> NDArray[np.float64]:
    """Powers of one length that make the entries of a state comparable, shape (4,)."""
    span = float(problem.breaks[-1] - problem.breaks[0])
    wave = float(np.max(characteristic_number(problem.foundation_modulus / problem.bending_stiffness)))
    return max(1.0 / span, wave) ** np.arange(4.0)


def _solve_banded(rows: NDArray[np.float64], sides: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve the matching system for the states, shape (m, 4); unknowns scaled, equations of unit size."""
    count = sides.size
    row = np.arange(count)
    first = np.maximum(4 * ((row + 2) // 4 - 1), 0)
    rows[:2] = 0.0
    rows[[0, 1], [0, 1]] = 1.0
    scaled = rows * np.tile(scale, 2)
    size = np.max(np.abs(scaled), axis=1)
    band = np.zeros((2 * _HALF_BAND + 1, count + 8))
    for offset in range(8):
        column = first + offset
        inside = (column < count) & (np.abs(row - column) <= _HALF_BAND)
        band[_HALF_BAND + (row - column)[inside], column[inside]] = (scaled[:, offset] / size)[inside]
    solution = solve_banded((_HALF_BAND, _HALF_BAND), band[:, :count], sides / size)
    return solution.reshape(-1, 4) * scale


def _between(
    modulus: NDArray[np.float64],
    first: NDArray[np.float64],
    last: NDArray[np.float64],
    x: NDArray[np.float64],
    length: NDArray[np.float64],
) -> NDArray[np.float64]:
    """State inside steps with independent ends: what decays from the left plus what decays from the right."""
    return decaying_states(modulus, first, x) + _MIRROR * decaying_states(modulus, last * _MIRROR, length - x)


def _cut(problem: BeamProblem) -> Steps:
    """Cut the pieces of a beam into steps."""
    modulus = problem.foundation_modulus / problem.bending_stiffness
    pieces = [
        _steps_of_piece(right - left, float(lam))
        for left, right, lam in zip(problem.breaks[:-1], problem.breaks[1:], characteristic_number(modulus), strict=True)
    ]
    counts = [length.size for length, _ in pieces]
    piece = np.repeat(np.arange(len(pieces)), counts)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    lengths = np.concatenate([length for length, _ in pieces])
    inner = np.concatenate([np.arange(count) > 0 for count in counts])
    travelled = np.cumsum(lengths) - lengths
    start = problem.breaks[piece] + np.where(inner, travelled - travelled[first][piece], 0.0)
    force, spring = np.zeros(start.size), np.zeros(start.size)
    force[first[1:]], spring[first[1:]] = problem.point_force[1:-1], problem.point_stiffness[1:-1]
    independent = np.concatenate([flag for _, flag in pieces])
    return Steps(start, lengths, modulus[piece], independent, force, spring)


def _steps_of_piece(length: float, lam: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Lengths of the steps of one piece, and whether the ends of each are independent."""
    if lam * length <= _LONG:
        count = max(1, int(np.ceil(lam * length / LONGEST_STEP)))
        return np.full(count, length / count), np.zeros(count, dtype=bool)
    near = np.full(_END_STEPS, LONGEST_STEP / lam)
    step = np.concatenate([near, [length - 2.0 * _END_STEPS * LONGEST_STEP / lam], near])
    return step, np.arange(step.size) == _END_STEPS
