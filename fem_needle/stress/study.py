"""All cases in as many processes as there are cores, and their table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from os import cpu_count

from fem_needle.display import Card, Shown
from fem_needle.dynamics import warming
from fem_needle.stress.cases import Case, cases
from fem_needle.stress.trial import Figure, Trial

RANDOM_SCENES, LONG_RANDOM_SCENES = 500, 10_000
SHOWN_FAILURES = 20
HEADER = """# Stress

Made by `fem-needle stress{} --scenes {} --out docs/stress.md`.
What is counted, and what the figures mean: [robustness](robustness.md).

"""


@dataclass(frozen=True)
class StressRow:
    """What came of a case.

    Attributes
    ----------
    case, extent
        What was varied, and how far.
    trials
        All scenes of it.
    """

    case: str
    extent: str
    trials: tuple[Trial, ...]

    @property
    def announced(self) -> int:
        """How many were refused, stopped with a message or warned of."""
        return sum(bool(trial.announced) for trial in self.trials)

    @property
    def failures(self) -> tuple[Trial, ...]:
        """Those in which something happened that must not."""
        return tuple(trial for trial in self.trials if trial.failed)

    @property
    def worst(self) -> Figure | None:
        """The figure nearest to its bound, or farthest beyond."""
        found = [trial.worst for trial in self.trials if trial.worst is not None]
        return max(found, key=lambda figure: figure.share, default=None)

    def cells(self) -> tuple[str, ...]:
        """Return the row as texts."""
        counts = (str(len(self.trials)), str(self.announced), str(len(self.failures)))
        return self.case, self.extent, *counts, _shown(self.worst)


@dataclass(frozen=True, repr=False)
class StressTable(Shown):
    """The rows, and how to get them again."""

    rows: tuple[StressRow, ...]
    random_scenes: int
    first_seed: int
    long: bool

    def _card(self) -> Card:
        runs = sum(len(row.trials) for row in self.rows)
        facts = (
            ("cases", str(len(self.rows))),
            ("runs", str(runs)),
            ("failures", str(self.failures)),
            ("random scenes", str(self.random_scenes)),
            ("first seed", str(self.first_seed)),
        )
        names = ("case", "range", "runs", "announced", "failures", "worst figure")
        cells = [row.cells() for row in self.rows]
        return Card("StressTable", "", facts, {name: [row[place] for row in cells] for place, name in enumerate(names)})

    @property
    def failures(self) -> int:
        """Over all rows."""
        return sum(len(row.failures) for row in self.rows)

    def shown_failures(self) -> list[str]:
        """Return a line for each of the first failures."""
        failed = [trial for row in self.rows for trial in row.failures]
        return [f"{trial.name}: {trial.why()}" for trial in failed[:SHOWN_FAILURES]]

    def page(self) -> str:
        """Return the table as Markdown, with how it was made and what failed."""
        lines = [
            f"{self.random_scenes} random scenes of each model, the first with seed {self.first_seed}; {self.failures} failures.",
            "",
            "| case | range | runs | announced | failures | worst figure |",
            "|---|---|---|---|---|---|",
            *("| " + " | ".join(row.cells()) + " |" for row in self.rows),
            *(f"\nFAILED {line}" for line in self.shown_failures()),
        ]
        return HEADER.format(" --long" if self.long else "", self.random_scenes) + "\n".join(lines) + "\n"


def stress(
    random_scenes: int | None = None,
    first_seed: int = 0,
    *,
    long: bool = False,
    processes: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> StressTable:
    """Put the program through its cases.

    Parameters
    ----------
    random_scenes
        How many are drawn for each model; 500, or 10 000 in the long form.
    first_seed
        Of the random scenes: seed, seed + 1, ...
    long
        Ten million steps in one run, and more random scenes.
    processes
        How many work at once; as many as there are cores.
    progress
        Told the share done, 0 to 1.
    """
    count = (LONG_RANDOM_SCENES if long else RANDOM_SCENES) if random_scenes is None else random_scenes
    chosen = cases(count, first_seed, long=long)
    jobs = [job for case in chosen for job in case.jobs]
    warming.prepare()
    with ProcessPoolExecutor(processes or cpu_count() or 1, get_context("spawn")) as pool:
        futures = [pool.submit(job) for job in jobs]
        found = []
        for number, future in enumerate(futures):
            found.append(future.result())
            if progress is not None:
                progress((number + 1) / len(futures))
    return StressTable(_rows(chosen, found), count, first_seed, long)


def _rows(chosen: Sequence[Case], found: list[list[Trial]]) -> tuple[StressRow, ...]:
    rows, start = [], 0
    for case in chosen:
        trials = tuple(trial for part in found[start : start + len(case.jobs)] for trial in part)
        rows.append(StressRow(case.name, case.extent, trials))
        start += len(case.jobs)
    return tuple(rows)


def _shown(figure: Figure | None) -> str:
    return "-" if figure is None else f"{figure.name} {figure.value:.1e} (allowed {figure.bound:.0e})"
