"""On what a benchmark was measured: figures of different machines must not be compared."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = ("numpy", "scipy", "scikit-fem", "numba")
THREADS = "OPENBLAS_NUM_THREADS"


def machine(rivals: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return processor, cores, load, threads of BLAS, versions of Python and packages; None where something is unknown.

    The load is the mean number of runnable processes in the last minute: above 1 others took part of the time.

    Parameters
    ----------
    rivals
        Distributions besides those that the program uses.
    """
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": load(),
        "system": f"{platform.system()} {platform.machine()}",
        "blas_threads": os.environ.get(THREADS),
        "python": platform.python_version(),
        **{name: _version(name) for name in (*PACKAGES, *rivals)},
    }


def load() -> float:
    """Return the mean number of runnable processes in the last minute; 0 where nobody counts them."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0


def commit() -> str | None:
    """Return the short name of the commit that the program is run from, with "+" after it if files differ; None without one."""
    folder = Path(__file__).parent
    name = _git(folder, "rev-parse", "--short", "HEAD")
    changed = _git(folder, "status", "--porcelain", "--untracked-files=no")
    return None if name is None else name + ("+" if changed else "")


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
