"""The command `analyze`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fem_needle.cli.run_session import print_json
from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.cli.short_path import short_path

if TYPE_CHECKING:
    from fem_needle.scene import Scene
    from fem_needle.study_files import StudyFolder

NAME = "analyze"
RUNS = Path("runs")

Text = str | None

Depths = Annotated[
    list[str] | None, typer.Option(metavar="DEPTH", help="Depth such as 50mm; may be repeated; by default the scene's.")
]
Held = Annotated[str, typer.Option(metavar="KIND", help="free: depth and speed are states; held: they are given.")]
Speed = Annotated[str, typer.Option(metavar="SPEED", help="Of the insertion at the operating point, such as 10mm/s.")]
Time = Annotated[str, typer.Option(metavar="TIME", help="At which the scene's loads are taken, such as 5s.")]
Position = Annotated[Text, typer.Option(metavar="Y", help="Adds a lateral force at y as an input, such as -5mm.")]
Folder = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder; by default runs/<name>-analyze, then with -2, ...")]
Assignments = Annotated[
    list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value of the scene; may be repeated.")
]


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(analyze)


def analyze(
    scene: SceneArgument,
    depth: Depths = None,
    axial: Held = "free",
    speed: Speed = "0 m/s",
    time: Time = "0 s",
    lateral_position: Position = None,
    out: Folder = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the analysis in DIR.")] = False,
    model: Annotated[Text, typer.Option(metavar="KIND", help="fem, assumed-modes or another installed model.")] = None,
    elements: Annotated[Text, typer.Option(metavar="N", help="Elements over the part that bends; auto: 16.")] = None,
    modes: Annotated[Text, typer.Option(metavar="N", help="How many assumed modes.")] = None,
    variant: Annotated[Text, typer.Option(metavar="NAME", help="Of the assumed modes.")] = None,
    basis: Annotated[Text, typer.Option(metavar="NAME", help="Of the assumed modes.")] = None,
    assignments: Assignments = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print analyze.json and nothing else.")] = False,
) -> None:
    """Linearize a needle at depths: frequencies, gains and their signs, what can be controlled and seen.

    Example: fem-needle analyze brachytherapy --depth 50mm --depth 100mm
    """
    from fem_needle.cli.settings import changed, number
    from fem_needle.linear.linearization import with_lateral_force
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene
    from fem_needle.study_files import StudyFolder

    options = {
        "model.kind": model,
        "model.modes": modes,
        "model.variant": variant,
        "model.basis": basis,
        "numerics.elements": elements,
    }
    loaded = changed(load_scene(scene), assignments or (), options)
    if lateral_position is not None:
        loaded = with_lateral_force(loaded, number("--lateral-position", lateral_position, "m"))
    wanted = _wanted(depth, time, speed) | {"axial": axial}
    path = RUNS / f"{Path(scene).stem}-{NAME}" if out is None else out
    _analyze(loaded, wanted, StudyFolder(NAME, RunTarget(path, force, numbered=out is None, for_study=True)), quiet=as_json)


def _wanted(depth: list[str] | None, time: str, speed: str) -> dict[str, Any]:
    """Return depths, time and speed in SI."""
    from fem_needle.cli.settings import number

    depths = None if depth is None else [number("--depth", text, "m") for text in depth]
    return {"depths": depths, "time": number("--time", time, "s"), "speed": number("--speed", speed, "m/s")}


def _analyze(scene: Scene, wanted: dict[str, Any], folder: StudyFolder, *, quiet: bool) -> None:
    """Compute, write and show an analysis."""
    from fem_needle.analysis.matlab import analysis_matlab
    from fem_needle.analysis.picture import analysis_picture
    from fem_needle.analysis.study import analyze as compute
    from fem_needle.atomic_file import write_file
    from fem_needle.cli.analyze_table import show_analysis

    folder.check()
    analysis = compute(scene, **wanted)
    plain = analysis.to_dict()
    for warning in analysis.warnings:
        typer.echo(f"warning: {warning}", err=True)
    written = folder.write(scene, plain, analysis.columns(), analysis_picture(analysis))
    write_file(written / f"{NAME}.mat", analysis_matlab(analysis))
    if quiet:
        print_json(plain)
    else:
        show_analysis(analysis, short_path(written))
