"""The command `converge`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli.run_options import by_path
from fem_needle.cli.run_session import print_json
from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.errors import ComputationError, SceneError

if TYPE_CHECKING:
    from fem_needle.convergence.study import ConvergenceStudy
    from fem_needle.scene import Scene
    from fem_needle.study_files import StudyFolder

NAME = "converge"
RUNS = Path("runs")

Text = str | None


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(converge)


def converge(
    scene: SceneArgument,
    over: Annotated[str, typer.Option(metavar="WHAT", help="elements, time-step or modes.")] = "elements",
    values: Annotated[Text, typer.Option(metavar="LIST", help="What it takes, such as 4,8,16 or 1ms,0.5ms.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder; by default runs/<name>-converge, then with -2, ...")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the study in DIR.")] = False,
    model: Annotated[Text, typer.Option(metavar="KIND", help="fem, assumed-modes or another installed model.")] = None,
    elements: Annotated[Text, typer.Option(metavar="N", help="Elements that are held fixed.")] = None,
    degree: Annotated[Text, typer.Option(metavar="N", help="Polynomial degree of an element, 3 or 4.")] = None,
    time_step: Annotated[Text, typer.Option(metavar="TIME", help="Time step that is held fixed.")] = None,
    analysis: Annotated[Text, typer.Option(metavar="KIND", help="auto, dynamic, quasi-static or static.")] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene; may be repeated.")
    ] = None,
    require_rate: Annotated[
        float | None, typer.Option(metavar="P", help="Exit status 1 if the last order above round-off is below P.")
    ] = None,
    require_error: Annotated[
        float | None, typer.Option(metavar="E", help="Exit status 1 if the relative error of the finest row is above E.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print converge.json and nothing else.")] = False,
) -> None:
    """Refine elements, time step or modes and show how the tip converges.

    Example: fem-needle converge bench-s --degree 3 --values 4,8,16,32 --require-rate 3.9
    """
    from fem_needle.cli.settings import changed
    from fem_needle.convergence.refinement import refuse_refined
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene
    from fem_needle.study_files import StudyFolder

    options = by_path(model=model, elements=elements, degree=degree, time_step=time_step, analysis=analysis)
    refuse_refined(over, options)
    loaded = changed(load_scene(scene), assignments or (), options)
    target = RunTarget(out or RUNS / f"{Path(scene).stem}-{NAME}", force, numbered=out is None, for_study=True)
    study = _study(loaded, over, values, StudyFolder(NAME, target), quiet=as_json)
    _require(study, require_rate, require_error)


def _study(scene: Scene, over: str, values: str | None, folder: StudyFolder, *, quiet: bool) -> ConvergenceStudy:
    """Compute, write and show a study."""
    from fem_needle.checks import suspicious
    from fem_needle.cli.converge_table import show_study
    from fem_needle.convergence.picture import convergence_picture
    from fem_needle.convergence.study import converge as compute

    folder.check()
    for message in suspicious(scene):
        typer.echo(f"warning: {message}", err=True)
    study = compute(scene, over, None if values is None else _numbers(over, values))  # type: ignore[arg-type]
    written = folder.write(scene, study.to_dict(), study.columns(), convergence_picture(study))
    if quiet:
        print_json(study.to_dict())
    else:
        show_study(study, written)
    return study


def _numbers(over: str, text: str) -> list[float]:
    """Return the values of a list: whole numbers, or times with or without a unit.

    Raises
    ------
    SceneError
        If one is none.
    """
    from fem_needle.scene.units import to_si

    parts = [part.strip() for part in text.strip("[] ").split(",")]
    try:
        if over == "time-step":
            return [float(part) if _is_number(part) else to_si(part, "s") for part in parts]
        return [int(part) for part in parts]
    except ValueError:
        kind = "times such as 1ms,0.5ms" if over == "time-step" else "whole numbers such as 4,8,16"
        raise SceneError(f"--values: got {text!r}; allowed {kind}") from None


def _is_number(text: str) -> bool:
    return not text.rstrip().endswith(("s", "n"))  # "s", "min": a unit of time


def _require(study: ConvergenceStudy, rate: float | None, error: float | None) -> None:
    """Fail where a study is not what was required; its files are there by now.

    Raises
    ------
    ComputationError
        With what was found.
    """
    found = []
    if rate is not None and not (study.observed_order is not None and study.observed_order >= rate):
        order = "there is none" if study.observed_order is None else f"it is {study.observed_order:.4g}"
        found.append(f"--require-rate: {order}, required at least {rate:g}")
    if error is not None and not (study.error is not None and study.error <= error):
        value = "there is none" if study.error is None else f"it is {study.error:.3g}"
        found.append(f"--require-error: {value}, required at most {error:g}")
    if found:
        raise ComputationError("; ".join(found))
