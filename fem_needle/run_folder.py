"""A run on disk: written while it is computed, readable at any moment, read back (docs/contract.md, "A run folder")."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.atomic_file import json_bytes, write_atomically
from fem_needle.errors import ComputationError, SceneError
from fem_needle.folder_lock import FolderLock, is_locked
from fem_needle.manifest import FAILED, FINISHED, INTERRUPTED, RUNNING, is_run_folder, manifest, state_of
from fem_needle.manifest import FILE as MANIFEST
from fem_needle.plant import Plant
from fem_needle.run_target import RunTarget, study_in
from fem_needle.sample_arrays import Samples, joined
from fem_needle.scene import Scene
from fem_needle.scene.steering import SIGNAL_PREFIXES
from fem_needle.scene_file import load_scene, scene_text
from fem_needle.section_forces import SectionForces
from fem_needle.series_file import SECTION, read_series, series_bytes
from fem_needle.trajectory import LATER_VARIABLES, VARIABLES, Trajectory, summary_of, trajectory_from_samples
from fem_needle.vtk_export import VtkSeries, frames_of_run, frames_of_samples

Array = NDArray[np.float64]

SCENE, SUMMARY, SERIES = "scene.toml", "summary.json", "series.nc"
MOST_RESERVED = 2**24  # bytes
OVERHEAD = 2**18  # bytes: what HDF5 takes besides the numbers, and more


class RunFolderWriter:
    """Writes a run folder; an observer of a run.

    Parameters
    ----------
    target
        Where.
    vtk
        Whether to write frames for ParaView.
    warnings
        What the summary says besides the run's own warnings.
    others
        Further files by name, and what makes them of the run.

    Notes
    -----
    Space for the series is held from the start in a file without a name, so that a disk that the frames fill still takes it.
    """

    def __init__(
        self,
        target: RunTarget,
        *,
        vtk: bool = True,
        warnings: Sequence[str] = (),
        others: Mapping[str, Callable[[Trajectory], bytes]] | None = None,
    ) -> None:
        target.check()
        self._target, self._vtk, self._warnings = target, vtk, tuple(warnings)
        self._others = dict(others or {})
        self._folder: Path | None = None
        self._manifest: dict[str, Any] = {}
        self._frames: VtkSeries | None = None
        self._reserve: IO[bytes] | None = None
        self._claimed: FolderLock | None = None
        self._plant: Plant | None = None
        self._choice: dict[str, Any] = {}
        self._blocks: list[Samples] = []
        self._arc_length = np.zeros(0)
        self._started = perf_counter()

    @property
    def folder(self) -> Path | None:
        """The run folder, absolute; None before it is created."""
        return self._folder

    def begin(self, plant: Plant, choice: dict[str, Any]) -> None:
        """Create the folder with the scene and the manifest.

        Raises
        ------
        SceneError
            If the folder exists or cannot be created.
        ComputationError
            If the disk is full.
        """
        self._plant, self._choice = plant, dict(choice)
        scene = plant.scene
        self._arc_length = np.linspace(0.0, scene.needle.length, scene.numerics.output_points)
        self._open(scene, self._arc_length, len(choice.get("output_times", ())))

    def progress(self, fraction: float) -> None:
        """Ignore."""

    def samples(self, block: Samples) -> None:
        """Write the frames of samples.

        Raises
        ------
        ComputationError
            If one cannot be written, as on a full disk.
        """
        self._blocks.append(block)
        if self._frames is None or self._plant is None:
            return
        for frame in frames_of_samples(self._plant, block, self._arc_length):
            with _writing(f"the frame at time {frame.time:g} s, depth {frame.depth:g} m"):
                self._frames.add(frame)

    def finish(self, run: Trajectory) -> Trajectory:
        """Write series and summary; return the run with ``folder`` in its summary.

        Raises
        ------
        ComputationError
            If they cannot be written.
        """
        try:
            run = self._save(run)
            with _writing("the frames"):
                self._finish_frames(run)
        finally:
            self._leave()
        return run

    def break_off(self, run: Trajectory | None, stop_reason: str) -> dict[str, Any]:
        """Save what there is of a run that ended early and return its summary.

        Parameters
        ----------
        run
            What was computed; None: the samples that the writer has seen.
        stop_reason
            Where the run itself gives none.
        """
        try:
            return self._break_off(self._seen(stop_reason) if run is None else run, stop_reason)
        finally:
            self._leave()

    def _break_off(self, run: Trajectory | None, stop_reason: str) -> dict[str, Any]:
        if run is not None:
            run = self._save(run)
            # Where the disk is full, the frames that are there are listed and have to do.
            with suppress(OSError):
                self._finish_frames(run)
            return run.summary
        summary = {key: value for key, value in self._choice.items() if key != "output_times"}
        summary |= {"stop_reason": stop_reason}
        if self._folder is None:
            return summary
        summary = self._completed(summary, self._folder)
        with _writing("the results"):
            self._release()
            self._finish_json(summary)
        return summary

    def _open(self, scene: Scene, arc_length: Array, rows: int) -> Path:
        self._manifest = manifest(scene)  # first: an interrupt from here on finds it
        self._claimed = self._target.claim()
        self._folder = folder = self._claimed.folder
        with _writing("the run folder"):
            write_atomically(folder / MANIFEST, json_bytes(self._manifest))
            write_atomically(folder / SCENE, scene_text(scene).encode("utf-8"))
            self._reserve = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 (held for the whole run)
            numbers = rows * (len(VARIABLES) + (1 + len(SECTION)) * arc_length.size)
            self._reserve.write(bytes(min(MOST_RESERVED, 8 * numbers + OVERHEAD)))
            self._reserve.flush()
            if self._vtk:
                self._frames = VtkSeries(folder, scene, arc_length)
        return folder

    def _save(self, run: Trajectory) -> Trajectory:
        """Write everything but frames; the scene again, with the settings of this run where its plant had others."""
        folder = self._folder or self._open(run.scene, run.arc_length, 0)
        run = replace(run, summary=self._completed(run.summary, folder))
        with _writing("the results"):
            self._release()
            write_atomically(folder / SERIES, series_bytes(run))
            self._finish_json(run.summary)
            write_atomically(folder / SCENE, scene_text(run.scene).encode("utf-8"))
            for name, content in self._others.items():
                write_atomically(folder / name, content(run))
        return run

    def _completed(self, summary: dict[str, Any], folder: Path) -> dict[str, Any]:
        warnings = dict.fromkeys((*self._warnings, *summary.get("warnings", ())))
        return summary | {"warnings": list(warnings), "folder": str(folder)}

    def _leave(self) -> None:
        """Let others have the folder."""
        if self._claimed is not None:
            self._claimed.release()

    def _release(self) -> None:
        if self._reserve is not None:
            self._reserve.close()
            self._reserve = None

    def _seen(self, stop_reason: str) -> Trajectory | None:
        if self._plant is None or not self._blocks:
            return None
        known = {key: value for key, value in self._choice.items() if key != "output_times"}
        run = trajectory_from_samples(self._plant, joined(self._blocks), {})
        return replace(run, summary=known | summary_of(run) | {"stop_reason": stop_reason})

    def _finish_frames(self, run: Trajectory) -> None:
        """Make the frames the rows of the series: an interrupt can fall between the two."""
        if self._frames is None:
            return
        self._frames.keep(len(run.time))
        for frame in frames_of_run(run, self._frames.count):
            self._frames.add(frame)
        self._frames.close()

    def _finish_json(self, summary: dict[str, Any]) -> None:
        if self._folder is None:
            return
        write_atomically(self._folder / SUMMARY, json_bytes(summary))
        wall_time = summary.get("wall_time", perf_counter() - self._started)
        state = summary["stop_reason"] if summary.get("stop_reason") in {INTERRUPTED, FAILED} else FINISHED
        write_atomically(self._folder / MANIFEST, json_bytes(self._manifest | {"wall_time": wall_time, "state": state}))


@contextmanager
def _writing(what: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        advice = "free some space, or use --no-vtk or a longer output_step"
        raise ComputationError(f"{what} cannot be written: {error.strerror or error}; {advice}") from error


def save_run(run: Trajectory, folder: Path, *, force: bool = False, vtk: bool = True) -> Path:
    """Write the run folder of a run and return it, absolute.

    Raises
    ------
    SceneError
        If the folder exists and ``force`` is not given, or is no run folder.
    ComputationError
        If it cannot be written.
    """
    writer = RunFolderWriter(RunTarget(folder, force), vtk=vtk)
    writer.finish(run)
    return writer.folder or folder


def load_run(folder: Path) -> Trajectory:
    """Return the run in a run folder.

    Raises
    ------
    SceneError
        If it is no run folder, or the run in it was broken off before anything but frames was written.
    """
    if not is_run_folder(folder):
        raise SceneError(f"{folder}: is no run folder (no manifest.json of this package)")
    if study := study_in(folder):
        raise SceneError(f"{folder}: holds a study ({study}), not a run; 'fem-needle report' shows it")
    try:
        values = read_series(folder / SERIES)
        summary = json.loads((folder / SUMMARY).read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise SceneError(f"{folder}: the run is not complete: {_progress(folder) or _lost(folder) or error}") from None
    rows = values["time"].size if "time" in values else 0
    values = {name: np.full(rows, np.nan) for name in LATER_VARIABLES} | {"lateral_force": np.zeros((rows, 0))} | values
    missing = {"time", "arc_length", "deflection", "guide_force", *VARIABLES} - set(values)
    if missing or not isinstance(summary, dict):
        raise SceneError(f"{folder}: the run is not complete: no {', '.join(sorted(missing)) or 'summary'}")
    _check_shapes(folder, values)
    return Trajectory(
        scene=load_scene(folder / SCENE),
        time=values["time"],
        series={name: values[name] for name in VARIABLES},
        guide_force=values["guide_force"],
        lateral_force=values["lateral_force"],
        path_position=values.get("path_position", np.zeros(0)),
        path_deflection=values.get("path_deflection", np.zeros(0)),
        signals={name: values[name] for name in values if name.startswith(SIGNAL_PREFIXES)},
        arc_length=values["arc_length"],
        station_deflection=values["deflection"],
        stored_sections=SectionForces(values["bending_moment"], values["shear_force"]) if "shear_force" in values else None,
        summary=summary | {"folder": str(folder.resolve())},
    )


def _progress(folder: Path) -> str | None:
    """Return why a run that has begun has no results yet; None where its manifest knows nothing of that."""
    if state_of(folder) != RUNNING:
        return None
    if is_locked(folder):
        return "it is being computed"
    return "it was killed, or found no space for its results; the frames that it wrote are there"


def _lost(folder: Path) -> str | None:
    """Return which of a run's files is not there."""
    return next((f"no {name}" for name in (SERIES, SUMMARY) if not (folder / name).exists()), None)


def _check_shapes(folder: Path, values: dict[str, Array]) -> None:
    """Refuse series whose variables do not belong together."""
    rows, stations = values["time"].size, values["arc_length"].size
    expected: dict[str, tuple[int, ...]] = dict.fromkeys(("time", *VARIABLES), (rows,))
    along = {name for name in ("deflection", *SECTION) if name in values}
    expected |= {"arc_length": (stations,)} | dict.fromkeys(along, (rows, stations))
    expected |= {"guide_force": (rows, values["guide_force"].shape[-1] if values["guide_force"].ndim else 0)}
    wrong = [name for name, shape in expected.items() if values[name].shape != shape]
    if wrong or rows == 0 or stations < 2:
        raise SceneError(f"{folder}: {SERIES} is damaged: wrong shape of {', '.join(wrong) or 'time or arc_length'}")
