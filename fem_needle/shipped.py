"""The scenes that come with the package."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent / "scenes"
_TEMPLATE = FOLDER / "_template.toml"


class ShippedScene(NamedTuple):
    """A scene that comes with the package.

    Attributes
    ----------
    name
        To load it by.
    title
        What it is, in one line.
    path
        Its file.
    """

    name: str
    title: str
    path: Path


def shipped_names() -> tuple[str, ...]:
    """Return the names of all shipped scenes, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("[!_]*.toml")))


def shipped_scenes() -> tuple[ShippedScene, ...]:
    """Return all shipped scenes, sorted by name."""
    paths = [FOLDER / f"{name}.toml" for name in shipped_names()]
    titles = [tomllib.loads(path.read_text(encoding="utf-8"))["title"] for path in paths]
    return tuple(ShippedScene(path.stem, title, path) for path, title in zip(paths, titles, strict=True))


def shipped_path(name: str) -> Path | None:
    """Return the file of a shipped scene, or None if there is none of that name."""
    return FOLDER / f"{name}.toml" if name in shipped_names() else None


def template_text() -> str:
    """Return a commented scene to start from."""
    return _TEMPLATE.read_text(encoding="utf-8")
