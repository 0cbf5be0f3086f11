"""The matching system against plain transfer matrices in 150 digits."""

import mpmath as mp
import numpy as np
import pytest

from fem_needle.exact.krylov import transition_matrices
from fem_needle.exact.matching import BeamProblem, solve_beam

DIGITS = 150  # exp(100) per piece, several pieces
LENGTH = 0.2


def mp_transition(modulus, distance):
    """Powers of the companion matrix of w'''' = -modulus w, exponentiated."""
    companion = mp.zeros(4)
    for row in range(3):
        companion[row, row + 1] = distance
    companion[3, 0] = -modulus * distance
    return mp.expm(companion, method="taylor")


def mp_states(problem):
    """States right of every break but the last, and left of the last, shape (n + 1, 4)."""
    count = problem.foundation_modulus.size
    stiffness = mp.mpf(problem.bending_stiffness)
    breaks = [mp.mpf(float(y)) for y in problem.breaks]
    carries = [
        mp_transition(mp.mpf(float(k)) / stiffness, breaks[i + 1] - breaks[i]) for i, k in enumerate(problem.foundation_modulus)
    ]
    matrix, right = mp.zeros(4 * count), mp.zeros(4 * count, 1)
    matrix[0, 0] = matrix[1, 1] = 1
    right[0], right[1] = mp.mpf(problem.clamp_deflection), mp.mpf(problem.clamp_slope)
    for i in range(1, count):
        row = 4 * i - 2
        matrix[row : row + 4, 4 * i - 4 : 4 * i] = carries[i - 1]
        matrix[row : row + 4, 4 * i : 4 * i + 4] = -mp.eye(4)
        if np.isinf(problem.point_stiffness[i]):
            matrix[row + 3, :] = mp.zeros(1, 4 * count)
            matrix[row + 3, 4 * i] = 1
        else:
            matrix[row + 3, 4 * i] -= mp.mpf(float(problem.point_stiffness[i])) / stiffness
            right[row + 3] = -mp.mpf(float(problem.point_force[i])) / stiffness
    matrix[4 * count - 2 :, 4 * count - 4 :] = carries[-1][2:, :]
    right[4 * count - 1] = -mp.mpf(float(problem.point_force[-1])) / stiffness
    solution = mp.lu_solve(matrix, right)
    last = carries[-1] * solution[4 * count - 4 :, :]
    values = [float(x) for x in solution] + [float(x) for x in last]
    return np.array(values).reshape(-1, 4)


def assert_deflection_and_sections(problem, section_tolerance=1e-10):
    with mp.workdps(DIGITS):
        expected = mp_states(problem)
    found = solve_beam(problem).state(problem.breaks)
    error = np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected), axis=0)
    assert error[0] < 1e-13
    assert np.all(error[1:] < section_tolerance)


def random_problem(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 6))
    breaks = np.sort(np.concatenate([[0.0, LENGTH], random.uniform(0.0, LENGTH, count - 1)]))
    modulus = 4.0 * 0.02 * (10.0 ** random.uniform(-3.0, 2.0, count) / LENGTH) ** 4
    modulus[random.random(count) < 0.3] = 0.0
    stiffness = random.choice([0.0, 0.0, 1e3, 1e6, np.inf], size=count + 1)
    stiffness[-1] = 0.0
    return BeamProblem(0.02, breaks, modulus, random.normal(size=count + 1), stiffness, 1e-3, 0.01)


@pytest.mark.parametrize("seed", range(12))
def test_random_beams(seed):
    assert_deflection_and_sections(random_problem(seed))


@pytest.mark.parametrize("gap", [1e-4, 1e-9])
@pytest.mark.parametrize("springs", [(0.0, 0.0), (np.inf, np.inf), (1e3, np.inf)])
def test_short_piece(gap, springs):
    breaks = np.array([0.0, 0.07, 0.07 + gap, LENGTH])
    stiffness = np.array([0.0, *springs, 0.0])
    force = np.array([0.0, 0.3, -0.2, 0.1])
    # the shear between two pins at a gap g is a moment over g: nothing is lost
    assert_deflection_and_sections(BeamProblem(0.02, breaks, np.array([0.0, 5e4, 5e4]), force, stiffness, 1e-3))


@pytest.mark.parametrize("moduli", [(1.0, 1e6), (1e6, 1.0), (0.0, 1e8)])
def test_large_jump_of_modulus(moduli):
    problem = BeamProblem(
        0.02,
        np.array([0.0, 0.05, LENGTH]),
        np.array(moduli),
        np.array([0.0, 1.0, 1.0]),
        np.zeros(3),
        1e-3,
        0.0,
    )
    assert_deflection_and_sections(problem)


@pytest.mark.parametrize("wave_lengths", [1e-8, 0.999, 1.001, 99.0, 101.0, 150.0])
def test_uniform_piece_of_any_length(wave_lengths):
    """Carried in one step, in many, and with independent ends beyond 100."""
    modulus = 4.0 * 0.02 * (wave_lengths / LENGTH) ** 4
    force = np.array([0.0, 0.1])
    problem = BeamProblem(0.02, np.array([0.0, LENGTH]), np.array([modulus]), force, np.zeros(2), 1e-3, 0.01)
    assert_deflection_and_sections(problem)


def test_inside_of_a_long_piece():
    """Between the ends of a piece of 300 wave lengths the decaying parts of both ends are there."""
    modulus = 4.0 * 0.02 * (300.0 / LENGTH) ** 4
    ends = np.array([0.0, 0.1])
    problem = BeamProblem(0.02, np.array([0.0, LENGTH]), np.array([modulus]), ends, np.zeros(2), 1e-3, 0.0)
    solution = solve_beam(problem)
    lam = 300.0 / LENGTH
    y = np.array([30.0, 39.0, 41.0, 45.0]) / lam
    from_clamp = 1e-3 * np.exp(-lam * y) * (np.cos(lam * y) + np.sin(lam * y))
    assert solution.state(y)[:, 0] == pytest.approx(from_clamp, rel=1e-9)
    from_tip = 2.0 * 0.1 * lam / modulus * np.exp(-lam * y) * np.cos(lam * y)
    assert solution.state(LENGTH - y)[:, 0] == pytest.approx(from_tip, rel=1e-9)


def test_transition_over_a_sum_is_the_product():
    first, second, both = (transition_matrices(81.0, x) for x in (0.1, 0.23, 0.33))
    assert second @ first == pytest.approx(both, rel=1e-13, abs=1e-13)


def test_pin_at_the_tip():
    """A propped cantilever under a force at its middle: the prop carries 5/16."""
    problem = BeamProblem(
        0.02,
        np.array([0.0, 0.5 * LENGTH, LENGTH]),
        np.zeros(2),
        np.array([0.0, 1.0, 0.0]),
        np.array([0.0, 0.0, np.inf]),
    )
    assert solve_beam(problem).shear_jump(LENGTH) == pytest.approx(-5.0 / 16.0, rel=1e-13)
