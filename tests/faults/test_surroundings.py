"""Terminals, folders and displays that are not as they should be: a message, never a traceback."""

import json
import os
import subprocess
import sys

import pytest

from fem_needle import load_scene, run_scene
from fem_needle.run_folder import save_run
from fem_needle.shipped import template_text
from tests.house.source import ROOT

FIT = ("--analysis", "static", "--fit", "tissue.layers.0.foundation_modulus")
RUN = ("--out", "{place}/x")
# Every command that writes, and where to; `{run}` is a run folder.
WRITERS = {
    "run": ("run", "thesis", *RUN),
    "steer": ("steer", "steering", *RUN),
    "steer, repeated": ("steer", "steering", "--repeat", "2", *RUN),
    "converge": ("converge", "thesis", *RUN),
    "analyze": ("analyze", "thesis", *RUN),
    "compare": ("compare", "thesis", *RUN),
    "identify": ("identify", "brachytherapy", "brachytherapy-tips", *FIT, *RUN),
    "benchmark": ("benchmark", "S", "--quick", *RUN),
    "record": ("benchmark", "S", "--quick", "--record", "{place}/x"),
    "validate": ("validate", *RUN),
    "experiments": ("experiments", *RUN),
    "stress": ("stress", "--scenes", "0", *RUN),
    "export": ("export", "{run}", "--format", "csv", *RUN),
    "frames": ("export", "{run}", "--format", "pvd", *RUN),
    "plot": ("plot", "{run}", *RUN),
    "picture": ("view", "{run}", "--picture", "{place}/x.png"),
    "page": ("view", "{run}", "--html", "{place}/x.html"),
    "report": ("report", "{run}", *RUN),
    "new": ("new", "{place}/x"),
}
OTHERS = {"check": ("check", "thesis"), "scenes": ("scenes",), "warm": ("warm",), "schema": ("schema",)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("here") / "run"
    save_run(run_scene(load_scene("thesis").with_value("numerics.output_step", 8.0)), path, vtk=False)
    return path


def placed(arguments, folder, place):
    return [text.format(run=folder, place=place) for text in arguments]


@pytest.mark.parametrize("arguments", WRITERS.values(), ids=WRITERS)
def test_a_file_in_place_of_a_folder_is_refused_first(command_line, folder, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    status, out, err = command_line(*placed(arguments, folder, "file"))
    assert (status, out) == (2, "")
    assert err.splitlines()[-1].startswith("error: file/x") and "file is no folder" in err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("arguments", WRITERS.values(), ids=WRITERS)
def test_a_read_only_folder_is_refused_before_anything_is_computed(command_line, folder, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    usual = os.access  # whoever may do everything can write there
    monkeypatch.setattr(os, "access", lambda path, mode: mode & os.W_OK == 0 and usual(path, mode))
    status, out, err = command_line(*placed(arguments, folder, "new"))
    assert (status, out) == (2, "")
    assert f"{tmp_path} is read-only for this user" in err
    assert list(tmp_path.iterdir()) == []


def test_missing_folders_of_a_picture_are_made(command_line, folder, tmp_path):
    assert command_line("view", folder, "--picture", tmp_path / "a" / "b" / "x.png", "--renderer", "matplotlib")[0] == 0
    assert (tmp_path / "a" / "b" / "x.png").exists()


@pytest.mark.parametrize("arguments", (WRITERS | OTHERS).values(), ids=WRITERS | OTHERS)
def test_a_working_folder_that_is_gone(command_line, folder, tmp_path, monkeypatch, arguments):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    status, out, err = command_line(*placed(arguments, folder, "."))
    assert (status, out) == (2, "")
    assert err == "error: the working folder: has been removed or cannot be read (enter another one with cd)\n"


def started(*arguments, **environment):
    command = [sys.executable, "-m", "fem_needle", *map(str, arguments)]
    done = subprocess.run(command, env=os.environ | environment, cwd=ROOT, capture_output=True, timeout=100, check=False)
    assert b"Traceback" not in done.stderr, done.stderr
    return done


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_letters_that_a_terminal_does_not_know_are_replaced(tmp_path, encoding):
    scene = tmp_path / "letters.toml"
    scene.write_text(template_text().replace('name = "tissue"', 'name = "Gel → Öl"'), encoding="utf-8")
    done = started("check", scene, PYTHONIOENCODING=encoding, PYTHONUTF8="0")
    assert done.returncode == 0
    assert ("Gel ? Öl" if encoding == "cp1252" else "Gel ? ?l") in done.stdout.decode(encoding)


def test_json_stays_json_where_letters_are_unknown(tmp_path):
    done = started("schema", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.returncode == 0
    assert json.loads(done.stdout.decode("ascii")) == json.loads(started("schema", PYTHONIOENCODING="utf-8").stdout)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device here")
def test_an_output_that_is_full():
    with open("/dev/full", "wb") as full:
        command = [sys.executable, "-m", "fem_needle", "scenes"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, cwd=ROOT, timeout=100, check=False)
    assert done.returncode == 1
    assert b"Traceback" not in done.stderr and b"No space left on device" in done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="displays of X")
@pytest.mark.parametrize("display", [{"DISPLAY": ":4711"}, {"DISPLAY": "", "WAYLAND_DISPLAY": "wayland-4711"}])
def test_a_display_that_does_not_answer_gets_a_picture(command_line, folder, monkeypatch, display):
    for name, value in display.items():
        monkeypatch.setenv(name, value)
    status, out, err = command_line("view", folder, "--force", "--renderer", "matplotlib")
    assert (status, out.startswith(f"wrote {folder}")) == (0, True)
    assert "note: no display that answers" in err
    assert (folder / "view.png").stat().st_size > 1000
