"""A run of three samples into a folder as the command makes it, and what must be true of the folder whatever happened."""

from __future__ import annotations

import json
import xml.etree.ElementTree as Xml
from pathlib import Path

import typer

from fem_needle import Insertion
from fem_needle.cli.run_session import finished
from fem_needle.errors import SceneError
from fem_needle.manifest import is_run_folder
from fem_needle.progress_bar import ProgressBar
from fem_needle.run_folder import RunFolderWriter, load_run
from fem_needle.run_target import RunTarget
from fem_needle.simulation import run_scene
from tests.unit.scene.examples import hub_scene

SCENE = hub_scene(
    title="short",
    insertion=Insertion(kind="speed", initial_depth=0.02, speed=0.01, final_depth=0.04),
    numerics={"analysis": "static", "elements": 2, "time_step": 1.0, "output_step": 1.0, "output_points": 5},
)
SAMPLES = 3
STATES = {"running", "finished", "interrupted", "failed"}


def compute(folder: Path, *, force: bool = False) -> int:
    """Run the scene into a folder and return the exit status."""
    try:
        writer = RunFolderWriter(RunTarget(folder, force))
        finished(lambda: run_scene(SCENE, observer=writer), writer, ProgressBar("short"), quiet=True)
    except typer.Exit as ended:
        return ended.exit_code
    return 0


def problems(folder: Path) -> list[str]:
    """Return what is wrong with a folder into which a run was broken off; nothing, where all that is there can be read."""
    if not folder.exists():
        return []
    hidden = [f"left over: {path.name}" for path in folder.rglob(".*")]
    files = [path for path in folder.iterdir() if path.is_file()]
    if files and not is_run_folder(folder):
        return [*hidden, "files without a manifest"]
    if files and json.loads((folder / "manifest.json").read_bytes())["state"] not in STATES:
        return [*hidden, "unknown state"]
    return hidden + _unreadable(folder)


def _unreadable(folder: Path) -> list[str]:
    found = []
    for path in folder.rglob("*.vt[pu]"):
        Xml.parse(path)  # whole, or this raises
    listed = [entry.get("file") for entry in Xml.parse(folder / "deflection.pvd").iter("DataSet")] if _listed(folder) else []
    found += [f"listed and not there: {name}" for name in listed if not (folder / name).exists()]
    try:
        run = load_run(folder)
    except SceneError as error:
        return found if "not complete" in str(error) or "no run folder" in str(error) else [*found, str(error)]
    if run.summary["stop_reason"] not in {"final-depth", "interrupted", "failed"}:
        found.append(f"unknown end: {run.summary['stop_reason']}")
    return found


def _listed(folder: Path) -> bool:
    return (folder / "deflection.pvd").exists()
