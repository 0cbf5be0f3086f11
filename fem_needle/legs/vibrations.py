"""A held needle in its own vibrations, all outputs at once (`fem_needle.modal_stepper.ModalStepper`: one after the other)."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd
from fem_needle.legs.course import instants_of
from fem_needle.legs.march import Piece, march_legs, most_steps
from fem_needle.legs.matrices import LegMatrices
from fem_needle.legs.states import Leg
from fem_needle.march import RunEnd, TimeGrid
from fem_needle.modal_stepper import ModalStepper, Vibration
from fem_needle.motion import DepthLaw, depth_law
from fem_needle.plant import Plant
from fem_needle.samples import Sample

Array = NDArray[np.float64]


def modal_march(plant: Plant, stepper: ModalStepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Return the generator of the samples, as `fem_needle.march.march` does."""
    vibration = Vibration(plant, initial_state(plant, depth_law(plant.scene)))
    pieces = _pieces(grid.outputs, vibration.resolved_time, most_steps(plant.size))
    return march_legs(plant, stepper, pieces, partial(_computed, plant, stepper, vibration), grid.steps)


def _pieces(outputs: tuple[float, ...], resolved: float, most: int) -> Iterator[Piece]:
    """Yield, for each output, a step to shortly before it and a short one, on which rates are taken; one more at the start."""
    times, shown, landed = [outputs[0], outputs[0] + resolved], [False], True
    for output in outputs[1:]:
        if output - resolved > times[-1]:
            times.append(output - resolved)
            shown.append(False)
        times.append(output)
        shown.append(True)
        if len(shown) >= most:
            yield Piece(np.array(times), np.array(shown), landed)
            times, shown, landed = [output], [], False
    if shown:
        yield Piece(np.array(times), np.array(shown), landed)


def _computed(
    plant: Plant, stepper: ModalStepper, vibration: Vibration, law: DepthLaw, piece: Piece, start: StepEnd
) -> tuple[Leg, int]:
    """Compute a piece; nothing can fail."""
    instants = instants_of(plant, law, stepper.method, piece.times, start.stage)
    table = plant.table(instants.depths)
    coordinates, velocities = vibration.over(instants.times)
    forces = instants.loads.forces  # no guides
    lengths = np.diff(piece.times)
    matrices = LegMatrices(table.matrices)
    return Leg(
        matrices, table.rates, table.points, instants, stepper.method, True, lengths, coordinates, velocities, forces
    ), len(lengths)
