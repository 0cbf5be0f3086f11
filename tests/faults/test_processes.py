"""Scripts without a guard, under every way to start processes, and daemonic workers: what can run there, runs."""

import subprocess
import sys

import pytest

SCENE = 'load_scene("steering").with_values({"insertion.final_depth": 0.012})'
MANY = """
from fem_needle import load_scene, simulate_many
print("runs", len(simulate_many(load_scene("bench-s"), {"needle.length": [0.19, 0.2]}, threads=THREADS)))
"""
REPEAT = f"""
from fem_needle import load_scene
from fem_needle.closed_loop import repeating
repeating.START = 0.0  # processes seem to pay at once
print("runs", len(repeating.repeat({SCENE}, 3, processes=PROCESSES).repetitions))
"""
DAEMON = """
import multiprocessing
def work(queue):
    BODY
    queue.put("done")
if __name__ == "__main__":
    queue = multiprocessing.get_context("fork").Queue()
    worker = multiprocessing.get_context("fork").Process(target=work, args=(queue,), daemon=True)
    worker.start()
    print(queue.get(timeout=60))
"""


def ran(script, tmp_path, *, method="spawn", check=True):
    path = tmp_path / "script.py"
    path.write_text(f"import multiprocessing\nmultiprocessing.set_start_method({method!r}, force=True)\n{script}")
    return subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=120, check=check)


@pytest.mark.parametrize("method", ["spawn", "forkserver"])
@pytest.mark.parametrize("threads", ["1", "2", "None"])
def test_many_runs_need_no_guard(tmp_path, method, threads):
    assert ran(MANY.replace("THREADS", threads), tmp_path, method=method).stdout == "runs 2\n"


@pytest.mark.parametrize("processes", ["1", "None"])
def test_repetitions_go_on_where_no_process_can_begin(tmp_path, processes):
    assert ran(REPEAT.replace("PROCESSES", processes), tmp_path).stdout == "runs 3\n"


def test_processes_that_were_asked_for_say_what_to_write(tmp_path):
    failed = ran(REPEAT.replace("PROCESSES", "2"), tmp_path, check=False)
    assert failed.returncode == 1 and "write the call below if __name__ == '__main__':" in failed.stderr.splitlines()[-1]


@pytest.mark.parametrize("body", [MANY.replace("THREADS", "None"), REPEAT.replace("PROCESSES", "2")], ids=["many", "repeat"])
def test_a_daemonic_worker(tmp_path, body):
    indented = body.strip().replace("\n", "\n    ")
    assert ran(DAEMON.replace("BODY", indented), tmp_path).stdout.splitlines()[-1] == "done"
