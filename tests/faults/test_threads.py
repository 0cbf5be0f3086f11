"""Same inputs, same bits, whatever the number of threads and processes."""

import os
import subprocess
import sys

import pytest

from fem_needle.threads import _libraries, one_thread
from tests.house.source import ROOT


def digests(threads, *more):
    counts = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), str(threads))
    command = [sys.executable, "-W", "ignore", "-m", "tests.faults.digests", *more]
    done = subprocess.run(command, env=os.environ | counts, cwd=ROOT, capture_output=True, text=True, timeout=200, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_one_and_eight_threads_give_the_same_bits():
    alone = digests(1)
    assert len(alone) == 2
    assert digests(8) == alone


@pytest.mark.slow
def test_threads_and_processes_give_the_same_bits_in_batches_loops_and_repetitions():
    alone = digests(1, "--more")
    assert len(set(alone)) == len(alone) - 2  # one process and two: the same line twice
    assert digests(8, "--more") == alone


def test_the_threads_of_the_caller_come_back():
    def counts():
        return [found["num_threads"] for found in _libraries().select(user_api="blas").info()]

    with _libraries().limit(limits=2, user_api="blas"):
        before = counts()
        assert before, "no library of linear algebra was found"
        assert one_thread(counts)() == [1] * len(before)
        assert counts() == before
        assert max(before) > 1 or os.cpu_count() == 1
