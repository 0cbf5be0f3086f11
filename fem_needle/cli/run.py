"""The command `run`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.cli.short_path import short_path
from fem_needle.errors import ComputationError, NeedleError

if TYPE_CHECKING:
    from fem_needle.run_folder import RunFolderWriter
    from fem_needle.run_target import RunTarget
    from fem_needle.scene import Scene
    from fem_needle.trajectory import Trajectory

RUNS = Path("runs")

Text = str | None

VARIANTS = "Of the assumed modes: conservative, corrected or as-printed."
BASES = "Assumed modes of the full-length or of the inserted-length."
Folder = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Run folder; by default runs/<name>, then runs/<name>-2, ...")
]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene; may be repeated.")
]
CORRECTIONS = "Let the static responses to loads join the assumed modes."


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("run")(run)


def run(
    scene: SceneArgument,
    out: Folder = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the run in DIR.")] = False,
    model: Annotated[Text, typer.Option(metavar="KIND", help="fem, assumed-modes or another installed model.")] = None,
    modes: Annotated[Text, typer.Option(metavar="N", help="How many assumed modes.")] = None,
    variant: Annotated[Text, typer.Option(metavar="NAME", help=VARIANTS)] = None,
    basis: Annotated[Text, typer.Option(metavar="NAME", help=BASES)] = None,
    static_corrections: Annotated[bool, typer.Option("--static-corrections", help=CORRECTIONS)] = False,
    elements: Annotated[Text, typer.Option(metavar="N", help="Elements over the part that bends, or auto.")] = None,
    mesh: Annotated[Path | None, typer.Option(metavar="FILE", help="Line mesh of the needle, in place of elements.")] = None,
    degree: Annotated[Text, typer.Option(metavar="N", help="Polynomial degree of an element, 3 or 4.")] = None,
    time_step: Annotated[Text, typer.Option(metavar="TIME", help="Largest time step, such as 1e-3 or '1 ms', or auto.")] = None,
    tolerance: Annotated[Text, typer.Option(metavar="X", help="Tip error / largest tip deflection to aim at.")] = None,
    analysis: Annotated[Text, typer.Option(metavar="KIND", help="auto, dynamic, quasi-static or static.")] = None,
    output_step: Annotated[Text, typer.Option(metavar="TIME", help="Time between samples, or auto.")] = None,
    assignments: Assignments = None,
    no_vtk: Annotated[bool, typer.Option("--no-vtk", help="Write no frames for ParaView.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json and nothing else.")] = False,
    explain: Annotated[bool, typer.Option("--explain", help="Say what each row of the table means.")] = False,
) -> None:
    """Insert a needle and leave a run folder that ParaView opens.

    Example: fem-needle run thesis --set tissue.layers.phantom.foundation_modulus=800
    """
    from fem_needle.cli.settings import changed
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene

    model_keys = {"kind": model, "modes": modes, "variant": variant, "basis": basis}
    numerics_keys = {"elements": elements, "degree": degree, "time_step": time_step, "tolerance": tolerance}
    options: dict[str, Any] = {f"model.{key}": value for key, value in model_keys.items()}
    options |= {f"numerics.{key}": value for key, value in numerics_keys.items()}
    options |= {"numerics.analysis": analysis, "numerics.output_step": output_step}
    options["numerics.mesh"] = None if mesh is None else _positions(mesh)
    options["model.static_corrections"] = static_corrections or None
    loaded = changed(load_scene(scene), assignments or (), options)
    target = RunTarget(RUNS / Path(scene).stem if out is None else out, force, numbered=out is None)
    target.check()
    _run(loaded, target, vtk=not no_vtk, quiet=as_json, explain=explain)


def _positions(mesh: Path) -> list[float]:
    from fem_needle.mesh_file import mesh_positions

    positions: list[float] = mesh_positions(mesh).tolist()
    return positions


def _run(scene: Scene, target: RunTarget, *, vtk: bool, quiet: bool, explain: bool) -> None:
    from fem_needle.checks import suspicious
    from fem_needle.cli.run_progress import Observers, ProgressBar
    from fem_needle.run_folder import RunFolderWriter
    from fem_needle.simulation import run_scene

    messages = suspicious(scene)
    for message in messages:
        typer.echo(f"warning: {message}", err=True)
    writer, bar = RunFolderWriter(target, vtk=vtk, warnings=messages), ProgressBar(scene.title)
    try:
        finished = run_scene(scene, observer=writer if quiet else Observers(bar, writer))
        if finished.summary["stop_reason"] == "interrupted":
            _stop(writer, finished, "interrupted", _interrupted(finished), quiet=quiet)
        finished = writer.finish(finished)
    except KeyboardInterrupt:
        _stop(writer, None, "interrupted", "interrupted", quiet=quiet)
    except ComputationError as error:
        _stop(writer, error.partial, "failed", str(error), quiet=quiet)
    finally:
        bar.stop()
    if quiet:
        _print_json(finished.summary)
    else:
        _print_table(finished, writer, messages)
    if explain:
        _explain(to_stderr=quiet)


def _interrupted(run: Trajectory) -> str:
    return f"interrupted at time {run.time[-1]:g} s, depth {run.depth[-1]:g} m"


def _stop(writer: RunFolderWriter, run: Trajectory | None, reason: str, message: str, *, quiet: bool) -> NoReturn:
    """Save what was computed and end with a message that says where it is.

    Raises
    ------
    typer.Exit
        Always.
    """
    try:
        summary = writer.break_off(run, reason)
    except NeedleError as error:
        message = f"{message}; {error}"
        summary = {"stop_reason": reason, "folder": str(writer.folder)}
    kept = "" if writer.folder is None else f"; what was computed is in {short_path(writer.folder)}"
    typer.echo(f"error: {message}{kept}", err=True)
    if quiet and writer.folder is not None:
        _print_json(summary)
    raise typer.Exit(1)


def _print_json(summary: dict[str, Any]) -> None:
    from fem_needle.atomic_file import json_bytes

    typer.echo(json_bytes(summary).decode(), nl=False)


def _print_table(run: Trajectory, writer: RunFolderWriter, messages: Sequence[str]) -> None:
    from fem_needle.cli.run_table import run_rows
    from fem_needle.cli.tables import new_table, show

    table = new_table(run.scene.title, "", "")
    table.show_header = False
    for row in run_rows(run, short_path(writer.folder or RUNS), messages):
        table.add_row(*row)
    show(table)


def _explain(*, to_stderr: bool) -> None:
    from fem_needle.cli.run_table import EXPLANATION

    for name, meaning in EXPLANATION:
        typer.echo(f"{name}: {meaning}", err=to_stderr)
