"""The report of a study: its words and figures, curves, its picture, warnings, versions."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_needle.errors import SceneError
from fem_needle.report.analyze_study import analyze_parts
from fem_needle.report.benchmark_study import benchmark_parts
from fem_needle.report.compare_study import compare_parts
from fem_needle.report.converge_study import converge_parts
from fem_needle.report.identify_study import identify_parts
from fem_needle.report.parts import Page, Picture, Section
from fem_needle.report.repeated_study import repeated_parts
from fem_needle.report.shared import scene_section, subject, values_section, versions_section, warnings_section
from fem_needle.report.study_parts import Columns, StudyParts
from fem_needle.scene import Scene

STUDIES: dict[str, Callable[[dict[str, Any], Columns, Scene], StudyParts]] = {
    "converge": converge_parts,
    "compare": compare_parts,
    "analyze": analyze_parts,
    "identify": identify_parts,
    "benchmark": benchmark_parts,
    "steer": repeated_parts,
}


def study_page(folder: Path, name: str, data: dict[str, Any], scene: Scene, manifest: dict[str, Any]) -> Page:
    """Return the report of a study.

    Parameters
    ----------
    folder
        Of the study.
    name
        Of `STUDIES`.
    data
        What its JSON file holds.
    scene
        What was studied.
    manifest
        What its manifest holds.

    Raises
    ------
    SceneError
        If a file of it is damaged or missing.
    """
    try:
        parts = STUDIES[name](data, _columns(folder / f"{name}.csv"), scene)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, OSError) as error:
        raise SceneError(f"{folder}: the study is damaged: {type(error).__name__}: {error}") from None
    sections = (
        Section("summary", "Summary", paragraphs=parts.paragraphs, grids=parts.grids),
        warnings_section(parts.warnings),
        Section("results", "Results", charts=parts.charts, pictures=_pictures(folder, name, parts), new_page=True),
        scene_section(scene, "What was studied"),
        values_section(scene),
        versions_section(scene, manifest),
    )
    return Page(parts.title or scene.title or parts.kind, subject(parts.kind, manifest), parts.alarm, sections)


def _columns(path: Path) -> Columns:
    """Return a table as texts by header."""
    with path.open(newline="", encoding="utf-8") as file:
        headers, *rows = csv.reader(file)
    return {header: [row[index] for row in rows] for index, header in enumerate(headers)}


def _pictures(folder: Path, name: str, parts: StudyParts) -> tuple[Picture, ...]:
    found = []
    for file, caption in {f"{name}.png": parts.picture, **parts.other_pictures}.items():
        if (folder / file).exists():
            found.append(Picture(caption, caption, (folder / file).read_bytes()))
    return tuple(found)
