"""Run folders: what is in them, who can read them, and what is left of a run that breaks off."""

from __future__ import annotations

import errno
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import pyvista
import xarray

from fem_needle import FiniteElementNeedle, Insertion, Scene, Support, load_scene, run_scene
from fem_needle.atomic_file import json_bytes
from fem_needle.dynamics import engine
from fem_needle.errors import ComputationError, SceneError
from fem_needle.run_folder import RunFolderWriter, load_run, save_run
from fem_needle.run_target import RunTarget
from fem_needle.simulation import simulate
from fem_needle.trajectory import VARIABLES, Trajectory
from tests.unit.scene.examples import entry_data, hub_scene

HOLD = Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.06)  # 4 s
STATIC = {"numerics": {"analysis": "static", "elements": 8, "time_step": 0.5, "output_step": 0.5, "output_points": 11}}


@pytest.fixture(autouse=True)
def _short_calls(monkeypatch):
    """Let the kernel give its samples one by one: so short a run would be over in one call."""
    monkeypatch.setattr(engine, "NUMBERS_OF_A_CALL", 1)


def short_scene(**changes) -> Scene:
    return hub_scene(title="A [short] run", insertion=HOLD, **(STATIC | changes))


class Stops:
    """Passes everything on to a writer and raises after some samples."""

    def __init__(self, writer, after, error):
        self.writer, self.after, self.error, self.seen = writer, after, error, 0

    def begin(self, plant, choice):
        self.writer.begin(plant, choice)

    def progress(self, fraction):
        if self.seen >= self.after:
            raise self.error

    def samples(self, block):
        self.writer.samples(block)
        self.seen += len(block)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[Trajectory, Path]:
    folder = tmp_path_factory.mktemp("runs") / "one"
    writer = RunFolderWriter(RunTarget(folder), warnings=["odd"])
    run = writer.finish(run_scene(short_scene(), observer=writer))
    return run, folder


def frames_of(folder: Path) -> list[str]:
    reader = pyvista.PVDReader(folder / "deflection.pvd")
    files = [dataset.path for dataset in reader.datasets]
    for file in files:
        assert pyvista.read(folder / file).n_points > 0
    return files


def leftovers(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob("*") if path.name.startswith(".") or path.suffix == ".tmp"]


def test_a_run_folder_holds_what_the_contract_says(written):
    run, folder = written
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["deflection.pvd", "manifest.json", "needle", "scene.toml", "series.nc", "summary.json", "tissue"]
    assert len(run.time) == len(list((folder / "needle").iterdir())) == len(list((folder / "tissue").iterdir())) == 9
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["folder"] == str(folder.resolve())
    assert summary["final_tip_deflection"] == run.tip_deflection[-1] != 0
    assert summary["warnings"] == ["odd"]
    assert summary["stop_reason"] == "final-depth"
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["format"] == 1
    assert {"python", "numpy", "scipy", "scikit-fem", "fem-needle"} <= set(manifest["versions"])
    assert manifest["seed"] == 0
    assert manifest["wall_time"] == summary["wall_time"] > 0


def test_the_scene_in_the_folder_is_complete_and_repeats_the_run(written):
    run, folder = written
    assert tomllib.loads((folder / "scene.toml").read_text())["numerics"]["tolerance"] == 1e-3
    again = load_scene(folder / "scene.toml")
    assert again == run.scene
    np.testing.assert_array_equal(run_scene(again).tip_deflection, run.tip_deflection)


def test_the_scene_has_the_settings_of_the_run_not_of_the_plant(tmp_path):
    plant = FiniteElementNeedle(short_scene(), elements=4)
    writer = RunFolderWriter(RunTarget(tmp_path / "one"), vtk=False)
    writer.finish(simulate(plant, output_step=1.0, observer=writer))
    assert load_scene(tmp_path / "one" / "scene.toml").numerics.output_step == 1.0


