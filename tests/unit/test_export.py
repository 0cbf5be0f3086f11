"""Exports, each opened again with the tool that it is for."""

from __future__ import annotations

import csv
import errno
import keyword
import re
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista
from scipy.io import loadmat
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from fem_needle import Guide, Insertion, Scene, Support, Trajectory, load_scene, matlab_file, run_scene
from fem_needle.errors import ComputationError, SceneError
from fem_needle.export import FORMATS, export_run
from fem_needle.run_folder import load_run, save_run
from fem_needle.run_target import EXPORTS, RunTarget
from fem_needle.scene.table_file import read_table
from fem_needle.scene_file import parse_scene
from fem_needle.series_file import COORDINATES, FIELDS, described_values
from fem_needle.trajectory import VARIABLES
from tests.unit.scene.examples import entry_data, hub_scene

NUMERICS = {"analysis": "static", "elements": 8, "time_step": 0.5, "output_step": 0.5, "output_points": 41}


def scene() -> Scene:
    """Two guides, from 20 to 60 mm in 4 s."""
    return hub_scene(
        title='A "short", run',
        support=Support(kind="hub", guides=[Guide(position=-0.03, stiffness=2e3), Guide(position=-0.05)]),
        insertion=Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.06),
        numerics=NUMERICS,
    )


@pytest.fixture(scope="module")
def computed() -> Trajectory:
    return run_scene(scene())


@pytest.fixture
def folder(computed, tmp_path) -> Path:
    return save_run(computed, tmp_path / "run", vtk=False)


