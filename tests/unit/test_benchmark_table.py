"""What the command `benchmark` prints: every kind of row, met and missed goals, scaling, what was left out."""

from pathlib import Path

from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.result import Benchmark, CaseInformation, GoalRow, Row, ScalingRow
from fem_needle.cli.benchmark_table import show_benchmark

ROWS = (
    Row("S", "ours", "fem-needle", Setting(elements=4), 1e-5, 1e-3, 9e-4, 2e-3, 5, 10, 1e-4, 2e-3),
    Row("S", "lost", "rival", Setting(elements=8), float("inf"), 1e-3, 9e-4, 2e-3, 5),
    Row("S", "absent", "rival", Setting(elements=8), note="is not installed"),
)
GOALS = (
    GoalRow("1", "quick", 1.0, 0.5, "s", True),
    GoalRow("2", "small", 1.0, 2.0, "MB", False),
    GoalRow("3", "unknown", 1.0, None, "s", None, "was not run"),
)
SCALING = (
    ScalingRow("elements", "ours", 40.0, 1e-6, 0.5, 2_000_000),
    ScalingRow("duration", "ours", 2.0, None, None, None, "too long"),
)


def test_a_benchmark_is_shown_whole(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    study = Benchmark(
        (CaseInformation("S", "a case", "an exact solution"),),
        ROWS,
        GOALS,
        SCALING,
        (("a rival", "is not installed"),),
        (("a method", "took too long"),),
        {"processor": "a machine", "cores": 2},
        "0123abc",
    )
    show_benchmark(study, Path("runs/benchmark"), Path("benchmarks/results/kept.json"))
    lines = capsys.readouterr().out.splitlines()

    def line(*parts):
        return any(all(part in text for part in parts) for text in lines)

    assert line("ours", "4 elements", "1.0e-05", "0.9 to 2", "100")
    assert line("lost", "no number")
    assert line("absent", "is not installed")
    assert line("quick", "0.5", "yes") and line("small", "no") and line("unknown", "not measured", "was not run")
    assert line("elements", "40", "0.5") and line("duration", "2 s", "too long")
    assert line("skipped: a rival: is not installed") and line("limited: a method: took too long")
    assert line("machine: a machine, 2 cores; commit 0123abc") and line("kept:", "kept.json")
