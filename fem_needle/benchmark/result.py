"""What a benchmark found: plain rows that go into a table, a file and a picture."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from fem_needle.benchmark.methods import Setting
from fem_needle.display import Card, Shown


@dataclass(frozen=True)
class Row:
    """One method with one setting on one case.

    Attributes
    ----------
    case, method, kind
        Names.
    setting
        How finely.
    error
        Of the tip (1), by the case's definition; None if it failed.
    median, lowest, highest
        Time to solve [s]; None if it failed.
    rounds
        How often it was timed.
    steps
        Time steps; None where they are not given.
    whole
        Time of the whole answer as a user calls it, once [s]; None where the method prepares nothing.
    note
        Why it failed, or "".
    """

    case: str
    method: str
    kind: str
    setting: Setting
    error: float | None = None
    median: float | None = None
    lowest: float | None = None
    highest: float | None = None
    rounds: int = 0
    steps: int | None = None
    whole: float | None = None
    note: str = ""

    @property
    def per_step(self) -> float | None:
        """Median time of a step [s]."""
        return None if self.median is None or self.steps is None else self.median / self.steps

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI."""
        return asdict(self) | {"label": self.setting.label, "per_step": self.per_step}


@dataclass(frozen=True)
class GoalRow:
    """A goal and what was measured.

    Attributes
    ----------
    number
        Of the goal, with a letter for its parts.
    text
        What is asked for.
    goal, measured
        Values in the unit; measured is None where it could not be.
    unit
        As shown.
    met
        Whether; None where it was not measured.
    note
        Why not measured, or by what.
    """

    number: str
    text: str
    goal: float
    measured: float | None
    unit: str
    met: bool | None
    note: str = ""


@dataclass(frozen=True)
class ScalingRow:
    """Cost of a problem of one size.

    Attributes
    ----------
    over
        "elements", "duration", "layers", "pieces of a cut path", "points of a table" or "runs".
    method
        Name.
    size
        How many, or seconds.
    per_step
        Time of a step [s]; None if it failed.
    total
        Time of the run [s].
    memory
        Most memory at once [bytes].
    note
        Why it failed, or "".
    """

    over: str
    method: str
    size: float
    per_step: float | None
    total: float | None
    memory: int | None
    note: str = ""


@dataclass(frozen=True)
class CaseInformation:
    """A case and where its true tips come from."""

    name: str
    about: str
    reference: str


@dataclass(frozen=True, eq=False, repr=False)
class Benchmark(Shown):
    """Run time against error.

    Attributes
    ----------
    cases
        What was computed.
    rows
        In the order of the cases, methods and settings.
    goals, scaling
        Where they were asked for.
    skipped
        Rivals that could not take part, and why.
    limits
        What kept methods from finer settings.
    machine, commit, date
        On what, from which version and when, as YYYY-MM-DDTHH:MM:SS+00:00.
    """

    cases: tuple[CaseInformation, ...]
    rows: tuple[Row, ...]
    goals: tuple[GoalRow, ...] = ()
    scaling: tuple[ScalingRow, ...] = ()
    skipped: tuple[tuple[str, str], ...] = ()
    limits: tuple[tuple[str, str], ...] = ()
    machine: dict[str, Any] | None = None
    commit: str | None = None
    date: str = ""

    def _card(self) -> Card:
        met = sum(goal.met is True for goal in self.goals)
        facts = (
            ("cases", ", ".join(case.name for case in self.cases)),
            ("rows", str(len(self.rows))),
            *((("goals met", f"{met} of {len(self.goals)}"),) if self.goals else ()),
            ("date", self.date or "unknown"),
            ("commit", self.commit or "unknown"),
        )
        columns: dict[str, list[Any]] = {
            "case": [row.case for row in self.rows],
            "method": [row.method for row in self.rows],
            "setting": [row.setting.label for row in self.rows],
            "error": [row.error for row in self.rows],
            "median [s]": [row.median for row in self.rows],
            "note": [row.note for row in self.rows],
        }
        return Card("Benchmark", "", facts, columns)

    def of_case(self, name: str) -> tuple[Row, ...]:
        """Return the rows of a case."""
        return tuple(row for row in self.rows if row.case == name)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI: `benchmark.json`."""
        return {
            "format": 1,
            "date": self.date,
            "commit": self.commit,
            "machine": self.machine,
            "cases": [asdict(case) for case in self.cases],
            "rows": [row.to_dict() for row in self.rows],
            "goals": [asdict(goal) for goal in self.goals],
            "scaling": [asdict(row) for row in self.scaling],
            "skipped": dict(self.skipped),
            "limits": dict(self.limits),
        }

    def columns(self) -> dict[str, list[Any]]:
        """Return the rows as columns: `benchmark.csv`."""
        names = {"case": "case", "method": "method", "kind": "kind", "error": "error [1]", "median": "median [s]"}
        names |= {"lowest": "lowest [s]", "highest": "highest [s]", "rounds": "rounds", "steps": "steps"}
        names |= {"whole": "whole [s]", "note": "note"}
        columns: dict[str, list[Any]] = {title: [getattr(row, name) for row in self.rows] for name, title in names.items()}
        settings = ("elements", "modes", "time_step", "tolerance", "variant")
        units = {"time_step": "time_step [s]", "tolerance": "tolerance [1]"}
        return columns | {units.get(name, name): [getattr(row.setting, name) for row in self.rows] for name in settings}


def benchmark_from_dict(data: dict[str, Any]) -> Benchmark:
    """Return the benchmark of a file `benchmark.json`."""
    extra = ("label", "per_step")
    rows = []
    for found in data["rows"]:
        values = {key: value for key, value in found.items() if key not in extra}
        error = values["error"]
        values["error"] = float("inf") if error is None and values["median"] is not None else error
        rows.append(Row(**values | {"setting": Setting(**values["setting"])}))
    return Benchmark(
        tuple(CaseInformation(**case) for case in data["cases"]),
        tuple(rows),
        tuple(GoalRow(**goal) for goal in data["goals"]),
        tuple(ScalingRow(**row) for row in data["scaling"]),
        tuple(data["skipped"].items()),
        tuple(data["limits"].items()),
        data["machine"],
        data["commit"],
        data["date"],
    )
