"""The command `identify`: what it shows and leaves, the sample, and what it refuses."""

from __future__ import annotations

import csv
import json
from functools import partial

import numpy as np
import pytest

from fem_needle import Measurements, SceneError, identify, load_scene, read_measurements, run_scene
from fem_needle.cli.identify_table import unit_of
from fem_needle.identification.picture import identification_picture
from fem_needle.identification.sample_data import sample_path
from fem_needle.identification.sample_tips import NAME, NOISE, SCENE, SPEED, START, TRUTH, made_tips

MODULI = list(TRUTH)
FIT = [word for path in MODULI for word in ("--fit", path)]
AT_REST = ("brachytherapy", NAME, "--analysis", "static")
FILES = {"identify.json", "identify.csv", "identify.png", "fitted.toml", "scene.toml", "manifest.json"}


@pytest.fixture
def command(command_line, monkeypatch, tmp_path):
    """Run `identify`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "identify")


def test_the_sample_is_made_anew_as_it_is_shipped(tmp_path):
    path = tmp_path / "made.csv"
    path.write_text(made_tips(), encoding="utf-8")
    made, shipped = read_measurements(path), read_measurements(sample_path(NAME))
    assert made.names == shipped.names
    insertion = load_scene(SCENE).insertion
    assert (insertion.initial_depth, insertion.speed) == (START, SPEED)
    for column in made.names:  # a last digit may fall on the other side where arithmetic rounds otherwise
        assert made[column] == pytest.approx(shipped[column], abs=1.5e-7), column


def test_two_moduli_from_the_sample(command, tmp_path):
    status, out, err = command(*AT_REST, *FIT, "--hold-back", "0.25")
    assert (status, err) == (0, "")
    folder = tmp_path / "runs" / "brachytherapy-identify"
    assert {path.name for path in folder.iterdir()} == FILES
    data = json.loads((folder / "identify.json").read_text())
    for one in data["parameters"]:
        assert one["interval"][0] < TRUTH[one["path"]] < one["interval"][1]
        assert load_scene("brachytherapy").with_value(one["path"], one["start"]) == load_scene("brachytherapy")
    assert (data["rows"], data["prediction"]["rows"]) == (15, 5)
    fitted = load_scene(folder / "fitted.toml")
    assert [layer.foundation_modulus for layer in fitted.tissue.layers] == [one["value"] for one in data["parameters"]]
    shown = {words[0]: words for words in (line.split() for line in out.splitlines()) if words}
    assert shown[MODULI[1]][1] == f"{1e-3 * data['parameters'][1]['value']:.5g}"
    assert shown[MODULI[1]][-1] == "kN/m^2"
    assert "residuals: like random noise" in out
    assert "prediction: 5 rows held back" in out
    assert "files: runs/brachytherapy-identify" in out


def test_the_table_of_rows(command, tmp_path):
    command(*AT_REST, *FIT, "--out", "here")
    with (tmp_path / "here" / "identify.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    sample = read_measurements(sample_path(NAME))
    assert [float(row["depth [m]"]) for row in rows] == sample["depth"].tolist()
    assert [float(row["measured [SI]"]) for row in rows] == sample["tip_deflection"].tolist()
    assert max(abs(float(row["residual [SI]"])) for row in rows) < 4 * NOISE
    assert {(row["data"], row["column"], row["unit"]) for row in rows} == {(f"{NAME}.csv", "tip_deflection", "m")}


def test_json_bounds_and_standard_deviations(command):
    given = ("--sigma", "tip_deflection=2um", "--linear", MODULI[1], "--bounds", f"{MODULI[1]}=10 kN/m^2:25 kN/m^2")
    status, out, _ = command(*AT_REST, *FIT, *given, "--json")
    data = json.loads(out)
    assert status == 0
    assert data["parameters"][1]["scale"] == "linear"
    assert data["parameters"][1]["value"] == pytest.approx(25e3, rel=1e-6)  # the bound, as the truth is 30 kN/m^2
    assert data["whiteness"]["p_value"] < 0.05


def test_a_model_that_misses_something_is_told(command):
    status, out, _ = command(*AT_REST, "--fit", MODULI[0])
    assert status == 0
    assert "not random" in out
    assert "the model misses something" in out


def test_few_modes_have_their_own_options(command):
    status, out, _ = command(*AT_REST, *FIT, "--model", "assumed-modes", "--modes", "3", "--json")
    assert (status, json.loads(out)["model"]) == (0, "assumed-modes")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*AT_REST,), "one or more different paths"),
        (("brachytherapy", "no-file.csv", *FIT), "no-file.csv"),
        ((*AT_REST, "--fit", "needle.weight"), "is no number of the scene"),
        ((*AT_REST, *FIT, "--sigma", "2um"), "--sigma: got '2um'"),
        ((*AT_REST, *FIT, "--sigma", "tip_deflection=2N"), "--sigma"),
        ((*AT_REST, *FIT, "--bounds", f"{MODULI[0]}=1"), "--bounds: got"),
        ((*AT_REST, *FIT, "--hold-back", "1.5"), "held_back: out of range"),
        ((*AT_REST, *FIT, "--set", "loads=[]"), "say nothing of"),
    ],
)
def test_what_is_wrong_leaves_nothing(command, tmp_path, arguments, message):
    status, _, err = command(*arguments)
    assert (status, message in err) == (2, True), err
    assert not (tmp_path / "runs").exists()


def test_a_run_is_not_replaced(command, tmp_path):
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "series.nc").touch()
    status, _, err = command(*AT_REST, *FIT, "--out", "here", "--force")
    assert (status, "error" in err) == (2, True)


def test_a_picture_of_pushes_and_tips_together():
    scene = load_scene("thesis").with_values({"insertion.final_depth": 0.03, "numerics.elements": 4, "friction.coulomb": 0.56})
    run = run_scene(scene.with_value("numerics.analysis", "static"))
    columns = {"time": run.time[1::10], "tip_deflection": run.tip_deflection[1::10], "push_force": run.push_force[1::10]}
    deviations = {"tip_deflection": 1e-5, "push_force": 0.01}
    start = run.scene.with_value("friction.coulomb", 0.4)
    found = identify(start, ["friction.coulomb"], Measurements(columns), deviations=deviations)
    assert found["friction.coulomb"].value == pytest.approx(scene.friction.coulomb, rel=1e-6)
    width, height = np.frombuffer(identification_picture(found)[16:24], dtype=">u4")
    assert (width, height) == (1200, 624)


def test_units_of_numbers():
    scene = load_scene("brachytherapy")
    assert unit_of(scene, "tissue.layers.prostate region.foundation_modulus") == "N/m^2"
    assert unit_of(scene, "needle.length") == "m"
    with pytest.raises(SceneError):
        identify(scene, ["needle.title"], read_measurements(sample_path(NAME)))