@pytest.fixture
def export(command_line):
    """Run `export`; return status, stdout, stderr."""
    return partial(command_line, "export")


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_csv(folder, computed, export):
    status, out, err = export(folder, "--format", "csv")
    assert (status, err) == (0, "")
    assert out.splitlines() == [f"wrote {folder / 'series.csv'}", f"wrote {folder / 'deflection.csv'}"]
    with (folder / "series.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    units = {"time": "s"} | {name: unit for name, (unit, _) in VARIABLES.items()} | {"guide_force_1": "N", "guide_force_2": "N"}
    assert header == [f"{name} [{unit}]" for name, unit in units.items()]
    columns = dict(zip(units, table.T, strict=True))
    np.testing.assert_array_equal(columns["time"], computed.time)
    for name in VARIABLES:
        np.testing.assert_array_equal(columns[name], getattr(computed, name))
    np.testing.assert_array_equal(columns["guide_force_2"], computed.guide_force[:, 1])
    assert np.any(columns["guide_force_2"] != columns["guide_force_1"])


def test_the_csv_of_the_deflection(folder, computed, export):
    assert export(folder, "--format", "csv")[0] == 0
    header, *rows = (folder / "deflection.csv").read_text().splitlines()
    assert header.startswith("time [s],0 [m],0.005 [m],")
    stations = [float(cell.removesuffix(" [m]")) for cell in header.split(",")[1:]]
    np.testing.assert_allclose(stations, computed.arc_length, rtol=1e-11)
    assert max(len(cell) for cell in header.split(",")) <= len("0.005 [m]")  # as in 0.015, not 0.015000000000000001
    table = np.array([row.split(",") for row in rows], dtype=float)
    np.testing.assert_array_equal(table, np.column_stack((computed.time, computed.station_deflection)))


def test_a_scene_reads_a_column_of_the_csv(folder, computed, export):
    assert export(folder, "--format", "csv")[0] == 0
    column = read_table("series.csv", "tip_deflection", folder)
    assert column == {"time": computed.time.tolist(), "value": computed.tip_deflection.tolist(), "unit": "m"}


def test_mat(folder, computed, export):
    status, out, err = export(folder, "--format", "mat")
    assert (status, out, err) == (0, f"wrote {folder / 'series.mat'}\n", "")
    found = {name: value for name, value in loadmat(folder / "series.mat").items() if not name.startswith("__")}
    assert set(found) == {*VARIABLES, *COORDINATES, *FIELDS, "units", "long_name", "title", "scene"}
    for name in found:
        assert re.fullmatch(r"[A-Za-z]\w{0,62}", name, flags=re.ASCII)
        assert not keyword.iskeyword(name)
    for name in ("time", *VARIABLES):
        np.testing.assert_array_equal(found[name], (computed.time if name == "time" else getattr(computed, name))[:, None])
    np.testing.assert_array_equal(found["deflection"], computed.station_deflection)
    np.testing.assert_array_equal(found["guide_force"], computed.guide_force)
    np.testing.assert_array_equal(found["arc_length"], computed.arc_length[:, None])
    np.testing.assert_array_equal(found["guide"], [[-0.03], [-0.05]])
    assert found["title"].item() == 'A "short", run'
    assert parse_scene(found["scene"].item()) == computed.scene


def test_the_structs_of_the_mat(folder, export):
    assert export(folder, "--format", "mat", "--out", folder / "deep" / "one.mat")[0] == 0
    found = loadmat(folder / "deep" / "one.mat", simplify_cells=True)
    expected = {name: (unit, meaning) for name, (unit, meaning) in VARIABLES.items()}
    for name, (unit, meaning) in expected.items():
        assert (found["units"][name], found["long_name"][name]) == (unit, meaning)
    assert set(found["units"]) == {*VARIABLES, *COORDINATES, *FIELDS}
    assert found["units"]["deflection"] == "m"


def test_a_mat_that_would_be_too_large(folder, monkeypatch, export):
    monkeypatch.setattr(matlab_file, "LARGEST", 8 * 9 * 41 - 1)
    status, out, err = export(folder, "--format", "mat")
    assert (status, out) == (1, "")
    assert "deflection is too large" in err
    assert not (folder / "series.mat").exists()


def frames_in_time(path: Path) -> list[tuple[float, pyvista.PolyData]]:
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    frames = []
    for time in times:
        reader.UpdateTimeStep(time)
        frames.append((time, pyvista.wrap(reader.GetOutputDataObject(0)).copy()))
    return frames


def test_vtkhdf_has_the_needle_of_every_time(folder, computed, export):
    status, out, err = export(folder, "--format", "vtkhdf")
    assert (status, out) == (0, f"wrote {folder / 'deflection.vtkhdf'}\n")
    assert "note: bending_moment and shear_force" in err
    found = frames_in_time(folder / "deflection.vtkhdf")
    assert [time for time, _ in found] == computed.time.tolist()
    for row, (_, needle) in enumerate(found):
        depth = computed.depth[row]
        np.testing.assert_array_equal(needle.lines, [41, *range(41)])
        np.testing.assert_allclose(needle.points[:, 0], np.linspace(depth - 0.2, depth, 41), rtol=0, atol=1e-15)
        np.testing.assert_array_equal(needle.points[:, 1:], 0.0)
        np.testing.assert_array_equal(needle["deflection"][:, 1], computed.station_deflection[row])
        np.testing.assert_array_equal(needle["deflection"][:, [0, 2]], 0.0)
    assert {"bending_moment", "shear_force", "tissue_reaction", "layer", "radius"} <= set(found[0][1].array_names)


def test_vtkhdf_says_what_it_is(folder, export):
    assert export(folder, "--format", "vtkhdf", "--out", folder / "x.vtkhdf")[0] == 0
    with h5py.File(folder / "x.vtkhdf") as file:
        root = file["VTKHDF"]
        assert (root.attrs["Type"], root.attrs["Version"].tolist()) == (b"PolyData", [2, 0])
        assert root["Steps"].attrs["NSteps"] == 9
        assert root["Points"].shape == (9 * 41, 3)
        assert root["Lines/Connectivity"].shape == (41,)


def test_vtkhdf_and_pvd_show_the_same(folder, export):
    assert export(folder, "--format", "vtkhdf")[0] == 0
    assert export(folder, "--format", "pvd")[0] == 0
    for row, (_, needle) in enumerate(frames_in_time(folder / "deflection.vtkhdf")):
        frame = pyvista.read(folder / f"needle/{row:06d}.vtp")
        assert set(frame.array_names) == set(needle.point_data)
        for name in frame.array_names:
            np.testing.assert_array_equal(needle[name], frame[name])


def test_pvd_of_a_run_without_frames(folder, computed, tmp_path, export):
    status, out, err = export(folder, "--format", "pvd")
    assert (status, out) == (0, f"wrote {folder / 'deflection.pvd'}\n")
    assert "spline through the stations" in err
    whole = save_run(computed, tmp_path / "whole")
    again, first = (pyvista.PVDReader(path / "deflection.pvd") for path in (folder, whole))
    np.testing.assert_array_equal(again.time_values, computed.time)
    assert [item.path for item in again.datasets] == [item.path for item in first.datasets]
    for row in range(len(computed.time)):
        rebuilt, exact = (pyvista.read(path / f"needle/{row:06d}.vtp") for path in (folder, whole))
        for name in ("deflection", "tissue_reaction", "layer", "radius"):
            np.testing.assert_array_equal(rebuilt[name], exact[name])
        assert (folder / f"tissue/{row:06d}.vtu").read_bytes() == (whole / f"tissue/{row:06d}.vtu").read_bytes()


def worst(rebuilt: list[np.ndarray], exact: list[np.ndarray]) -> float:
    return float(np.max(np.abs(np.array(rebuilt) - exact)) / np.max(np.abs(exact)))


@pytest.mark.parametrize(
    ("name", "moment", "shear"),
    [("thesis", 4e-3, 0.05), ("bench-m2", 4e-3, 0.05), ("bench-d", 4e-3, None), ("misra-2010", 0.05, None)],
)
def test_how_good_rebuilt_moments_are(tmp_path, export, name, moment, shear):
    """As docs/contract.md says; the frames of the run itself are the reference."""
    given = load_scene(name)
    run = run_scene(given, elements=32, output_step=given.duration / 5, tolerance=1e-2)
    folder = save_run(run, tmp_path / "run")
    assert export(folder, "--format", "pvd", "--out", tmp_path / "again")[0] == 0
    names = [f"needle/{row:06d}.vtp" for row in range(len(run.time))]
    frames = [[pyvista.read(path / name) for name in names] for path in (tmp_path / "again", folder)]
    for array, limit in (("bending_moment", moment), ("shear_force", shear)):
        rebuilt, exact = ([frame[array] for frame in side] for side in frames)
        assert np.max(np.abs(exact)) > 0
        assert limit is None or 0 < worst(rebuilt, exact) < limit


def test_a_loaded_run_under_a_hub_bends_from_the_hub_on(folder, computed):
    """A station at the clamp counts: the slope of a hub that is held straight is 0 there."""
    loaded = load_run(folder)
    slope = loaded.deflection(np.array([0.0, 0.2]), derivative=1)
    assert np.max(np.abs(slope[:, 0])) < 1e-2 * np.max(np.abs(slope[:, 1]))
    np.testing.assert_allclose(loaded.deflection(computed.arc_length), computed.station_deflection, rtol=1e-12, atol=1e-15)


def test_a_surface_at_a_station_has_no_moment_outside():
    scene = Scene.from_dict(entry_data(numerics=NUMERICS | {"output_points": 21}, loads=[{"kind": "tip", "force": 0.1}]))
    run = run_scene(scene)
    loaded = Trajectory(**{**vars(run), "plant": None})
    stations = np.array([0.05, 0.1 - 1e-9, 0.1 + 1e-9])
    moment = 0.0256 * loaded.deflection(stations, derivative=2)[0]
    assert moment[:2].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(moment[2], 0.0256 * run.deflection(stations, derivative=2)[0, 2], rtol=1e-2)


@pytest.mark.parametrize("kind", FORMATS)
def test_nothing_is_overwritten_without_force(folder, export, kind):
    assert export(folder, "--format", kind)[0] == 0
    before = contents(folder)
    status, out, err = export(folder, "--format", kind)
    assert (status, out) == (2, "")
    assert "--force" in err
    assert contents(folder) == before
    target = folder / {"csv": "deflection.csv", "mat": "series.mat", "vtkhdf": "deflection.vtkhdf", "pvd": "deflection.pvd"}[kind]
    target.write_text("old")
    assert export(folder, "--format", kind, "--force")[0] == 0
    assert target.read_bytes() != b"old"
    assert set(contents(folder)) == set(before)


def test_force_drops_frames_of_an_older_export_and_nothing_else(folder, tmp_path, export):
    out = tmp_path / "frames"
    assert export(folder, "--format", "pvd", "--out", out)[0] == 0
    (out / "needle" / "000099.vtp").write_text("old")
    (out / "needle" / "notes.txt").write_text("mine")
    assert export(folder, "--format", "pvd", "--out", out, "--force")[0] == 0
    assert not (out / "needle" / "000099.vtp").exists()
    assert (out / "needle" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("force", [True, False])
def test_frames_of_something_else_stay(folder, tmp_path, export, force):
    (tmp_path / "other" / "needle").mkdir(parents=True)
    (tmp_path / "other" / "needle" / "mine.vtp").write_text("precious")
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "needle").symlink_to(tmp_path / "other" / "needle")
    for name in ("other", "linked"):
        status, out, err = export(folder, "--format", "pvd", "--out", tmp_path / name, *(["--force"] if force else []))
        assert (status, out) == (2, "")
        assert "left as" in err
    assert (tmp_path / "other" / "needle" / "mine.vtp").read_text() == "precious"


def test_a_place_that_cannot_be(folder, tmp_path, export):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "taken.mat").mkdir()
    for kind, place in (("csv", "file"), ("pvd", "file/deeper"), ("mat", "taken.mat"), ("mat", "file/x.mat"), ("csv", "x" * 300)):
        status, out, err = export(folder, "--format", kind, "--out", tmp_path / place, "--force")
        assert (status, out, "Traceback" in err) == (2, "", False)
        assert "cannot be written" in err
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("kind", FORMATS)
def test_a_full_disk(folder, monkeypatch, export, kind):
    def full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    status, out, err = export(folder, "--format", kind)
    assert (status, out) == (1, "")
    assert "No space left" in err
    assert "Traceback" not in err


