from itertools import pairwise

import numpy as np
import pytest

from fem_needle.path import straight_path


def cubic(y):
    return 1e-3 + 0.02 * (y - 0.04) - 3.0 * (y - 0.04) ** 2 + 50.0 * (y - 0.04) ** 3


def cut(start=0.04, positions=(0.04, 0.045, 0.05, 0.06)):
    return straight_path(start).extended(list(positions), [cubic(y) for y in positions])


def at(path, *y):
    return path.value(np.array(y)).tolist()


def test_a_straight_path_is_zero_up_to_its_front():
    path = straight_path(0.04)
    assert path.deepest == 0.04
    assert at(path, -0.01, 0.0, 0.0399) == [0.0, 0.0, 0.0]
    assert at(path.seen_from(0.04, 2e-3), 0.0399, 0.04, 1.0) == [0.0, 2e-3, 2e-3]
    assert all(len(part) == 0 for part in path.points())


def test_a_piece_is_the_polynomial_through_four_points():
    y = np.linspace(0.04, 0.0599, 9)
    assert cut().value(y) == pytest.approx(cubic(y), rel=1e-12)
    assert cut().deepest == pytest.approx(0.06, abs=1e-17)


def test_the_path_jumps_at_the_initial_depth():
    below, above = at(cut(), np.nextafter(0.04, 0.0), 0.04)
    assert (below, above) == (0.0, pytest.approx(1e-3, rel=1e-14))


@pytest.mark.parametrize("count", [2, 3, 4])
def test_points_that_do_not_advance_are_left_out(count):
    positions = [0.04, 0.045, 0.05, 0.06][:count]
    doubled = [y for y in positions for _ in (0, 1)]
    once = straight_path(0.04).extended(positions, [cubic(y) for y in positions])
    twice = straight_path(0.04).extended(doubled, [cubic(y) for y in doubled])
    assert np.array_equal(once.coefficients, twice.coefficients)
    assert np.array_equal(once.edges, twice.edges)
    degree = np.flatnonzero(once.coefficients[0])[-1]
    assert degree == count - 1


def test_a_tip_that_does_not_advance_moves_only_the_front():
    path = cut()
    moved = path.extended([0.06, 0.06], [1.0, 2.0])
    assert moved.coefficients is path.coefficients
    assert at(moved, 0.06, 0.07) == [2.0, 2.0]


def test_a_needle_behind_the_deepest_point_does_not_move_the_front():
    path = cut()
    assert path.seen_from(0.05, 7.0) is path
    assert at(path.seen_from(0.06, 7.0), 0.06) == [7.0]


def test_earlier_pieces_stay_to_the_last_bit():
    path = cut()
    longer = path.extended([path.deepest, 0.07, 0.08], [3e-3, 4e-3, 2e-3])
    y = np.linspace(0.0, 0.0599, 50)
    assert np.array_equal(path.value(y), longer.value(y))
    assert at(longer, path.deepest, 0.07) == pytest.approx([3e-3, 4e-3], rel=1e-12)
    assert path.deepest == pytest.approx(0.06)  # the shorter one is as it was


def test_the_points_show_both_sides_of_the_jump_and_every_end():
    path = cut().extended([0.06, 0.07], [2e-3, 5e-3])
    y, rest = path.points()
    assert y == pytest.approx([0.04, 0.04, 0.06, 0.07], abs=1e-16)
    assert rest == pytest.approx([0.0, 1e-3, cubic(0.06), 5e-3], rel=1e-12)
    assert all(a <= b for a, b in pairwise(y))
