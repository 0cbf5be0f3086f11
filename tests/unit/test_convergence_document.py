"""The page on convergence: its example runs."""

import re

from tests.house.source import ROOT


def test_the_example_of_the_page_runs_and_is_short(capsys):
    page = (ROOT / "docs" / "convergence.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^```python\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE)
    assert len(example.splitlines()) < 10
    exec(compile(example, "convergence.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:4]] == ["4", "8", "16", "32"]
    assert lines[4].startswith("exact")
