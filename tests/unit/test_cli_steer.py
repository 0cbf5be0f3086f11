"""The command `steer`: options, files that other readers open, exit statuses, repetitions."""

from __future__ import annotations

import csv
import json
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from fem_needle import Gains, load_scene, parse_scene, progress_bar, save_scene, steer
from fem_needle.cli.steer_settings import steered
from fem_needle.closed_loop.picture import LoopCurves
from fem_needle.closed_loop.repeated_picture import mean_path
from fem_needle.closed_loop.repeating import repeat
from fem_needle.closed_loop.repetitions import drawn, scattered
from fem_needle.run_folder import load_run
from tests.unit.test_cli_converge import png_size_and_pixels

SHORT = """
title = "Short loop"
needle = { length = 0.2, bending_stiffness = 0.01572, mass_per_length = 0.01 }
support = { kind = "hub" }
tissue = { layers = [{ foundation_modulus = 5e3 }] }
insertion = { kind = "speed", initial_depth = 0.05, speed = 0.01, final_depth = 0.06 }
loads = [{ kind = "tip", force = 0.1 }, { kind = "lateral", position = 0.0, force = 0.0 }]
target = { depth = 0.058 }
sensors = [{ kind = "tip-imaging", period = 0.1, noise = 1e-5 }, { kind = "encoder", period = 0.1 }]
scatter = { modulus = 0.2, entry_angle = 0.002, speed = 0.1 }

[controller]
kind = "pid"
period = 0.1
schedule = "model-gain"
gains = { proportional = 200.0, integral = 2000.0 }

[actuators]
lateral_force = { minimum = -2.0, maximum = 2.0 }

[numerics]
elements = 4
analysis = "quasi-static"
time_step = 0.05
output_step = 0.1
output_points = 5
"""
# Unstable but in the stiffest of tissues.
VIOLENT = ("--schedule", "none", "--set", "controller.gains={proportional = 2e3}", "--set", "actuators.lateral_force={}")


@pytest.fixture
def scene():
    return parse_scene(SHORT)


