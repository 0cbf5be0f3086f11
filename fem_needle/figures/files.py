"""Pictures of a run as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from fem_needle.atomic_file import check_target, write_file
from fem_needle.errors import SceneError
from fem_needle.figures.animation import animated_gif
from fem_needle.figures.course_figure import courses
from fem_needle.figures.energy_figure import energies
from fem_needle.figures.shape_figure import shapes
from fem_needle.figures.tip_figure import tip_path
from fem_needle.figures.waterfall_figure import waterfall
from fem_needle.pictures import FORMATS, picture_bytes
from fem_needle.run_target import ANIMATION, PICTURES
from fem_needle.trajectory import Trajectory

_DRAWN: dict[str, Callable[[Trajectory], Figure]] = {
    "shapes": shapes,
    "tip-path": tip_path,
    "courses": courses,
    "energies": energies,
    "waterfall": waterfall,
}
KINDS = tuple(_DRAWN)


def write_pictures(
    run: Trajectory,
    folder: Path,
    kinds: Sequence[str] = KINDS,
    formats: Sequence[str] = ("png",),
    *,
    depths: Sequence[float] | None = None,
    animate: bool = False,
    force: bool = False,
) -> tuple[Path, ...]:
    """Write pictures of a run into a folder and return the files, `shapes.png` and so on.

    Parameters
    ----------
    run
        Computed or loaded.
    folder
        Created where it is missing.
    kinds
        Of `KINDS`.
    formats
        Of `FORMATS`.
    depths
        Of the shapes [m].
    animate
        Also `animation.gif`.
    force
        Replace earlier pictures.

    Raises
    ------
    SceneError
        If a kind or a format is unknown, a depth is none of the run, or something is there that must not be overwritten.
    ComputationError
        If a file cannot be written.
    """
    _check_choices("kind", kinds, KINDS)
    _check_choices("format", formats, FORMATS)
    if depths is not None and "shapes" not in kinds:
        raise SceneError(f"depth: has no effect without shapes (got {', '.join(kinds)}; add the kind 'shapes')")
    names = {f"{PICTURES[kind]}.{ending}": (kind, ending) for kind in kinds for ending in formats}
    targets = [folder / name for name in (*names, *([ANIMATION] if animate else []))]
    for target in targets:
        check_target(target, force=force)
    drawn = {kind: shapes(run, depths) if kind == "shapes" else _DRAWN[kind](run) for kind in dict.fromkeys(kinds)}
    for name, (kind, ending) in names.items():
        write_file(folder / name, picture_bytes(drawn[kind], ending))
    if animate:
        write_file(folder / ANIMATION, animated_gif(run))
    return tuple(targets)


def _check_choices(name: str, given: Sequence[str], allowed: Sequence[str]) -> None:
    for choice in given:
        if choice not in allowed:
            raise SceneError(f"{name}: is not a choice (got {choice!r}; allowed {', '.join(allowed)})")
