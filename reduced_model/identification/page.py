"""The page docs/identification_thesis.md: the thesis' identification repeated."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from reduced_model.identification import bending, friction, stiffness
from reduced_model.validation.page import write_files
from reduced_model.validation.section import Section

SECTIONS: dict[str, Callable[[], Section]] = {
    "friction": friction.section,
    "stiffness": stiffness.section,
    "meaning": stiffness.meaning_section,
    "bending": bending.section,
}
HEAD = """# The thesis' identification repeated

Every number here is computed by `reduced_model.identification.page.write_page` and tested to be current by
`tests/reduced/test_identification.py`. Formulas and their sources: [identification](identification.md); what is wrong in the
thesis: [erratum](erratum.md).
"""


def page() -> str:
    """Return the page, Markdown; computed, some ten seconds."""
    return "\n".join([HEAD, *(compute().markdown for compute in SECTIONS.values())])


def write_page(file: Path) -> tuple[Path, ...]:
    """Write the page; return what was written.

    Raises
    ------
    SceneError
        If it cannot be written.
    """
    return write_files(file, page(), [])
