"""Short texts are one line, HTML tables are well formed, hold the numbers of the result, and run nothing."""

from __future__ import annotations

from html.parser import HTMLParser

import numpy as np
import pytest

from fem_needle import (
    FiniteElementNeedle,
    analyze,
    compare,
    converge,
    identify,
    load_scene,
    run_scene,
    simulate_many,
    solve_static,
)
from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.result import Benchmark, CaseInformation, GoalRow, Row
from fem_needle.closed_loop.repeated import RepeatedLoop, Repetition
from fem_needle.closed_loop.repetitions import Draw
from fem_needle.display import MOST_ROWS, Card, columns_in_millimeters
from fem_needle.identification import read_measurements, sample_path
from fem_needle.stress import Figure, StressRow, StressTable, Trial

EVIL = '<script>alert("1")</script> & \n <img src=x onerror=alert(2)>'
LAYERS = [f"tissue.layers.{number}.foundation_modulus" for number in (0, 1)]
VOID = {"meta", "br", "img"}


class Cells(HTMLParser):
    """Collects the cells, and checks that tags are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.rows = [], set(), []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in {"td", "th"}:
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in {"td", "th"}:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def scene():
    return load_scene("bench-s").with_value("title", EVIL)


def repeated(scene):
    summary = {"stop_reason": "final-depth", "target_reached": True, "target_error": 2e-4}
    summary |= {"target_time": 1.0, "target_depth": 0.1, "effort": {}, "largest_command": {}, "max_abs_tip_deflection": 1e-3}
    good = Repetition(1, Draw(), summary | {"steps": 5})
    return RepeatedLoop(scene, 2, (good, Repetition(2, Draw(), {"stop_reason": "failed"}, EVIL)))


def benchmark():
    row = Row("S", EVIL, "fem-needle", Setting(elements=4), 1e-3, 0.5, 0.4, 0.6, 3)
    return Benchmark((CaseInformation("S", "static", "exact"),), (row,), (GoalRow("1", "fast", 1.0, 0.5, "s", True),))


def stress_table():
    trials = (Trial("a", (Figure("tip", 1e-6, 1e-9),)), Trial("b", announced="refused"))
    return StressTable((StressRow(EVIL, "wide", trials),), 3, 5, long=False)


def identification(scene):
    data = [read_measurements(sample_path("brachytherapy-tips"))]
    values = {"numerics.analysis": "static", "numerics.elements": 6, "title": scene.title}
    settled = load_scene("brachytherapy").with_values(values)
    return identify(settled, LAYERS[:1], data)


MAKERS = {
    "Scene": lambda scene: scene,
    "Trajectory": lambda scene: run_scene(scene, elements=4),
    "Equilibrium": lambda scene: solve_static(FiniteElementNeedle(scene, elements=4), depth=0.1),
    "ConvergenceStudy": lambda scene: converge(scene, values=[2, 4]),
    "Comparison": lambda scene: compare(scene, modes=[2], elements=6),
    "Analysis": lambda scene: analyze(scene.with_value("numerics.elements", 4), [0.1]),
    "Identification": identification,
    "ManyRuns": lambda scene: simulate_many(scene, {"loads.0.force": np.array([0.1, 0.2])}),
    "RepeatedLoop": repeated,
    "Benchmark": lambda scene: benchmark(),
    "StressTable": lambda scene: stress_table(),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_every_result_has_a_line_and_a_table(kind, scene):
    result = MAKERS[kind](scene)
    assert type(result).__name__ == kind
    assert repr(result) == str(result)
    assert repr(result).startswith(kind) and len(repr(result).splitlines()) == 1 and len(repr(result)) < 400
    html = result._repr_html_()
    cells = Cells(html)
    assert cells.tags <= {"div", "p", "strong", "table", "thead", "tr", "th", "td"}
    assert "<script" not in html and "<img" not in html
    assert cells.rows


def test_a_scene_shows_its_layers_in_millimeters():
    scene = load_scene("brachytherapy")
    rows = Cells(scene._repr_html_()).rows
    assert ["fat and muscle", "0", "20", "5", *rows[-2][4:]] == rows[-2]
    assert ["insertion", "from 5 mm to 100 mm at 10 mm/s"] in rows
    assert "support hub with 1 guide, tissue 2 layers" in repr(scene)


def test_insertions_of_every_kind_are_said_in_words():
    texts = {name: repr(load_scene(name)) for name in ("release", "friction-ramp")}
    assert "insertion held at 100 mm" in texts["release"]
    assert "insertion pushed from 80 mm" in texts["friction-ramp"]
    moved = load_scene("thesis").with_values({"insertion": {"kind": "profile", "depth": {"time": [0, 1], "value": [0.02, 0.05]}}})
    assert "insertion between 20 mm and 50 mm" in repr(moved)


def test_a_run_shows_its_tip(scene):
    run = run_scene(scene, elements=4)
    rows = dict(row for row in Cells(run._repr_html_()).rows if len(row) == 2)
    assert rows["tip"] == f"{1e3 * run.tip_deflection[-1]:.4g} mm"
    assert rows["relative energy residual"] == f"{run.summary['relative_energy_residual']:.1e}"


def test_an_equilibrium_shows_forces_at_rest():
    rest = solve_static(FiniteElementNeedle(load_scene("brachytherapy"), elements=4), depth=0.05)
    rows = dict(Cells(rest._repr_html_()).rows)
    assert rows["depth"] == "50 mm" and rows["tip"] == f"{1e3 * rest.tip_deflection:.4g} mm"
    assert (rows["guide 0"], f"{rest.guide_forces[0]:.1g}") == ("0 N", "-0")  # no minus sign before nothing


def test_a_study_shows_its_rows(scene):
    study = converge(scene, values=[2, 4])
    rows = Cells(study._repr_html_()).rows
    head = next(row for row in rows if "tip_deflection [mm]" in row)
    shown = rows[rows.index(head) + 1 :]
    tips = [row[head.index("tip_deflection [mm]")] for row in shown]
    assert tips == [f"{1e3 * row.tip_deflection:.6g}" for row in study.rows]
    assert f"order {study.observed_order:.3f} (theory 6)" in repr(study)


def test_long_tables_say_what_they_leave_out():
    card = Card("Kind", "", (("a", "b"),), {"number": list(range(MOST_ROWS + 7))})
    assert len(Cells(card.html()).rows) == MOST_ROWS + 2  # the fact and the header
    assert "and 7 more rows" in card.html()


def test_lengths_become_millimeters_and_empty_columns_vanish():
    shown = columns_in_millimeters({"tip [m]": [0.001, None], "note": ["", ""], "time [s]": [1.0, 2.0]})
    assert shown == {"tip [mm]": [1.0, None], "time [s]": [1.0, 2.0]}
