"""Everything that is compiled, before anybody waits for it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fem_needle.dynamics.compilation import Entrance
from fem_needle.dynamics.loop import run_steps
from fem_needle.dynamics.rest_loop import run_rests
from fem_needle.errors import NeedleError

ENTRANCES: tuple[Entrance, ...] = (run_steps, run_rests)


@dataclass(frozen=True)
class Warmed:
    """An entrance that is ready.

    Attributes
    ----------
    what
        Its name in messages.
    functions
        How many functions were compiled for it, 0 where it was kept already.
    seconds
        That took [s].
    folder
        Where it is kept.
    """

    what: str
    functions: int
    seconds: float
    folder: Path

    def line(self) -> str:
        """Return what was done as a line."""
        if self.functions:
            return f"{self.what}: compiled in {self.seconds:.1f} s, kept in {self.folder}"
        return f"{self.what}: there already, loaded in {self.seconds:.1f} s from {self.folder}"


def prepare() -> None:
    """Load or compile all entrances where that has not been done yet: before processes start, which would all compile them."""
    for entrance in ENTRANCES:
        entrance.prepare()


def warm() -> Iterator[Warmed]:
    """Prepare all entrances, one after the other.

    Raises
    ------
    NeedleError
        If one cannot be kept: the next process would compile it again.
    """
    for entrance in ENTRANCES:
        seconds, folder = entrance.prepare(), entrance.folder
        if folder is None or not entrance.is_kept:
            raise NeedleError(f"the {entrance.what} is compiled, but cannot be kept: name a folder in NUMBA_CACHE_DIR")
        yield Warmed(entrance.what, entrance.compiled, seconds, folder)
