"""The source as the house tests see it."""

import ast
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("fem_needle", "reduced_model")
IGNORED = {"runs", "dist", "build", "site", "__pycache__", ".git", ".venv", ".hypothesis", "mutants"}
Function = ast.FunctionDef | ast.AsyncFunctionDef


def python_files(*folders: str) -> list[Path]:
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def offending(paths: Iterable[Path], found: Callable[[Path], object]) -> dict[str, object]:
    """What a check finds in each file, of those in which it finds anything."""
    return {str(path.relative_to(ROOT)): what for path in paths if (what := found(path))}


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def functions(path: Path) -> Iterator[Function]:
    return (node for node in ast.walk(tree(path)) if isinstance(node, Function))


def texts() -> list[Path]:
    """Every text file of the repository."""
    suffixes = {".py", ".md", ".toml", ".cff", ".txt", ".yml", ".yaml", ".ipynb", ".csv", ".cfg", ""}
    found = (path for path in ROOT.rglob("*") if path.is_file() and path.suffix in suffixes)
    return sorted(path for path in found if not is_ignored(path.relative_to(ROOT)))


def is_ignored(path: Path) -> bool:
    return any(part in IGNORED or part.endswith(("_cache", ".egg-info")) for part in path.parts)
