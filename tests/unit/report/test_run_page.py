"""The report of a run: its content agrees with the run, whatever is in it is text, broken runs have theirs."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from fem_needle import run_scene
from fem_needle.cli.run_table import run_rows
from fem_needle.errors import ComputationError, SceneError
from fem_needle.manifest import manifest
from fem_needle.report import html_page, read_folder, run_charts, write_report
from fem_needle.report import run_page as run_page_module
from fem_needle.report.charts import thinned
from fem_needle.report.run_page import run_page
from fem_needle.run_folder import save_run
from fem_needle.scene import Layer, Tissue
from tests.unit.scene.examples import hub_scene

HOSTILE = '</script><script>alert(1)</script><img src=x onerror="alert(2)">'
SCENE = hub_scene(
    title=f"short {HOSTILE}",
    tissue=Tissue(layers=[Layer(name=HOSTILE, foundation_modulus=520.0)]),
    numerics={"analysis": "static", "elements": 2, "output_step": 2.0, "output_points": 11},
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return save_run(run_scene(SCENE), tmp_path_factory.mktemp("report") / "run", vtk=False)


@pytest.fixture(scope="module")
def run():
    return run_scene(SCENE)


@pytest.fixture(scope="module")
def page(folder):
    return read_folder(folder)


@pytest.fixture(scope="module")
def html(page):
    return html_page(page)


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out what takes long: the pictures' content."""
    for room in (run_charts, run_page_module):
        monkeypatch.setattr(room, "png_bytes", lambda _: b"PNG")


