"""The loop over time with all steps of a leg in one compiled call (`fem_needle.march` steps in Python)."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem_needle.compiled.arguments import NodeCourse, arguments, at_nodes
from fem_needle.compiled.loop import run_steps
from fem_needle.compiled.notice import announced
from fem_needle.ledger import StepEnd
from fem_needle.legs.course import Instants, instants_of
from fem_needle.legs.march import Piece, march_legs, pieces_of
from fem_needle.legs.matrices import LegMatrices, without
from fem_needle.legs.states import Leg, momenta_of, point_forces_of, woven
from fem_needle.march import RunEnd, TimeGrid
from fem_needle.motion import DepthLaw
from fem_needle.plant import Plant
from fem_needle.samples import Sample
from fem_needle.steppers import DynamicStepper
from fem_needle.tables import CENTRIFUGAL, CONVECTION, MASS, OperatorTable

Array = NDArray[np.float64]


def compiled_march(plant: Plant, stepper: DynamicStepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Return the generator of the samples, as `fem_needle.march.march` does."""
    return march_legs(plant, stepper, pieces_of(grid, plant.size), partial(_computed, plant, stepper), grid.steps)


def _computed(plant: Plant, stepper: DynamicStepper, law: DepthLaw, piece: Piece, start: StepEnd) -> tuple[Leg, int]:
    """Compute a piece; returns its states as far as they are finite and the number of steps done."""
    instants = instants_of(plant, law, stepper.method, piece.times, start.stage)
    table = plant.table(instants.depths)
    lengths, nodes = np.diff(piece.times), np.arange(1, len(instants.times)).reshape(-1, 3)[:, :2].ravel()
    loads = instants.loads
    course = NodeCourse(
        instants.speeds[nodes],
        instants.factor[nodes],
        loads.forces[nodes],
        loads.clamp[nodes],
        loads.clamp_rates[nodes],
        loads.clamp[3::3],
        lengths,
        np.arange(len(lengths)),
    )
    state = np.stack([start.solution.coordinates, start.solution.momentum])
    given = arguments(at_nodes(table), course, stepper.method, plant.prescribed, state, inertia=stepper.inertia)
    with announced():
        done = int(run_steps(0, len(lengths), *given))
    guide_forces = np.zeros((len(lengths), 2, 0)) if given[-1] is None else given[-1][2]
    kept = tuple(part[:done] for part in (*given[5], guide_forces))
    return _leg(plant, stepper, instants.first(3 * done + 1), table, lengths[:done], start, kept), done


def _leg(
    plant: Plant,
    stepper: DynamicStepper,
    instants: Instants,
    table: OperatorTable,
    lengths: Array,
    start: StepEnd,
    kept: tuple[Array, Array, Array],
) -> Leg:
    """Put the states of the steps together with what follows from them: velocities, momenta, forces."""
    matrices = table.matrices if stepper.inertia else without(table.matrices, (MASS, CONVECTION, CENTRIFUGAL))
    known, method, reader = start.solution, stepper.method, LegMatrices(matrices)
    stages, ends, guide_forces = kept
    coordinates = woven(known.coordinates, stages, ends[:, 0])
    begun = coordinates[:-1:3, None]
    node_rates = np.einsum("ij,tjn->tin", method.inverse, stages - begun) / lengths[:, None, None]
    clamped, nodes, at_ends = plant.prescribed, slice(None), 3 * np.arange(1, len(lengths) + 1)
    node_rates[:, nodes, :clamped] = instants.loads.clamp_rates[1:].reshape(-1, 3, 2)[:, :2, :clamped]
    end_rates = np.zeros_like(ends[:, 0])
    if stepper.inertia:
        end_rates[:, :clamped] = instants.loads.clamp_rates[at_ends, :clamped]
        known_momenta = momenta_of(reader, instants, at_ends, coordinates[at_ends], end_rates)
        end_rates[:, clamped:] = reader.solve_mass(at_ends, clamped, (ends[:, 1] - known_momenta)[:, clamped:])
    return Leg(
        *(reader, table.rates, table.points, instants, method, stepper.inertia, lengths, coordinates),
        woven(known.velocities, node_rates, end_rates),
        point_forces_of(table.points, instants, method, coordinates, guide_forces, known.forces),
    )