@pytest.fixture
def run(command_line, monkeypatch, tmp_path):
    """Run `steer` on the short loop, in a folder with nothing else; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(progress_bar, "PATIENCE", 1e3)  # a busy machine shows no bar either
    Path("short.toml").write_text(SHORT, encoding="utf-8")
    return partial(command_line, "steer", "short.toml")


def rows_of(out):
    """Values of a table by name, in their order."""
    found = {}
    for name, _, value in (line.strip().partition("  ") for line in out.splitlines()):
        found.setdefault(name, []).append(value.strip())
    return found


def test_a_loop_shows_a_table_and_leaves_a_folder(run, scene):
    status, out, err = run()
    assert (status, err) == (0, "")
    folder, expected = Path("runs/short"), steer(scene).summary
    summary, rows = load_run(folder).summary, rows_of(out)
    for name in ("target_error", "target_time", "target_reached", "effort", "largest_command", "controller", "sensors", "steps"):
        assert summary[name] == expected[name]
    assert rows["target error"] == [f"{1e3 * expected['target_error']:.4g} mm at 0.8 s, depth 58 mm (final-depth)"]
    largest, effort = expected["largest_command"]["lateral_force"], expected["effort"]["lateral_force"]
    assert rows["command"] == [f"lateral force: largest {largest:.4g} N, integral {effort:.4g} N s"]
    assert rows["controller"] == ["pid, model-gain; lateral_force from tip_deflection every 100 ms"]
    assert rows["sensors"] == ["tip-imaging every 100 ms; encoder every 100 ms"]
    assert rows["picture"] == [str(folder / "steer.png")]
    assert "warning" not in rows
    size, pixels = png_size_and_pixels(folder / "steer.png")
    assert min(size) > 600
    assert len(set(pixels)) > 20
    assert (folder / "deflection.pvd").exists()


def test_other_readers_open_commands_and_measurements(run, scene):
    assert run("--no-vtk")[0] == 0
    expected, path = steer(scene), Path("runs/short/series.nc")
    with h5py.File(path) as file:
        command = file["command_lateral_force"]
        assert command.attrs["units"] == "N"
        assert command[...].tolist() == expected.command_lateral_force.tolist()
        assert float(np.max(np.abs(command[...]))) > 0.1
    with xarray.open_dataset(path, engine="h5netcdf") as series:
        readings = series["measurement_tip_deflection"]
        assert (readings.dims, readings.attrs["units"]) == (("time",), "m")
        assert readings.values.tolist() == expected.measurement_tip_deflection.tolist()
        difference = readings.values - series["tip_deflection"].values
    assert 0.0 < np.max(np.abs(difference)) < 6e-5  # noise of 1e-5
    assert not Path("runs/short/deflection.pvd").exists()


def test_json_is_the_summary_and_nothing_else(run):
    status, out, err = run("--json", "--out", "one", "--no-vtk")
    assert (status, err) == (0, "")
    assert out == Path("one/summary.json").read_text(encoding="utf-8")
    assert json.loads(out)["sensors"] == ["tip-imaging", "encoder"]


@pytest.mark.parametrize("options", [("--no-vtk",), ("--repeat", "2")])
def test_energies_are_always_there(run, options):
    """The option of old is accepted, told to do nothing, and changes nothing."""
    status, _, told = run("--no-energies", "--out", "asked", *options)
    assert status == 0 and "--no-energies does nothing any more" in told
    assert run("--out", "usual", *options)[0] == 0
    name = "steer.json" if "--repeat" in options else "summary.json"
    asked, usual = (json.loads(Path(folder, name).read_text(encoding="utf-8")) for folder in ("asked", "usual"))
    for one in (asked, usual):
        for row in one.get("rows", [one]):
            for key in ("solve_time", "wall_time", "folder"):
                row.pop(key, None)
    assert asked == usual


def test_another_controller_keeps_the_signals_and_drops_the_gains(scene):
    controller = steered(scene, (), {}, "inverse-dynamics:realizable", ()).controller
    assert (controller.kind, controller.variant, controller.schedule) == ("inverse-dynamics", "realizable", "none")
    assert controller.gains == Gains()
    assert (controller.period, controller.input, controller.output) == (0.1, "lateral_force", "tip_deflection")


def test_the_same_controller_keeps_its_gains(scene):
    assert steered(scene, (), {}, "pid", ()) == scene
    gains = {"controller": {"kind": "incremental", "gains": {"increment": 0.1}}}
    assert steered(scene.with_values(gains), (), {}, "incremental:intended", ()).controller.gains.increment == 0.1


def test_gains_of_the_command_line_belong_to_its_controller(scene):
    schedule = {"controller.schedule": "model-gain"}
    controller = steered(scene, ("controller.gains.proportional=50 N/m",), schedule, "proportional", ()).controller
    assert (controller.kind, controller.schedule) == ("proportional", "model-gain")
    assert (controller.gains.proportional, controller.gains.integral) == (50.0, None)


def test_sensors_are_changed_and_added(scene):
    texts = ("tip-imaging:noise=0.2mm,delay=0.1", "base-moment", "base-moment:noise=1e-3")
    imaging, encoder, moment = steered(scene, ("sensors.1.period=50 ms",), {}, None, texts).sensors
    assert (imaging.kind, imaging.noise, imaging.delay, imaging.period) == ("tip-imaging", 2e-4, 0.1, 0.1)
    assert (encoder.kind, encoder.period) == ("encoder", 0.05)
    assert (moment.kind, moment.noise) == ("base-moment", 1e-3)


def test_options_end_up_in_the_scene_of_the_folder(run):
    options = ("--model", "assumed-modes", "--modes", "3", "--static-corrections", "--analysis", "static")
    loop = ("--controller", "proportional", "--schedule", "model-gain", "--sensor", "tip-imaging:delay=0.2")
    status, out, _ = run(*options, *loop, "--output-step", "0.2", "--tolerance", "1e-2", "--time-step", "100 ms", "--explain")
    assert status == 0
    scene = load_scene("runs/short/scene.toml")
    assert (scene.model.kind, scene.model.modes, scene.model.static_corrections) == ("assumed-modes", 3, True)
    numerics = scene.numerics
    assert (numerics.analysis, numerics.time_step, numerics.output_step, numerics.tolerance) == ("static", 0.1, 0.2, 1e-2)
    assert (scene.controller.kind, scene.controller.schedule, scene.sensors[0].delay) == ("proportional", "model-gain", 0.2)
    readings = load_run(Path("runs/short")).measurement_tip_deflection
    assert np.isnan(readings[0])  # the first image is known 0.2 s later
    assert np.all(np.isfinite(readings[1:]))
    assert readings.size == 6
    for row in ("target error: ", "command: ", "controller: ", "sensors: ", "error estimate: "):
        assert any(line.startswith(row) for line in out.splitlines())


def test_a_target_that_is_never_reached_is_told(run):
    status, out, _ = run("--set", "target.depth=70mm", "--no-vtk")
    assert status == 0
    assert rows_of(out)["warning"] == ["the tip never reached the target's depth, 70 mm: the error is that where it ended"]
    summary = load_run(Path("runs/short")).summary
    assert (summary["target_reached"], summary["target_depth"]) == (False, pytest.approx(0.06))


def test_an_unstable_loop_ends_with_what_was_computed(run):
    status, out, err = run(*VIOLENT, "--no-vtk", "--json")
    assert (status, json.loads(out)["stop_reason"]) == (1, "unstable")
    assert "the loop is unstable" in err
    assert str(Path("runs/short")) in err
    loaded = load_run(Path("runs/short"))
    assert loaded.summary["stop_reason"] == "unstable"
    assert abs(loaded.tip_deflection[-1]) > 0.1
    assert np.all(np.abs(loaded.tip_deflection[:-1]) < 0.1)
    assert png_size_and_pixels(Path("runs/short/steer.png"))[0][0] > 600


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--controller", "magic"), "controller.kind"),
        (("--controller", "pid:"), "--controller"),
        (("--controller", "pid:realizable"), "controller.variant"),
        (("--controller", "inverse-dynamics", "--schedule", "model-gain"), "controller.schedule"),
        (("--sensor", "nose"), "sensors.2.kind"),
        (("--sensor", "tip-imaging:nois=1"), "did you mean 'noise'"),
        (("--sensor", "tip-imaging:noise"), "--sensor"),
        (("--sensor", ":noise=1"), "--sensor"),
        (("--sensor", "tip-imaging:noise=1 N"), "sensors.0.noise"),
        (("--repeat", "0"), "--repeat"),
        (("--repeat", "two"), "--repeat"),
        (("--set", "controller.output=hub_force"), "no sensor reads hub_force"),
    ],
)
def test_wrong_input_writes_nothing(run, options, message):
    status, out, err = run(*options)
    assert (status, out) == (2, "")
    assert message in err
    assert [path.name for path in Path.cwd().iterdir()] == ["short.toml"]


def interrupting_at(share):
    """A progress bar whose owner interrupts at a share of the work."""

    def progress(self, fraction):
        if fraction >= share:
            raise KeyboardInterrupt

    return progress


def test_an_interrupt_keeps_what_was_computed(run, monkeypatch):
    monkeypatch.setattr(progress_bar.ProgressBar, "progress", interrupting_at(0.5))
    status, out, err = run("--no-vtk")
    assert (status, out) == (1, "")
    assert "interrupted at time 0.5 s" in err
    loaded = load_run(Path("runs/short"))
    assert (loaded.summary["stop_reason"], loaded.time[-1]) == ("interrupted", pytest.approx(0.5))
    assert Path("runs/short/steer.png").exists()


def test_repetitions_leave_a_study(run, scene):
    status, out, err = run("--repeat", "4")
    assert (status, err) == (0, "")
    folder = Path("runs/short-steer")
    assert {path.name for path in folder.iterdir()} == {"steer.json", "steer.csv", "steer.png", "scene.toml", "manifest.json"}
    data = json.loads((folder / "steer.json").read_text(encoding="utf-8"))
    alone = [steer(scene, repetition=number) for number in (1, 2, 3, 4)]
    errors = np.array([one.summary["target_error"] for one in alone])
    assert [row["target_error"] for row in data["rows"]] == errors.tolist()
    assert [row["effort"] for row in data["rows"]] == [one.summary["effort"] for one in alone]
    assert (data["arrived"], data["failed"], data["missed"]) == (4, 0, 0)
    assert data["mean"] == pytest.approx(np.sum(errors) / 4, rel=1e-14)
    assert data["standard_deviation"] == pytest.approx(np.sqrt(np.sum((errors - np.mean(errors)) ** 2) / 3), rel=1e-14)
    assert data["largest_error"] == np.max(np.abs(errors))
    assert data["standard_deviation"] > 0.0
    with (folder / "steer.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [float(row["target_error [m]"]) for row in table] == errors.tolist()
    assert [float(row["modulus_factor [1]"]) for row in table] == [drawn(scene, number).modulus_factor for number in (1, 2, 3, 4)]
    assert [float(row["largest_lateral_force [N]"]) for row in table] == [
        one.summary["largest_command"]["lateral_force"] for one in alone
    ]
    assert rows_of(out)["mean error"] == [f"{1e3 * data['mean']:.4g} mm"]
    assert len(set(png_size_and_pixels(folder / "steer.png")[1])) > 20


@pytest.mark.slow
def test_repetitions_are_the_same_in_any_number_of_processes(scene):
    one, two = (repeat(scene, 3, processes=processes) for processes in (1, 2))
    assert one.to_dict() == two.to_dict()
    assert one.columns() == two.columns()
    for first, second in zip(one.repetitions, two.repetitions, strict=True):
        assert first.tip_deflection.tolist() == second.tip_deflection.tolist()


def test_a_repetition_that_fails_does_not_end_the_others(run):
    status, out, _ = run("--repeat", "5", *VIOLENT, "--set", "scatter.modulus=1")
    assert status == 0
    rows = json.loads(Path("runs/short-steer/steer.json").read_text(encoding="utf-8"))["rows"]
    stiff = [row["modulus_factor"] > 10.0 for row in rows]  # at 2e3 N/m a tip in softer tissue moves too far
    assert 0 < sum(stiff) < 5
    assert [row["stop_reason"] == "final-depth" for row in rows] == stiff
    assert [row["target_error"] is not None for row in rows] == stiff
    assert all("unstable" in row["failure"] for row, good in zip(rows, stiff, strict=True) if not good)
    shown = rows_of(out)
    assert shown["repetitions"] == [f"5: {sum(stiff)} arrived, {5 - sum(stiff)} failed, 0 missed the target's depth"]
    assert len(shown["failed"]) == 3  # and one more


def test_repetitions_that_all_fail_are_an_error(run):
    status, _, err = run("--repeat", "2", *VIOLENT, "--set", "scatter.modulus=0")
    assert status == 1
    assert "all repetitions failed" in err
    assert Path("runs/short-steer/steer.png").exists()


def test_a_scene_that_is_wrong_in_every_repetition_is_wrong_input(run):
    speed = "{ time = [0.0, 1.0], value = [0.1, 0.1] }"  # to 150 mm, of 200 mm
    fast = f'insertion={{kind = "speed", initial_depth = 0.05, speed = {speed}}}'
    settings = (fast, "run.duration=1", "target={}", "scatter.speed=1", "run.seed=2")  # that draws 1.9 times the speed twice
    status, _, err = run("--repeat", "2", *(part for setting in settings for part in ("--set", setting)))
    assert status == 2
    assert "insertion.speed: the depth leaves the needle in the run" in err
    assert not Path("runs").exists()


def test_an_interrupt_keeps_the_repetitions_that_are_done(run, monkeypatch):
    monkeypatch.setattr(progress_bar.ProgressBar, "progress", interrupting_at(0.6))
    status, _, err = run("--repeat", "3")
    assert status == 1
    assert "interrupted after 1 of 3 repetitions" in err
    rows = json.loads(Path("runs/short-steer/steer.json").read_text(encoding="utf-8"))["rows"]
    assert [row["stop_reason"] for row in rows] == ["final-depth", "interrupted"]


def test_runs_and_studies_do_not_replace_each_other(run, command_line):
    assert run("--no-vtk")[0] == run("--repeat", "1")[0] == 0
    assert run("--repeat", "1", "--out", "runs/short", "--force")[0] == 2
    assert run("--out", "runs/short-steer", "--force")[0] == 2
    status, out, _ = run("--repeat", "2", "--out", "runs/short-steer", "--force", "--json")
    assert status == 0
    assert out == Path("runs/short-steer/steer.json").read_text(encoding="utf-8")
    assert len(json.loads(out)["rows"]) == 2
    assert command_line("run", "short.toml", "--no-vtk", "--out", "runs/short", "--force")[0] == 0
    assert not Path("runs/short/steer.png").exists()  # it was of the loop


def test_what_is_drawn_is_what_acts(scene):
    draw, changed = drawn(scene, 2), scattered(scene, 2)
    assert changed.tissue.layers[0].foundation_modulus == draw.modulus_factor * 5e3
    assert changed.insertion.speed == draw.speed_factor * 0.01
    assert changed.support.hub_angle == draw.entry_angle
    assert changed.support.hub_deflection == pytest.approx(-0.15 * draw.entry_angle, rel=1e-14)
    assert draw != drawn(scene, 3)
    held = scene.with_values({"insertion": {"kind": "hold", "initial_depth": 0.05}, "run.duration": 1.0, "target": None})
    assert drawn(held, 2).speed_factor == 1.0


def test_a_picture_is_over_the_depth_where_it_rises(scene):
    assert LoopCurves(steer(scene)).over_depth
    assert not LoopCurves(steer(scene.with_value("run.duration", 1.3))).over_depth
    speed = {"controller": {"kind": "pid", "input": "speed", "output": "depth", "period": 0.1}, "target.lateral": 0.06}
    speed |= {"controller.gains": {"proportional": 1.0, "integral": 0.0}}
    curves = LoopCurves(steer(scene.with_values(speed | {"actuators": {"speed": {"minimum": 0.0, "maximum": 0.01}}})))
    assert (curves.over_depth, curves.steers_depth, curves.commands) == (False, True, ("speed",))
    assert curves.command("speed")[2] == "mm/s"


def test_a_picture_marks_images_when_they_are_known(scene):
    late = steer(scene.with_values({"sensors.0.delay": 0.25, "sensors.0.period": 0.2, "numerics.output_step": 0.05}))
    assert late.time[LoopCurves(late).seen].tolist() == pytest.approx([0.25, 0.45, 0.65, 0.85])


def test_the_mean_of_paths_is_over_what_all_have():
    rising = (np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 3.0]))
    falling = (np.array([1.0, 4.0]), np.array([0.0, -3.0]))
    stations, mean = mean_path([rising, falling])
    assert (stations[0], stations[-1]) == (1.0, 3.0)
    assert mean == pytest.approx(np.full(stations.size, 0.5))  # (s + 1 - s) / 2


def test_a_scene_that_was_saved_repeats_the_loop(scene, tmp_path):
    save_scene(scene, tmp_path / "saved.toml")
    again = steer(load_scene(tmp_path / "saved.toml"))
    assert again.tip_deflection.tolist() == steer(scene).tip_deflection.tolist()
