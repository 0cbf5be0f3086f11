"""The command `run`: in-process, and as a process where signals and start-up matter."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
import pyvista

from fem_needle import load_scene, progress_bar
from fem_needle.cli.settings import value_of
from fem_needle.errors import ComputationError
from fem_needle.run_folder import RunFolderWriter, load_run

SHORT = ("--set", "insertion.final_depth=0.04", "--output-step", "0.5", "--elements", "4")
# 1.6e6 steps: long enough to be caught in the middle.
LONG = ("--analysis", "static", "--time-step", "1e-5", "--output-step", "1e-3")


@pytest.fixture
def run(command_line, monkeypatch, tmp_path):
    """Run `run`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "run")


def test_a_run_shows_a_table_and_leaves_a_folder(run, tmp_path, monkeypatch):
    monkeypatch.setattr("fem_needle.progress_bar.PATIENCE", 1e3)  # a busy machine shows no bar either
    status, out, err = run("thesis", *SHORT)
    assert (status, err) == (0, "")
    loaded = load_run(tmp_path / "runs" / "thesis")
    rows = {name: value for name, _, value in (line.strip().partition("  ") for line in out.splitlines())}
    rows = {name: value.strip() for name, value in rows.items()}
    assert "Thesis needle" in out
    assert rows["depth"].startswith("40 mm at 2 s")
    assert rows["tip deflection"].startswith(f"{1e3 * loaded.tip_deflection[-1]:.4g} mm")
    assert rows["analysis"] == loaded.summary["analysis"]
    assert rows["model"] == "fem, 4 elements of degree 4"
    assert rows["time step"] == "4 steps of up to 0.5 s"
    assert rows["left out"].startswith("inertia: ")
    assert rows["run folder"] == str(Path("runs/thesis"))
    assert "Warp By Vector" in rows["ParaView"]
    assert len(loaded.time) == 5
    assert len(pyvista.PVDReader(tmp_path / "runs" / "thesis" / "deflection.pvd").datasets) == 10


def test_json_is_the_summary_and_nothing_else(run, tmp_path):
    status, out, err = run("thesis", *SHORT, "--json", "--out", "deep/one")
    assert (status, err) == (0, "")
    assert out == (tmp_path / "deep" / "one" / "summary.json").read_text()
    summary = json.loads(out)
    assert Path(summary["folder"]) == tmp_path / "deep" / "one"
    assert {"elements", "time_step", "steps", "error_estimate", "skipped", "warnings", "wall_time", "solve_time"} <= set(summary)


def test_a_run_says_that_a_controller_does_not_act(run):
    status, out, err = run("steering", "--elements", "2", "--output-step", "1", "--no-vtk", "--json")
    assert status == 0
    assert "'fem-needle steer' closes its loop" in err
    assert "controller" not in json.loads(out)


def test_options_end_up_in_the_scene_of_the_folder(run, tmp_path):
    options = ("--model", "fem", "--degree", "3", "--time-step", "250 ms", "--tolerance", "1e-2", "--analysis", "static")
    layer = ("--set", "tissue.layers.phantom.foundation_modulus=1 kN/m^2", "--set", "loads.0.force=0.2")
    assert run("thesis", *SHORT, *options, *layer)[0] == 0
    scene = load_scene(tmp_path / "runs" / "thesis" / "scene.toml")
    numerics = scene.numerics
    assert (numerics.elements, numerics.degree, numerics.time_step, numerics.tolerance) == (4, 3, 0.25, 1e-2)
    assert (numerics.analysis, numerics.output_step) == ("static", 0.5)
    assert scene.tissue.layers[0].foundation_modulus == 1e3
    assert scene.loads[0].force == 0.2
    assert run(str(tmp_path / "runs" / "thesis" / "scene.toml"), "--out", "again")[0] == 0
    first, again = (load_run(tmp_path / name) for name in ("runs/thesis", "again"))
    assert again.tip_deflection.tolist() == first.tip_deflection.tolist()


def test_runs_are_numbered_and_none_is_overwritten(run, tmp_path):
    for _ in range(3):
        assert run("thesis", *SHORT, "--no-vtk")[0] == 0
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["thesis", "thesis-2", "thesis-3"]
    before = (tmp_path / "runs" / "thesis" / "manifest.json").stat().st_mtime_ns
    status, out, err = run("thesis", *SHORT, "--out", "runs/thesis")
    assert (status, out) == (2, "")
    assert "--force" in err
    assert (tmp_path / "runs" / "thesis" / "manifest.json").stat().st_mtime_ns == before
    assert run("thesis", *SHORT, "--out", "runs/thesis", "--force")[0] == 0
    assert (tmp_path / "runs" / "thesis" / "deflection.pvd").exists()


