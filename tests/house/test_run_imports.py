"""A run loads what it computes with and no reader of its results."""

from tests.house.test_help_imports import HEAVY, loaded


def test_the_help_of_a_run_loads_nothing_heavy():
    assert not loaded("run", "--help") & HEAVY


def test_a_run_loads_no_reader_of_its_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    modules = loaded("run", "thesis", "--set", "insertion.final_depth=0.03", "--output-step", "0.5", "--elements", "4")
    assert {"scipy", "h5netcdf"} <= modules
    assert not modules & {"xarray", "pyvista", "vtk", "vtkmodules", "meshio", "matplotlib"}
    assert not modules & {"scipy.optimize", "scipy.integrate", "scipy.interpolate", "scipy.stats", "scipy.signal"}
