"""Rivals: methods in scripts of a folder, each skipped with the reason where what it needs is not installed."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from fem_needle.benchmark.methods import Method
from fem_needle.errors import SceneError


@dataclass(frozen=True, eq=False)
class Rivals:
    """What a folder of rivals offers.

    Attributes
    ----------
    methods
        That can be used: ``METHODS`` of each script.
    packages
        Distributions that they use: ``PACKAGE`` of each script.
    skipped
        Script and reason of those that cannot.
    """

    methods: tuple[Method, ...] = ()
    packages: tuple[str, ...] = ()
    skipped: tuple[tuple[str, str], ...] = ()


def load_rivals(folder: Path) -> Rivals:
    """Return the methods of all scripts in a folder.

    Raises
    ------
    SceneError
        If there is no such folder, or a script without ``METHODS`` and ``PACKAGE`` in it.
    """
    if not folder.is_dir():
        raise SceneError(f"--rivals: no such folder (got {str(folder)!r}; allowed a folder of scripts)")
    methods: list[Method] = []
    packages: list[str] = []
    skipped: list[tuple[str, str]] = []
    for path in sorted(folder.glob("*.py")):
        try:
            module = _loaded(path)
        except ImportError as error:
            skipped.append((path.stem, str(error)))
            continue
        if not hasattr(module, "METHODS") or not hasattr(module, "PACKAGE"):
            raise SceneError(f"--rivals: {path} is no rival (allowed scripts with METHODS and PACKAGE)")
        methods += module.METHODS
        packages.append(module.PACKAGE)
    return Rivals(tuple(methods), tuple(packages), tuple(skipped))


def _loaded(path: Path) -> ModuleType:
    """Import a script by its path.

    Raises
    ------
    ImportError
        If something that it needs is missing.
    """
    specification = spec_from_file_location(f"fem_needle_rival_{path.stem}", path)
    if specification is None or specification.loader is None:
        raise ImportError(f"{path} cannot be imported")
    module = module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