DIMENSIONS = dict.fromkeys(VARIABLES, ("time",)) | {
    "time": ("time",),
    "arc_length": ("arc_length",),
    "guide": ("guide",),
    "load": ("load",),
    **dict.fromkeys(("deflection", "bending_moment", "shear_force", "curvature", "bending_stress"), ("time", "arc_length")),
    "guide_force": ("time", "guide"),
    "lateral_force": ("time", "load"),
    "path_position": ("path_position",),
    "path_deflection": ("path_position",),
}


def with_netcdf4(path):
    with netCDF4.Dataset(path) as file:
        return {n: (v.dimensions, v.units, v.long_name, np.ma.getdata(v[...])) for n, v in file.variables.items()}


def with_xarray(path):
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        data.load()
    return {n: (v.dims, v.attrs["units"], v.attrs["long_name"], v.values) for n, v in data.variables.items()}


@pytest.mark.parametrize("read", [with_netcdf4, with_xarray])
def test_the_series_opens_elsewhere_with_units_and_names(written, read):
    run, folder = written
    found = read(folder / "series.nc")
    assert {name: about[0] for name, about in found.items()} == DIMENSIONS
    assert all(unit and meaning for _, unit, meaning, _ in found.values())
    assert found["tip_deflection"][1] == "m"
    for name in VARIABLES:
        np.testing.assert_array_equal(found[name][3], getattr(run, name))
    np.testing.assert_array_equal(found["time"][3], run.time)
    np.testing.assert_array_equal(found["deflection"][3], run.station_deflection)
    np.testing.assert_array_equal(found["guide_force"][3], run.guide_force)
    np.testing.assert_array_equal(found["guide"][3], [-0.03])
    np.testing.assert_allclose(found["arc_length"][3][[0, -1]], [0.0, 0.2])


def test_h5py_reads_compressed_values_and_their_scales(written):
    run, folder = written
    with h5py.File(folder / "series.nc") as file:
        deflection = file["deflection"]
        np.testing.assert_array_equal(deflection[...], run.station_deflection)
        assert deflection.compression == "gzip"
        assert [scale[0].name for scale in deflection.dims] == ["/time", "/arc_length"]
        assert all({"units", "long_name"} <= set(item.attrs) for item in file.values())


@pytest.mark.parametrize("read", [with_netcdf4, with_xarray])
def test_a_needle_without_guides_has_an_empty_dimension(tmp_path, read):
    scene = Scene.from_dict(entry_data(numerics=STATIC["numerics"]))
    folder = save_run(run_scene(scene), tmp_path / "one", vtk=False)
    assert read(folder / "series.nc")["guide_force"][3].shape == (3, 0)
    assert load_run(folder).guide_force.shape == (3, 0)


def test_saving_and_loading(written, tmp_path):
    run, _ = written
    folder = run.save(tmp_path / "copy")
    loaded = Trajectory.load(folder)
    assert loaded.scene == run.scene
    for name in VARIABLES:
        np.testing.assert_array_equal(getattr(loaded, name), getattr(run, name))
    np.testing.assert_array_equal(loaded.deflection(), run.deflection())
    assert loaded.summary == run.summary | {"folder": str(folder), "warnings": ["odd"]}
    assert len(frames_of(folder)) == 18
    with pytest.raises(SceneError, match="--force"):
        run.save(folder)
    run.save(folder, force=True)
    again = loaded.save(tmp_path / "again")  # from the stations: no model is there
    assert len(frames_of(again)) == 18


def test_a_killed_run_leaves_what_was_computed(tmp_path):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    stops = Stops(writer, 4, RuntimeError())
    with pytest.raises(RuntimeError):
        run_scene(short_scene(), observer=stops)
    assert 4 <= stops.seen < 9
    assert len(frames_of(tmp_path / "one")) == 2 * stops.seen
    assert leftovers(tmp_path) == []
    writer._release()  # as the end of the process does
    with pytest.raises(SceneError, match="not complete"):
        load_run(tmp_path / "one")


@pytest.mark.parametrize("name", ["series.nc", "summary.json"])
def test_a_run_without_one_of_its_files_names_it(tmp_path, name):
    folder = run_scene(short_scene()).save(tmp_path / "one")
    (folder / name).unlink()
    with pytest.raises(SceneError, match=f"the run is not complete: no {name}"):
        load_run(folder)


