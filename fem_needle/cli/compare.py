"""The command `compare`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fem_needle.cli.run_session import print_json
from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.errors import ComputationError

if TYPE_CHECKING:
    from fem_needle.comparison.result import Comparison
    from fem_needle.scene import Scene
    from fem_needle.study_files import StudyFolder

NAME = "compare"
RUNS = Path("runs")

Text = str | None

Modes = Annotated[list[int] | None, typer.Option("--modes", metavar="N", help="How many assumed modes; may be repeated.")]
Depths = Annotated[
    list[str] | None,
    typer.Option("--depth", metavar="DEPTH", help="Of shapes and figures, such as 50mm; may be repeated; by default three."),
]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder; by default runs/<name>-compare, then with -2, ...")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene; may be repeated.")
]
CORRECTIONS = "Let the static responses to loads join the assumed modes."
LIMIT = "Exit status 1 if the largest tip error of a model is above E."


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(compare)


def compare(
    scene: SceneArgument,
    reference: Annotated[str, typer.Option(metavar="KIND", help="The model that is trusted.")] = "fem",
    model: Annotated[str, typer.Option(metavar="KIND", help="The model that is tested.")] = "assumed-modes",
    modes: Modes = None,
    variant: Annotated[Text, typer.Option(metavar="NAME", help="conservative, corrected or as-printed.")] = None,
    basis: Annotated[Text, typer.Option(metavar="NAME", help="full-length or inserted-length.")] = None,
    static_corrections: Annotated[bool, typer.Option("--static-corrections", help=CORRECTIONS)] = False,
    depth: Depths = None,
    within: Annotated[float, typer.Option(metavar="E", help="Error of the tip that the range of depth keeps.")] = 0.01,
    elements: Annotated[Text, typer.Option(metavar="N", help="Of the reference; else as many as it needs.")] = None,
    time_step: Annotated[Text, typer.Option(metavar="TIME", help="Of all runs; else what the reference needs.")] = None,
    assignments: Assignments = None,
    out: Folder = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the comparison in DIR.")] = False,
    require_error: Annotated[float | None, typer.Option(metavar="E", help=LIMIT)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print compare.json and nothing else.")] = False,
) -> None:
    """Test a model against a reference: tip, shape, frequencies, energies, range, cost.

    Example: fem-needle compare thesis --reference fem --model assumed-modes --modes 2 --modes 3
    """
    from fem_needle.cli.settings import changed
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene
    from fem_needle.study_files import StudyFolder

    options = {"numerics.elements": elements, "numerics.time_step": time_step}
    loaded = changed(load_scene(scene), assignments or (), options)
    wanted: dict[str, Any] = {"reference": reference, "model": model, "modes": tuple(modes or ()), "within": within}
    wanted |= {"variant": variant, "basis": basis, "static_corrections": static_corrections or None}
    wanted["depths"] = None if depth is None else [_length(text) for text in depth]
    target = RunTarget(out or RUNS / f"{Path(scene).stem}-{NAME}", force, numbered=out is None, for_study=True)
    comparison = _compare(loaded, wanted, StudyFolder(NAME, target), quiet=as_json)
    _require(comparison, require_error)


def _length(text: str) -> float:
    """Return a depth in meters.

    Raises
    ------
    SceneError
        If it is none.
    """
    from fem_needle.cli.settings import number

    return number("--depth", text, "m")


def _compare(scene: Scene, wanted: dict[str, Any], folder: StudyFolder, *, quiet: bool) -> Comparison:
    """Compute, write and show a comparison."""
    from fem_needle.checks import suspicious
    from fem_needle.cli.compare_table import show_comparison
    from fem_needle.comparison.picture import comparison_picture
    from fem_needle.comparison.study import compare as compute

    folder.check()
    messages = suspicious(scene)
    comparison = compute(scene, **wanted)
    for message in dict.fromkeys((*messages, *(text for answer in comparison.answers for text in answer.warnings))):
        typer.echo(f"warning: {message}", err=True)
    plain = comparison.to_dict()
    written = folder.write(scene, plain, comparison.columns(), comparison_picture(comparison))
    if quiet:
        print_json(plain)
    else:
        show_comparison(comparison, written)
    return comparison


def _require(comparison: Comparison, error: float | None) -> None:
    """Fail where a model is worse than required; the files are there by now.

    Raises
    ------
    ComputationError
        With what was found.
    """
    if error is None:
        return
    found = [
        f"{model.answer.label}: it is {model.largest_tip_error:.3g}"
        for model in comparison.models
        if not model.largest_tip_error <= error
    ]
    if found:
        raise ComputationError(f"--require-error: {'; '.join(found)}, required at most {error:g}")