def test_a_run_that_is_replaced_leaves_no_export_of_the_old_one(folder, computed, export):
    for kind in FORMATS:
        assert export(folder, "--format", kind)[0] == 0
    assert set(EXPORTS) <= set(contents(folder))
    RunTarget(folder, force=True).create()
    assert set(contents(folder)) == {"manifest.json"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("--format", "xdmf"), "allowed pvd, vtkhdf, csv, mat"), ((), "--format"), (("--format",), "--format")],
)
def test_a_format_that_is_none(folder, export, arguments, message):
    status, out, err = export(folder, *arguments)
    assert (status, out, "Traceback" in err) == (2, "", False)
    assert message in err


def test_an_unknown_format_in_python(computed, tmp_path):
    with pytest.raises(SceneError, match="format: is not a choice"):
        export_run(computed, "xdmf", tmp_path)


def test_only_a_run_folder_is_exported(tmp_path, export):
    for place in (tmp_path, tmp_path / "missing", Path(__file__)):
        status, out, err = export(place, "--format", "csv")
        assert (status, out) == (2, "")
        assert "is no run folder" in err


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_truncated_series(folder, export, share):
    content = (folder / "series.nc").read_bytes()
    (folder / "series.nc").write_bytes(content[: int(share * len(content))])
    status, out, err = export(folder, "--format", "csv")
    assert (status, out) == (2, "")
    assert "the run is not complete" in err
    assert len(err.splitlines()) == 1


