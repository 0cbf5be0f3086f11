"""Start-up is part of the user's waiting: help and scene lists load nothing heavy."""

import json
import subprocess
import sys

import pytest

HEAVY = {
    "scipy", "skfem", "vtk", "vtkmodules", "pyvista", "numba", "xarray", "matplotlib", "numpy", "h5py", "meshio",
    "plotly", "jinja2",
}  # fmt: skip
PROBE = """
import json, sys
from fem_needle.cli import main
sys.argv = ["fem-needle", *sys.argv[1:]]
try:
    main()
finally:
    print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})), file=sys.stderr)
"""


def loaded(*arguments: str) -> set[str]:
    done = subprocess.run([sys.executable, "-c", PROBE, *arguments], capture_output=True, text=True, check=True, timeout=60)
    return set(json.loads(done.stderr.splitlines()[-1]))


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), ("check", "--help"), ("scenes",)])
def test_help_loads_nothing_heavy(arguments):
    modules = loaded(*arguments)
    assert "typer" in modules
    assert not modules & HEAVY


def test_a_check_loads_no_numerics_beyond_numpy():
    modules = loaded("check", "thesis")
    assert "pydantic" in modules
    assert not modules & (HEAVY - {"numpy"})


def test_the_package_itself_loads_nothing():
    code = "import sys, fem_needle; print('pydantic' in sys.modules); fem_needle.Scene; print('pydantic' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == ["False", "True"]
