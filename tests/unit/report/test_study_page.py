"""Reports of studies: figures agree with the files, what is missing leaves a hole, damage is refused."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest

from fem_needle import load_scene
from fem_needle.errors import SceneError
from fem_needle.report import html_page, read_folder
from fem_needle.report.study_page import study_page

FIT = "tissue.layers.0.foundation_modulus"
TIPS = ("brachytherapy", "brachytherapy-tips", "--analysis", "static")
SHORT = ("--set", "target.depth=0.015", "--set", "insertion.final_depth=0.015", "--no-energies", "--elements", "2")
STUDIES = {
    "converge": ("bench-s", "--values", "1,2"),
    "compare": ("bench-s", "--modes", "2", "--modes", "3", "--elements", "4"),
    "analyze": ("thesis", "--depth", "50mm", "--depth", "100mm", "--elements", "4"),
    "identify": (*TIPS, "--fit", FIT, "--elements", "4"),
    "benchmark": ("S", "--quick"),
    "steer": ("steering", "--repeat", "2", *SHORT),
}
IMAGE = '<img src="data:image/png;base64,'
KINDS = {
    "converge": "Convergence study", "compare": "Comparison of models", "analyze": "Analysis for control",
    "identify": "Identification", "benchmark": "Benchmark", "steer": "Repeated closed loop",
}  # fmt: skip
LONG = {"compare", "analyze", "benchmark", "steer"}
# Figures that a study may lack: not defined there, infinite, or of a run that did not arrive.
NUMBERS = {
    "error", "shape_error", "observed_order", "grid_convergence_index", "asymptotic", "tip", "shape", "bending_energy", "run",
    "static", "static_load", "median", "lowest", "highest", "steps", "note", "target_error", "target_time", "largest_error",
    "mean", "standard_deviation", "prediction", "p_value", "first_correlation", "condition", "natural_frequencies", "tip_force",
    "value", "start", "correlation", "failure", "lateral_force", "max_abs_tip_deflection",
}  # fmt: skip


@pytest.fixture
def folder(command_line, tmp_path):
    """Make a study and return its folder."""

    def made(name):
        status, _, err = command_line(name, *STUDIES[name], "--out", tmp_path / name)
        assert status == 0, err
        return tmp_path / name

    return made


def data_of(folder, name):
    return json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))


def leaves(value, path=()):
    """Yield the path of one leaf for each place in the structure, of a list that of its last item."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, (*path, key))
    elif isinstance(value, list) and value:
        yield from leaves(value[-1], (*path, len(value) - 1))
    else:
        yield path


def without(data, path):
    """Return data with None at a path."""
    changed = copy.deepcopy(data)
    holder = changed
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = None
    return changed


def cells(page, caption):
    """Return the rows of a table by its caption."""
    return next(grid for section in page.sections for grid in section.grids if grid.caption == caption).rows


def curves(page):
    return [trace for section in page.sections for chart in section.charts for trace in chart.figure.data]


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in STUDIES])
def test_a_study_has_a_report_also_with_holes(name, folder):
    path = folder(name)
    page, data = read_folder(path), data_of(path, name)
    assert page.subject.startswith(KINDS[name]) and page.alarm == ""
    traces = curves(page)
    assert traces and sum(int(np.count_nonzero(np.isfinite(np.asarray(trace.y, dtype=float)))) for trace in traces) > 1
    html = html_page(page)
    assert html.count(IMAGE) == 1 and "nan" not in html.partition("<script>")[0].lower().split()
    CHECKS[name](page, data)
    scene, manifest = load_scene(path / "scene.toml"), {}
    for hole in leaves(data):
        try:
            study_page(path, name, without(data, hole), scene, manifest)
        except SceneError as error:
            assert "the study is damaged" in str(error) and hole[-1] not in NUMBERS, hole


