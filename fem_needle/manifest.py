"""`manifest.json`: with what, when and how long a run was computed."""

from __future__ import annotations

import json
import platform
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from fem_needle.scene import Scene

FILE = "manifest.json"
FORMAT = 1
RUNNING, FINISHED, INTERRUPTED, FAILED = "running", "finished", "interrupted", "failed"  # states
PACKAGES = ("fem-needle", "numpy", "scipy", "scikit-fem")


def manifest(scene: Scene) -> dict[str, Any]:
    """Return what is known when a run starts; `wall_time` [s] and `state` are filled in at its end."""
    versions = {"python": platform.python_version()} | {name: metadata.version(name) for name in PACKAGES}
    return {
        "format": FORMAT,
        "versions": versions,
        "platform": platform.platform(),
        "seed": scene.run.seed,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "wall_time": None,
        "state": RUNNING,
    }


def state_of(folder: Path) -> str | None:
    """Return the state in the manifest of a run folder; None where it has none, as those of older versions."""
    found = _read(folder)
    return found.get("state") if isinstance(found, dict) and isinstance(found.get("state"), str) else None


def is_run_folder(folder: Path) -> bool:
    """Return whether a folder was written by this package."""
    found = _read(folder)
    if not isinstance(found, dict) or not isinstance(found.get("format"), int):
        return False
    versions = found.get("versions")
    return isinstance(versions, dict) and "fem-needle" in versions


def _read(folder: Path) -> Any:
    try:
        return json.loads((folder / FILE).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
