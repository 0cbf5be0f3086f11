"""The stiffness matrix of a point: exact data, coverage, curl, softening; and what it says of moduli."""

import numpy as np
import pytest

from fem_needle import SceneError
from fem_needle.exact import InfiniteBeam, SemiInfiniteBeam
from fem_needle.identification import (
    StiffnessMatrix,
    beam_foundation_modulus,
    beam_modulus_of_point,
    beam_point_stiffness,
    eight_directions,
    identify_softening,
    identify_stiffness,
    indented_modulus,
    rod_modulus_of_point,
)
from reduced_model.thesis_data import TABLE_II

MATRIX = np.array([[1260.0, 40.0], [-100.0, 1010.0]])
FORCES = eight_directions(1.1, 3)
MOVED = FORCES @ np.linalg.inv(MATRIX).T


def matrix_of(row):
    return StiffnessMatrix(1e3 * np.array([[row.k_xx, row.k_xz], [row.k_zx, row.k_zz]]))


def test_eight_directions():
    forces = eight_directions(2.0)
    assert np.hypot(*forces.T) == pytest.approx(np.full(8, 2.0))
    assert forces[[0, 2]] == pytest.approx(np.array([[2.0, 0.0], [0.0, 2.0]]))
    assert forces.sum(axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("noise_in", ["force", "displacement"])
def test_exact_data_and_an_offset_of_the_sensor(noise_in):
    found = identify_stiffness(MOVED, FORCES + np.array([0.05, -0.03]), noise_in=noise_in)
    assert found.stiffness.matrix == pytest.approx(MATRIX)


@pytest.mark.parametrize("noise_in", ["force", "displacement"])
def test_intervals_cover_the_truth(noise_in):
    random, held = np.random.default_rng(3), np.zeros(3)
    for _ in range(400):
        moved, forces = MOVED.copy(), FORCES.copy()
        if noise_in == "force":
            forces += 0.05 * random.standard_normal(forces.shape)
        else:
            moved += 5e-5 * random.standard_normal(moved.shape)
        found = identify_stiffness(moved, forces, noise_in=noise_in)
        estimates = (found.combination({"k_zz": 1.0}), found.curl, found.anisotropy)
        for index, (one, true) in enumerate(zip(estimates, (1010.0, 140.0, 250.0), strict=True)):
            held[index] += one.interval()[0] < true < one.interval()[1]
    assert np.all((held / 400 >= 0.90) & (held / 400 <= 0.99))


def test_noise_on_the_right_hand_side_makes_a_stiffness_too_small():
    """Displacements with noise s on a mean square D^2: forces on displacements give K / (1 + s^2 / D^2)."""
    random, forces = np.random.default_rng(0), eight_directions(1.0, 400)
    noise = 3e-4
    moved = forces / 1000.0 + noise * random.standard_normal(forces.shape)
    wrong = identify_stiffness(moved, forces, noise_in="force").stiffness.matrix[1, 1]
    right = identify_stiffness(moved, forces, noise_in="displacement").stiffness.matrix[1, 1]
    assert wrong == pytest.approx(1000.0 / (1.0 + noise**2 / 0.5e-6), rel=0.02)
    assert right == pytest.approx(1000.0, rel=0.02)


def test_a_spring_passes_the_test_of_its_curl_and_a_curl_does_not():
    """At 5 % a spring is taken for none in about 5 % of 400 experiments, the curl of 140 N/m never for a spring's."""
    random, alarms, missed = np.random.default_rng(5), 0, 0
    for _ in range(400):
        noise = 0.02 * random.standard_normal(FORCES.shape)
        alarms += identify_stiffness(MOVED, MOVED @ np.diag([1260.0, 1010.0]) + noise).curl.p_value() < 0.05
        missed += identify_stiffness(MOVED, FORCES + noise).curl.p_value() > 0.05
    assert 0.02 <= alarms / 400 <= 0.09
    assert missed == 0


def test_parts_and_the_work_over_a_closed_path():
    found = StiffnessMatrix(MATRIX)
    assert found.symmetric + found.antisymmetric == pytest.approx(MATRIX)
    assert found.symmetric == pytest.approx(found.symmetric.T)
    assert found.principal == pytest.approx(np.sort(np.linalg.eigvals(found.symmetric)))
    angle, radius = np.linspace(0.0, 2.0 * np.pi, 2001), 2e-3
    path = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    middle = 0.5 * (path[1:] + path[:-1])
    work = float(np.sum((middle @ MATRIX.T) * np.diff(path, axis=0)))
    assert found.closed_path_work(np.pi * radius**2) == pytest.approx(work, rel=1e-4)
    assert StiffnessMatrix(found.symmetric).closed_path_work(1.0) == 0.0


def test_the_curl_of_table_two():
    found = [matrix_of(row).relative_curl for row in TABLE_II]
    assert found == pytest.approx([0.139, 0.173, 0.174, 0.185, 0.202], abs=1e-3)
    assert all(np.all(matrix_of(row).principal > 0.0) for row in TABLE_II)


def test_table_two_softens():
    forces, stiffness = [row.force for row in TABLE_II], [1e3 * row.k_zz for row in TABLE_II]
    for deviations in (None, [row.deviation_zz for row in TABLE_II]):
        found = identify_softening(forces, stiffness, deviations)
        assert found.verdict == "softens"
        assert found.exponent.value == pytest.approx(-2.1, abs=0.15)
        assert found.tangent_share == pytest.approx(1 / 3.1, abs=0.02)


def test_the_tangent_of_a_power_law():
    """k = c f^n is d = f^(1 - n) / c; its slope by finite differences."""
    forces = np.array([0.5, 1.0, 1.5, 2.0])
    found = identify_softening(forces, 800.0 * forces**-0.7)
    f, step = 1.2, 1e-6
    tangent = 2 * step / ((f + step) ** 1.7 - (f - step) ** 1.7) * 800.0
    assert found.tangent_share * 800.0 * f**-0.7 == pytest.approx(tangent, rel=1e-6)


def test_a_linear_spring_and_one_that_stiffens():
    forces, random = np.linspace(1.0, 2.0, 12), np.random.default_rng(9)
    scatter = np.exp(0.05 * random.standard_normal(12))
    assert identify_softening(forces, 700.0 * scatter).verdict == "linear"
    assert identify_softening(forces, 700.0 * scatter * forces).verdict == "stiffens"


def test_point_stiffness_of_beams_agrees_with_the_exact_solutions():
    k, bending = 5e3, 0.0157
    end = 1.0 / SemiInfiniteBeam(bending_stiffness=bending, foundation_modulus=k, force=1.0).tip_deflection
    middle = 1.0 / float(InfiniteBeam(bending_stiffness=bending, foundation_modulus=k, force=1.0).deflection(0.0))
    assert beam_point_stiffness(k, bending, "end") == pytest.approx(end)
    assert beam_point_stiffness(k, bending, "middle") == pytest.approx(middle)
    for place, stiffness in (("end", end), ("middle", middle)):
        assert beam_modulus_of_point(stiffness, bending, place) == pytest.approx(k)


def test_moduli_by_hand():
    assert indented_modulus(520.0, 2e-3) == pytest.approx(0.75 * 520.0 / 4e-3)
    assert rod_modulus_of_point(520.0, 0.1) == pytest.approx(5200.0)
    # E b^4 / EI = 1: the twelfth root is one as well
    assert beam_foundation_modulus(1e5, 1e-2, 1e-3, 0.0) == pytest.approx(0.65e5)
    assert beam_foundation_modulus(1e5, 1e-2, 1e-3 / 4096.0, 0.5) == pytest.approx(2.0 * 0.65e5 / 0.75)


def test_wrong_input():
    with pytest.raises(SceneError, match="two columns"):
        identify_stiffness(np.ones((4, 3)), np.ones((4, 3)))
    with pytest.raises(SceneError, match="apart"):
        identify_stiffness(np.outer(np.arange(6.0), [1.0, 2.0]), np.ones((6, 2)))
    with pytest.raises(SceneError, match="noise_in"):
        identify_stiffness(MOVED, FORCES, noise_in="both")
    with pytest.raises(SceneError, match="positive"):
        identify_softening([1.0, 2.0, 3.0], [1.0, 0.0, 2.0])
    with pytest.raises(SceneError, match="3 or more"):
        identify_softening([1.0, 2.0], [1.0, 2.0])
    with pytest.raises(SceneError, match="contact_radius"):
        indented_modulus(520.0, 0.0)
    with pytest.raises(SceneError, match="poisson_ratio"):
        indented_modulus(520.0, 1e-3, 0.7)
    with pytest.raises(SceneError, match="place"):
        beam_point_stiffness(1e3, 0.01, "hub")
