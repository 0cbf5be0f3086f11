"""The kernel gives what the loops before it gave (docs/decisions/0023-one-kernel.md), in every kind of scene.

``former_loops.npz`` was written by `tests.consistency.kernel_scenes` with the numpy loops of commit 515baf2.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.consistency.kernel_scenes import cases, variables

AGREEMENT = 1e-9  # of the largest value of the run
RESIDUALS = {"energy_residual": "bending_energy", "axial_energy_residual": "friction_dissipation"}  # differences of such
# The push at a rigid guide is a small difference of forces that alternate from step to step.
LOOSER = {("guides, dynamic", "push_force"): 1e-8}
# Where steps end at a node the loops gave the mean of the guides' forces over the step, the kernel gives those at the end.
AT_END = {f"guides, dynamic, {count} modes" for count in (2, 6)}
OF_GUIDES = {"push_force", "guide_force", "hub_force", "hub_moment"}


@cache
def former():
    """What the loops gave, by run and variable."""
    with np.load(Path(__file__).with_name("former_loops.npz")) as held:
        return dict(held)


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case.name)
def test_every_variable(case):
    found = variables(case)
    known = {key: values for key, values in found.items() if f"{case.name}/{key}" in former()}
    assert len(found) - len(known) <= 3  # the loops did not keep cutting, tip and axial force
    for key, values in known.items():
        if case.name in AT_END and key in OF_GUIDES:
            continue
        expected = former()[f"{case.name}/{key}"]
        scale = former()[f"{case.name}/{RESIDUALS.get(key, key)}"]
        allowed = LOOSER.get((case.name, key), AGREEMENT) * np.max(np.abs(scale), initial=1e-12)
        assert values.shape == expected.shape, key
        assert np.max(np.abs(values - expected), initial=0.0) <= allowed, key