def check_converge(page, data):
    rows = cells(page, "Discretizations")
    assert [row[0] for row in rows] == ["1", "2"]
    assert float(rows[1][1]) == pytest.approx(1e3 * data["rows"][1]["tip_deflection"], rel=1e-7)
    error = curves(page)[0]
    assert error.y.tolist() == [row["error"] for row in data["rows"]] and error.x.tolist() == [1.0, 2.0]


def check_compare(page, data):
    rows = cells(page, "Largest errors and cost")
    assert rows[0] == ("unknowns", *(str(one["unknowns"]) for one in (data["reference"], *data["models"])))
    at_rest = cells(page, "At rest")
    assert len(at_rest) == 3 * len(data["depths"]) and at_rest[0][1] == "fem"
    assert {trace.name for trace in curves(page)} >= {"fem", "2 modes", "3 modes, error"}


def check_analyze(page, data):
    rows = {row[0]: row[1:] for row in cells(page, "At each depth")}
    gains = [point["static_gains"]["tip_force"] for point in data["depths"]]
    assert [float(cell) for cell in rows["tip by tip force [mm/N]"]] == pytest.approx([1e3 * gain for gain in gains], rel=1e-3)
    note = next(grid for section in page.sections for grid in section.grids if grid.caption == "At each depth").note
    assert "damped poles, overdamped ones left out" in note and "undamped frequency 1" in {trace.name for trace in curves(page)}
    frequency = data["depths"][0]["natural_frequencies"][0] / (2.0 * np.pi)
    assert float(rows["vibration 1"][0].partition("\u00a0")[0]) == pytest.approx(frequency, rel=1e-3)


def check_identify(page, data):
    [row] = cells(page, "Fitted values")
    assert row[0] == FIT and row[4] == "kN/m²"
    assert float(row[1]) == pytest.approx(1e-3 * data["parameters"][0]["value"], rel=1e-3)
    assert len(next(trace for trace in curves(page) if trace.name == "measured").y) == data["rows"]


def check_benchmark(page, data):
    assert page.title == "Benchmark"
    assert [row[1] for row in cells(page, "Methods")] == [row["method"] for row in data["rows"]]
    assert {trace.name for trace in curves(page)} == {row["method"] for row in data["rows"]}


def check_steer(page, data):
    errors = [row["target_error"] for row in data["rows"]]
    [trace] = curves(page)
    assert trace.y.tolist() == pytest.approx([1e3 * error for error in errors])
    assert len(cells(page, "Repetitions")) == data["asked"] == 2


CHECKS = {
    "converge": check_converge, "compare": check_compare, "analyze": check_analyze, "identify": check_identify,
    "benchmark": check_benchmark, "steer": check_steer,
}  # fmt: skip


def test_repetitions_that_did_not_arrive_leave_holes_and_warnings(folder):
    path = folder("steer")
    data = data_of(path, "steer")
    row = data["rows"][1]
    row |= dict.fromkeys(("target_error", "target_time", "target_reached", "effort", "largest_command"))
    row |= {"failure": "unstable <i>at</i> 2e-05 s", "stop_reason": "unstable"}
    data |= {"asked": 3, "arrived": 1, "failed": 1, "standard_deviation": None}
    (path / "steer.json").write_text(json.dumps(data), encoding="utf-8")
    page = read_folder(path)
    assert page.alarm == "The study was interrupted: 2 of 3 repetitions."
    html = html_page(page)
    assert "repetition 2: unstable &lt;i&gt;at&lt;/i&gt; 2\u00a0×\u00a010⁻⁵ s" in html and "standard deviation none" in html
    assert np.isnan(curves(page)[0].y[1])


def test_a_study_without_its_table_is_damaged(folder):
    path = folder("converge")
    (path / "converge.csv").unlink()
    with pytest.raises(SceneError, match="the study is damaged: FileNotFoundError"):
        read_folder(path)


def test_a_study_without_its_picture_has_its_curves(folder):
    path = folder("converge")
    (path / "converge.png").unlink()
    assert IMAGE not in html_page(read_folder(path))
