"""Gains over the depth, the analysis of a scene, its files, and the command."""

import csv
import json
from functools import partial

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.optimize import brentq

from fem_needle import FiniteElementNeedle, SceneError, analyze, load_scene, solve_static
from fem_needle.analysis.depth_gains import depth_gains, tip_gains
from fem_needle.analysis.matlab import analysis_matlab
from fem_needle.analysis.picture import analysis_picture
from fem_needle.analysis.study import scene_depths
from fem_needle.exact import exact_static
from fem_needle.linear.linearization import linearize
from fem_needle.scene import Guide, LateralLoad, Layer, Needle, Table, TipLoad
from tests.consistency.scenes import GEL, held, moving, profile, scene_of

TUBE = Needle(length=0.2, bending_stiffness=0.01572, mass_per_length=0.004)
KEYS = {"lateral_force": "loads.0.force", "tip_force": "loads.1.force", "hub_deflection": "support.hub_deflection"}


@pytest.fixture(autouse=True)
def few_points(monkeypatch):
    """Curves of 31 points: enough for every sign change here but the last one at the skin."""
    monkeypatch.setattr("fem_needle.analysis.depth_gains.POINTS", 31)


def pushed_at_the_skin(modulus):
    layers = (Layer(foundation_modulus=modulus),)
    return scene_of("hub", held(0.1), layers, [LateralLoad(position=0.0, force=1.0)], needle=TUBE)


@pytest.mark.parametrize(("modulus", "depths"), [(2e3, [145.72]), (1e4, [68.67]), (5e4, [36.90, 165.7])])
def test_sign_changes_of_a_force_at_the_skin(modulus, depths):
    scene = pushed_at_the_skin(modulus)
    found = [one for one in depth_gains(FiniteElementNeedle(scene, elements=16)).sign_changes if one.input == "lateral_force"]
    assert [1e3 * change.depth for change in found] == pytest.approx(depths, abs=0.1)
    assert [change.sign_beyond for change in found] == [-1, 1][: len(depths)]
    for change in found:
        around = change.depth - 2e-3, change.depth + 2e-3
        exact = brentq(lambda depth: exact_static(scene, depth).tip_deflection, *around)
        assert change.depth == pytest.approx(exact, abs=2e-6)


def test_gains_are_differences_of_equilibria():
    guides = {"guides": [Guide(position=-0.03)], "hub_deflection": 1e-3}
    scene = scene_of("hub", held(0.1), GEL, [LateralLoad(position=-0.0123, force=0.3), TipLoad(force=0.1)], support=guides)
    plant, depth = FiniteElementNeedle(scene, elements=8), 0.0911
    before = solve_static(plant, depth=depth).tip_deflection
    model = linearize(plant, depth=depth, axial="held")
    curve = depth_gains(plant, [depth])
    gains = dict(zip([one.name for one in curve.inputs], tip_gains(plant, depth), strict=True))
    for name, key in KEYS.items():
        value = scene.to_dict(complete=True)["support"]["hub_deflection"] if name == "hub_deflection" else None
        start = value if value is not None else scene.loads[int(key.split(".")[1])].force
        after = solve_static(FiniteElementNeedle(scene.with_value(key, start + 1.0), elements=8), depth=depth)
        assert gains[name] == pytest.approx(after.tip_deflection - before, rel=1e-8)
        assert model.static_gain("tip_deflection", name) == pytest.approx(gains[name], rel=1e-7)
    step = 1e-5
    tips = [solve_static(plant, depth=depth + sign * step).tip_deflection for sign in (1, -1)]
    assert gains["depth"] == pytest.approx((tips[0] - tips[1]) / (2 * step), rel=1e-6)


def test_depths_of_a_scene():
    assert scene_depths(scene_of("entry", held(0.1))) == [0.1]
    assert scene_depths(scene_of("entry", moving(0.1, 0.02, 0.1))) == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1])
    there_and_back = profile([0.0, 1.0, 2.0], [0.05, 0.13, 0.05])
    assert scene_depths(scene_of("entry", there_and_back, duration=2.0))[-1] == pytest.approx(0.13)
    assert scene_depths(load_scene("liver-push")) == pytest.approx([0.002, 0.0165, 0.031, 0.0455, 0.06])
    assert scene_depths(scene_of("entry", moving(0.1, 0.0, 0.1)))[0] == pytest.approx(0.002)


