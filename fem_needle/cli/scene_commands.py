"""Commands on scenes: scenes, new, check, schema."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_needle.cli.run_session import print_json
from fem_needle.cli.tables import new_table, show

if TYPE_CHECKING:
    from fem_needle.scene import Scene

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="A scene file, or the name of a shipped scene.")]


def register(application: typer.Typer) -> None:
    """Add the commands of this group."""
    for name, command in (("scenes", scenes), ("new", new), ("check", check), ("schema", schema)):
        application.command(name)(command)


def scenes() -> None:
    """List the shipped scenes.

    Example: fem-needle scenes
    """
    from fem_needle.shipped import shipped_scenes

    table = new_table("", "Name", "What it is")
    for scene in shipped_scenes():
        table.add_row(scene.name, scene.title)
    show(table)


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Where to write the scene.")],
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented scene to start from.

    Example: fem-needle new my-needle.toml
    """
    from fem_needle.atomic_file import check_target, write_file
    from fem_needle.shipped import template_text

    check_target(file, force=force)
    write_file(file, template_text().encode())
    typer.echo(f"wrote {file}; try: fem-needle check {file}")


def check(
    scene: SceneArgument,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with status 2 on a warning.")] = False,
) -> None:
    """Show every value of a scene in SI and in mm, N, s, and what looks suspicious.

    Example: fem-needle check thesis --strict
    """
    from fem_needle.checks import NOT_YOUNGS_MODULUS, notes, suspicious
    from fem_needle.cli.scene_table import scene_rows
    from fem_needle.scene_file import load_scene

    loaded = load_scene(scene)
    model_warnings = _model_warnings(loaded)
    table = new_table(loaded.title, "Key", "SI", "mm, N, s, degrees")
    for row in scene_rows(loaded):
        table.add_row(*row)
    show(table)
    for note in (NOT_YOUNGS_MODULUS, *notes(loaded)):
        typer.echo(f"note: {note}")
    messages = [*suspicious(loaded), *model_warnings]
    for message in messages:
        typer.echo(f"warning: {message}", err=True)
    if messages and strict:
        raise typer.Exit(2)


def _model_warnings(scene: Scene) -> tuple[str, ...]:
    """Refuse what the scene's model cannot have, and return its warnings; finite elements have everything."""
    if scene.model.kind == "fem":
        return ()
    from fem_needle.models import build_plant

    return build_plant(scene).warnings


def schema() -> None:
    """Print the JSON schema of a scene file.

    Example: fem-needle schema > scene.schema.json
    """
    from fem_needle.scene import Scene

    print_json(Scene.model_json_schema())
