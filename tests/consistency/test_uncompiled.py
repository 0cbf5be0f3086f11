"""The kernel as plain Python gives what it gives compiled, and compiled with checks no index leaves its array."""

import os
import subprocess
import sys

import numpy as np
import pytest

from tests.consistency import kernel_scenes, small_runs
from tests.consistency.kernel_scenes import cases
from tests.house.source import ROOT

ROUNDINGS = 1e-11  # of the largest value of the run; compiled sums are reordered
OF_SIX_MODES = 1e-9  # that are nearly the same over the part in the tissue
DIFFERENCES = {"energy_residual": "tissue_energy", "axial_energy_residual": "friction_dissipation"}


def written(module, path, **settings):
    """What a module writes in a process of its own, by run and variable."""
    command = [sys.executable, "-m", module.__name__, str(path)]
    done = subprocess.run(command, env=os.environ | settings, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    with np.load(path) as held:
        return dict(held)


@pytest.fixture(scope="module")
def uncompiled(tmp_path_factory):
    return written(small_runs, tmp_path_factory.mktemp("uncompiled") / "runs.npz", NUMBA_DISABLE_JIT="1")


def scale_of(run, key):
    """The largest value of a variable, or of what it is a difference of."""
    sizes = [np.max(np.abs(np.asarray(run[name], dtype=float)), initial=1e-9) for name in {key, DIFFERENCES.get(key, key)}]
    return max(sizes)


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case.name)
def test_plain_python_gives_the_same(uncompiled, case):
    compiled = small_runs.variables(case)
    for key, values in compiled.items():
        found = uncompiled[f"{case.name}/{key}"]
        assert found.shape == np.shape(values), key
        allowed = (OF_SIX_MODES if case.modes > 2 else ROUNDINGS) * scale_of(compiled, key)
        assert np.max(np.abs(found - values), initial=0.0) <= allowed, key


@pytest.mark.slow
def test_no_index_leaves_its_array(tmp_path):
    found = written(kernel_scenes, tmp_path / "runs.npz", NUMBA_BOUNDSCHECK="1")
    assert len(found) > 20 * len(list(cases()))
