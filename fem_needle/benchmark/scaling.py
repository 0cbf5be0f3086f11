"""How the cost grows: over elements, duration, layers, pieces of a cut path, points of a table, runs; and the memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_needle.batch.many import simulate_many
from fem_needle.benchmark.cases import cases_of
from fem_needle.benchmark.library_elements import NaiveElements
from fem_needle.benchmark.loop import whole_loop
from fem_needle.benchmark.methods import Setting
from fem_needle.benchmark.own_methods import FixedElements
from fem_needle.benchmark.result import ScalingRow
from fem_needle.benchmark.timing import seconds
from fem_needle.dynamics import warming
from fem_needle.dynamics.grid import time_grid
from fem_needle.errors import NeedleError
from fem_needle.models import build_plant
from fem_needle.scene import Scene
from fem_needle.scene_file import load_scene
from fem_needle.simulation import simulate

Array = NDArray[np.float64]

ELEMENTS = (10, 30, 100, 300, 1000, 3000, 10_000)
NAIVE_ELEMENTS = ELEMENTS[:5]
DURATIONS = (0.4, 0.8, 1.6, 3.2)  # s
STEPS, NAIVE_STEPS = 400, 50  # enough for the compiled loop; few for the slow one
STEP, OUTPUT_STEP = 1e-3, 0.01  # s
LAYERS = (1, 3, 10, 30, 100)  # of equal thickness, each of its own modulus
LAYERED = 0.3  # m, all layers together
PIECES = (500, 1000, 2000, 4000, 8000)  # of a path that is cut: one a step
POINTS = (10, 100, 1000, 10_000)  # of a table of the tip's force: a step lands on each
RUNS = (1, 10, 100)
FEW_ELEMENTS = 8
PUSHED_IN = 4.0  # s, of the run on a cut path
DURATION_ELEMENTS = 40
ROUNDS = 3
# What varies, its sizes, the steps that they take, what prepares a run.
_Others = tuple[str, tuple[int, ...], Callable[[int], int], Callable[[int], Callable[[], Array]]]
OWN, NAIVE = FixedElements.name, NaiveElements.name


@dataclass(frozen=True)
class Sizes:
    """Sizes over which the cost is looked at: elements, durations [s], layers, pieces of a cut path, points of a table, runs."""

    elements: tuple[int, ...] = ELEMENTS
    durations: tuple[float, ...] = DURATIONS
    layers: tuple[int, ...] = LAYERS
    pieces: tuple[int, ...] = PIECES
    points: tuple[int, ...] = POINTS
    runs: tuple[int, ...] = RUNS


QUICK = Sizes(ELEMENTS[:3], DURATIONS[:2], LAYERS[:2], PIECES[:2], POINTS[:2], RUNS[:2])


def scaling(sizes: Sizes, tell: Callable[[str], None] = lambda message: None) -> tuple[ScalingRow, ...]:
    """Return the cost of case M with steps of 1 ms: 400 or 50 steps over the elements, 40 elements over the duration [s].

    On 8 elements, M over layers, `brachytherapy` on a cut path over its pieces, M over the points of its force and over runs.
    """
    warming.prepare()  # to compile is no part of a run, and would use up its patience
    rows = []
    for count in sizes.elements:
        tell(f"scaling: {count} elements")
        rows.append(_measured("elements", OWN, count, STEPS, partial(_own, count, STEPS * STEP)))
        if count in NAIVE_ELEMENTS:
            rows.append(_measured("elements", NAIVE, count, NAIVE_STEPS, partial(_naive, count)))
    for duration in sizes.durations:
        tell(f"scaling: {duration:g} s")
        steps = round(duration / STEP)
        rows.append(_measured("duration", OWN, duration, steps, partial(_own, DURATION_ELEMENTS, duration)))
    others: tuple[_Others, ...] = (
        ("layers", sizes.layers, _steps_of_layers, _layered),
        ("pieces of a cut path", sizes.pieces, int, _on_path),
        ("points of a table", sizes.points, _landings, _with_table),
        ("runs", sizes.runs, STEPS.__mul__, _many),
    )
    for over, counts, steps_of, prepare in others:
        for count in counts:
            tell(f"scaling: {count} {over}")
            rows.append(_measured(over, OWN, count, steps_of(count), partial(prepare, count)))
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
    values = {"run.duration": duration, "numerics.output_step": OUTPUT_STEP, "numerics.time_step": STEP}
    return case.scene.with_values(values)


def _own(elements: int, duration: float) -> Callable[[], Array]:
    return whole_loop(build_plant(_scene(duration).with_value("numerics.elements", elements)))


def _of_layers(count: int) -> Scene:
    edges = np.linspace(0.0, LAYERED, count + 1).tolist()
    layers = [
        {"start": start, "end": end, "foundation_modulus": 500.0 * (1 + index % 2)}
        for index, (start, end) in enumerate(pairwise(edges))
    ]
    return _scene(DURATIONS[-1]).with_values({"tissue.layers": layers, "numerics.elements": FEW_ELEMENTS})


def _steps_of_layers(count: int) -> int:
    return _steps(_of_layers(count))


def _layered(count: int) -> Callable[[], Array]:
    return _simulated(_of_layers(count))


def _steps(scene: Scene) -> int:
    """Return the steps of a run, which land on every kink."""
    return time_grid(build_plant(scene), STEP, OUTPUT_STEP).steps


def _simulated(scene: Scene) -> Callable[[], Array]:
    plant = build_plant(scene)
    return lambda: simulate(plant).tip_deflection


def _on_path(pieces: int) -> Callable[[], Array]:
    numerics = {"numerics.time_step": PUSHED_IN / pieces, "numerics.analysis": "dynamic", "numerics.elements": FEW_ELEMENTS}
    scene = load_scene("brachytherapy").with_values(numerics | {"tissue.rest_line": "cut-path", "run.duration": PUSHED_IN})
    return _simulated(scene)


def _tabled(points: int) -> Scene:
    times = np.linspace(0.0, DURATIONS[-1], points)
    force = {"time": times.tolist(), "value": (0.1 * np.sin(40.0 * times)).tolist()}
    return _scene(DURATIONS[-1]).with_values({"loads.0.force": force, "numerics.elements": FEW_ELEMENTS})


def _landings(points: int) -> int:
    return _steps(_tabled(points))


def _with_table(points: int) -> Callable[[], Array]:
    return _simulated(_tabled(points))


def _many(runs: int) -> Callable[[], Array]:
    scene = _scene(STEPS * STEP).with_value("numerics.elements", FEW_ELEMENTS)
    speeds = np.linspace(0.04, 0.05, runs)
    return lambda: simulate_many(scene, {"insertion.speed": speeds}, threads=1, progress=_unwatched).final_tip_deflection


def _unwatched(share: float) -> None:
    """Show nothing."""


def _naive(elements: int) -> Callable[[], Array]:
    case = cases_of(["M"])[0]
    short = type(case)(case.name, case.shipped, case.about, case.output_step, shortened=NAIVE_STEPS * STEP)
    return NaiveElements().prepare(short, Setting(elements=elements, time_step=STEP))
