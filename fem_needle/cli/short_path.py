"""A path as a user sees it."""

from __future__ import annotations

from pathlib import Path


def short_path(path: Path) -> Path:
    """Return a path relative to the current folder where it lies inside."""
    try:
        here = Path.cwd()
    except OSError:  # it has been removed meanwhile
        return path
    return path.relative_to(here) if path.is_relative_to(here) else path
