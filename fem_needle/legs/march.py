"""The loop over time in legs: states of many steps at once, their works and samples in arrays (`fem_needle.march`: by steps)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd, Works
from fem_needle.legs.states import Leg
from fem_needle.legs.works import figures, leg_works, row_corrections
from fem_needle.loads import LoadCase
from fem_needle.march import RunEnd, TimeGrid, ends_by_itself, equal_times, failed_step, pass_landing
from fem_needle.motion import DepthLaw, Instant, depth_law
from fem_needle.plant import Plant
from fem_needle.samples import Sample, reactions_of_clamp
from fem_needle.scene import Scene
from fem_needle.stages import StageSolution, evaluate_stage
from fem_needle.steppers import Stepper

Array = NDArray[np.float64]

MOST_STEPS = 500  # of a leg
MOST_COORDINATES = 100_000  # of all steps of a leg: its tables stay in the tens of megabytes


@dataclass(frozen=True, eq=False)
class Piece:
    """Steps of one leg: their times (steps + 1,), which ends are outputs, and whether the first step follows a landing."""

    times: Array
    is_output: NDArray[np.bool_]
    landed: bool


Source = Callable[[DepthLaw, Piece, StepEnd], tuple[Leg, int]]  # states as far as they are finite, and the number of steps done


def march_legs(
    plant: Plant, stepper: Stepper, pieces: Iterable[Piece], source: Source, steps: int
) -> Generator[Sample, None, RunEnd]:
    """Yield a sample at each output time, as `fem_needle.march.march` does; ``steps`` is what the run's end tells of them.

    Raises
    ------
    ComputationError
        If a step cannot be solved or gives numbers that are not finite; says at which time and depth.
    """
    law = depth_law(plant.scene)
    state, works, last_length, pending = initial_state(stepper.plant, law), Works(), 0.0, 0.0
    deepest = law.depth(0.0)
    for piece in pieces:
        time, length = float(piece.times[0]), float(piece.times[1] - piece.times[0])
        if piece.landed:
            state, work = pass_landing(plant, stepper, law, state, time, float(piece.times[1]))
            works, last_length = (works if time == 0.0 else works + work), 0.0
        if abs(last_length - length) > 1e-9 * length:  # a row of equal steps has ended
            works = works + Works(boundary_energy=pending)
        leg, done = source(law, piece, state)
        if done:
            gained = _all_works(plant.scene, leg, last_length, deepest)
            yield from _samples(plant, law, piece, leg, works, gained, deepest)
        if done < len(piece.is_output):
            failed = float(piece.times[done])
            raise failed_step(failed, law.depth(failed), "the equations have no finite answer")
        works = works + _works_at(gained, -1)
        deepest = max(deepest, float(np.max(leg.instants.depths[leg.ends])))
        pending = float(row_corrections(leg, np.array([done - 1]), at_start=False)[0])
        last_length, state = float(leg.lengths[-1]), _end_of(stepper, leg)
    return RunEnd("final-depth" if ends_by_itself(plant.scene) else "duration", steps)


def most_steps(size: int) -> int:
    """Return how many steps a leg may have."""
    return max(1, min(MOST_STEPS, MOST_COORDINATES // size))


def pieces_of(grid: TimeGrid, size: int) -> Iterator[Piece]:
    """Cut the grid at its landings, and long stretches between them, for a plant of so many coordinates."""
    most = most_steps(size)
    outputs, landings = set(grid.outputs), {0.0, *grid.landings}
    times: list[float] = []
    shown: list[bool] = []
    landed = True
    for start, end, count in grid.intervals():
        if start in landings and shown:
            yield Piece(np.array(times), np.array(shown), landed)
            times, shown, landed = [], [], True
        times = times or [start]
        for number, mark in enumerate(islice(equal_times(start, end, count), 1, None), start=1):
            times.append(mark)
            shown.append(number == count and end in outputs)
            if len(shown) == most:
                yield Piece(np.array(times), np.array(shown), landed)
                times, shown, landed = [mark], [], False
    if shown:
        yield Piece(np.array(times), np.array(shown), landed)


def _end_of(stepper: Stepper, leg: Leg) -> StepEnd:
    """Return the state at the end of a leg, as a step leaves it."""
    instants, last = leg.instants, np.array([len(leg.coordinates) - 1])
    motion = (instants.times, instants.depths, instants.speeds, instants.accelerations)
    case = LoadCase(*(getattr(instants.loads, field.name)[-1] for field in fields(LoadCase)))
    stage = evaluate_stage(stepper.plant, Instant(*(float(part[-1]) for part in motion)), case)
    momentum = leg.momenta(last)[0] if leg.inertia else np.zeros_like(leg.coordinates[-1])
    return StepEnd(stage, StageSolution(leg.coordinates[-1], leg.velocities[-1], momentum, leg.forces[-1]))


def _deepest(leg: Leg, before: float) -> Array:
    """Return the largest depth so far [m] at the start of a leg and after every step (steps + 1,)."""
    return np.maximum.accumulate(np.maximum(leg.instants.depths[leg.ends], before))


def _all_works(scene: Scene, leg: Leg, last_length: float, deepest: float) -> dict[str, Array]:
    """Return the works by name since the start of a leg, at its start and after every step (steps + 1,) [J]."""
    before = np.append(last_length, leg.lengths[:-1])
    starts_row = np.append(np.abs(before - leg.lengths) > 1e-9 * leg.lengths, False)
    works = leg_works(leg, starts_row)
    depths, speeds = leg.instants.depths[leg.nodes], leg.instants.speeds[leg.nodes]
    weights = leg.method.weights * leg.lengths[:, None] * speeds
    friction = np.sum(weights * axial.friction_force(scene, depths, speeds), axis=1)
    return {field.name: getattr(works, field.name) for field in fields(works)} | {
        "friction_dissipation": np.append(0.0, np.cumsum(friction)),
        "cutting_work": axial.cutting_work(scene, deepest, _deepest(leg, deepest)),
    }


def _works_at(gained: dict[str, Array], step: int) -> Works:
    return Works(**{name: float(values[step]) for name, values in gained.items()})


def _samples(
    plant: Plant, law: DepthLaw, piece: Piece, leg: Leg, works: Works, gained: dict[str, Array], deepest: float
) -> Iterator[Sample]:
    """Yield the samples of a leg, that of its start only at the start of the run."""
    done = np.flatnonzero(piece.is_output[: len(leg.lengths)]) + 1  # steps done at each output
    if piece.landed and piece.times[0] == 0.0:
        done = np.append(0, done)
    if not len(done):
        return
    shown = figures(leg, leg.stride * done, plant.deflection_at_one)
    ending = row_corrections(leg, np.maximum(done - 1, 0), at_start=False) * (done > 0)
    deepest_yet, depths = _deepest(leg, deepest)[done], law.depths(piece.times[done])
    means = leg.guide_means(done)
    for row, steps in enumerate(done.tolist()):
        total = works + _works_at(gained, steps) + Works(boundary_energy=float(ending[row]))
        values = {field.name: getattr(shown, field.name)[row] for field in fields(shown)}
        yield _sample(plant, leg, leg.stride * steps, values, total, float(depths[row]), float(deepest_yet[row]), means[row])


def _sample(
    plant: Plant,
    leg: Leg,
    instant: int,
    shown: dict[str, Any],
    works: Works,
    depth: float,
    deepest: float,
    guide_force: Array,
) -> Sample:
    """Return the sample of an instant."""
    instants, scene = leg.instants, plant.scene
    speed, mass = float(instants.speeds[instant]), scene.needle.mass_per_length * scene.needle.length
    friction = float(axial.friction_force(scene, depth, speed))
    resisting = friction + axial.cutting_force(scene, depth, speed, deepest)
    axial_force = float(shown["axial_force"]) if plant.axial_force_acts else 0.0
    hub_force, hub_moment = reactions_of_clamp(plant, shown["hub_residual"], depth, leg.forces[instant])
    return Sample(
        time=float(instants.times[instant]),
        depth=depth,
        speed=speed,
        coordinates=leg.coordinates[instant].copy(),
        point_forces=leg.forces[instant].copy(),
        guide_force=guide_force,
        push_force=mass * float(instants.accelerations[instant]) + resisting - axial_force,
        friction_force=friction,
        tissue_force=float(shown["tissue_force"]),
        hub_force=hub_force,
        hub_moment=hub_moment,
        axial_kinetic_energy=0.5 * mass * speed**2,
        path_position=np.zeros(0),
        path_deflection=np.zeros(0),
        **{name: float(value) for name, value in shown.items() if name.endswith("_energy")},
        **{field.name: float(getattr(works, field.name)) for field in fields(works)},
    )
