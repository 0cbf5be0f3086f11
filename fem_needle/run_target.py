"""Where a run folder goes, without ever overwriting anything by accident."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from pathlib import Path

from fem_needle.atomic_file import check_place, is_unfinished
from fem_needle.errors import SceneError
from fem_needle.folder_lock import FolderLock, is_locked
from fem_needle.manifest import FILE as MANIFEST
from fem_needle.manifest import is_run_folder

# What a run folder holds, exports of an older run included; `force` removes this and nothing else.
_TABLES = ("series", "deflection", "bending_moment", "shear_force", "curvature", "bending_stress")
EXPORTS = (*(f"{name}.csv" for name in _TABLES), "series.mat", "deflection.vtkhdf")
# Pictures of a run by kind, each with one of the endings.
PICTURES = {"shapes": "shapes", "tip-path": "tip_path", "courses": "courses", "energies": "energies", "waterfall": "waterfall"}
ANIMATION = "animation.gif"
_DRAWN = (*(f"{name}.{ending}" for name in PICTURES.values() for ending in ("png", "svg", "pdf")), ANIMATION)
_PAGES = ("steer.png", "report.html")
FILES = ("summary.json", "series.nc", *_PAGES, "deflection.pvd", *EXPORTS, *_DRAWN, "scene.toml", "manifest.json")
STUDIES = ("converge", "compare", "analyze", "benchmark", "steer", "identify")
FRAMES = (("needle", "*.vtp"), ("tissue", "*.vtu"))


def study_in(folder: Path) -> str | None:
    """Return the name of the study whose files are in a folder, None where there is none."""
    return next((name for name in STUDIES if (folder / f"{name}.json").exists()), None)


@dataclass(frozen=True)
class RunTarget:
    """A place for a run folder.

    Attributes
    ----------
    path
        The folder.
    force
        Replace the run that is there.
    numbered
        Take ``path-2``, ``path-3``, ... where ``path`` exists.
    for_study
        Whether a study goes there, which may replace a study; a run may not.
    """

    path: Path
    force: bool = False
    numbered: bool = False
    for_study: bool = False

    def check(self) -> None:
        """Refuse, before anything is computed, what `create` would refuse.

        Raises
        ------
        SceneError
            If something is there that must not be overwritten.
        """
        try:
            there = self.path.exists() or self.path.is_symlink()
            if not there or self.numbered:
                check_place(self.path)
            if not there or (self.numbered and not self.force):
                return
            if is_locked(self.path):
                raise SceneError(f"{self.path}: another run is writing into it; wait, or name another folder")
            self._check_content()
        except SceneError:
            raise
        except (OSError, ValueError) as error:
            raise SceneError(f"{self.path}: cannot be used as a run folder: {error}") from None

    def _check_content(self) -> None:
        if self._is_empty_folder():
            return
        if not is_run_folder(self.path):
            raise SceneError(f"{self.path}: exists and is no run folder; it is left as it is (name another folder)")
        if not self.force:
            raise SceneError(f"{self.path}: exists already; --force (force=True) replaces what is in it")
        if not self.for_study and study_in(self.path):
            raise SceneError(f"{self.path}: holds a study, not a run; it is left as it is (name another folder)")
        if any((self.path / name).is_symlink() for name, _ in FRAMES):
            raise SceneError(f"{self.path}: holds links in place of folders; it is left as it is")

    def create(self) -> Path:
        """Create the folder and return it, absolute.

        Raises
        ------
        SceneError
            As `check`, or if the folder cannot be created.
        """
        claimed = self.claim()
        claimed.release()
        return claimed.folder

    def claim(self) -> FolderLock:
        """Create the folder and hold it, so that no other run writes into it until it is released.

        Raises
        ------
        SceneError
            As `check`, or if the folder cannot be created.
        """
        self.check()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.numbered and not self.force:
                return FolderLock(_first_free(self.path).resolve())
            self.path.mkdir(exist_ok=True)
            return self._cleared(FolderLock(self.path.resolve()))
        except SceneError:
            raise
        except (OSError, ValueError) as error:
            raise SceneError(f"{self.path}: cannot be created: {error}") from None

    def _cleared(self, claimed: FolderLock) -> FolderLock:
        """Empty a folder that is held; another run may have filled it since it was checked."""
        try:
            self._check_content()
            _clear(claimed.folder)
        except BaseException:
            claimed.release()
            raise
        return claimed

    def _is_empty_folder(self) -> bool:
        return self.path.is_dir() and all(is_unfinished(path) for path in self.path.iterdir())


def _first_free(path: Path) -> Path:
    """Create the first folder of its numbers that is free; two runs at once get two folders."""
    for number in count(1):
        candidate = path if number == 1 else path.with_name(f"{path.name}-{number}")
        try:
            candidate.mkdir()
        except FileExistsError:
            continue
        return candidate
    raise AssertionError("unreachable")


def _clear(folder: Path) -> None:
    """Remove the files of a run but the manifest, which the next one replaces: what is left is a run folder at any moment."""
    for name, pattern in FRAMES:
        frames = folder / name
        if frames.is_dir():
            for path in (*frames.glob(pattern), *filter(is_unfinished, frames.iterdir())):
                path.unlink()
            if not any(frames.iterdir()):
                frames.rmdir()
    for name in FILES:
        if name != MANIFEST:
            (folder / name).unlink(missing_ok=True)
    for path in filter(is_unfinished, list(folder.iterdir())):
        path.unlink()
