"""The steps of a run: between outputs and kinks, short behind kinks, and all of them shorter in a finer run."""

import numpy as np
import pytest

from fem_needle.dynamics.grid import HALVINGS, TimeGrid


def steps_of(grid):
    ends = [start + (end - start) * np.arange(1, count + 1) / count for start, end, count in grid.intervals()]
    return np.diff(np.concatenate([[0.0], *ends]))


def test_steps_behind_kinks_grow():
    grid = TimeGrid((0.0, 1.0, 2.0, 4.0), (1.0,), 0.5, is_graded=True)
    steps = steps_of(grid)
    assert np.sum(steps) == pytest.approx(4.0)
    assert grid.steps == len(steps) == 8 + 2 * HALVINGS
    graded = steps[: HALVINGS + 1]
    assert graded[0] == pytest.approx(0.5 * 2.0**-HALVINGS)
    assert graded[1:] / graded[:-1] == pytest.approx([1.0, *[2.0] * (HALVINGS - 1)])
    assert steps[HALVINGS + 1] == pytest.approx(0.5)


def test_a_finer_run_shortens_the_steps_that_are_short_already():
    coarse = TimeGrid((0.0, 1.0, 1.1, 2.0), (1.0,), 1.0)
    assert steps_of(coarse) == pytest.approx([1.0, 0.1, 0.9])
    finer = TimeGrid((0.0, 1.0, 1.1, 2.0), (1.0,), 0.5, coarser=coarse)
    assert steps_of(finer) == pytest.approx([0.5, 0.5, 0.05, 0.05, 0.45, 0.45])
    assert steps_of(TimeGrid((0.0, 1.0, 1.1, 2.0), (1.0,), 0.5)) == pytest.approx([0.5, 0.5, 0.1, 0.45, 0.45])
    assert finer.largest_step == 0.5
