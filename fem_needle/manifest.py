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
PACKAGES = ("fem-needle", "numpy", "scipy", "scikit-fem")


def manifest(scene: Scene) -> dict[str, Any]:
    """Return what is known when a run starts; `wall_time` [s] is filled in at its end."""
    versions = {"python": platform.python_version()} | {name: metadata.version(name) for name in PACKAGES}
    return {
        "format": FORMAT,
        "versions": versions,
        "platform": platform.platform(),
        "seed": scene.run.seed,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "wall_time": None,
    }


def is_run_folder(folder: Path) -> bool:
    """Return whether a folder was written by this package."""
    try:
        found = json.loads((folder / FILE).read_bytes())
    except (OSError, ValueError, RecursionError):
        return False
    if not isinstance(found, dict) or not isinstance(found.get("format"), int):
        return False
    versions = found.get("versions")
    return isinstance(versions, dict) and "fem-needle" in versions