def test_a_study_is_no_run_and_says_what_it_is(tmp_path):
    folder = run_scene(short_scene()).save(tmp_path / "one")
    (folder / "compare.json").write_text("{}")
    with pytest.raises(SceneError, match=r"holds a study \(compare\), not a run; 'fem-needle report' shows it"):
        load_run(folder)


def test_an_interrupted_run_is_complete_as_far_as_it_got(tmp_path):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    run = writer.finish(run_scene(short_scene(), observer=Stops(writer, 4, KeyboardInterrupt())))
    loaded = load_run(tmp_path / "one")
    assert loaded.summary["stop_reason"] == "interrupted"
    assert len(loaded.time) == len(run.time) >= 4
    reader = pyvista.PVDReader(tmp_path / "one" / "deflection.pvd")
    np.testing.assert_array_equal(reader.time_values, loaded.time)
    assert len(frames_of(tmp_path / "one")) == 2 * len(loaded.time)


def test_frames_beyond_the_rows_of_the_series_are_dropped(tmp_path):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    run = run_scene(short_scene(), observer=writer)
    cut = replace(
        run,
        time=run.time[:3],
        series={name: values[:3] for name, values in run.series.items()},
        guide_force=run.guide_force[:3],
        lateral_force=run.lateral_force[:3],
        station_deflection=run.station_deflection[:3],
        samples=run.samples.rows(slice(3)),
    )
    writer.finish(cut)
    assert len(frames_of(tmp_path / "one")) == len(list((tmp_path / "one").rglob("*.vt[pu]"))) == 6


@pytest.mark.parametrize("carried", [True, False])
def test_a_failed_run_is_complete_as_far_as_it_got(tmp_path, carried):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    with pytest.raises(ComputationError) as caught:
        run_scene(short_scene(), observer=Stops(writer, 4, ComputationError("stuck")))
    summary = writer.break_off(caught.value.partial if carried else None, "failed")
    loaded = load_run(tmp_path / "one")
    assert loaded.summary == summary
    assert summary["stop_reason"] == "failed"
    assert len(frames_of(tmp_path / "one")) == 2 * len(loaded.time) >= 8


def test_a_run_that_fails_before_its_first_sample(tmp_path):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    writer.begin(FiniteElementNeedle(short_scene(), elements=4), {"analysis": "static", "output_times": (0.0, 1.0)})
    assert writer.break_off(None, "failed")["analysis"] == "static"
    assert json.loads((tmp_path / "one" / "summary.json").read_text())["stop_reason"] == "failed"
    assert not (tmp_path / "one" / "deflection.pvd").exists()  # readers take no empty list


