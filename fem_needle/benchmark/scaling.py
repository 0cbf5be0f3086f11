"""How the cost grows: of a step over the elements, of a run over its duration, and the memory of both."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem_needle.benchmark.cases import cases_of
from fem_needle.benchmark.library_elements import NaiveElements
from fem_needle.benchmark.loop import whole_loop
from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.own_methods import FixedElements
from fem_needle.benchmark.result import ScalingRow
from fem_needle.benchmark.timing import seconds
from fem_needle.errors import NeedleError
from fem_needle.models import build_plant
from fem_needle.scene import Scene

Array = NDArray[np.float64]

ELEMENTS = (10, 30, 100, 300, 1000, 3000, 10_000)
NAIVE_ELEMENTS = ELEMENTS[:5]
DURATIONS = (0.4, 0.8, 1.6, 3.2)  # s
STEPS, NAIVE_STEPS = 400, 50  # enough for the compiled loop; few for the slow one
STEP = 1e-3  # s
DURATION_ELEMENTS = 40
ROUNDS = 3
OWN, NAIVE = FixedElements.name, NaiveElements.name


def scaling(
    elements: Sequence[int] = ELEMENTS,
    durations: Sequence[float] = DURATIONS,
    tell: Callable[[str], None] = lambda message: None,
) -> tuple[ScalingRow, ...]:
    """Return the cost of case M with steps of 1 ms: 400 or 50 steps over the elements, 40 elements over the duration [s]."""
    rows = []
    for count in elements:
        tell(f"scaling: {count} elements")
        rows.append(_measured("elements", OWN, count, STEPS, partial(_own, count, STEPS * STEP)))
        if count in NAIVE_ELEMENTS:
            rows.append(_measured("elements", NAIVE, count, NAIVE_STEPS, partial(_naive, count)))
    for duration in durations:
        tell(f"scaling: {duration:g} s")
        steps = round(duration / STEP)
        rows.append(_measured("duration", OWN, duration, steps, partial(_own, DURATION_ELEMENTS, duration)))
    return tuple(rows)


def _measured(over: str, method: str, size: float, steps: int, prepare: Callable[[], Callable[[], Array]]) -> ScalingRow:
    """Return the shortest of a few times, and the memory of a run that is not timed, preparation included."""
    try:
        call = prepare()
        call()
        time = min(seconds(call) for _ in range(ROUNDS))
        memory = _peak(prepare)
    except NeedleError as error:
        return ScalingRow(over, method, size, None, None, None, str(error))
    return ScalingRow(over, method, size, time / steps, time, memory)


def _peak(prepare: Callable[[], Callable[[], Array]]) -> int:
    """Return the most memory that Python and numpy hold at once while a run is prepared and done [bytes]."""
    tracemalloc.start()
    try:
        prepare()()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _scene(duration: float) -> Scene:
    case = cases_of(["M"])[0]
    values = {"run.duration": duration, "numerics.output_step": 0.01, "numerics.time_step": STEP}
    return case.scene.with_values(values)


def _own(elements: int, duration: float) -> Callable[[], Array]:
    return whole_loop(build_plant(_scene(duration).with_value("numerics.elements", elements)))


def _naive(elements: int) -> Callable[[], Array]:
    case = cases_of(["M"])[0]
    short = type(case)(case.name, case.shipped, case.about, case.output_step, shortened=NAIVE_STEPS * STEP)
    return NaiveElements().prepare(short, Setting(elements=elements, time_step=STEP))
