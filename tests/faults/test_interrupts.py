"""A full disk or an interrupt at every write of a run, and at lines between: what is there can be read, nothing else stays."""

from __future__ import annotations

import errno
import sys
from pathlib import Path

import pytest

from fem_needle.errors import SceneError
from fem_needle.run_folder import load_run
from tests.faults.short_run import SAMPLES, compute, problems

CALLS = ("write_bytes", "replace", "mkdir", "unlink")
FULL = OSError(errno.ENOSPC, "No space left on device")
WRITERS = ("run_folder", "atomic_file", "vtk_export", "run_target", "folder_lock", "manifest", "run_job", "series_file")


class Fault:
    """Raises an error at the n-th call that changes the disk; a full disk stays full for what writes."""

    def __init__(self, monkeypatch, at: int, error: BaseException, *, lasting: bool) -> None:
        self.at, self.error, self.lasting, self.seen = at, error, lasting, 0
        for name in CALLS:
            monkeypatch.setattr(Path, name, self._watched(name, getattr(Path, name)))

    def _watched(self, name, original):
        def call(path, *arguments, **named):
            if name == "write_bytes" or not self.lasting:  # a full disk can still rename and remove
                self.seen += 1
                if self.seen == self.at or (self.lasting and self.seen > self.at):
                    if name == "write_bytes":
                        original(path, arguments[0][: len(arguments[0]) // 2])
                    raise self.error
            return original(path, *arguments, **named)

        return call


def attempt(folder: Path) -> int | None:
    try:
        return compute(folder)
    except KeyboardInterrupt:
        return None
    except SceneError:  # the folder could not be made
        return 2


def survey(tmp_path, at, error, *, lasting):
    """Break a run off at one call; return whether the fault was met, and the run's exit status."""
    folder = tmp_path / f"{type(error).__name__}-{lasting}-{at}"
    with pytest.MonkeyPatch.context() as patch:
        fault = Fault(patch, at, error, lasting=lasting)
        status = attempt(folder)
    assert problems(folder) == [], f"fault at call {at}"
    return fault.seen >= at, status, folder


EVERY = pytest.mark.slow
CASES = [
    pytest.param(KeyboardInterrupt(), False, 4, id="interrupt"),
    pytest.param(FULL, True, 3, id="full disk"),
    pytest.param(KeyboardInterrupt(), False, 1, id="interrupt, every call", marks=EVERY),
    pytest.param(FULL, True, 1, id="full disk, every call", marks=EVERY),
    pytest.param(FULL, False, 1, id="full for a moment, every call", marks=EVERY),
]


@pytest.mark.parametrize(("error", "lasting", "stride"), CASES)
def test_every_write_may_fail(tmp_path, error, lasting, stride):
    met, at, loaded = True, 1 - stride, 0
    while met:
        at += stride
        met, status, folder = survey(tmp_path, at, error, lasting=lasting)
        assert (status == 0) == (not met)
        loaded += (folder / "summary.json").exists()
        if at % 5 == 0 or not met:  # the same place can be used again
            assert compute(folder, force=True) == 0
            assert len(load_run(folder).time) == SAMPLES
            assert problems(folder) == []
    assert at > 15
    assert loaded > 0  # of those, some were broken off late enough to have results


def break_at_line(at: int):
    """Return a trace function that interrupts at the n-th line of the modules that write, and its counter."""
    counter = [0]

    def lines(frame, event, argument):
        if event == "line":
            counter[0] += 1
            if counter[0] == at:
                sys.settrace(None)
                raise KeyboardInterrupt
        return lines

    def calls(frame, event, argument):
        name = frame.f_globals.get("__name__", "")
        return lines if name.startswith("fem_needle.") and name.split(".")[1] in WRITERS else None

    return calls, counter


def interrupted_at_line(folder, at):
    trace, counter = break_at_line(at)
    before = sys.gettrace()
    sys.settrace(trace)
    try:
        attempt(folder)
    finally:
        sys.settrace(before)
    return counter[0]


def check_lines(tmp_path, stride, first):
    lines = interrupted_at_line(tmp_path / "whole", 10**9)
    assert lines > 500
    for at in range(first, lines, stride):
        folder = tmp_path / str(at)
        interrupted_at_line(folder, at)
        assert problems(folder) == [], f"interrupt at line {at}"
        assert compute(folder, force=True) == 0, f"after an interrupt at line {at}"


def test_an_interrupt_between_writes(tmp_path):
    check_lines(tmp_path, stride=331, first=117)


@pytest.mark.slow
def test_an_interrupt_at_any_line(tmp_path):
    check_lines(tmp_path, stride=83, first=1)
