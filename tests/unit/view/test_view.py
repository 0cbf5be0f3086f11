"""A run in three dimensions: where things stand, what is said, which way arrows point, who draws."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from fem_needle import SceneError, load_scene, run_scene
from fem_needle.errors import NeedleError
from fem_needle.run_folder import save_run
from fem_needle.scene import Guide, LateralLoad
from fem_needle.view import Renderer, arrangement, picture, write_picture
from fem_needle.view.drawing import drawing, layer_labels
from fem_needle.view.html import _figure, _times, html_page, shown_rows
from fem_needle.view.solids import arrow, box, plate, tube
from tests.consistency.scenes import LAYERS, moving, scene_of

LATERAL = (LateralLoad(position=-0.02, force=0.4),)
SCENE = scene_of(
    "hub", moving(0.1, 0.02, 0.08), layers=LAYERS, loads=LATERAL, support={"guides": (Guide(position=-0.05),)},
    numerics={"analysis": "static", "output_step": 0.1}, duration=0.6, title="needle <b>one</b>",
)  # fmt: skip


@pytest.fixture(scope="module")
def arranged():
    return arrangement(run_scene(SCENE))


def volume(surface):
    """Return the volume inside a closed surface whose triangles turn outward."""
    a, b, c = (surface.points[surface.triangles[:, corner]] for corner in range(3))
    return float(np.sum(np.einsum("ij,ij->i", a, np.cross(b, c)))) / 6.0


def test_solids_are_closed_and_turn_outward():
    line = np.column_stack((np.linspace(0.0, 10.0, 5), np.zeros(5), np.zeros(5)))
    polygon = 12 * 0.5 * np.sin(2 * np.pi / 12)  # area of the tube's cross-section of radius 1
    assert volume(tube(line, 1.0)) == pytest.approx(10.0 * polygon)
    assert volume(box(1.0, 3.0, 0.5)) == pytest.approx(2.0)
    solid = arrow(np.zeros(3), np.array([0.0, -4.0, 0.0]), 0.1)
    assert volume(solid) > 0.0
    assert solid.points[:, 1].min() == pytest.approx(-4.0) and solid.points[:, 1].max() == pytest.approx(0.0)
    assert np.allclose(plate(5.0, 1.0, 2.0).points[:, 0], 5.0)


def test_the_needle_stands_where_the_run_says(arranged):
    pose, run = arranged.pose(3), arranged.run
    assert pose.tip == pytest.approx([1e3 * run.depth[3], 1e3 * arranged.magnification * run.tip_deflection[3], 0.0])
    assert pose.needle.points[:, 0].min() == pytest.approx(1e3 * (run.depth[3] - 0.2))
    assert f"depth {1e3 * run.depth[3]:.4g} mm" in pose.caption


def test_arrows_point_where_forces_push(arranged):
    """The load pushes up, at -20 mm, its tip on the needle; its supports push down in sum, less what the tissue takes."""
    pose = arranged.pose(0)
    points = pose.loads.points
    assert np.allclose(np.unique(np.round(points[np.argmax(points[:, 1]), 0])), -20.0)
    line = arranged._line(0)
    assert points[:, 1].max() == pytest.approx(np.interp(-20.0, line[:, 0], line[:, 1]))
    assert points[:, 1].max() - points[:, 1].min() == pytest.approx(arranged.newton * 0.4)
    guide = arranged.run.guide_force[0, 0]
    near = pose.reactions.points[np.abs(pose.reactions.points[:, 0] + 50.0) < 5.0]
    assert np.sign(guide) == -1.0 and near[:, 1].max() - near[:, 1].min() == pytest.approx(-arranged.newton * guide, rel=0.01)


def test_what_is_not_to_scale_is_said(arranged):
    assert arranged.note.startswith(f"deflections {arranged.magnification:g} times as large; arrows: 25 mm = ")
    assert arranged.note in drawing(arranged, 0).caption
    shown = 1e3 * arranged.magnification * np.max(np.abs(arranged.run.station_deflection))
    assert 0.4 * 25.0 <= shown <= 25.0  # an eighth of 200 mm, by steps of 1, 2, 5


@pytest.mark.parametrize(("magnification", "said"), [(3.0, 3), (None, 1)])
def test_magnification_may_be_given_and_a_needle_at_rest_has_none(magnification, said):
    run = run_scene(SCENE.with_values({"loads": []}))
    assert arrangement(run, magnification).note.startswith(f"deflections {said} times as large")
    assert "arrows" not in arrangement(run).note


def test_layers_and_ruler(arranged):
    assert [(slab.start, slab.end) for slab in arranged.slabs] == [(0.0, 50.0), (50.0, 80.0), (100.0, 150.0)]
    assert [slab.number for slab in arranged.slabs] == [0, 1, 2]
    assert arranged.slabs[1].label.replace("\u00a0", " ") == "layer 1, 20 kN/m\u00b2"
    assert arranged.ruler.tolist() == pytest.approx(np.arange(-150.0, 151.0, 50.0))


def test_a_guide_on_a_spring_is_told_from_a_rigid_one():
    guides = [{"position": -0.02}, {"position": -0.05, "stiffness": 300.0}]
    drawn = drawing(arrangement(run_scene(SCENE.with_values({"support.guides": guides}))), 0)
    plates = {part.name: part for part in drawn.parts if "guides" in part.name}
    places = {name: set(part.surface.points[:, 0].tolist()) for name, part in plates.items()}
    assert places == {"rigid guides": {-20.0}, "guides on springs": {-50.0}}
    assert len({part.color for part in plates.values()}) == 2 and {*plates} <= {name for name, _ in drawn.legend}
    page = html_page(arrangement(run_scene(SCENE)))
    assert ">rigid guides</label>" in page and "guides on springs" not in page


THIN = [{"name": f"a layer of fat {n}", "start": n / 100, "end": (n + 1) / 100, "foundation_modulus": 5e3} for n in range(8)]


@pytest.mark.parametrize(("layers", "named"), [(THIN, False), (THIN[:1], True)])
def test_names_of_layers_that_have_no_room_give_way_to_numbers_with_a_key(layers, named):
    arranged = arrangement(run_scene(SCENE.with_values({"tissue.layers": layers})))
    texts, caption = [label.text for label in layer_labels(arranged)], drawing(arranged, 0).caption.replace("\u00a0", " ")
    assert texts == ([slab.label for slab in arranged.slabs] if named else [str(n) for n in range(8)])
    assert ("0: a layer of fat 0, 5 kN/m²" in caption) is not named


def test_a_page_numbers_its_layers_and_its_key_hides_the_right_parts(arranged):
    page = html_page(arranged)
    assert [label.text for label in layer_labels(arranged, numbered=True)] == ["0", "1", "2"]
    assert '"text":"layer 0, ' not in page and "0: 5\u00a0kN/m²</label>" in page
    figure = _figure(arranged, shown_rows(7), 0)
    boxes = re.findall(r'value="(\d+)"><i style="background: (#\w+)"', page)
    assert len(boxes) == 3 + 1 + 3 and [figure.data[int(number)].color for number, _ in boxes] == [color for _, color in boxes]
    assert "7 of 7 samples" in page


def test_times_at_the_slider_have_no_more_digits_than_they_need(arranged):
    long = replace(arranged.run, time=np.linspace(0.0, 9.97, 7))
    assert _times(replace(arranged, run=long), list(range(7))) == ["0", "2", "3", "5", "7", "8", "10"]
    short = replace(arranged.run, time=np.linspace(0.0, 6e-4, 7))
    assert _times(replace(arranged, run=short), [0, 1, 6]) == ["0", "0.0001", "0.0006"]


@pytest.mark.parametrize("magnification", [0.0, -2.0, np.inf, np.nan])
def test_impossible_magnifications(arranged, magnification):
    with pytest.raises(SceneError, match="--magnification: is no positive number"):
        arrangement(arranged.run, magnification)


def test_times_outside_the_run(arranged):
    assert arranged.row(None) == len(arranged.run.time) - 1
    assert arranged.row(0.31) == 3
    with pytest.raises(SceneError, match=r"--time: not in the run \(got 2; allowed 0 to 0.6 s\)"):
        arranged.row(2.0)


def test_a_page_has_frames_for_the_samples_and_needs_no_network(arranged):
    page = html_page(arranged, 2)
    assert "needle &lt;b&gt;one&lt;/b&gt;" in page and "<b>one</b>" not in page
    assert page.count('"name":"6"') == 1 and '"active":2' in page
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", page)
    assert f"Deflections {arranged.magnification:g} times as large" in page


def test_a_page_of_a_long_run_has_samples_spread_over_it():
    rows = shown_rows(1001, 333)
    assert (len(rows), rows[0], rows[-1]) == (61, 0, 1000) and 333 in rows
    assert shown_rows(3) == [0, 1, 2]


def colors(path):
    image = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    return {tuple(color) for color in np.unique(image, axis=0).tolist()}


def test_matplotlib_draws_where_it_is_asked(arranged, tmp_path):
    assert write_picture(arranged, 0, tmp_path / "a.png", Renderer.MATPLOTLIB) is Renderer.MATPLOTLIB
    assert len(colors(tmp_path / "a.png")) > 100


def test_a_crash_of_vtk_falls_back_to_matplotlib_and_is_announced(arranged, monkeypatch, tmp_path, command_line):
    class Crashing:
        def __init__(self, *_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

        def submit(self, *_):
            raise BrokenProcessPool("the process ended")

    monkeypatch.setattr(picture, "ProcessPoolExecutor", Crashing)
    assert write_picture(arranged, 0, tmp_path / "a.png") is Renderer.MATPLOTLIB
    with pytest.raises(NeedleError, match="--renderer: VTK cannot draw here: it finds no GL"):
        write_picture(arranged, 0, tmp_path / "b.png", Renderer.VTK)
    save_run(arranged.run, tmp_path / "run", vtk=False)
    status, out, err = command_line("view", str(tmp_path / "run"), "--picture", str(tmp_path / "c.png"))
    assert status == 0 and "times as large" in out
    assert "note: VTK found no GL here, so matplotlib drew it" in err


@pytest.mark.slow
def test_vtk_draws_the_needle(arranged, tmp_path):
    """Where there is GL: the needle's dark pixels move when the magnification grows."""
    drawer = write_picture(arranged, 6, tmp_path / "a.png")
    if drawer is not Renderer.VTK:
        pytest.skip("no GL here")
    assert len(colors(tmp_path / "a.png")) > 20
    write_picture(arrangement(arranged.run, 5 * arranged.magnification), 6, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


WINDOW = """
import os, sys
os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
from pathlib import Path
import pyvista as pv
from fem_needle.run_folder import load_run
from fem_needle.view import arrangement
from fem_needle.view.by_vtk import show

pv.OFF_SCREEN = True
moves = []
def kept(plotter, move, *_, **__):
    moves.append(move)
def shown(plotter):
    print(plotter.actors["needle"].bounds[1])
    moves[0](0.0)
    print(plotter.actors["needle"].bounds[1])
pv.Plotter.add_slider_widget, pv.Plotter.show = kept, shown
show(arrangement(load_run(Path(sys.argv[1]))), 6)
"""


@pytest.mark.slow
def test_the_slider_of_the_window_moves_the_needle(arranged, tmp_path):
    save_run(arranged.run, tmp_path / "run", vtk=False)
    done = subprocess.run([sys.executable, "-c", WINDOW, str(tmp_path / "run")], capture_output=True, text=True, check=False)
    if done.returncode < 0:
        pytest.skip("no GL here")
    assert [float(line) for line in done.stdout.split()] == pytest.approx([80.0, 20.0], abs=0.01), done.stderr


@pytest.fixture
def view(command_line, arranged, monkeypatch, tmp_path):
    save_run(arranged.run, tmp_path / "run", vtk=False)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return lambda *arguments: command_line("view", "run", *arguments)


def test_without_a_display_a_picture_is_left_in_the_run(view, tmp_path):
    status, out, err = view("--renderer", "matplotlib")
    assert status == 0 and "wrote run/view.png" in out
    assert "note: no display that answers, so a picture in place of a window" in err
    assert view("--renderer", "matplotlib")[0] == 2
    assert view("--renderer", "matplotlib", "--force")[0] == 0


def test_a_page_by_the_command(view, tmp_path):
    status, out, _ = view("--html", "a.html", "--time", "0.2 s", "--magnification", "7")
    assert status == 0 and "wrote a.html: 7 of 7 samples; deflections 7 times as large" in out
    assert '"active":2' in (tmp_path / "a.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--renderer", "vtk", "--html", "a.html"), "--renderer: has no effect without --picture"),
        (("--renderer", "paint", "--picture", "a.png"), "is not a choice (got 'paint'; allowed auto, vtk, matplotlib)"),
        (("--time", "9", "--picture", "a.png"), "--time: not in the run (got 9; allowed 0 to 0.6 s)"),
        (("--picture", "a.jpg"), "--picture: is no PNG file by its name (got 'a.jpg'; allowed a name that ends in .png)"),
        (("--magnification", "-1", "--html", "a.html"), "--magnification: is no positive number (got -1)"),
    ],
)
def test_mistakes(view, arguments, message):
    status, _, err = view(*arguments)
    assert status == 2 and message in err


def test_a_display_gets_a_window(view, monkeypatch):
    shown = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("fem_needle.cli.view._answers", lambda: True)
    monkeypatch.setattr("fem_needle.view.by_vtk.show", lambda arranged, row: shown.append(row))
    assert view("--time", "0.3")[0] == 0
    assert shown == [3]


def test_the_arrow_at_the_tip_shows_its_force():
    run = run_scene(load_scene("thesis").with_values({"numerics.output_step": 8.0}))
    run.series["tip_force"] = np.array([0.1, -0.1, 0.1])  # as a loop turns it
    arranged = arrangement(run)
    poses = [arranged.pose(row) for row in range(3)]
    ways = [1 if pose.loads.points[:, 1].max() <= pose.tip[1] + 1e-9 else -1 for pose in poses]  # the arrow ends at the tip
    assert ways == [1, -1, 1]


def test_frames_say_their_own_time(arranged):
    captions = re.findall(r'"title":\{"text":"([^"]+)"', html_page(arranged))
    texts = {json.loads(f'"{caption}"') for caption in captions}
    assert {arranged.pose(row).caption for row in range(7)} <= texts
