"""The example of docs/comparison.md runs, and a row of its table is true."""

from __future__ import annotations

import re

from fem_needle import compare, load_scene
from tests.house.source import ROOT

TEXT = (ROOT / "docs" / "comparison.md").read_text(encoding="utf-8")


def test_the_example_runs(capsys):
    (example,) = re.findall(r"^```python\n(.*?)^```", TEXT, flags=re.DOTALL | re.MULTILINE)
    exec(compile(example, "comparison.md", "exec"), {})
    assert capsys.readouterr().out.startswith("2 modes")


def test_the_ranges_of_the_table_are_those_that_are_found():
    (row,) = re.findall(r"^\| 5 \|(.*)\|$", TEXT, flags=re.MULTILINE)
    cells = [cell.strip() for cell in row.split("|")]
    found = compare(load_scene("bench-s").with_value("tissue.layers.phantom.foundation_modulus", 5000.0), modes=(2, 3))
    two, three = (model.ranges for model in found.models)
    assert cells[0] == f"to {1e3 * two[0].end:.1f}; {1e3 * two[1].start:.1f} to {1e3 * two[1].end:.1f}"
    assert cells[1] == f"{two[0].number_end:.2f}"
    assert cells[2] == f"{100 * abs(found.models[0].chosen.tip[-1]):.1f} %"
    assert cells[3:5] == [f"to {1e3 * three[0].end:.1f}", f"{three[0].number_end:.2f}"]
