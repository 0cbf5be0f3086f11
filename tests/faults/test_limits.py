"""What no machine finishes or holds is refused at once, with value, unit and limit."""

import resource
import subprocess
import sys

import pytest

from fem_needle import load_scene, run_scene, steer
from fem_needle.errors import SceneError
from fem_needle.scene import csv_table
from tests.house.source import ROOT

FAST = {"mean": 0.0, "amplitude": 0.01, "frequency": 1e12}
TOO_LONG = {
    "steps": ("thesis", {"numerics.time_step": 1e-12}, r"1\.6e\+13 steps \(got 1e-12 s over 16 s; allowed up to 1000000000"),
    "samples": ("thesis", {"numerics.output_step": 1e-9}, r"1\.6e\+10 samples \(got 1e-09 s over 16 s; allowed up to 1000000"),
    "memory": ("thesis", {"numerics.output_step": 1e-4, "numerics.elements": 2000}, r"GB for 160001 samples.* up to 4 GB"),
    "stations": ("thesis", {"numerics.output_step": 5e-3, "numerics.output_points": 100_001}, "GB for 3201 samples"),
    "a fast load": ("thesis", {"loads.0.force": FAST}, r"1\.6e\+13 swings"),
    "a fast load, dynamic": ("thesis", {"loads.0.force": FAST, "numerics.analysis": "dynamic"}, "steps"),
    "a fast load, at rest": ("thesis", {"loads.0.force": FAST, "numerics.analysis": "static"}, "steps"),
    "a fast push": ("thesis-open-loop", {"insertion.push_force": FAST, "run.duration": 0.1}, "steps"),
}


@pytest.mark.parametrize("name", TOO_LONG)
def test_runs_without_end_are_refused(name):
    scene, values, message = TOO_LONG[name]
    with pytest.raises(SceneError, match=message):
        run_scene(load_scene(scene).with_values(values))


@pytest.mark.parametrize("key", ["controller.period", "sensors.0.period"])
def test_loops_without_end_are_refused(key):
    with pytest.raises(SceneError, match=rf"{key}: makes 9e\+09 readings \(got 1e-09 s over 9 s; allowed up to 1000000"):
        steer(load_scene("steering").with_value(key, 1e-9))


def test_too_many_repetitions_are_refused(command_line):
    status, _, err = command_line("steer", "steering", "--repeat", 100_001)
    assert (status, "got 100001; allowed 1 to 100000" in err) == (2, True)


def test_a_table_of_too_many_cells_is_refused_unread(monkeypatch):
    monkeypatch.setattr(csv_table, "_cells", None)
    with pytest.raises(ValueError, match=r"has 6000001 cells \(allowed up to 3000000\)"):
        csv_table.read_csv("a,b\n" * 3_000_000)


SPARE = 700_000_000  # bytes beyond what a scene file may take: the interpreter, numpy, scipy


@pytest.mark.slow
def test_the_largest_table_is_read_within_the_stated_memory(tmp_path):
    (tmp_path / "table.csv").write_text("time [s],force [N]\n" + "".join(f"{i},1\n" for i in range(1_499_000)))
    program = (
        "import resource; from fem_needle.scene.table_file import read_table; from pathlib import Path;"
        f"read_table('table.csv', 'force', Path({str(tmp_path)!r}));"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert int(done.stdout) * 1024 < 1_000_000_000


@pytest.mark.slow
def test_too_little_memory_is_told(tmp_path):
    def little():
        resource.setrlimit(resource.RLIMIT_AS, (SPARE + 800_000_000,) * 2)

    command = [sys.executable, "-m", "fem_needle", "run", "thesis", "--elements", "1000000", "--no-vtk", "--analysis", "static"]
    command += ["--time-step", "8", "--output-step", "8", "--set", "numerics.tolerance=0.1"]
    done = subprocess.run(command, cwd=tmp_path, preexec_fn=little, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 1, done.stderr
    assert "not enough memory" in done.stderr
    assert "Traceback" not in done.stderr
