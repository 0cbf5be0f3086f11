"""The command `compare`: files that other readers open, what the table says, exit statuses."""

from __future__ import annotations

import csv
import json
from functools import partial

import numpy as np
import pytest
from matplotlib import image

from fem_needle import load_scene

PRINTED = ("thesis-open-loop", "--variant", "as-printed", "--set", "insertion.final_depth=0.0202", "--time-step", "5e-5")
FILES = {"compare.csv", "compare.json", "compare.png", "manifest.json", "scene.toml"}
SHORT = ("thesis", "--set", "insertion.final_depth=0.06", "--set", "numerics.output_step=1", "--elements", "4")


@pytest.fixture
def compare(command_line, monkeypatch, tmp_path):
    """Run `compare`, in an empty folder; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    return partial(command_line, "compare")


def rows_of(out):
    """Name and cells of each row of the table: two blanks part them."""
    lines = ([cell.strip() for cell in line.strip().split("  ") if cell.strip()] for line in out.splitlines())
    return {cells[0]: cells[1:] for cells in lines if cells}


def test_a_comparison_leaves_files_that_agree_with_the_table(compare, tmp_path):
    status, out, err = compare(*SHORT, "--modes", "2", "--modes", "3", "--depth", "50mm", "--within", "1e-4")
    assert (status, err) == (0, "")
    folder = tmp_path / "runs" / "thesis-compare"
    assert {path.name for path in folder.iterdir()} == FILES
    data = json.loads((folder / "compare.json").read_text())
    with (folder / "compare.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    parts = [[row for row in table if row["part"] == part] for part in ("rest", "run")]
    assert [len(part) for part in parts] == [81, 5]
    assert [float(row["time [s]"]) for row in parts[1]] == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0])
    rows = rows_of(out)
    for index, (model, name) in enumerate(zip(data["models"], ("2_modes", "3_modes"), strict=True)):
        at_rest, in_run = ([float(row[f"tip_error_{name} [1]"]) for row in part] for part in parts)
        assert model["largest_errors_at_rest"]["tip"] == np.max(np.abs(at_rest))
        assert model["run_errors"]["tip"] == model["largest_tip_error"] == np.max(np.abs(in_run))
        assert rows["tip error, of the tip there"][index] == f"{100 * model['errors_at_rest'][0]['tip']:.3g} %"
        assert rows["largest tip error, of the largest tip"][index] == f"{100 * model['run_errors']['tip']:.3g} %"
        (first,) = model["ranges"]
        assert rows["within 0.01 % at rest: depth [mm]"][index] == f"{1e3 * first['start']:.1f} to {1e3 * first['end']:.1f}"
    assert data["models"][0]["ranges"][0]["end"] < 0.05 < data["models"][1]["ranges"][0]["end"]
    assert rows["degrees of freedom"] == ["12", "2", "3"]
    assert rows["natural frequency 3 [Hz]"][1] == "none"
    assert load_scene(folder / "scene.toml").insertion.final_depth == 0.06
    assert_drawn(folder / "compare.png", (864, 1200))


def test_shapes_in_the_file_are_those_at_the_depths(compare, tmp_path):
    assert compare(*SHORT, "--depth", "50mm", "--depth", "0.03")[0] == 0
    data = json.loads((tmp_path / "runs" / "thesis-compare" / "compare.json").read_text())
    assert [shape["depth"] for shape in data["shapes"]] == data["depths"] == [0.05, 0.03]
    for shape, true, found in zip(data["shapes"], data["reference"]["at_rest"], data["models"][0]["at_rest"], strict=True):
        assert shape["position"][-1] == pytest.approx(shape["depth"], abs=1e-15)
        assert [row[-1] for row in shape["deflections"]] == [true["tip_deflection"], found["tip_deflection"]]


def assert_drawn(path, size):
    pixels = image.imread(path)
    assert pixels.shape[:2] == size
    assert len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)) > 50


def test_the_picture_of_no_error_at_all_is_drawn(compare, tmp_path):
    assert compare("bench-s", "--model", "fem", "--out", "study")[0] == 0
    assert_drawn(tmp_path / "study" / "compare.png", (468, 1200))


@pytest.mark.slow
def test_a_model_without_statics_is_shown_in_its_run_with_its_warnings(compare, tmp_path):
    status, out, err = compare(*PRINTED, "--elements", "4", "--out", "study")
    assert status == 0
    assert "grows without bound" in err
    assert "at rest: nothing, for this variant has no equilibrium" in out
    assert "kinematics fixed-frame" in out
    assert_drawn(tmp_path / "study" / "compare.png", (864, 1200))


def test_json_is_the_comparison_and_nothing_else(compare, tmp_path):
    status, out, err = compare("bench-s", "--json", "--out", "study")
    assert (status, err) == (0, "")
    assert out == (tmp_path / "study" / "compare.json").read_text()
    assert json.loads(out)["models"][0]["at_rest"][0]["natural_frequencies"][2] is None


@pytest.mark.parametrize(("limit", "status"), [("0.016", 0), ("0.015", 1)])
def test_the_exit_status_tells_whether_the_model_is_good_enough(compare, tmp_path, limit, status):
    """Two modes of the thesis' needle miss its tip by 1.55 % at 200 mm."""
    found, _, err = compare("bench-s", "--require-error", limit, "--out", "study")
    assert found == status
    assert ("2 modes: it is 0.0155, required at most 0.015" in err) == (status == 1)
    assert {path.name for path in (tmp_path / "study").iterdir()} == FILES


def test_the_table_says_what_was_compared_how(compare):
    _, out, _ = compare("bench-s", "--basis", "inserted-length", "--static-corrections", "--modes", "1")
    assert "reference: fem, 8 elements of degree 4; a finer one changes its tip" in out
    assert "1 mode: assumed-modes, 1 mode, " in out
    assert "static corrections, variant conservative, basis inserted-length" in out
    assert "kinematics material, analysis static, nothing moves" in out
    assert "at rest: loads at 0 s" in out
    assert "k: modulus of the layer that holds the tip" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("thesis", "--modes", "201"), "model.modes"),
        (("thesis", "--depth", "5 N"), "--depth"),
        (("thesis", "--variant", "as-printed"), "initial.shape: 'as-printed' has no equilibrium"),
        (("release", "--variant", "corrected"), "model.variant: is fixed-frame"),
        (("thesis", "--model", "rope"), "unknown model"),
    ],
)
def test_wrong_input_leaves_nothing(compare, tmp_path, arguments, said):
    status, out, err = compare(*arguments)
    assert (status, out) == (2, "")
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_a_comparison_is_replaced_by_force_alone(compare):
    assert compare("bench-s", "--out", "study")[0] == 0
    status, _, err = compare("bench-s", "--out", "study")
    assert (status, "--force" in err) == (2, True)
    assert compare("bench-s", "--out", "study", "--force")[0] == 0
