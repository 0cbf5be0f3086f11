"""A process that is killed, ended, short of disk or not alone: what is in the folder can be read, and used again."""

import json
import os
import resource
import signal
import subprocess
import sys
import time

import pytest

from fem_needle.atomic_file import is_unfinished
from fem_needle.errors import SceneError
from fem_needle.folder_lock import FolderLock, is_locked
from fem_needle.run_folder import RunFolderWriter, load_run
from fem_needle.run_target import RunTarget
from tests.faults.short_run import compute, problems

# 1.6e6 steps, 1.6e4 samples: long enough to be caught anywhere.
LONG = ("--analysis", "static", "--time-step", "1e-5", "--output-step", "1e-3", "--elements", "4")
SHORT = ("--analysis", "static", "--output-step", "4", "--elements", "4")


def start(folder, *options, **named):
    command = [sys.executable, "-m", "fem_needle", "run", "thesis", "--out", str(folder), *options]
    return subprocess.Popen(command, cwd=folder.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **named)


def heed():
    """Heed the signals that a shell lets its background jobs ignore, and the tests with them."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def wait_for(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def state(folder):
    return json.loads((folder / "manifest.json").read_text())["state"]


def after(folder, count):
    """Wait for so many frames; 0: for the manifest."""
    wait_for((folder / "manifest.json").exists if count == 0 else (folder / "needle" / f"{count:06d}.vtp").exists)


# A killed process can leave one hidden file; everything else is whole.
def check_killed(folder):
    assert len([path for path in folder.rglob("*") if is_unfinished(path)]) <= 1
    assert [text for text in problems(folder) if not text.startswith("left over: .")] == []
    assert state(folder) == "running"
    with pytest.raises(SceneError, match="killed"):
        load_run(folder)
    assert compute(folder, force=True) == 0
    assert problems(folder) == []


def kill_at(tmp_path, count):
    folder = tmp_path / f"after-{count}"
    process = start(folder, *LONG)
    after(folder, count)
    if count:
        with pytest.raises(SceneError, match="it is being computed"):
            load_run(folder)
        with pytest.raises(SceneError, match="another run is writing"):
            RunTarget(folder, force=True).check()
    process.kill()
    process.communicate()
    check_killed(folder)


def test_a_killed_run(tmp_path):
    kill_at(tmp_path, 20)


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 1, 2, 3, 50, 400])
def test_a_run_killed_anywhere(tmp_path, count):
    kill_at(tmp_path, count)


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow),
                                    pytest.param(signal.SIGHUP, marks=pytest.mark.slow)])  # fmt: skip
def test_a_run_that_is_ended_keeps_what_was_computed(tmp_path, number):
    folder = tmp_path / "run"
    process = start(folder, *LONG, "--set", "numerics.output_points=2", preexec_fn=heed)
    after(folder, 3)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err) == (1, False), err
    assert "interrupted" in err
    assert state(folder) == "interrupted"
    assert len(load_run(folder).time) > 1
    assert problems(folder) == []


@pytest.mark.parametrize("most", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_disk_that_takes_no_more(tmp_path, most):
    folder = tmp_path / "run"
    unmeasured = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}  # data are files, too
    limits = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)), "env": unmeasured}
    process = start(folder, *SHORT, **limits)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err) == (1, False), err
    assert "cannot be written: File too large" in err
    assert problems(folder) == []
    assert compute(folder, force=True) == 0


def test_one_folder_has_one_writer(tmp_path):
    (tmp_path / "run").mkdir()
    first, second = (RunTarget(tmp_path / "run", force=True) for _ in range(2))
    claimed = first.claim()
    for attempt in (second.check, second.claim, lambda: RunFolderWriter(second), lambda: FolderLock(tmp_path / "run")):
        with pytest.raises(SceneError, match="another run is writing into it"):
            attempt()
    claimed.release()
    assert not is_locked(tmp_path / "run")
    second.claim().release()


def test_what_a_killed_run_left_does_not_keep_its_folder(tmp_path):
    folder = tmp_path / "run"
    (folder / "needle").mkdir(parents=True)
    (folder / ".manifest.json.123.tmp").write_text("{")
    (folder / "needle").rmdir()
    assert compute(folder) == 0
    (folder / ".series.nc.77.tmp").write_text("half")
    (folder / "needle" / ".000001.vtp.77.tmp").write_text("half")
    (folder / ".profile").write_text("mine")
    assert compute(folder, force=True) == 0
    assert problems(folder) == ["left over: .profile"]  # not ours: it stays


def at_once(folder, count, *options):
    """Start so many runs into one folder; return the statuses and what they said."""
    processes = [start(folder, *SHORT, *options, "--set", f"title=run {number}") for number in range(count)]
    said = [process.communicate(timeout=100)[1] for process in processes]
    return [process.returncode for process in processes], said


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--force",)])
def test_runs_at_once_into_one_folder_do_not_mix(tmp_path, options):
    for attempt in range(2):
        folder = tmp_path / ("run" if options else str(attempt))
        statuses, said = at_once(folder, 3, *options)
        assert 0 in statuses
        assert set(statuses) <= {0, 2}
        assert all("Traceback" not in text for text in said)
        run = load_run(folder)
        assert len(list((folder / "needle").iterdir())) == len(run.time)
        assert problems(folder) == []
        done = [number for number, status in enumerate(statuses) if status == 0]
        assert run.scene.title in {f"run {number}" for number in done}
        assert options or len(done) == 1


@pytest.mark.slow
def test_runs_at_once_without_a_folder_get_one_each(tmp_path):
    command = [sys.executable, "-m", "fem_needle", "run", "thesis", *SHORT, "--no-vtk"]
    processes = [subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, env=os.environ) for _ in range(3)]
    assert [process.wait(timeout=100) for process in processes] == [0, 0, 0]
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["thesis", "thesis-2", "thesis-3"]
    assert all(problems(path) == [] for path in (tmp_path / "runs").iterdir())