def test_an_analysis_of_a_scene():
    scene = load_scene("brachytherapy").with_value("numerics.elements", 4)
    found = analyze(scene, [0.06, 0.09], time=5.0)
    shallow, deep = found.points
    assert shallow.gains["lateral_force"] > 0 > deep.gains["lateral_force"]
    assert shallow.verdict("controllable").holds
    straight = analyze(scene, [0.06]).points[0]
    alone = straight.verdict("controllable", "push")
    assert (alone.dimension, alone.full, alone.holds) == (2, 14, False)
    assert alone.smallest <= alone.threshold
    assert straight.verdict("observable", "tip_deflection").dimension == 12
    assert straight.verdict("output-controllable", "push").dimension == 1
    with pytest.raises(SceneError, match="verdict"):
        straight.verdict("stable")
    with pytest.raises(SceneError, match="different"):
        analyze(scene, [0.06, 0.06])
    with pytest.raises(SceneError, match="rising"):
        depth_gains(found.plant, [0.1, 0.05])


def test_two_lateral_forces_have_numbers():
    loads = [LateralLoad(position=-0.02, force=0.0), LateralLoad(position=-0.01, force=0.0)]
    model = linearize(FiniteElementNeedle(scene_of("hub", held(0.1), GEL, loads), elements=3), depth=0.1, axial="held")
    assert [one.name for one in model.inputs][:2] == ["lateral_force_1", "lateral_force_2"]


def test_the_matlab_file_opens_again(tmp_path):
    found = analyze(load_scene("brachytherapy").with_value("numerics.elements", 3), [0.04, 0.06], axial="held")
    (tmp_path / "a.mat").write_bytes(analysis_matlab(found))
    content = loadmat(tmp_path / "a.mat", simplify_cells=True)
    for index, point in enumerate(found.points):
        for name in ("A", "B", "C", "D"):
            assert np.array_equal(content[name][:, :, index], getattr(point.model, name))
            assert np.array_equal(content["slow"][name][:, :, index], getattr(point.slow, name))
    assert content["depth"].tolist() == [0.04, 0.06]
    assert content["inputs"].tolist() == ["lateral_force", "tip_force", "hub_deflection", "hub_angle"]
    assert content["inputs_units"].tolist() == ["N", "N", "m", "rad"]
    assert content["slow"]["states"][0] == "mode_1"
    assert content["gain"].shape == (len(content["gain_depth"]), 5)
    assert content["natural_frequency"].shape == (len(content["gain_depth"]), 3)


