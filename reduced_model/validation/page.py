"""The page docs/validation.md: all sections below one another, and the conclusions at the end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fem_needle.atomic_file import write_file
from reduced_model.validation import energy, insertion, released, signs, thesis_at_rest, transients, tube_at_rest
from reduced_model.validation.section import Section

AT_REST: dict[str, Callable[[], Section]] = {
    "thesis": thesis_at_rest.section,
    "tube": tube_at_rest.section,
    "signs": signs.section,
}
ALL: dict[str, Callable[[], Section]] = {
    "thesis": thesis_at_rest.section,
    "tube": tube_at_rest.section,
    "released": released.section,
    "inserted": insertion.section,
    "signs": signs.section,
    "energy": energy.section,
    "transients": transients.section,
}
HEAD = """# Validation: where few modes hold and where not

Every number here is computed by `fem-needle validate --out docs/validation.md` and tested to be current by
`tests/reduced/test_validation.py`. What is compared with exact solutions: [verification](verification.md); what is wrong in the
thesis: [erratum](erratum.md); models and symbols: [theory](theory.md), [conventions](conventions.md).
"""
ONLY_AT_REST = "Sections 3, 4, 6 and 7, in which something moves, are left out.\n"


def sections(*, quick: bool = False) -> list[Section]:
    """Return the sections, computed; the quick ones are those at rest."""
    return [compute() for compute in (AT_REST if quick else ALL).values()]


def page(found: list[Section], *, quick: bool = False) -> str:
    """Return the page of sections, Markdown."""
    sentences = "\n".join(f"- {sentence}" for section in found for sentence in section.conclusions)
    parts = [HEAD, *([ONLY_AT_REST] if quick else []), *(section.markdown for section in found)]
    return "\n".join([*parts, f"## 8 In short\n\n{sentences}\n"])


def write_page(file: Path, found: list[Section], *, quick: bool = False) -> tuple[Path, ...]:
    """Write the page, and its pictures into the folder ``pictures`` beside it.

    Returns
    -------
    tuple of Path
        What was written.

    Raises
    ------
    ComputationError
        If it cannot be written.
    """
    return write_files(file, page(found, quick=quick), found)


def write_files(file: Path, text: str, found: list[Section]) -> tuple[Path, ...]:
    """Write a page and the pictures of its sections; return what was written.

    Raises
    ------
    ComputationError
        If it cannot be written.
    """
    folder = file.parent / "pictures"
    contents = {file: text.encode()}
    for section in found:
        contents |= {folder / name: draw() for name, draw in section.pictures.items()}
    for path, content in contents.items():
        write_file(path, content)
    return tuple(contents)
