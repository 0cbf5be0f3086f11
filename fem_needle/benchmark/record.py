"""Benchmarks that are kept, with the machine and the commit that they were measured on."""

from __future__ import annotations

import json
from pathlib import Path

from fem_needle.atomic_file import json_bytes, write_file
from fem_needle.benchmark.result import Benchmark, benchmark_from_dict
from fem_needle.errors import SceneError


def write_record(study: Benchmark, folder: Path) -> Path:
    """Write `<date>-<commit>.json` into a folder and return its path; one of the same day and commit is replaced.

    Raises
    ------
    ComputationError
        If it cannot be written.
    """
    path = folder / f"{study.date[:10]}-{(study.commit or 'unknown').rstrip('+')}.json"
    write_file(path, json_bytes(study.to_dict()))
    return path


def read_record(path: Path) -> Benchmark:
    """Return a benchmark that was kept.

    Raises
    ------
    SceneError
        If the file is none.
    """
    try:
        return benchmark_from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SceneError(f"{path}: no benchmark: {error}") from None