def test_damaged_series(folder, export):
    """Any byte may be wrong: an error in one line, or numbers."""
    content, random = (folder / "series.nc").read_bytes(), np.random.default_rng(3)
    statuses = set()
    for _ in range(40):
        broken = bytearray(content)
        for place in random.integers(0, len(content), 5):
            broken[place] ^= 0x55
        (folder / "series.nc").write_bytes(bytes(broken))
        status, _, err = export(folder, "--format", "csv", "--force")
        assert len(err.splitlines()) == (status == 2)
        statuses.add(status)
    assert 2 in statuses <= {0, 2}


@pytest.mark.parametrize("name", ["time", "depth", "deflection", "guide_force"])
def test_series_that_do_not_belong_together(folder, export, name):
    with h5py.File(folder / "series.nc", "r+") as file:
        values = file[name][:-1]
        del file[name]
        file[name] = values
    status, out, err = export(folder, "--format", "mat")
    assert (status, out) == (2, "")
    assert "wrong shape" in err


@pytest.mark.parametrize("text", ["", "x = {", "[]"])
@pytest.mark.parametrize("file", ["summary.json", "scene.toml", "manifest.json"])
def test_other_broken_files_of_a_run(folder, export, file, text):
    (folder / file).write_text(text)
    status, out, err = export(folder, "--format", "csv")
    assert (status, out, "Traceback" in err) == (2, "", False)
    assert err.startswith("error: ")


def test_what_is_described_is_what_the_run_holds(computed):
    described = described_values(computed)
    assert set(described) == {*VARIABLES, *COORDINATES, *FIELDS}
    sizes = {"time": 9, "arc_length": 41, "guide": 2}
    for dimensions, _, _, values in described.values():
        assert values.shape == tuple(sizes.get(name, 0) for name in dimensions)


def test_an_error_in_writing_is_a_failed_computation(computed, tmp_path, monkeypatch):
    def full(path: Path, content: bytes) -> int:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(ComputationError, match="Read-only"):
        export_run(computed, "mat", tmp_path / "x.mat")
    assert list(tmp_path.iterdir()) == []
