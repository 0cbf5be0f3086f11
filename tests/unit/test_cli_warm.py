"""The command warm, and what is shown while something is compiled."""

import io
import os
import pickle
import re
import subprocess
import sys
from copy import deepcopy

import pytest

from fem_needle.cli.waiting import compilations_shown
from fem_needle.dynamics import notice
from fem_needle.dynamics.compilation import Entrance
from fem_needle.dynamics.warming import ENTRANCES, prepare, warm
from tests.house.source import ROOT, python_files

FUNCTIONS_MISSED = 0.2  # of those that an entrance expects


def test_every_entrance_is_warmed():
    written = [
        path.stem for path in python_files("fem_needle") for _ in re.findall(r"^@entrance\(", path.read_text(), re.MULTILINE)
    ]
    assert sorted(entrance.__module__.rpartition(".")[2] for entrance in ENTRANCES) == sorted(written)


def test_warm_says_what_it_did(command_line):
    status, out, err = command_line("warm")
    assert status == 0, err
    for line, entrance in zip(out.splitlines(), ENTRANCES, strict=True):
        assert re.match(rf"{entrance.what}: (compiled|there already, loaded) in ", line) and str(entrance.folder) in line


def test_what_cannot_be_kept_fails(command_line, monkeypatch):
    monkeypatch.setattr(Entrance, "is_kept", property(lambda self: False))
    status, _, err = command_line("warm")
    assert status == 1
    assert (
        err.splitlines()[-1]
        == f"error: the {ENTRANCES[0].what} is compiled, but cannot be kept: name a folder in NUMBA_CACHE_DIR"
    )


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_a_terminal_shows_a_bar(monkeypatch, stream):
    monkeypatch.setattr(sys, "stderr", stream())
    monkeypatch.setattr("fem_needle.progress_bar.PATIENCE", 0.0)
    with compilations_shown():
        notice.begun("time loop", 20, is_kept=True)
        for share in (0.3, 1.0):
            notice.done("time loop", share)
    text = sys.stderr.getvalue()
    assert ("compiling the time loop" in text and "100%" in text) == (stream is Terminal)


def test_nobody_watches_what_is_over(monkeypatch):
    seen = []
    with notice.watched(lambda what, share: seen.append("outer")), notice.watched(lambda what, share: seen.append("inner")):
        notice.done("time loop", 0.5)
    notice.done("time loop", 0.6)
    assert seen == ["inner"]


def test_a_copy_of_an_entrance_is_the_entrance():
    for entrance in ENTRANCES:
        assert deepcopy(entrance) is entrance and pickle.loads(pickle.dumps(entrance)) is entrance


@pytest.mark.slow
@pytest.mark.parametrize("entrance", ENTRANCES, ids=lambda entrance: entrance.__name__)
def test_a_cold_entrance_compiles_as_many_functions_as_it_expects(tmp_path, entrance):
    code = f"from {entrance.__module__} import {entrance.__name__} as e; e.prepare(); print(e.compiled, e.is_kept)"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=ROOT, capture_output=True, text=True, timeout=300, check=True
    )
    assert done.stderr.startswith(f"compiling the {entrance.what}, once on this machine (some ")
    compiled, is_kept = done.stdout.split()
    assert is_kept == "True"
    assert abs(int(compiled) - entrance.functions) <= FUNCTIONS_MISSED * entrance.functions


def test_warming_tells_what_was_there():
    prepare()
    assert [done.what for done in warm()] == [entrance.what for entrance in ENTRANCES]
    assert all(done.functions == entrance.compiled for done, entrance in zip(warm(), ENTRANCES, strict=True))
