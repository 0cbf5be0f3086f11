"""What is in a folder: the page of a run, or that of a study."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fem_needle.errors import SceneError
from fem_needle.manifest import FILE as MANIFEST
from fem_needle.manifest import is_run_folder
from fem_needle.report.parts import Page
from fem_needle.report.run_page import broken_page, run_page
from fem_needle.report.study_page import study_page
from fem_needle.run_folder import SCENE, SERIES, SUMMARY, load_run
from fem_needle.run_target import study_in
from fem_needle.scene import Scene
from fem_needle.scene_file import load_scene


def read_folder(folder: Path) -> Page:
    """Return the report of a run folder or of the folder of a study.

    Raises
    ------
    SceneError
        If it is neither, or its files cannot be read.
    """
    if not is_run_folder(folder):
        raise SceneError(f"{folder}: is no run folder and no study (no {MANIFEST} of this package)")
    manifest = _json(folder / MANIFEST)
    name = study_in(folder)
    if name is not None:
        return study_page(folder, name, _json(folder / f"{name}.json"), _scene(folder), manifest)
    if not (folder / SERIES).exists():
        summary = _json(folder / SUMMARY) if (folder / SUMMARY).exists() else {}
        return broken_page(_scene(folder), summary, manifest)
    return run_page(load_run(folder), manifest, folder)


def _json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise SceneError(f"{path}: cannot be read: {error}") from None
    if not isinstance(found, dict):
        raise SceneError(f"{path}: is damaged: no table of names and values")
    return found


def _scene(folder: Path) -> Scene:
    return load_scene(folder / SCENE)