def test_no_vtk(run, tmp_path):
    status, out, _ = run("thesis", *SHORT, "--no-vtk")
    assert status == 0
    assert "ParaView" not in out
    assert sorted(path.name for path in (tmp_path / "runs" / "thesis").iterdir()) == [
        "manifest.json",
        "scene.toml",
        "series.nc",
        "summary.json",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nothing-there",), "no file and no shipped scene"),
        (("thesis", "--set", "needle.lenght=1"), "did you mean 'length'"),
        (("thesis", "--set", "needle.length"), "--set"),
        (("thesis", "--set", "=1"), "--set"),
        (("thesis", "--set", "needle.length="), "--set"),
        (("thesis", "--set", "needle.length=nan"), "needle.length"),
        (("thesis", "--set", "tissue.layers.fat.damping=1"), "phantom"),
        (("thesis", "--elements", "0"), "numerics.elements"),
        (("thesis", "--elements", "four"), "numerics.elements"),
        (("thesis", "--time-step", "-1"), "numerics.time_step"),
        (("thesis", "--time-step", "1 mm"), "numerics.time_step"),
        (("thesis", "--tolerance", "1"), "numerics.tolerance"),
        (("thesis", "--analysis", "guess"), "numerics.analysis"),
        (("thesis", "--model", "magic"), "model.kind"),
        (("thesis", "--output-step", "1000"), "numerics.output_step"),
        (("thesis", "--degree", "5"), "numerics.degree"),
        (("thesis", "--out", "x" * 300), "run folder"),
        (("thesis", "--nonsense"), "--nonsense"),
        ((), "SCENE"),
    ],
)
def test_wrong_input_writes_nothing(run, tmp_path, arguments, message):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_all_wrong_settings_are_named_at_once(run):
    _, _, err = run("thesis", "--elements", "0", "--tolerance", "7", "--set", "needle.length=-1")
    assert len(err.splitlines()) >= 3


def test_force_does_not_touch_what_is_no_run_folder(run, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "series.nc").write_text("precious")
    status, _, err = run("thesis", *SHORT, "--out", "mine", "--force")
    assert status == 2
    assert "is no run folder" in err
    assert (tmp_path / "mine" / "series.nc").read_text() == "precious"


def test_suspicious_values_are_shown_and_kept(run):
    status, out, err = run("thesis", *SHORT, "--json", "--set", "tissue.layers.0.foundation_modulus=5 MPa")
    assert status == 0
    warnings = json.loads(out)["warnings"]
    assert any("looks like a Young's modulus" in warning for warning in warnings)
    assert err.splitlines() == [f"warning: {warning}" for warning in warnings]


def test_explain(run):
    assert "Warp" in run("thesis", *SHORT)[1]
    status, out, _ = run("thesis", *SHORT, "--explain")
    assert status == 0
    for row in ("depth: ", "tip deflection: ", "energy residual: ", "error estimate: ", "left out: "):
        assert any(line.startswith(row) for line in out.splitlines())
    _, out, err = run("thesis", *SHORT, "--explain", "--json")
    assert json.loads(out)
    assert "energy residual: " in err


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_failed_computation_says_where_its_rows_are(run, monkeypatch, tmp_path, options):
    def failing(self, block):
        original(self, block)
        if block.time[-1] >= 1.0:
            raise ComputationError("the step at time 1 s, depth 0.03 m failed: use a smaller time_step")

    original = RunFolderWriter.samples
    monkeypatch.setattr(RunFolderWriter, "samples", failing)
    status, out, err = run("thesis", *SHORT, *options)
    assert status == 1
    assert err.startswith("error: the step at time 1 s, depth 0.03 m failed")
    assert str(Path("runs/thesis")) in err
    loaded = load_run(tmp_path / "runs" / "thesis")
    assert loaded.summary["stop_reason"] == "failed"
    assert len(loaded.time) >= 3
    assert (json.loads(out)["stop_reason"] == "failed") if options else (out == "")


def test_a_progress_bar_where_it_takes_long(run, monkeypatch):
    monkeypatch.setattr(progress_bar, "PATIENCE", 0.0)
    _, out, err = run("thesis", *SHORT)
    assert "Thesis needle" in err
    assert "100%" in err
    assert "100%" not in out
    assert run("thesis", *SHORT, "--json")[2] == ""


def test_values_of_the_command_line():
    assert value_of("3") == 3
    assert value_of("1e-3") == 1e-3
    assert value_of("127 mm") == "127 mm"
    assert value_of("fixed-frame") == "fixed-frame"
    assert value_of("{ mean = 0, amplitude = 1, frequency = 2 }") == {"mean": 0, "amplitude": 1, "frequency": 2}
    assert value_of("1\nother = 2") == "1\nother = 2"


# Tests that run in the background inherit an ignored interrupt.
OBEDIENT = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from fem_needle.cli import main; main()"


def started(tmp_path) -> subprocess.Popen[str]:
    """Start a long run and wait until some frames are listed."""
    command = [sys.executable, "-c", OBEDIENT, "run", "thesis", *LONG]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    collection, until = tmp_path / "runs" / "thesis" / "deflection.pvd", time.monotonic() + 60
    while time.monotonic() < until and process.poll() is None:
        if collection.exists() and collection.read_text().count("<DataSet") >= 6:
            return process
        time.sleep(0.02)
    process.kill()
    raise RuntimeError(f"no frames: {process.communicate()}")


def test_an_interrupt_keeps_what_was_computed(tmp_path):
    process = started(tmp_path)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (1, "")
    assert "interrupted at time" in err
    assert str(Path("runs/thesis")) in err
    assert "Traceback" not in err
    loaded = load_run(tmp_path / "runs" / "thesis")
    assert loaded.summary["stop_reason"] == "interrupted"
    reader = pyvista.PVDReader(tmp_path / "runs" / "thesis" / "deflection.pvd")
    assert reader.time_values == loaded.time.tolist()


def test_a_kill_leaves_readable_frames(tmp_path):
    process = started(tmp_path)
    process.kill()
    process.communicate(timeout=60)
    folder = tmp_path / "runs" / "thesis"
    datasets = pyvista.PVDReader(folder / "deflection.pvd").datasets
    assert len(datasets) >= 6
    assert all(pyvista.read(folder / dataset.path).n_points > 0 for dataset in datasets)
    assert load_scene(folder / "scene.toml").numerics.analysis == "static"
