"""The code blocks of a page, and what running them means.

``sh``: one command a line. ``python``: blocks of a page share their names. ``toml``: begins with ``# file.toml``, a whole scene,
or ``# into file.toml``, tables that take the place of those of that scene. ``csv file.csv``: a file. ``output``: what the block
before prints, ``...`` stands for anything, as in doctest. ``matlab``: not executed, but the files and names that it reads must be
there. ``text``: no code. A comment before a block marks it: ``<!-- slow -->``, or ``<!-- not executed: reason -->`` for commands
that are only parsed.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from tests.house.source import ROOT, texts

LANGUAGES = {"sh", "python", "toml", "csv", "output", "matlab", "text", "{toctree}"}
BLOCK = re.compile(
    r"^(?:<!-- (?P<mark>slow|not executed: [^\n]+?) -->\n)?"
    r"```(?P<language>[^\s`]*)[ \t]*(?P<name>[^\n`]*)\n(?P<text>.*?)^```[ \t]*$",
    flags=re.DOTALL | re.MULTILINE,
)
PAGES = [ROOT / "README.md", *(path for path in texts() if path.suffix == ".md" and path.is_relative_to(ROOT / "docs"))]


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the name behind it, its text, the mark above it."""

    language: str
    name: str
    text: str
    mark: str

    @property
    def is_slow(self) -> bool:
        return self.mark == "slow"

    @property
    def is_only_parsed(self) -> bool:
        return self.mark.startswith("not executed")

    @property
    def lines(self) -> list[str]:
        """The commands of a shell block, without comments."""
        plain = (re.sub(r"(^|\s)#.*$", "", line).strip() for line in self.text.splitlines())
        return [line for line in plain if line]


def blocks(path: Path) -> list[Block]:
    """The blocks of a page in order."""
    found = BLOCK.finditer(path.read_text(encoding="utf-8"))
    return [Block(match["language"], match["name"], match["text"], match["mark"] or "") for match in found]


def chosen(path: Path, *, slow: bool) -> list[Block]:
    """What runs: everything, or what is not slow; what a block prints goes with it."""
    found, marks = [], ""
    for block in blocks(path):
        marks = block.mark if block.language != "output" else marks
        if slow or marks != "slow":
            found.append(block)
    return found
