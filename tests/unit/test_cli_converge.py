"""The command `converge`: files that other readers open, and exit statuses."""

from __future__ import annotations

import csv
import json
import struct
import zlib
from functools import partial

import pytest

from fem_needle import load_scene

FILES = {"converge.csv", "converge.json", "converge.png", "manifest.json", "scene.toml"}
QUICK = ("bench-s", "--degree", "3", "--values", "4,8,16")


@pytest.fixture
def converge(command_line, monkeypatch, tmp_path):
    """Run `converge`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "converge")


def png_size_and_pixels(path):
    """Width and height from the header, and the unpacked image data."""
    content = path.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    place, data, size = 8, b"", (0, 0)
    while place < len(content):
        length, kind = struct.unpack(">I4s", content[place : place + 8])
        body = content[place + 8 : place + 8 + length]
        size = struct.unpack(">II", body[:8]) if kind == b"IHDR" else size
        data += body if kind == b"IDAT" else b""
        place += length + 12
    return size, zlib.decompress(data)


def test_a_study_leaves_files_and_a_table(converge, tmp_path):
    status, out, err = converge(*QUICK)
    assert (status, err) == (0, "")
    folder = tmp_path / "runs" / "bench-s-converge"
    assert {path.name for path in folder.iterdir()} == FILES
    data = json.loads((folder / "converge.json").read_text())
    with (folder / "converge.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["value"] for row in data["rows"]] == [int(row["elements [1]"]) for row in table] == [4, 8, 16]
    assert [row["error"] for row in data["rows"]] == [float(row["error [1]"]) for row in table]
    assert data["reference"].startswith("exact")
    assert (data["over"], data["theoretical_order"], data["held"]["degree"]) == ("elements", 4.0, 3)
    lines = [line.split() for line in out.splitlines()]
    (finest,) = [words for words in lines if words[:1] == ["16"]]
    assert finest[1] == f"{1e3 * data['rows'][-1]['tip_deflection']:.9f}"
    assert "reference: exact" in out
    assert "held fixed: analysis static, model fem, degree 3" in out
    assert "files: runs/bench-s-converge" in out


def test_the_picture_has_its_size_and_is_not_blank(converge, tmp_path):
    assert converge(*QUICK, "--out", "study")[0] == 0
    size, pixels = png_size_and_pixels(tmp_path / "study" / "converge.png")
    assert size == (840, 552)
    assert len(set(pixels)) > 20


@pytest.mark.parametrize("values", ["8,16", "64,128,256"])
def test_pictures_of_little_are_drawn(converge, tmp_path, values):
    """Two rows; nothing but round-off."""
    assert converge("bench-s", "--values", values, "--out", "study")[0] == 0
    assert png_size_and_pixels(tmp_path / "study" / "converge.png")[0] == (840, 552)


def test_json_is_the_file_and_nothing_else(converge, tmp_path):
    status, out, err = converge(*QUICK, "--json", "--out", "study")
    assert (status, err) == (0, "")
    assert out == (tmp_path / "study" / "converge.json").read_text()


def test_the_scene_beside_a_study_has_its_settings(converge, tmp_path):
    assert converge(*QUICK, "--out", "study", "--set", "needle.length=150 mm", "--analysis", "static")[0] == 0
    scene = load_scene(tmp_path / "study" / "scene.toml")
    assert (scene.needle.length, scene.numerics.degree, scene.numerics.analysis) == (0.15, 3, "static")


def test_time_steps_with_units(converge, tmp_path):
    short = ("--set", "run.duration=2 ms", "--elements", "2")
    status, out, err = converge("bench-d", "--over", "time-step", "--values", "0.1ms,5e-5, 25 us", *short, "--out", "study")
    assert (status, err) == (0, "")
    data = json.loads((tmp_path / "study" / "converge.json").read_text())
    assert [row["value"] for row in data["rows"]] == [1e-4, 5e-5, 25e-6]
    assert data["held"]["elements"] == 2
    assert data["reference"].startswith("exact: sum over modes")
    assert "time step [s]" in out


@pytest.mark.parametrize(
    ("requirement", "message"),
    [
        (("--require-rate", "4.5"), "--require-rate: it is 3.99"),
        (("--require-error", "1e-12"), "--require-error: it is 5.86e-09, required at most 1e-12"),
    ],
)
def test_what_is_required_and_missed_fails_after_the_files_are_written(converge, tmp_path, requirement, message):
    status, _, err = converge(*QUICK, "--out", "study", *requirement)
    assert status == 1
    assert message in err
    assert {path.name for path in (tmp_path / "study").iterdir()} == FILES


def test_what_is_required_and_met(converge):
    assert converge(*QUICK, "--require-rate", "3.9", "--require-error", "1e-8")[0] == 0


def test_a_rate_cannot_be_met_by_round_off(converge):
    status, _, err = converge("bench-s", "--values", "64,128,256", "--require-rate", "-99")
    assert status == 1
    assert "--require-rate: there is none" in err


def test_default_folders_are_numbered_and_named_ones_are_guarded(converge, tmp_path):
    for name in ("bench-s-converge", "bench-s-converge-2"):
        assert converge(*QUICK)[0] == 0
        assert (tmp_path / "runs" / name / "converge.csv").exists()
    assert converge(*QUICK, "--out", "study")[0] == 0
    status, _, err = converge(*QUICK, "--out", "study")
    assert status == 2
    assert "--force" in err
    assert converge("bench-s", "--values", "2,4", "--out", "study", "--force")[0] == 0
    assert len(json.loads((tmp_path / "study" / "converge.json").read_text())["rows"]) == 2


def test_a_run_is_never_replaced_by_a_study(converge, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    (run / "manifest.json").write_text('{"format": 1, "versions": {"fem-needle": "0"}}')
    (run / "series.nc").write_bytes(b"precious")
    status, _, err = converge(*QUICK, "--out", "run", "--force")
    assert (status, (run / "series.nc").read_bytes()) == (2, b"precious")
    assert "holds a run" in err


def test_suspicious_values_are_told(converge):
    status, _, err = converge("bench-s", "--values", "1,2", "--set", "loads.0.force=5")
    assert status == 0
    assert "warning: the tip force 5 N bends the needle" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("bench-s", "--values", "4,x"), "--values: got '4,x'; allowed whole numbers"),
        (("bench-d", "--over", "time-step", "--values", "1 mm,2 mm"), "allowed times such as"),
        (("bench-s", "--over", "degree"), "allowed elements, time-step, modes"),
        (("bench-s", "--over", "time-step"), "series of equilibria"),
        (("no-such-scene",), "no file and no shipped scene"),
        (("bench-s", "--degree", "7"), "numerics.degree"),
    ],
)
def test_wrong_input_writes_nothing(converge, tmp_path, arguments, message):
    status, out, err = converge(*arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert list(tmp_path.iterdir()) == []
