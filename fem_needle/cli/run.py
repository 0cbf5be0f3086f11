"""The command `run`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli import run_options as shared
from fem_needle.cli.run_options import RUNS, by_path
from fem_needle.cli.run_session import explain as explain_rows
from fem_needle.cli.run_session import finished, print_json, show_rows, shown_folder, warned
from fem_needle.cli.scene_commands import SceneArgument

if TYPE_CHECKING:
    from fem_needle.run_target import RunTarget
    from fem_needle.scene import Scene


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("run")(run)


def run(
    scene: SceneArgument,
    out: shared.Out = None,
    force: shared.Force = False,
    model: shared.Model = None,
    modes: shared.Modes = None,
    variant: shared.Variant = None,
    basis: shared.Basis = None,
    static_corrections: shared.Corrections = False,
    elements: shared.Elements = None,
    mesh: Annotated[Path | None, typer.Option(metavar="FILE", help="Line mesh of the needle, in place of elements.")] = None,
    degree: Annotated[shared.Text, typer.Option(metavar="N", help="Polynomial degree of an element, 3 or 4.")] = None,
    time_step: shared.TimeStep = None,
    tolerance: shared.Tolerance = None,
    analysis: shared.Analysis = None,
    output_step: shared.OutputStep = None,
    assignments: shared.Assignments = None,
    no_vtk: shared.NoVtk = False,
    as_json: shared.AsJson = False,
    explain: shared.Explain = False,
) -> None:
    """Insert a needle and leave a run folder that ParaView opens.

    Example: fem-needle run thesis --set tissue.layers.phantom.foundation_modulus=800
    """
    from fem_needle.cli.settings import changed
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene

    options = by_path(model=model, modes=modes, variant=variant, basis=basis, static_corrections=static_corrections)
    options |= by_path(elements=elements, degree=degree, time_step=time_step, tolerance=tolerance)
    options |= by_path(analysis=analysis, output_step=output_step, mesh=None if mesh is None else _positions(mesh))
    loaded = changed(load_scene(scene), assignments or (), options)
    target = RunTarget(RUNS / Path(scene).stem if out is None else out, force, numbered=out is None)
    target.check()
    _run(loaded, target, vtk=not no_vtk, quiet=as_json)
    if explain:
        from fem_needle.cli.run_table import EXPLANATION

        explain_rows(EXPLANATION, to_stderr=as_json)


def _positions(mesh: Path) -> list[float]:
    from fem_needle.mesh_file import mesh_positions

    positions: list[float] = mesh_positions(mesh).tolist()
    return positions


def _run(scene: Scene, target: RunTarget, *, vtk: bool, quiet: bool) -> None:
    """Compute, write and show a run."""
    from fem_needle.cli.run_table import run_rows
    from fem_needle.progress_bar import Observers, ProgressBar
    from fem_needle.run_folder import RunFolderWriter
    from fem_needle.simulation import run_scene

    messages = warned(scene)
    if scene.controller.kind != "none":
        typer.echo("note: the scene's controller does not act here; 'fem-needle steer' closes its loop", err=True)
    writer, bar = RunFolderWriter(target, vtk=vtk, warnings=messages), ProgressBar(scene.title)
    observer = writer if quiet else Observers(bar, writer)
    done = finished(lambda: run_scene(scene, observer=observer), writer, bar, quiet=quiet)
    if quiet:
        print_json(done.summary)
    else:
        show_rows(scene.title, run_rows(done, shown_folder(writer), messages))
