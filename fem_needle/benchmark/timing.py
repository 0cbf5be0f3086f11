"""Times of calls that take turns, so that a busy moment of the machine does not fall on one of them alone."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from statistics import median
from typing import Any

from fem_needle.errors import NeedleError

SHORTEST = 2e-3  # s: a shorter call is repeated until that much time has gone by
SLOW = 1.0  # s: a longer call is timed in few rounds
SLOW_ROUNDS = 2


@dataclass(frozen=True)
class Timing:
    """Times of one call in several rounds.

    Attributes
    ----------
    median, lowest, highest
        [s].
    rounds
        How many.
    """

    median: float
    lowest: float
    highest: float
    rounds: int


def seconds(call: Callable[[], Any], count: int = 1) -> float:
    """Return the time of a call [s], the mean of a number of calls in a row."""
    started = clock.perf_counter()
    for _ in range(count):
        call()
    return (clock.perf_counter() - started) / count


def take_turns(calls: Sequence[Callable[[], Any]], first: Sequence[float], rounds: int) -> list[Timing | None]:
    """Time calls in rounds, each once a round.

    Parameters
    ----------
    calls
        What is timed; each has been called once, so that nothing is loaded or compiled here.
    first
        How long that took [s], loading and compiling included.
    rounds
        At least 1; of a call longer than `SLOW`, `SLOW_ROUNDS` are enough.

    Returns
    -------
    list of Timing
        One for each call; None of one that failed in its first round. After a failure a call has no more turns.
    """
    found: list[list[float]] = [[] for _ in calls]
    stopped: set[int] = set()
    for _ in range(rounds):
        for index, (times, call, before) in enumerate(zip(found, calls, first, strict=True)):
            if index not in stopped and (len(times) < SLOW_ROUNDS or min(times) <= SLOW):
                try:
                    times.append(seconds(call, _enough(before, times)))
                except NeedleError:
                    stopped.add(index)
    return [Timing(median(times), min(times), max(times), len(times)) if times else None for times in found]


def _enough(first: float, times: Sequence[float]) -> int:
    """Return how many calls fill the shortest time that can be measured well."""
    return ceil(SHORTEST / max(min((first, *times)), 1e-9))
