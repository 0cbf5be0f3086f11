"""The command `steer`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli import run_options as shared
from fem_needle.cli.run_options import RUNS, by_path
from fem_needle.cli.run_session import explain as explain_rows
from fem_needle.cli.run_session import finished, print_json, show_rows, shown_folder, warned
from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.errors import ComputationError, SceneError

if TYPE_CHECKING:
    from fem_needle.closed_loop.repeated import RepeatedLoop
    from fem_needle.run_target import RunTarget
    from fem_needle.scene import Scene

NAME = "steer"
PICTURE = "steer.png"

Controller = Annotated[
    shared.Text, typer.Option(metavar="KIND[:VARIANT]", help="none, pid, inverse-dynamics, incremental or proportional.")
]
Sensors = Annotated[
    list[str] | None,
    typer.Option("--sensor", metavar="KIND[:KEY=VALUE,...]", help="Change a sensor, or add one; may be repeated."),
]
NO_ENERGIES = "Does nothing any more: works and the energy balance cost next to nothing."
NOTHING_TO_LEAVE_OUT = "warning: --no-energies does nothing any more: works and the energy balance are always computed"
REPEAT = "Run it N times with other scatter and noise; leaves a study in runs/<name>-steer."


def _tell_nothing(asked: bool) -> None:
    """Tell who asks for a loop without energies that there is none."""
    if asked:
        typer.echo(NOTHING_TO_LEAVE_OUT, err=True)


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(steer)


def steer(
    scene: SceneArgument,
    controller: Controller = None,
    schedule: Annotated[shared.Text, typer.Option(metavar="KIND", help="Of the gains: none or model-gain.")] = None,
    sensor: Sensors = None,
    repeat: Annotated[int | None, typer.Option(metavar="N", help=REPEAT)] = None,
    out: shared.Out = None,
    force: shared.Force = False,
    model: shared.Model = None,
    modes: shared.Modes = None,
    variant: shared.Variant = None,
    basis: shared.Basis = None,
    static_corrections: shared.Corrections = False,
    elements: shared.Elements = None,
    time_step: shared.TimeStep = None,
    tolerance: shared.Tolerance = None,
    analysis: shared.Analysis = None,
    output_step: shared.OutputStep = None,
    assignments: shared.Assignments = None,
    no_energies: Annotated[bool, typer.Option("--no-energies", help=NO_ENERGIES, callback=_tell_nothing)] = False,
    no_vtk: shared.NoVtk = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json, or steer.json, and nothing else.")] = False,
    explain: shared.Explain = False,
) -> None:
    """Steer a needle to its target: sensors, a controller and actuators close the loop.

    Example: fem-needle steer steering --sensor tip-imaging:noise=0.2mm,delay=0.1
    """
    from fem_needle.cli.steer_settings import steered
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene

    options = by_path(model=model, modes=modes, variant=variant, basis=basis, static_corrections=static_corrections)
    options |= by_path(elements=elements, time_step=time_step, tolerance=tolerance, analysis=analysis, output_step=output_step)
    options |= {"controller.schedule": schedule}
    loaded = steered(load_scene(scene), assignments or (), options, controller, sensor or ())
    folder = out or RUNS / (Path(scene).stem if repeat is None else f"{Path(scene).stem}-{NAME}")
    target = RunTarget(folder, force, numbered=out is None, for_study=repeat is not None)
    if repeat is None:
        _steer(loaded, target, vtk=not no_vtk, quiet=as_json)
    else:
        _repeat(loaded, repeat, target, quiet=as_json)
    if explain:
        _explain(to_stderr=as_json)


def _explain(*, to_stderr: bool) -> None:
    from fem_needle.cli.steer_table import EXPLANATION

    explain_rows(EXPLANATION, to_stderr=to_stderr)


def _steer(scene: Scene, target: RunTarget, *, vtk: bool, quiet: bool) -> None:
    """Compute, write and show a loop."""
    from fem_needle.cli.steer_table import steer_rows
    from fem_needle.closed_loop.picture import steer_picture
    from fem_needle.closed_loop.steering import steer as compute
    from fem_needle.progress_bar import ProgressBar
    from fem_needle.run_folder import RunFolderWriter

    target.check()
    messages = warned(scene)
    writer = RunFolderWriter(target, vtk=vtk, warnings=messages, others={PICTURE: steer_picture})
    bar = ProgressBar(scene.title)
    progress = (lambda share: None) if quiet else bar.progress
    run = finished(lambda: compute(scene, progress=progress), writer, bar, quiet=quiet)
    if quiet:
        print_json(run.summary)
    else:
        show_rows(scene.title, steer_rows(run, shown_folder(writer), messages))


def _repeat(scene: Scene, repetitions: int, target: RunTarget, *, quiet: bool) -> None:
    """Compute, write and show many runs of a loop."""
    from fem_needle.cli.short_path import short_path
    from fem_needle.cli.steer_table import repeat_rows
    from fem_needle.closed_loop.repeated_picture import repeated_picture
    from fem_needle.closed_loop.repeating import repeat as compute
    from fem_needle.limits import MOST_REPETITIONS
    from fem_needle.progress_bar import ProgressBar
    from fem_needle.study_files import StudyFolder

    if not 1 <= repetitions <= MOST_REPETITIONS:
        raise SceneError(f"--repeat: out of range (got {repetitions}; allowed 1 to {MOST_REPETITIONS})")
    folder = StudyFolder(NAME, target)
    folder.check()
    warned(scene)
    bar = ProgressBar(scene.title)
    try:
        study = compute(scene, repetitions, progress=None if quiet else bar.progress)
    finally:
        bar.stop()
    plain = study.to_dict()
    written = short_path(folder.write(scene, plain, study.columns(), repeated_picture(study)))
    if quiet:
        print_json(plain)
    else:
        show_rows(scene.title, repeat_rows(study, written))
    _require(study, written)


def _require(study: RepeatedLoop, folder: Path) -> None:
    """Fail where nothing came of the repetitions; their files are there by now.

    Raises
    ------
    ComputationError
        If they were interrupted, or all failed.
    """
    kept = f"what was computed is in {folder}"
    if study.is_interrupted:
        complete = sum(one.is_complete for one in study.repetitions)
        raise ComputationError(f"interrupted after {complete} of {study.asked} repetitions; {kept}")
    if study.failed == study.asked:
        raise ComputationError(f"all repetitions failed, the first one: {study.repetitions[0].failure}; {kept}")
