"""Scenes in TOML files: load, parse, save."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import tomli_w

from fem_needle.errors import SceneError
from fem_needle.scene import Scene
from fem_needle.scene.table_file import read_text
from fem_needle.shipped import shipped_names, shipped_path

MOST_KEYS = 100_000
MOST_PARTS = 16  # of a dotted key
_INNER_PART = re.compile(r"""\.[ \t]*+(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+(?=\.)""")


def load_scene(name_or_path: str | Path) -> Scene:
    """Return the scene of a file, or the shipped scene of that name.

    Parameters
    ----------
    name_or_path
        Name of a shipped scene such as ``"thesis"``, or path of a TOML file
        (``"./thesis"`` for a file that has a shipped name).

    Raises
    ------
    SceneError
        With all mistakes, one line each; also for a missing, empty, binary,
        non-UTF-8 or huge file.
    """
    shipped = shipped_path(name_or_path) if isinstance(name_or_path, str) else None
    path = shipped or Path(name_or_path)
    try:
        if not path.exists():
            raise ValueError(_missing(str(name_or_path)))
        text = read_text(path)
    except (ValueError, OSError) as error:
        raise SceneError(f"scene: {error}") from None
    return parse_scene(text, path.parent)


def parse_scene(text: str, folder: Path | None = None) -> Scene:
    """Return the scene of a TOML text.

    Parameters
    ----------
    text
        TOML.
    folder
        Where the CSV files lie that the text names.

    Raises
    ------
    SceneError
        If the text is no TOML, or with all mistakes of the scene.
    """
    return Scene.from_dict(_toml(text), folder=folder)


def _toml(text: str) -> dict[str, Any]:
    if not text.strip():
        raise SceneError("scene: is empty")
    _check_size(text)
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError(f"scene: is not TOML: {error}") from None


def _check_size(text: str) -> None:
    """Refuse what would take unbounded memory to parse: a key of many parts costs the square of their number."""
    for mark, what in (("=", "keys"), ("[", "tables and lists")):
        if text.count(mark) > MOST_KEYS:
            raise SceneError(f"scene: has {text.count(mark)} {what} (allowed up to {MOST_KEYS})")
    deepest = max((len(_INNER_PART.findall(line)) + 2 for line in text.split("\n")), default=0)
    if deepest > MOST_PARTS:
        raise SceneError(f"scene: has a key of {deepest} parts (allowed up to {MOST_PARTS})")


def scene_text(scene: Scene) -> str:
    """Return the complete TOML of a scene: every key with its value, defaults included, SI."""
    return tomli_w.dumps(scene.to_dict(complete=True))


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as TOML; a file of that name is replaced.

    Loading it gives an equal scene.

    Parameters
    ----------
    scene
        Any scene.
    path
        Of the file, usually ``.toml``.
    """
    Path(path).write_bytes(scene_text(scene).encode("utf-8"))


def _missing(name: str) -> str:
    close = get_close_matches(name, shipped_names(), n=1)
    hint = f"did you mean '{close[0]}'?" if close else f"shipped are: {', '.join(shipped_names())}"
    return f"{name!r} is no file and no shipped scene; {hint}"
