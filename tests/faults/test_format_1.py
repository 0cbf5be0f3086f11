"""Files of format 1, as they were written once, keep opening."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from fem_needle import Trajectory, load_scene, read_measurements, run_scene
from fem_needle.export import FORMATS, export_run
from fem_needle.scene import Sinusoid, Table

FILES = Path(__file__).parent / "format_1"


@pytest.mark.parametrize(("name", "samples", "guides"), [("run", 6, 1), ("loop", 10, 1)])
def test_a_run_folder_opens(name, samples, guides, tmp_path):
    run = Trajectory.load(FILES / name)
    assert run.summary["final_tip_deflection"] == run.tip_deflection[-1] == run.station_deflection[-1, -1]
    assert run.summary["final_depth"] == run.depth[-1] == 0.1
    assert (len(run.time), run.arc_length.size, run.guide_force.shape) == (samples, 11, (samples, guides))
    assert (run.path_position.size > 2) == (name == "run")
    assert len(run.signals) == (6 if name == "loop" else 0)
    copy = shutil.copytree(FILES / name, tmp_path / name)
    for kind in FORMATS:
        assert all(path.exists() for path in export_run(Trajectory.load(copy), kind, copy))


def test_a_scene_with_its_table_and_its_mesh_opens_and_runs():
    scene = load_scene(FILES / "scene" / "scene.toml")
    assert scene.numerics.mesh == (0.0, 0.05, 0.1, 0.2)
    assert scene.insertion.speed == Table(time=(0.0, 5.0), value=(0.01, 0.01))
    assert scene.loads[0].force == Table(time=(0.0, 1.0), value=(0.0, 0.1))
    assert isinstance(scene.tissue.stiffness_factor, Sinusoid)
    assert scene.support.hub_deflection == Table(time=(0.0, 1.0, 2.0), value=(0.0, 0.001, 0.002))
    assert run_scene(scene).depth[-1] == 0.04


def test_measurements_open():
    data = read_measurements(FILES / "scene" / "measured.csv")
    np.testing.assert_allclose(data["depth"], [0.010, 0.011, 0.012])
    np.testing.assert_array_equal(data["push_force"], [0.5, 0.6, 0.7])


@pytest.mark.parametrize("name", ["run", "loop"])
def test_the_scene_of_a_run_folder_opens(name):
    assert load_scene(FILES / name / "scene.toml") == Trajectory.load(FILES / name).scene
