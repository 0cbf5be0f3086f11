"""What an inverse dynamics of second order would divide by has no limit under refinement; the static gain has."""

from itertools import pairwise

import pytest

from fem_needle import build_plant, load_scene
from fem_needle.analysis.depth_gains import tip_gains

FINGER, TIP = 0, -1


def accelerations(kind, size):
    """Return the accelerations of the tip per force of the finger and of the tip [1/kg], and the finger's static gain [m/N]."""
    key = "numerics.elements" if kind == "fem" else "model.modes"
    scene = load_scene("brachytherapy").with_values({"support.guides": [], "model.kind": kind, key: size})
    plant = build_plant(scene)
    points, operators = plant.points(0.05), plant.operators(0.05, 0.0)
    rows = points.rows[:, plant.prescribed :]
    moved = rows[TIP] @ operators.mass_factorization.solve(rows.T)
    return moved[FINGER], moved[TIP], tip_gains(plant, 0.05)[FINGER]


def test_elements():
    finger, tip, static = zip(*(accelerations("fem", size) for size in (5, 10, 20, 40, 80)), strict=True)
    assert finger == pytest.approx([1345, 311, -19.8, -0.0141, 1.33e-9], rel=5e-3)
    assert [after / before for before, after in pairwise(tip)] == pytest.approx([2.0] * 4, rel=1e-3)
    assert static == pytest.approx([static[-1]] * 5, rel=5e-4)


def test_modes():
    finger, tip, _ = zip(*(accelerations("assumed-modes", size) for size in (2, 4, 8, 16)), strict=True)
    assert finger == pytest.approx([2051, -4000, 4329, 3908], rel=1e-3)
    assert [after / before for before, after in pairwise(tip)] == pytest.approx([2.0] * 3, rel=1e-3)
