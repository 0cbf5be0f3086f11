"""The page docs/steering.md: the thesis' experiments in closed loop, and controllers compared."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from reduced_model.steering.closed_loops import section as closed_loops
from reduced_model.steering.comparison import section as comparison
from reduced_model.steering.table_iv import section as table_iv
from reduced_model.validation.page import write_files
from reduced_model.validation.section import Section

SECTIONS: dict[str, Callable[[], Section]] = {
    "closed loops": closed_loops,
    "table": table_iv,
    "comparison": comparison,
}
HEAD = """# Steering: the thesis' experiments in closed loop, and controllers compared

Every number here is computed by `fem-needle experiments --out docs/steering.md` (about five minutes). Sensors, actuators and
controllers with their equations: [control](control.md); what is wrong in the thesis: [erratum](erratum.md).
"""


def sections() -> list[Section]:
    """Return the sections, computed."""
    return [compute() for compute in SECTIONS.values()]


def page(found: list[Section]) -> str:
    """Return the page of sections, Markdown."""
    return "\n".join([HEAD, *(section.markdown for section in found)])


def write_page(file: Path, found: list[Section]) -> tuple[Path, ...]:
    """Write the page, and its pictures into the folder ``pictures`` beside it; return what was written.

    Raises
    ------
    SceneError
        If it cannot be written.
    """
    return write_files(file, page(found), found)
