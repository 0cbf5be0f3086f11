"""A section of the page, and how its numbers and tables are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

SMALLEST_PERCENT = 1e-3  # smaller ones are rounding on some machines
WHOLE_PERCENT = 99.5  # from here on no decimals


@dataclass(frozen=True, eq=False)
class Section:
    """A part of the page.

    Attributes
    ----------
    title
        Its heading.
    text
        What stands below, Markdown.
    conclusions
        Sentences for the end of the page.
    pictures
        Names of PNG files and what draws them.
    """

    title: str
    text: str
    conclusions: tuple[str, ...] = ()
    pictures: Mapping[str, Callable[[], bytes]] = field(default_factory=dict)

    @property
    def markdown(self) -> str:
        """Heading and text."""
        return f"## {self.title}\n\n{self.text.strip()}\n"


def percent(share: float) -> str:
    """Return a share (1) in percent: two digits, its sign, a floor; "fails" where there is none."""
    value = 100.0 * share
    if not abs(value) < float("inf"):
        return "fails"
    if abs(value) < SMALLEST_PERCENT:
        return f"< {SMALLEST_PERCENT:g}"
    return f"{value:.0f}" if abs(value) >= WHOLE_PERCENT else f"{value:.2g}"


def millimeters(length: float) -> str:
    """Return a length [m] in whole mm."""
    return f"{1e3 * length:.0f}"


def kilo(modulus: float) -> str:
    """Return a foundation modulus [N/m^2] in kN/m^2."""
    return f"{1e-3 * modulus:g}"


def prose(text: str) -> str:
    """Return a text as one line, however it is broken in the source."""
    return " ".join(text.split())


def blocks(*parts: str) -> str:
    """Return paragraphs, tables and pictures below one another."""
    return "\n\n".join(parts)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def picture(name: str, caption: str) -> str:
    """Return the Markdown of a picture beside the page."""
    return f"![{caption}](pictures/{name})"
