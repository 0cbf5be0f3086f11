"""Files of pictures: formats, the same bytes each time, the command, nothing overwritten."""

from __future__ import annotations

import errno
from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image, ImageSequence

from fem_needle import ComputationError, SceneError
from fem_needle.figures import FORMATS, KINDS, animated_gif, courses, picture_bytes, shapes, tip_path, waterfall, write_pictures
from fem_needle.figures.animation import frame_rows
from fem_needle.run_target import FILES, PICTURES
from tests.unit.figures.runs import cut_off, run_named

STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.fixture
def folder(tmp_path):
    run_named("hub").save(tmp_path / "run")
    return tmp_path / "run"


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_run_gives_the_same_bytes(kind):
    first, second = (picture_bytes(draw(), kind) for draw in (lambda: tip_path(run_named("hold")),) * 2)
    assert first == second
    assert first.startswith(STARTS[kind])


def test_the_map_in_a_vector_picture_is_the_same_each_time():
    first, second = (picture_bytes(waterfall(run_named("still")), "svg") for _ in range(2))
    assert first == second


def test_letters_in_a_vector_picture_are_letters():
    svg = picture_bytes(shapes(run_named("hub")), "svg").decode()
    assert ">deflection [mm]</text>" in svg
    assert "<dc:date>" not in svg
    assert b"CreationDate" not in picture_bytes(courses(run_named("hub")), "pdf")


def test_an_unknown_format_is_refused():
    with pytest.raises(ValueError, match=r"jpg.*allowed png, svg, pdf"):
        picture_bytes(shapes(run_named("hub")), "jpg")


def test_a_moving_picture_moves_from_the_first_to_the_last_sample():
    run = cut_off(run_named("hub"), 4)
    content = animated_gif(run)
    frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(Image.open(BytesIO(content)))]
    assert len(frames) == len(run.time) and len(content) < 3e6
    assert all(np.any(one != other) for one, other in pairwise(frames))
    assert (frame_rows(run)[0], frame_rows(run)[-1]) == (0, len(run.time) - 1)


def test_one_sample_is_one_frame():
    assert Image.open(BytesIO(animated_gif(run_named("one sample")))).n_frames == 1


def test_frames_of_a_long_run_are_spread_over_the_time():
    run = run_named("hub")
    many = cut_off(run, len(run.time))
    object.__setattr__(many, "time", np.linspace(0.0, 1.0, 1001) ** 3)
    rows = frame_rows(many)
    assert len(rows) == 60 and np.all(np.diff(rows) > 0)
    np.testing.assert_allclose(np.diff(many.time[rows]), 1.0 / 59.0, atol=4e-3)


def test_the_run_folder_knows_every_picture():
    assert set(PICTURES) == set(KINDS)
    assert {f"{name}.{ending}" for name in PICTURES.values() for ending in FORMATS} | {"animation.gif"} <= set(FILES)


def test_the_command_draws_every_kind_once(folder, command_line):
    status, out, _ = command_line("plot", folder)
    names = {f"{name}.png" for name in PICTURES.values()}
    assert status == 0 and names <= {path.name for path in folder.iterdir()}
    assert out.count("wrote ") == len(names)
    status, _, told = command_line("plot", folder)
    assert (status, "exists already; --force" in told) == (2, True)


def test_the_command_draws_what_is_asked_for_where_it_is_asked_for(folder, tmp_path, command_line):
    arguments = ("--kind", "tip-path", "--format", "svg", "--format", "pdf", "--out", tmp_path / "new" / "place")
    assert command_line("plot", folder, *arguments)[0] == 0
    assert {path.name for path in (tmp_path / "new" / "place").iterdir()} == {"tip_path.svg", "tip_path.pdf"}
    assert command_line("plot", folder, *arguments[:4], *arguments[6:], "--force")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--kind", "cake"), "kind: is not a choice (got 'cake'; allowed shapes, tip-path"),
        (("--format", "jpg"), "format: is not a choice (got 'jpg'; allowed png, svg, pdf)"),
        (("--depth", "90cm"), "depths: is not a depth of the run (got 900 mm; allowed 5 to 100 mm"),
        (("--depth", "deep"), "--depth: "),
    ],
)
def test_wrong_options_are_told_and_nothing_is_written(folder, command_line, arguments, message):
    before = sorted(folder.iterdir())
    status, _, told = command_line("plot", folder, *arguments)
    assert (status, message in told) == (2, True), told
    assert sorted(folder.iterdir()) == before


def test_a_depth_chooses_the_shapes(folder, command_line):
    assert command_line("plot", folder, "--kind", "shapes", "--format", "svg", "--depth", "50mm")[0] == 0
    content = (folder / "shapes.svg").read_text(encoding="utf-8")
    assert content.count("mm deep</text>") == 1 and ">50 mm deep</text>" in content


def test_pictures_go_with_the_run_that_is_replaced(folder):
    write_pictures(run_named("hub"), folder, ["shapes"], ["png", "svg"])
    run_named("hub").save(folder, force=True)
    assert not list(folder.glob("shapes.*"))


def test_a_picture_that_cannot_be_written_is_told(folder):
    (folder / "shapes.png").mkdir()
    with pytest.raises(SceneError, match="it is a folder"):
        write_pictures(run_named("hub"), folder, ["shapes"], force=True)


def test_a_full_disk_is_told(folder, monkeypatch):
    def full(path, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("fem_needle.atomic_file.write_atomically", full)
    with pytest.raises(ComputationError, match=r"cannot be written: No space left on device"):
        write_pictures(run_named("hold"), folder, ["tip-path"])