@pytest.fixture
def command(command_line, monkeypatch, tmp_path):
    """Run `analyze`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "analyze")


FEW = ("--elements", "4")


def test_the_picture_says_that_its_frequencies_are_undamped(monkeypatch):
    drawn = []
    monkeypatch.setattr("fem_needle.analysis.picture.png_bytes", lambda figure: drawn.append(figure) or b"")
    analysis_picture(analyze(load_scene("brachytherapy").with_values({"numerics.elements": 2}), [0.06]))
    panel = drawn[0].axes[-1]
    assert panel.get_ylabel() == "undamped [Hz]" and "undamped" in panel.get_legend().get_texts()[0].get_text()


def test_the_command_leaves_its_files(command, tmp_path):
    depths = ("--depth", "60mm", "--depth", "0.09")
    status, out, err = command("brachytherapy", *FEW, *depths, "--time", "5 s")
    assert (status, err) == (0, "")
    assert "damped, overdamped ones left out; the picture and the CSV file have the undamped frequencies" in out
    assert "90 mm" in out and "mm/N" in out and "the tip goes against lateral force" in out
    folder = tmp_path / "runs" / "brachytherapy-analyze"
    plain = json.loads((folder / "analyze.json").read_text())
    assert [one["depth"] for one in plain["depths"]] == [0.06, 0.09]
    assert {"natural_frequencies", "damping_ratios", "poles", "static_gains", "verdicts"} <= set(plain["depths"][0])
    assert plain["depths"][0]["verdicts"][0]["singular_values"]
    with (folder / "analyze.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    gains = [float(row["tip_deflection / lateral_force [m/(N)]"]) for row in rows]
    change = next(one["depth"] for one in plain["sign_changes"] if one["input"] == "lateral_force")
    before = [gain for row, gain in zip(rows, gains, strict=True) if float(row["depth [m]"]) < change]
    assert min(before) > 0 > gains[len(before)]
    assert (folder / "analyze.png").read_bytes()[:4] == b"\x89PNG"
    assert loadmat(folder / "analyze.mat")["A"].shape[2] == 2
    assert (folder / "scene.toml").exists()


def test_json_and_a_lateral_force_that_the_scene_has_not(command):
    status, out, _ = command("release", *FEW, "--lateral-position", "-5mm", "--axial", "held", "--json", "--out", "one")
    assert status == 0
    plain = json.loads(out)
    assert plain["inputs"][0]["name"] == "lateral_force"
    assert plain["axial"] == "held"
    assert "push" not in plain["depths"][0]["static_gains"]
    response, one = plain["depths"][0]["transfer_functions"], plain["depths"][0]
    below, first = response["frequencies"][0], one["natural_frequencies"][0]
    # Far below the first vibration the tip answers its own force statically, raised by 1 / (1 - ratio^2) at most.
    static, found = one["static_gains"]["tip_force"], response["magnitudes"]["tip_force"]
    assert static * (1.0 - 1e-9) <= found[0] <= static / (1.0 - (below / first) ** 2)
    assert abs(response["phases"]["tip_force"][0]) < 1e-9
    assert max(found) > 2.0 * static
    assert set(response["magnitudes"]) == set(response["phases"]) == {signal["name"] for signal in plain["inputs"]}
    assert command("release", *FEW, "--out", "one")[0] == 2
    assert command("release", *FEW, "--out", "one", "--force")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("thesis", "--depth", "300mm"), "0.2 m"),
        (("thesis", "--depth", "fast"), "--depth"),
        (("thesis", "--depth", "2 s"), "--depth"),
        (("thesis", "--speed", "1 mm"), "--speed"),
        (("thesis", "--axial", "loose"), "'held'"),
        (("thesis", "--lateral-position", "-5mm"), "lateral"),
        (("brachytherapy", "--depth", "180mm"), "0.17 m"),
        (("brachytherapy", "--speed", "10mm/s"), "guides"),
        (("thesis", "--model", "magic"), "model.kind"),
        (("nothing-there",), "no file"),
    ],
)
def test_wrong_input_writes_nothing(command, tmp_path, arguments, message):
    status, out, err = command(*arguments, *FEW)
    assert (status, out) == (2, "")
    assert message in err
    assert list(tmp_path.iterdir()) == []


def test_a_model_with_mistakes_warns(command):
    options = ("--model", "assumed-modes", "--variant", "as-printed", "--set", "initial.shape=straight", "--depth", "100mm")
    status, out, err = command("thesis", *options, "--json")
    assert status == 0
    assert err.splitlines() == [f"warning: {warning}" for warning in json.loads(out)["warnings"]]
    assert "grows without bound" in err


def test_assumed_modes_on_the_command_line(command, tmp_path):
    options = ("--model", "assumed-modes", "--modes", "3", "--basis", "inserted-length")
    status, out, _ = command("thesis", *options, "--depth", "100mm")
    assert status == 0
    assert "of 8 states" in out
    plain = json.loads((tmp_path / "runs" / "thesis-analyze" / "analyze.json").read_text())
    assert (plain["model"], plain["modes"], plain["basis"]) == ("assumed-modes", 3, "inserted-length")


def test_files_that_cannot_be_written(command, monkeypatch):
    def full(path, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fem_needle.atomic_file.write_atomically", full)
    status, _, err = command("release", *FEW)
    assert status == 1
    assert "No space left" in err


def test_loads_that_vary_are_taken_at_a_time():
    ramp = Table(time=[0.0, 1.0], value=[0.0, 0.2])
    plant = FiniteElementNeedle(scene_of("entry", held(0.1), loads=[TipLoad(force=ramp)]), elements=3)
    early, late = (linearize(plant, depth=0.1, time=time).operating_point.tip_deflection for time in (0.25, 0.5))
    assert late == pytest.approx(2 * early, rel=1e-12)