class Elements(HTMLParser):
    """Tags with their attributes, and the text outside scripts and styles."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.text, self._inside = [], "", ""
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._inside = tag

    def handle_endtag(self, tag):
        self._inside = ""

    def handle_data(self, data):
        if self._inside not in {"script", "style"}:
            self.text += data


def section(page, name):
    return next(one for one in page.sections if one.name == name)


def rows(page, name):
    return {row[0]: row[1].replace("\u00a0", " ") for grid in section(page, name).grids for row in grid.rows}


def of(run, folder):
    return run_page(run, manifest(run.scene), folder)


def test_the_summary_is_that_of_the_run(page, run):
    shown = rows(page, "summary")
    assert shown["depth at the end"] == "160 mm"
    assert shown["tip deflection at the end"] == f"{1e3 * run.tip_deflection[-1]:.4g} mm"
    assert shown["largest push force"] == f"{np.max(np.abs(run.push_force)):.4g} N"
    assert shown["samples"] == str(len(run.time)) == "8"
    assert section(page, "summary").paragraphs[0][1].startswith("The run ended at the final depth, after 14")


def test_what_was_left_out_is_told_with_its_reason(page, run):
    assert {item["term"] for item in run.summary["skipped"]} == rows(page, "method").keys()
    assert dict(section(page, "method").paragraphs)["Inertia"].startswith("Inertia was left out: ")


def test_the_ledger_has_every_term_at_the_end(page, run):
    [stored, works, axial, residuals] = section(page, "ledger").grids
    assert [len(grid.rows) for grid in (stored, works, axial, residuals)] == [3, 5, 5, 2]
    [unit] = re.findall(r"end \[(.*)\]", stored.headers[2])
    size = {"mJ": 1e-3, "µJ": 1e-6}[unit]
    bending = next(row for row in stored.rows if row[0] == "bending energy")
    assert float(bending[2]) == pytest.approx(run.bending_energy[-1] / size, rel=1e-3)


@pytest.mark.usefixtures("undrawn")
def test_round_off_in_the_ledger_and_in_the_table_is_zero(run, folder):
    noise = np.where(run.time > 0.0, 1e-45, 0.0)
    page = of(replace(run, series=run.series | {"hub_work": noise}), folder)
    [row] = [row for grid in section(page, "ledger").grids for row in grid.rows if row[0].startswith("work of the moving hub")]
    assert row[1:] == ("0", "0", "0")
    tip = run.tip_deflection * (run.time < run.time[-1]) + 1e-30
    loaded = replace(run, series=run.series | {"tip_deflection": tip})
    assert ", tip 0 mm, " in str(loaded)
    summary = run.summary | {"final_tip_deflection": 1e-30}
    assert dict(run_rows(replace(run, summary=summary), folder, ()))["tip deflection"].startswith("0 mm (largest ")


@pytest.mark.usefixtures("undrawn")
def test_versions_of_the_run_stand_beside_those_of_the_report(run, folder):
    known = json.loads((folder / "manifest.json").read_bytes())
    known["versions"]["numpy"] = "0.0.1"
    [grid] = section(run_page(run, known, folder), "versions").grids
    [made] = [row for row in grid.rows if row[0] == "numpy"]
    assert made == ("numpy", "0.0.1", np.__version__)


def test_curves_are_those_of_the_run(page, run):
    needle, courses, energies = section(page, "results").charts
    tip = next(trace for trace in courses.figure.data if trace.name == "tip deflection")
    assert np.allclose(tip.y, 1e3 * run.tip_deflection) and np.allclose(tip.x, run.time)
    assert len(needle.moments) == len(needle.figure.frames) == len(run.time)
    [line] = needle.figure.frames[3].data
    assert line.y[-1] == pytest.approx(1e3 * run.tip_deflection[3]) and line.x[-1] == pytest.approx(1e3 * run.depth[3])
    assert all(chart.picture is not None for chart in (needle, courses, energies))


LAYERED = {
    "tissue.layers": [{"name": "fat", "end": 0.02, "foundation_modulus": 5e3}, {"start": 0.02, "foundation_modulus": 2e4}],
    "support.guides": [{"position": -0.01}, {"position": -0.03, "stiffness": 300.0}],
    "target": {"lateral": 0.002, "depth": 0.19},
}


@pytest.mark.usefixtures("undrawn")
def test_the_moving_needle_has_its_layers_guides_and_target(run):
    chart = run_charts.needle_chart(replace(run, scene=run.scene.with_values(LAYERED)))
    points = {trace.name: (list(trace.x), trace.marker.symbol) for trace in chart.figure.data if trace.mode == "markers"}
    assert points["rigid guide"] == ([-10.0], "diamond") and points["guide on a spring"] == ([-30.0], "pentagon")
    assert points["target"][0] == [190.0]
    low, high = chart.figure.layout.xaxis.range
    assert low < -30.0 and high > 190.0
    assert [note.text for note in chart.figure.layout.annotations] == ["0", "1"]
    caption = chart.caption.replace("\u00a0", " ")
    assert "White diamonds: rigid guides; blue pentagons: guides on a spring; the purple diamond: target." in caption
    assert "0: fat, 5 kN/m²;  1: 20 kN/m²." in caption


@pytest.mark.usefixtures("undrawn")
def test_the_toolbar_has_a_margin_of_its_own(run):
    for chart in (run_charts.needle_chart(run), run_charts.course_chart(run)):
        assert chart.figure.layout.modebar.orientation == "v" and chart.figure.layout.margin.r >= 40


def test_nothing_that_a_scene_says_is_markup(html):
    assert "<script>alert" not in html and "<img src=x" not in html
    elements = Elements(html)
    assert not [attributes for tag, attributes in elements.tags if tag == "img" and attributes["src"] == "x"]
    assert HOSTILE in elements.text
    assert len([tag for tag, attributes in elements.tags if tag == "script" and "type" not in attributes]) == 2


def test_a_page_needs_nothing_from_elsewhere(html):
    tags = Elements(html).tags
    sources = [attributes.get("src") for _, attributes in tags if "src" in attributes]
    assert sources and all(source.startswith("data:image/png;base64,") for source in sources)
    assert not [tag for tag, _ in tags if tag in {"link", "iframe", "object", "embed", "base"}]
    policy = next(attributes["content"] for tag, attributes in tags if attributes.get("http-equiv"))
    assert "default-src 'none'" in policy and "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]
    assert html.count("plotly.js v") == 1


def test_a_page_can_be_read_without_eyes_and_without_a_mouse(html):
    tags = Elements(html).tags
    assert ("html", {"lang": "en", "class": "no-script"}) in tags
    assert all(attributes.get("alt") for tag, attributes in tags if tag == "img")
    assert all(attributes.get("scope") in {"row", "col"} for tag, attributes in tags if tag == "th")
    names = {attributes.get("id") for _, attributes in tags}
    assert {attributes["for"] for tag, attributes in tags if tag == "label"} <= names
    assert {attributes["href"][1:] for tag, attributes in tags if tag == "a"} <= names


@pytest.mark.usefixtures("undrawn")
def test_the_data_of_curves_is_json_without_nan(run, folder):
    tip = run.tip_deflection.copy()
    tip[2] = np.nan
    broken = replace(run, series=run.series | {"tip_deflection": tip})
    html = html_page(of(broken, folder))
    found = re.findall(r'<script type="application/json" id="([\w-]+)-data">(.*?)</script>', html)
    assert [name for name, _ in found] == ["needle", "courses", "energies"]
    for _, text in found:
        json.loads(text, parse_constant=pytest.fail)
    assert rows(of(broken, folder), "summary")["largest tip deflection"] == f"{1e3 * np.nanmax(np.abs(tip)):.4g} mm"


@pytest.mark.usefixtures("undrawn")
def test_a_loop_without_energies_says_so(run, folder):
    names = [name for name in run.series if name.endswith(("_energy", "_work", "_dissipation", "_residual", "_loss"))]
    series = run.series | dict.fromkeys(names, np.full(len(run.time), np.nan))
    page = of(replace(run, series=series, summary=run.summary | {"relative_energy_residual": None}), folder)
    assert rows(page, "summary")["residual of the energy balance"] == "not computed"
    assert {cell for grid in section(page, "ledger").grids for row in grid.rows for cell in row[1:]} == {"not computed"}
    assert html_page(page)


def test_one_sample_is_enough(run, folder):
    series = {name: values[:1] for name, values in run.series.items()}
    parts = {"time": run.time[:1], "guide_force": run.guide_force[:1], "station_deflection": run.station_deflection[:1]}
    html = html_page(of(replace(run, series=series, **parts), folder))
    assert 'type="range"' not in html and "20\u00a0mm deep" in html


ENDINGS = {"interrupted": "interrupted before its end", "failed": "failed before the end", "unstable": "became unstable"}


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(("reason", "said"), ENDINGS.items())
def test_a_run_that_ended_early_says_so_first(run, folder, reason, said):
    summary = run.summary | {"stop_reason": reason, "warnings": ["a <b>warning</b> of 2e-05"]}
    html = html_page(of(replace(run, summary=summary), folder))
    assert html.index(said) < html.index("<main")
    assert "<li>a &lt;b&gt;warning&lt;/b&gt; of 2\u00a0×\u00a010⁻⁵</li>" in html


@pytest.mark.parametrize("summary", [{"stop_reason": "failed", "warnings": ["too stiff"]}, None])
def test_a_run_without_results_has_a_report(folder, tmp_path, summary):
    (tmp_path / "scene.toml").write_bytes((folder / "scene.toml").read_bytes())
    known = json.loads((folder / "manifest.json").read_bytes())
    (tmp_path / "manifest.json").write_text(json.dumps(known | {"state": "running"}), encoding="utf-8")
    if summary is not None:
        (tmp_path / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    page = read_folder(tmp_path)
    assert page.alarm.endswith("It has left no results.") and ("failed" in page.alarm) == (summary is not None)
    html = html_page(page)
    assert "200\u00a0mm long" in html and "Plotly" not in html and ("too stiff" in html) == (summary is not None)


@pytest.mark.usefixtures("undrawn")
def test_a_scene_with_a_controller_that_did_not_act_says_so(run, folder):
    finger = {"kind": "lateral", "position": -0.01, "force": 0.0}
    loop = {"loads": [finger], "sensors": [{"kind": "tip-imaging"}], "controller": {"kind": "pid"}}
    scene, none = run.scene.with_values(loop), np.zeros((len(run.time), 1))
    told = dict(section(of(replace(run, scene=scene, lateral_force=none), folder), "scene").paragraphs)
    assert told["Open loop"] == "The scene's controller did not act in this run." and "pid" in told["Control"]
    closed = replace(run, scene=scene, lateral_force=none, summary=run.summary | {"controller": {"kind": "pid"}})
    assert "Open loop" not in dict(section(of(closed, folder), "scene").paragraphs)


def test_long_curves_are_thinned_and_keep_their_ends():
    chosen = thinned(100_000)
    assert (len(chosen), chosen[0], chosen[-1]) == (2000, 0, 99_999)
    assert thinned(3).tolist() == [0, 1, 2] and thinned(1).tolist() == [0]


@pytest.mark.usefixtures("undrawn")
def test_the_command_writes_a_page_and_replaces_it_by_force_alone(folder, tmp_path, command_line):
    path = tmp_path / "new" / "page.html"
    assert command_line("report", folder, "--out", path)[:2] == (0, f"wrote {path}\n")
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    status, _, err = command_line("report", folder, "--out", path)
    assert status == 2 and "exists already" in err
    assert command_line("report", folder, "--out", path, "--force")[0] == 0


def test_a_report_goes_with_its_run(run, tmp_path):
    folder = save_run(run, tmp_path / "run", vtk=False)
    (folder / "report.html").touch()
    save_run(run, folder, force=True, vtk=False)
    assert not (folder / "report.html").exists()


def test_what_is_no_run_is_refused(tmp_path, command_line):
    status, _, err = command_line("report", tmp_path)
    assert status == 2 and f"{tmp_path}: is no run folder and no study" in err and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("text", "said"), [("{", "cannot be read"), ("[]", "is damaged: no table")])
def test_damaged_summaries_are_refused(folder, tmp_path, text, said):
    for name in ("scene.toml", "manifest.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "summary.json").write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=said):
        read_folder(tmp_path)


def test_a_report_that_cannot_be_written_says_so(page, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ComputationError, match=r"report\.html: cannot be written"):
        write_report(page, tmp_path / "file" / "report.html")
