"""The command `identify`."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fem_needle.cli import run_options as shared
from fem_needle.cli.run_options import RUNS, by_path
from fem_needle.cli.run_session import print_json, warned
from fem_needle.cli.scene_commands import SceneArgument
from fem_needle.errors import SceneError

if TYPE_CHECKING:
    from fem_needle.identification.measurements import Measurements
    from fem_needle.identification.result import Identification
    from fem_needle.scene import Scene
    from fem_needle.study_files import StudyFolder

NAME = "identify"
FITTED_SCENE = "fitted.toml"

Texts = list[str] | None
Data = Annotated[list[str], typer.Argument(metavar="DATA...", help="CSV files of measurements, or names of sample data.")]
HOLD_BACK = "Share of the rows, the last ones of each file, that are predicted and not fitted, such as 0.25."


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command(NAME)(identify)


def identify(
    scene: SceneArgument,
    data: Data,
    fit: Annotated[Texts, typer.Option(metavar="PATH", help="A number of the scene that is fitted; may be repeated.")] = None,
    bounds: Annotated[Texts, typer.Option(metavar="PATH=LOW:HIGH", help="What it may become; either end may be empty.")] = None,
    linear: Annotated[Texts, typer.Option(metavar="PATH", help="Fit it as it is, not in its logarithm.")] = None,
    sigma: Annotated[Texts, typer.Option(metavar="COLUMN=X", help="Standard deviation of a column, such as 0.1mm.")] = None,
    hold_back: Annotated[float, typer.Option(metavar="SHARE", help=HOLD_BACK)] = 0.0,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder; by default runs/<name>-identify, then with -2, ...")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the study in DIR.")] = False,
    model: shared.Model = None,
    modes: shared.Modes = None,
    elements: shared.Elements = None,
    analysis: shared.Analysis = None,
    assignments: shared.Assignments = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print identify.json and nothing else.")] = False,
) -> None:
    """Fit numbers of a scene to measured tips, shapes and pushes.

    Example: fem-needle identify brachytherapy brachytherapy-tips --analysis static --fit tissue.layers.0.foundation_modulus
    --fit tissue.layers.1.foundation_modulus
    """
    from fem_needle.cli.settings import changed
    from fem_needle.run_target import RunTarget
    from fem_needle.scene_file import load_scene
    from fem_needle.study_files import StudyFolder

    options = by_path(model=model, modes=modes, elements=elements, analysis=analysis)
    loaded = changed(load_scene(scene), assignments or (), options)
    given = {
        "deviations": _once("--sigma", [_deviation(text) for text in sigma or ()]),
        "bounds": _once("--bounds", [_bounds(loaded, text) for text in bounds or ()]),
        "linear": linear or (),
        "held_back": hold_back,
    }
    target = RunTarget(out or RUNS / f"{Path(scene).stem}-{NAME}", force, numbered=out is None, for_study=True)
    _identify(loaded, data, fit or (), given, StudyFolder(NAME, target), quiet=as_json)


def _identify(
    scene: Scene, data: Sequence[str], paths: Sequence[str], given: dict[str, Any], folder: StudyFolder, *, quiet: bool
) -> None:
    """Compute, write and show a fit."""
    from fem_needle.cli.identify_table import show_identification
    from fem_needle.identification.fit import identify as compute
    from fem_needle.identification.result import plain

    folder.check()
    warned(scene)
    found = compute(scene, paths, [_measured(one) for one in data], **given)
    written = _written(scene, found, folder)
    if quiet:
        print_json(plain(found))
    else:
        show_identification(found, written)


def _written(scene: Scene, found: Identification, folder: StudyFolder) -> Path:
    from fem_needle.identification.picture import identification_picture
    from fem_needle.identification.result import columns, plain
    from fem_needle.scene_file import scene_text

    fitted = scene_text(found.scene).encode("utf-8")
    return folder.write(scene, plain(found), columns(found), identification_picture(found), {FITTED_SCENE: fitted})


def _measured(name: str) -> Measurements:
    """Return the data of a file, or the sample of that name."""
    from fem_needle.identification.measurements import read_measurements
    from fem_needle.identification.sample_data import sample_names, sample_path

    return read_measurements(sample_path(name) if name in sample_names() else name)


def _deviation(text: str) -> tuple[str, float]:
    """Return column and standard deviation [SI] of an option ``--sigma``."""
    from fem_needle.cli.settings import number
    from fem_needle.identification.data_columns import FITTED
    from fem_needle.scene.spelling import known_name

    column, [value] = _pair("--sigma", text, "COLUMN=X", 1)
    column = known_name(column, FITTED)
    return column, number("--sigma", value, "N" if column == "push_force" else "m")


def _bounds(scene: Scene, text: str) -> tuple[str, tuple[float, float]]:
    """Return path and ends [SI] of an option ``--bounds``."""
    from fem_needle.cli.identify_table import unit_of
    from fem_needle.cli.settings import number

    path, ends = _pair("--bounds", text, "PATH=LOW:HIGH", 2)
    low, high = (
        number("--bounds", end, unit_of(scene, path)) if end else free for end, free in zip(ends, (-inf, inf), strict=True)
    )
    return path, (low, high)


def _once(option: str, pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return values by name, none of which may be given twice."""
    names = [name for name, _ in pairs]
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise SceneError(f"{option}: got {', '.join(twice)} more than once; allowed once each")
    return dict(pairs)


def _pair(option: str, text: str, form: str, count: int) -> tuple[str, Sequence[str]]:
    """Return the name and the values of an option.

    Raises
    ------
    SceneError
        If the option has another form.
    """
    name, equals, values = text.partition("=")
    parts = [part.strip() for part in values.split(":")]
    if not (name.strip() and equals and len(parts) == count and any(parts)):
        raise SceneError(f"{option}: got {text!r}; allowed {form}")
    return name.strip(), parts
