"""Pushes as people read them."""

import pytest

from fem_needle.display import in_newtons


@pytest.mark.parametrize(
    ("force", "shown"), [(-3.402e-6, "0 N"), (9.9e-6, "0 N"), (1e-5, "1e-05 N"), (-0.56249, "-0.5625 N"), (0.0, "0 N")]
)
def test_a_push_that_nobody_measures_is_none(force, shown):
    assert in_newtons(force) == shown
