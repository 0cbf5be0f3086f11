"""The command `benchmark`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli.run_session import print_json
from fem_needle.errors import SceneError

if TYPE_CHECKING:
    from fem_needle.benchmark.cases import Case
    from fem_needle.benchmark.result import Benchmark
    from fem_needle.benchmark.rivals import Rivals
    from fem_needle.study_files import StudyFolder

NAME = "benchmark"
RUNS = Path("runs")
REPEATS = 5
RANDOM_SCENES, QUICK_RANDOM_SCENES = 40, 4

Names = Annotated[list[str] | None, typer.Argument(metavar="[CASES]...", help="S, D, M, M2, brachytherapy; by default all.")]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder; by default runs/benchmark, then with -2, ...")]
Scripts = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of rivals, such as benchmarks/rivals.")]
Record = Annotated[Path | None, typer.Option(metavar="DIR", help="Write DIR/<date>-<commit>.json too, to be kept.")]


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(benchmark)


def benchmark(
    cases: Names = None,
    goals: Annotated[bool, typer.Option("--goals", help="Measure every goal: goal, measured, met.")] = False,
    scaling: Annotated[bool, typer.Option("--scaling", help="Cost over elements, duration, layers, path, tables, runs.")] = False,
    repeats: Annotated[int | None, typer.Option(metavar="N", help="Rounds in which methods take turns; by default 5.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One round of the two coarsest settings of each method.")] = False,
    rivals: Scripts = None,
    out: Folder = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the benchmark in DIR.")] = False,
    record: Record = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print benchmark.json and nothing else.")] = False,
) -> None:
    """Measure run time against error: this program, exact solutions, libraries and rivals on the same cases.

    Example: fem-needle benchmark S --quick
    """
    from fem_needle.atomic_file import check_place
    from fem_needle.benchmark.cases import cases_of
    from fem_needle.benchmark.rivals import Rivals, load_rivals
    from fem_needle.run_target import RunTarget
    from fem_needle.study_files import StudyFolder

    if repeats is not None and (quick or repeats < 1):
        why = "has no effect with --quick, one round" if quick else "too few"
        raise SceneError(f"--repeats: {why} (got {repeats}; allowed 1 or more without --quick)")
    if record is not None:
        check_place(record / RUNS.name)
    chosen = cases_of(cases or ())
    others = Rivals() if rivals is None else load_rivals(rivals)
    folder = StudyFolder(NAME, RunTarget(out or RUNS / NAME, force, numbered=out is None, for_study=True))
    folder.check()
    rounds = 1 if quick else repeats or REPEATS
    study = _measure(chosen, others, rounds, quick=quick, goals=goals, scaling=scaling, quiet=as_json)
    _write(study, chosen, folder, record, quiet=as_json)


def _measure(
    cases: tuple[Case, ...], rivals: Rivals, repeats: int, *, quick: bool, goals: bool, scaling: bool, quiet: bool
) -> Benchmark:
    """Measure what was asked for and say on stderr what is going on."""
    from dataclasses import replace

    from fem_needle.benchmark.goals import goal_rows
    from fem_needle.benchmark.scaling import QUICK, Sizes
    from fem_needle.benchmark.scaling import scaling as measure_scaling
    from fem_needle.benchmark.study import benchmark as compute

    def tell(message: str) -> None:
        if not quiet:
            typer.echo(message, err=True)

    study = compute(cases, rivals=rivals, repeats=repeats, quick=quick, tell=tell)
    if goals:
        scenes = QUICK_RANDOM_SCENES if quick else RANDOM_SCENES
        study = replace(study, goals=goal_rows(study.rows, scenes, tell))
    if scaling:
        study = replace(study, scaling=measure_scaling(QUICK if quick else Sizes(), tell))
    return study


def _write(study: Benchmark, cases: tuple[Case, ...], folder: StudyFolder, record: Path | None, *, quiet: bool) -> None:
    """Write and show a benchmark."""
    from fem_needle.benchmark.picture import benchmark_picture
    from fem_needle.benchmark.record import write_record
    from fem_needle.benchmark.scaling_picture import scaling_picture
    from fem_needle.cli.benchmark_table import show_benchmark

    pictures = {"benchmark-scaling.png": scaling_picture(study.scaling)} if study.scaling else {}
    plain = study.to_dict()
    written = folder.write(cases[0].scene, plain, study.columns(), benchmark_picture(study), pictures)
    kept = None if record is None else write_record(study, record)
    if quiet:
        print_json(plain)
    else:
        show_benchmark(study, written, kept)
