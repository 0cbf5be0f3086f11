"""Files of a study: `<name>.json`, `<name>.csv`, `<name>.png`, with the scene and the manifest beside them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from fem_needle.atomic_file import json_bytes, write_atomically
from fem_needle.errors import ComputationError, SceneError
from fem_needle.manifest import FILE, FINISHED, manifest
from fem_needle.run_target import RunTarget
from fem_needle.scene import Scene
from fem_needle.scene_file import scene_text

RUN_FILE = "series.nc"  # what a run folder has and the folder of a study has not


@dataclass(frozen=True)
class StudyFolder:
    """Where a study goes.

    Attributes
    ----------
    name
        Of the study; that of its files.
    target
        The folder.
    """

    name: str
    target: RunTarget

    def check(self) -> None:
        """Refuse, before anything is computed, what `write` would refuse.

        Raises
        ------
        SceneError
            If something is there that must not be overwritten; a run never is.
        """
        self.target.check()
        if (self.target.path / RUN_FILE).exists() and (self.target.force or not self.target.numbered):
            raise SceneError(f"{self.target.path}: holds a run, not a study; it is left as it is (name another folder)")

    def write(
        self,
        scene: Scene,
        result: Any,
        columns: Mapping[str, Sequence[Any]],
        picture: bytes,
        others: Mapping[str, bytes] | None = None,
    ) -> Path:
        """Write the files, each whole or not at all, and return the folder.

        Parameters
        ----------
        scene
            What was studied, complete with the settings of the command line.
        result
            Plain data, SI.
        columns
            Header, such as ``error [1]``, and a value for each row; None is left empty.
        picture
            A PNG.
        others
            Further files by name.

        Raises
        ------
        SceneError
            As `check`.
        ComputationError
            If a file cannot be written.
        """
        self.check()
        claimed, known = self.target.claim(), manifest(scene)
        folder = claimed.folder
        files = {
            FILE: json_bytes(known),
            "scene.toml": scene_text(scene).encode("utf-8"),
            f"{self.name}.json": json_bytes(result),
            f"{self.name}.csv": csv_bytes(columns),
            f"{self.name}.png": picture,
            **(others or {}),
        }
        finished = json_bytes(known | {"state": FINISHED})
        try:
            for name, content in files.items():
                write_atomically(folder / name, content)
            write_atomically(folder / FILE, finished)
        except OSError as error:
            raise ComputationError(f"{folder}: cannot be written: {error}") from error
        finally:
            claimed.release()
        return folder


def csv_bytes(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Return a table as CSV with all digits."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue().encode("utf-8")
