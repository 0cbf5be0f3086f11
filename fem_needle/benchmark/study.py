"""A benchmark: every method on every case that it can do, timed in turns."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.cases import CASES, Case
from fem_needle.benchmark.exact_methods import ExactStatics, ModesAndCosines
from fem_needle.benchmark.library_elements import FactoredElements, NaiveElements
from fem_needle.benchmark.machine import commit, machine
from fem_needle.benchmark.methods import RIVAL, Method, Setting, Solve
from fem_needle.benchmark.modal_system import ModalSystem
from fem_needle.benchmark.own_methods import AssumedModes, FixedElements, ToleranceElements
from fem_needle.benchmark.reference import how, reference_tips
from fem_needle.benchmark.result import Benchmark, CaseInformation, Row
from fem_needle.benchmark.rivals import Rivals
from fem_needle.benchmark.timing import SLOW, seconds, take_turns
from fem_needle.errors import NeedleError

Array = NDArray[np.float64]

METHODS: tuple[Method, ...] = (
    FixedElements(),
    ToleranceElements(),
    AssumedModes(),
    ExactStatics(),
    ModesAndCosines(),
    NaiveElements(),
    FactoredElements(),
    ModalSystem(),
)
REPEATS = 5
QUICK_SETTINGS = 2


@dataclass(frozen=True)
class _Entry:
    """A method that is ready for its turns."""

    method: Method
    setting: Setting
    row: Row
    solve: Solve | None = None
    first: float = 0.0


def benchmark(
    cases: Sequence[Case] = CASES,
    methods: Sequence[Method] = METHODS,
    rivals: Rivals | None = None,
    *,
    repeats: int = REPEATS,
    quick: bool = False,
    tell: Callable[[str], None] = lambda message: None,
) -> Benchmark:
    """Time methods on cases, in rounds in which they take turns.

    Parameters
    ----------
    cases, methods
        What is computed, and how.
    rivals
        Further methods.
    repeats
        Rounds.
    quick
        Only the two coarsest settings of each method.
    tell
        Is told what is being done.

    Raises
    ------
    NeedleError
        If a reference cannot be computed. A method that fails is a row with a note.
    """
    rivals = rivals or Rivals()
    everyone = (*methods, *rivals.methods)
    rows: list[Row] = []
    for case in cases:
        tell(f"{case.name}: reference")
        reference = reference_tips(case)
        entries = [entry for method in everyone for entry in _prepared(case, method, reference, quick=quick, tell=tell)]
        rows += _timed(case, entries, repeats, tell)
    return Benchmark(
        cases=tuple(CaseInformation(case.name, case.about, how(case)) for case in cases),
        rows=tuple(rows),
        skipped=rivals.skipped,
        limits=tuple((method.name, method.limited) for method in everyone if method.limited),
        machine=machine(rivals.packages),
        commit=commit(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _prepared(
    case: Case, method: Method, reference: Array, *, quick: bool, tell: Callable[[str], None]
) -> list[_Entry]:
    """Return a method's settings, each called once; after a failure nothing finer is tried."""
    entries: list[_Entry] = []
    settings = method.settings(case)
    for setting in settings[:QUICK_SETTINGS] if quick else settings:
        tell(f"{case.name}: {method.name}, {setting.label}")
        row = Row(case.name, method.name, method.kind, setting, steps=setting.steps(case))
        try:
            solve = method.prepare(case, setting)
            started = clock.perf_counter()
            tips = solve()
            first = clock.perf_counter() - started
        except Exception as error:
            if not isinstance(error, NeedleError) and method.kind != RIVAL:
                raise
            return [*entries, _Entry(method, setting, replace(row, note=str(error)))]
        entries.append(_Entry(method, setting, replace(row, error=case.error(tips, reference)), solve, first))
    return entries


def _timed(case: Case, entries: Sequence[_Entry], repeats: int, tell: Callable[[str], None]) -> list[Row]:
    """Return the rows with their times; in a round every method's coarsest setting comes first."""
    ready = [(entry, entry.solve) for entry in entries if entry.solve is not None]
    counted: dict[str, int] = {}
    order = []
    for index, (entry, _) in enumerate(ready):
        counted[entry.method.name] = counted.get(entry.method.name, 0) + 1
        order.append((counted[entry.method.name], index))
    turns = [ready[index] for _, index in sorted(order)]
    tell(f"{case.name}: {repeats} rounds")
    timings = take_turns([solve for _, solve in turns], [entry.first for entry, _ in turns], repeats)
    rows = {id(entry): entry.row for entry in entries}
    for (entry, _), timing in zip(turns, timings, strict=True):
        if timing is None:
            rows[id(entry)] = replace(entry.row, error=None, note="stopped in its turn")
            continue
        times = {"median": timing.median, "lowest": timing.lowest, "highest": timing.highest, "rounds": timing.rounds}
        rows[id(entry)] = replace(entry.row, **times, whole=_whole(case, entry, timing.median))  # type: ignore[arg-type]
    return list(rows.values())


def _whole(case: Case, entry: _Entry, time: float) -> float | None:
    """Return the time of the whole answer [s], once; None where nothing is prepared, or where the solving alone is slow."""
    call = entry.method.whole(case, entry.setting)
    if call is None or time > SLOW:
        return None
    try:
        return seconds(call)
    except NeedleError:
        return None
