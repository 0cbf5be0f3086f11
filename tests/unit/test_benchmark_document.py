"""docs/benchmark.md shows the last kept result, and nothing else."""

from __future__ import annotations

from importlib.util import module_from_spec, spec_from_file_location

import pytest

from fem_needle.benchmark.methods import OWN, Setting
from fem_needle.benchmark.result import Row
from tests.house.source import ROOT


@pytest.fixture(scope="module")
def make_page():
    specification = spec_from_file_location("make_page", ROOT / "benchmarks" / "make_page.py")
    module = module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_page_shows_the_last_kept_result(make_page):
    path, page = make_page.last_record(), make_page.PAGE.read_text(encoding="utf-8")
    assert make_page.page_with(make_page.figures(make_page.read_record(path), path.name), page) == page


def test_the_kept_results_name_machine_and_commit(make_page):
    for path in make_page.RESULTS.glob("*.json"):
        study = make_page.read_record(path)
        assert path.name == f"{study.date[:10]}-{study.commit.rstrip('+')}.json"
        assert study.machine["processor"] and study.machine["cores"] and study.machine["numpy"]


def row(error, median):
    return Row("S", "m", OWN, Setting(), error, median)


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ([row(1e-2, 1e-3), row(1e-4, 0.3), row(1e-5, 0.02)], "20 ms"),
        ([row(1e-2, 3.456), row(2e-2, 1e-3)], "(1e-02, 3.5 s)"),
        ([row(float("inf"), 1.0)], "-"),
        ([], "-"),
    ],
    ids=["fastest that is good enough", "best that was reached", "no number", "not run"],
)
def test_a_cell_of_the_table(make_page, rows, text):
    assert make_page._cell(rows, 1e-3) == text


@pytest.mark.parametrize(("seconds", "text"), [(1.23e-6, "1.2 us"), (4.56e-8, "0.046 us"), (9.99e-3, "10 ms"), (123.4, "120 s")])
def test_times_are_short(make_page, seconds, text):
    assert make_page.time_text(seconds) == text