def fill_disk_after(monkeypatch, count: int) -> None:
    """Let every file beginning with the ``count``-th frame meet a full disk half-way."""
    write, frames = Path.write_bytes, []

    def limited(path: Path, content: bytes) -> int:
        frames.extend([path] if ".vtu" in path.name else [])
        if len(frames) < count:
            return write(path, content)
        write(path, content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", limited)


@pytest.mark.parametrize("freed", [True, False])
def test_a_full_disk_leaves_the_frames_before_readable(tmp_path, monkeypatch, freed):
    writer = RunFolderWriter(RunTarget(tmp_path / "one"))
    with monkeypatch.context() as patch:
        fill_disk_after(patch, 4)
        with pytest.raises(ComputationError, match=r"frame at time 1\.5 s, depth 0\.035 m .*No space left") as caught:
            run_scene(short_scene(), observer=writer)
        if not freed:
            with pytest.raises(ComputationError, match="results cannot be written"):
                writer.break_off(caught.value.partial, "failed")
    if freed:
        writer.break_off(caught.value.partial, "failed")
        assert load_run(tmp_path / "one").summary["stop_reason"] == "failed"
    assert 4 <= len(caught.value.partial.time) < 9
    assert len(frames_of(tmp_path / "one")) == (2 * len(caught.value.partial.time) if freed else 6)
    assert leftovers(tmp_path) == []


def test_space_for_the_series_is_held_and_given_back(tmp_path):
    class Looks(RunFolderWriter):
        def samples(self, block):
            super().samples(block)
            assert self._reserve is not None
            sizes.append(self._reserve.tell())

    sizes: list[int] = []
    writer = Looks(RunTarget(tmp_path / "one"), vtk=False)
    run = writer.finish(run_scene(short_scene(), observer=writer))
    held = min(sizes)
    needed = sum((tmp_path / "one" / name).stat().st_size for name in ("series.nc", "summary.json"))
    assert held > run.station_deflection.nbytes
    assert held > needed
    assert writer._reserve is None


def test_an_existing_run_is_replaced_only_by_force(written, tmp_path):
    run, _ = written
    folder = save_run(run, tmp_path / "one")
    (folder / "notes.txt").write_text("mine")
    (folder / "needle" / "extra.vtp").write_text("old")
    before = (folder / "series.nc").read_bytes()
    with pytest.raises(SceneError, match="exists already"):
        RunFolderWriter(RunTarget(folder))
    assert (folder / "series.nc").read_bytes() == before
    save_run(run, folder, force=True, vtk=False)
    assert sorted(path.name for path in folder.iterdir()) == [
        "manifest.json",
        "notes.txt",
        "scene.toml",
        "series.nc",
        "summary.json",
    ]


@pytest.mark.parametrize("manifest", [None, "{}", "[1]", '{"format": 1}', '{"format": 1, "versions": {"other": "1"}}', "{" * 9])
@pytest.mark.parametrize("numbered", [True, False])
def test_force_leaves_a_folder_that_is_no_run_folder(tmp_path, manifest, numbered):
    (tmp_path / "summary.json").write_text("precious")
    if manifest is not None:
        (tmp_path / "manifest.json").write_text(manifest)
    with pytest.raises(SceneError, match="is no run folder"):
        RunTarget(tmp_path, force=True, numbered=numbered).create()
    assert (tmp_path / "summary.json").read_text() == "precious"


def test_force_does_not_follow_links_out_of_the_folder(written, tmp_path):
    run, _ = written
    folder, other = save_run(run, tmp_path / "one", vtk=False), tmp_path / "other"
    other.mkdir()
    (other / "precious.vtp").write_text("mine")
    (folder / "needle").symlink_to(other)
    with pytest.raises(SceneError, match="links"):
        RunTarget(folder, force=True).create()
    assert (other / "precious.vtp").read_text() == "mine"


def test_folders_are_numbered_and_an_empty_one_is_taken(tmp_path):
    made = [RunTarget(tmp_path / "deep" / "run", numbered=True).create().name for _ in range(3)]
    assert made == ["run", "run-2", "run-3"]
    assert RunTarget(tmp_path / "deep" / "run-2").create() == tmp_path / "deep" / "run-2"


def test_a_folder_that_cannot_be(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "below", tmp_path / "nul\0", tmp_path / ("x" * 300)):
        with pytest.raises(SceneError, match=r"cannot|no run folder"):
            RunTarget(path).create()


def test_only_a_run_folder_loads(tmp_path):
    with pytest.raises(SceneError, match="is no run folder"):
        load_run(tmp_path)


def test_json_has_no_numbers_that_are_not_finite():
    values = {"a": np.float64("nan"), "b": [np.inf, 1.5], "c": np.arange(2), "d": Path("x"), "e": None, "f": True}
    assert json.loads(json_bytes(values)) == {"a": None, "b": [None, 1.5], "c": [0, 1], "d": "x", "e": None, "f": True}


def test_a_hub_that_moves_is_supported(tmp_path):
    scene = short_scene(support=Support(kind="hub", hub_deflection={"time": [0.0, 4.0], "value": [0.0, 0.01]}))
    run = run_scene(scene)
    assert load_run(save_run(run, tmp_path / "one")).scene == scene
