"""Runs in other formats; `FORMATS` names them. Nothing is overwritten by accident."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from fem_needle.atomic_file import check_target, write_file, writing
from fem_needle.csv_file import series_csv, station_csv
from fem_needle.errors import SceneError
from fem_needle.folder_lock import FolderLock
from fem_needle.matlab_file import matlab_file
from fem_needle.run_target import FRAMES
from fem_needle.series_file import along_needle
from fem_needle.trajectory import Trajectory
from fem_needle.vtk_export import COLLECTION, VtkSeries, frames_of_run
from fem_needle.vtkhdf_file import vtkhdf_file

FORMATS = ("pvd", "vtkhdf", "csv", "mat")

_FILES: dict[str, dict[str, Callable[[Trajectory], bytes]]] = {
    "csv": {"series.csv": series_csv},
    "mat": {"series.mat": matlab_file},
    "vtkhdf": {"deflection.vtkhdf": vtkhdf_file},
}


def export_run(run: Trajectory, kind: str, path: Path, *, force: bool = False) -> tuple[Path, ...]:
    """Write a run in another format and return the files to open.

    Parameters
    ----------
    run
        The run.
    kind
        One of `FORMATS`.
    path
        A folder; "mat" and "vtkhdf" take a path with their ending as the file itself.
    force
        Replace an earlier export.

    Raises
    ------
    SceneError
        If the format is unknown, or something is there that must not be overwritten.
    ComputationError
        If the files cannot be written.
    """
    if kind not in FORMATS:
        raise SceneError(f"format: is not a choice (got {kind!r}; allowed {', '.join(FORMATS)})")
    if kind == "pvd":
        return _export_frames(run, path, force=force)
    targets = _targets(run, kind, path)
    for target in targets:
        check_target(target, force=force)
    for target, content in targets.items():
        write_file(target, content(run))
    return tuple(targets)


def _targets(run: Trajectory, kind: str, path: Path) -> dict[Path, Callable[[Trajectory], bytes]]:
    if path.suffix == f".{kind}" and kind in {"mat", "vtkhdf"}:
        return dict.fromkeys((path,), *_FILES[kind].values())
    along = {f"{name}.csv": partial(station_csv, name) for name in along_needle(run)} if kind == "csv" else {}
    return {path / name: content for name, content in (_FILES[kind] | along).items()}


def _export_frames(run: Trajectory, folder: Path, *, force: bool) -> tuple[Path, ...]:
    """Write `deflection.pvd` with its frames, as the run itself does."""
    collection = folder / COLLECTION
    check_target(collection, force=force)
    _check_frames(folder, force=force)
    with writing(collection), _held(folder):
        collection.unlink(missing_ok=True)
        for name, pattern in FRAMES:
            for old in (folder / name).glob(pattern):
                old.unlink()
        series = VtkSeries(folder, run.scene, run.arc_length)
        for frame in frames_of_run(run):
            series.add(frame)
        series.close()
    return (collection,)


def _check_frames(folder: Path, *, force: bool) -> None:
    """Refuse frames that no list names, and folders that lead elsewhere."""
    for name, pattern in FRAMES:
        frames = folder / name
        if frames.is_symlink() or (frames.exists() and not frames.is_dir()):
            raise SceneError(f"{frames}: is no folder of frames; it is left as it is")
        listed = force and (folder / COLLECTION).exists()
        if frames.is_dir() and any(frames.glob(pattern)) and not listed:
            raise SceneError(f"{frames}: holds frames of something else; they are left as they are (name another folder)")


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Create a folder and keep other writers out of it."""
    folder.mkdir(parents=True, exist_ok=True)
    lock = FolderLock(folder)
    try:
        yield
    finally:
        lock.release()
