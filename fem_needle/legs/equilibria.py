"""A needle that goes through equilibria, all those of a leg at once (`fem_needle.steppers.StaticStepper`: one by one)."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbtrf, dpbtrs

from fem_needle.ledger import StepEnd
from fem_needle.legs.course import Instants, instants_of
from fem_needle.legs.march import Piece, march_legs, pieces_of
from fem_needle.legs.matrices import LegMatrices, without
from fem_needle.legs.states import Leg, gathered, scattered
from fem_needle.march import RunEnd, TimeGrid
from fem_needle.motion import DepthLaw
from fem_needle.plant import Plant
from fem_needle.samples import Sample
from fem_needle.steppers import StaticStepper
from fem_needle.tables import BENDING, CENTRIFUGAL, CONVECTION, DAMPING, DRAG, MASS, SLIP, TISSUE, PointTable

Array = NDArray[np.float64]


def equilibrium_march(plant: Plant, stepper: StaticStepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Return the generator of the samples, as `fem_needle.march.march` does."""
    return march_legs(plant, stepper, pieces_of(grid, plant.size), partial(_computed, plant, stepper), grid.steps)


def _computed(plant: Plant, stepper: StaticStepper, law: DepthLaw, piece: Piece, start: StepEnd) -> tuple[Leg, int]:
    """Compute a piece; returns its states as far as there are any, and the number of steps done."""
    instants = instants_of(plant, law, stepper.method, piece.times, start.stage)
    table = plant.table(instants.depths)
    # Equilibria know no rates: without inertia, and without viscosity, where there is any.
    matrices = LegMatrices(without(table.matrices, (MASS, CONVECTION, CENTRIFUGAL, DAMPING, DRAG, SLIP)))
    inside = law.depths(instants.times) >= plant.smallest_depth
    coordinates, forces, done = _equilibria(matrices, table.points, instants, plant.prescribed, inside)
    coordinates[0], forces[0] = start.solution.coordinates, start.solution.forces
    steps = max(0, done - 1) // (len(stepper.method.nodes) + 1)
    count = steps * (len(stepper.method.nodes) + 1) + 1
    leg = Leg(
        *(matrices, table.rates, table.points, instants.first(count), stepper.method, False, np.diff(piece.times)[:steps]),
        *(coordinates[:count], np.zeros((count, plant.size)), forces[:count]),
    )
    return leg, steps


def _equilibria(
    matrices: LegMatrices, points: PointTable, instants: Instants, clamped: int, inside: NDArray[np.bool_]
) -> tuple[Array, Array, int]:
    """Return coordinates (T, n), forces (T, p) and how many instants have an equilibrium; outside: a straight needle."""
    everywhere, guides = np.arange(len(instants.times)), points.guides
    stiffness = matrices.bands(BENDING, everywhere)
    if matrices.has(TISSUE):
        stiffness += instants.factor[:, None, None] * matrices.bands(TISSUE, everywhere)
    coordinates = np.zeros((len(everywhere), stiffness.shape[2]))
    coordinates[:, :clamped] = instants.loads.clamp[:, :clamped]
    forces = np.zeros((len(everywhere), points.rows.shape[1]))
    forces[:, guides:] = instants.loads.forces
    pulled = np.array([_known_forces(band, known, clamped) for band, known in zip(stiffness, coordinates, strict=True)])
    right = scattered(points.first, points.rows, forces, coordinates.shape[1]) - pulled
    gaps = gathered(points.first, points.rows, coordinates)[:, :guides]
    gaps += np.einsum("tgl,tl->tg", points.flexibility[:, :guides, guides:], instants.loads.forces)
    rows = _dense_rows(points, coordinates.shape[1])[:, clamped:]
    compliance = points.flexibility[:, :guides, :guides] + np.diag(points.guide_compliance)
    for number in range(len(everywhere)):
        if not inside[number]:
            coordinates[number] = 0.0
            continue
        sides = np.column_stack([right[number, clamped:], rows[number]])
        # The lower half of the band, the clamp's columns left out, is LAPACK's storage of a definite matrix.
        factors, failed = dpbtrf(stiffness[number, stiffness.shape[1] // 2 :, clamped:], lower=1)
        if failed:
            return coordinates, forces, number
        answers, _ = dpbtrs(factors, sides, lower=1)
        free = answers[:, 0]
        if guides:
            reached = answers[:, 1:]
            system = rows[number].T @ reached + compliance[number]
            held = np.linalg.solve(system, -(rows[number].T @ free + gaps[number]))
            free, forces[number, :guides] = free + reached @ held, held
        coordinates[number, clamped:] = free
    return coordinates, forces, len(everywhere)


def _known_forces(band: Array, known: Array, clamped: int) -> Array:
    """Return K q of the clamp's own displacement."""
    result, middle = np.zeros_like(known), band.shape[0] // 2
    for column in range(clamped):
        if known[column]:
            first, last = max(0, column - middle), min(len(known), column + middle + 1)
            result[first:last] += known[column] * band[middle + first - column : middle + last - column, column]
    return result


def _dense_rows(points: PointTable, size: int) -> Array:
    """Return the guides' rows as columns (T, n, guides)."""
    guides, instants = points.guides, len(points.rows)
    result = np.zeros((instants, size, guides))
    for guide in range(guides):
        columns = points.first[:, guide, None] + np.arange(points.rows.shape[2])
        result[np.arange(instants)[:, None], columns, guide] = points.rows[:, guide]
    return result
