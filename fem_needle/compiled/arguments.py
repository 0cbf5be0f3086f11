"""Arguments of `fem_needle.compiled.loop.run_steps`: the operators at the nodes of all steps from a plant's table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.collocation import Collocation
from fem_needle.tables import (
    ABSENT,
    BENDING,
    CENTRIFUGAL,
    CONVECTION,
    DAMPING,
    DRAG,
    MASS,
    TISSUE,
    Matrices,
    OperatorTable,
    PointTable,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
SAME_LENGTH = 1e-12  # of a step: two lengths that differ by less are one, rounded
OPERATOR_MASS, POSITION, VELOCITY, TRANSPORT, MOTION = range(5)  # as in `fem_needle.compiled.loop`


@dataclass(frozen=True, eq=False)
class NodeCourse:
    """What acts at the nodes of all steps (T = 2 steps), and how long the steps are.

    Attributes
    ----------
    speeds, factors
        Of the insertion [m/s] and of the tissue's stiffness (T,).
    forces, clamp, clamp_rates
        Loads [N] (T, loads), hub [m, rad] and its rates (T, 2).
    end_clamp
        Hub at the ends of the steps (steps, 2).
    lengths
        [s] (steps,).
    kept
        Row of the record that receives each step, -1: none (steps,).
    """

    speeds: Array
    factors: Array
    forces: Array
    clamp: Array
    clamp_rates: Array
    end_clamp: Array
    lengths: Array
    kept: Indices


@dataclass(frozen=True, eq=False)
class _Use:
    """A kind of matrix as part of an operator, times a number at each node, as it is or transposed."""

    kind: int
    operator: int
    factor: Array
    transposed: bool = False


def arguments(
    table: OperatorTable, course: NodeCourse, method: Collocation, clamped: int, state: Array, *, inertia: bool
) -> tuple:
    """Return the arguments; state: coordinates and momentum at the start (2, n), where the loop leaves those at the end.

    The record is in them: coordinates at the stages and states at the ends, and, where there are guides, their forces
    (`fem_needle.compiled.loop.run_steps`, ``kept`` and ``guides``).
    """
    matrices, points = table.matrices, table.points
    size, rows = state.shape[1], matrices.bases.shape[1]
    clamp = np.ascontiguousarray(np.stack([course.clamp, course.clamp_rates], axis=1)[:, :, :clamped])
    kept, free = 1 + int(np.max(course.kept, initial=-1)), 2 * (size - clamped)
    terms = _terms(matrices, _uses(matrices, course, inertia=inertia))
    end_clamp = np.ascontiguousarray(course.end_clamp[:, :clamped])
    return (
        terms,
        (points.rows, points.first),
        (course.lengths, course.forces, clamp, end_clamp, course.kept, _is_new(terms, course.lengths)),
        (method.inverse, method.end),
        state,
        (np.zeros((kept, 2, size)), np.zeros((kept, 2, size))),
        (
            np.zeros((2, 5, rows, size)),
            np.zeros((free, 2 * rows + 1)),
            np.zeros((4, size)),
            np.zeros((2, size)),
            np.zeros(free),
            np.zeros((2, size)),
            np.zeros((2, size)),
        ),
        _guides(points, course, kept, free) if points.guides else None,
    )


def _is_new(terms: tuple, lengths: Array) -> NDArray[np.bool_]:
    """Return whether a step has another length or other operators than the one before (steps,): its matrix is factored anew."""
    result = np.ones(len(lengths), dtype=np.bool_)
    result[1:] = np.abs(np.diff(lengths)) > SAME_LENGTH * lengths[1:]
    _, _, _, sums, _, range_scale, range_ends, blocks, block = terms
    for values in (sums, range_scale, range_ends, blocks, block):
        steps = values.reshape(len(lengths), -1)
        result[1:] |= np.any(steps[1:] != steps[:-1], axis=1)
    return result


def _guides(points: PointTable, course: NodeCourse, kept: int, free: int) -> tuple:
    """Return what the guides need."""
    guides = points.guides
    compliance = points.flexibility[:, :guides, :guides] + np.diag(points.guide_compliance)
    opened = np.einsum("tgl,tl->tg", points.flexibility[:, :guides, guides:], course.forces)
    return (
        np.ascontiguousarray(compliance),
        np.ascontiguousarray(opened),
        np.zeros((kept, 2, guides)),
        np.zeros((2 * guides, free)),
        np.zeros((2 * guides, free)),
        np.zeros((2 * guides, 2 * guides)),
        np.zeros(2 * guides),
    )


def _uses(matrices: Matrices, course: NodeCourse, *, inertia: bool) -> list[_Use]:
    """Return which kinds make up which operator: K + m G, v D - v^2 R, C - v S^T, v S and M."""
    speeds, one = course.speeds, np.ones_like(course.speeds)
    uses = [
        _Use(BENDING, POSITION, one),
        _Use(TISSUE, POSITION, course.factors),
        _Use(DAMPING, VELOCITY, one),
        _Use(DRAG, MOTION, speeds),
    ]
    if inertia:
        uses += [
            _Use(MASS, OPERATOR_MASS, one),
            _Use(CENTRIFUGAL, MOTION, -(speeds**2)),
            _Use(CONVECTION, TRANSPORT, speeds),
            _Use(CONVECTION, VELOCITY, -speeds, transposed=True),
        ]
    return [use for use in uses if matrices.base_of[use.kind] != ABSENT and np.any(use.factor)]


def _terms(matrices: Matrices, uses: list[_Use]) -> tuple:
    """Return bases, their element matrices, stride, and sums, ranges and blocks over the nodes."""
    nodes = len(matrices.scale)
    bases, columns = list(matrices.bases), []
    for use in uses:
        base = int(matrices.base_of[use.kind])
        if base >= 0 and use.transposed:
            bases.append(banded.transpose(matrices.bases[base]))
        if base >= 0:
            where = len(bases) - 1 if use.transposed else base
            columns.append((use.operator, where, use.factor * matrices.scale[:, use.kind]))
    sums = np.zeros((nodes, 5, len(bases)))
    for operator, base, scale in columns:
        sums[:, operator, base] += scale
    ranges, range_scale, range_ends = _ranges(matrices, uses)
    blocks, block = _blocks(matrices, uses)
    constants = np.array(bases).reshape(len(bases), *matrices.bases.shape[1:])
    return (constants, matrices.local, matrices.stride, sums, ranges, range_scale, range_ends, blocks, block)


def _ranges(matrices: Matrices, uses: list[_Use]) -> tuple[Indices, Array, Indices]:
    found = [(use, n) for use in uses for n in np.flatnonzero(matrices.range_kind == use.kind).tolist()]
    nodes = len(matrices.scale)
    numbers = np.array([(use.operator, matrices.range_base[n]) for use, n in found], dtype=np.int64).reshape(-1, 2)
    scale, ends = np.zeros((nodes, len(found))), np.zeros((nodes, len(found), 2), dtype=np.int64)
    for column, (use, n) in enumerate(found):
        scale[:, column] = use.factor * matrices.range_scale[:, n]
        ends[:, column, 0], ends[:, column, 1] = matrices.range_first[:, n], matrices.range_stop[:, n]
    return numbers, scale, ends


def _blocks(matrices: Matrices, uses: list[_Use]) -> tuple[Indices, Array]:
    found = [(use, n) for use in uses for n in np.flatnonzero(matrices.block_kind == use.kind).tolist()]
    nodes, count = len(matrices.scale), matrices.block.shape[2]
    numbers = np.zeros((nodes, len(found), 2), dtype=np.int64)
    entries = np.zeros((nodes, len(found), count, count))
    for column, (use, n) in enumerate(found):
        block = matrices.block[:, n]
        numbers[:, column, 0], numbers[:, column, 1] = use.operator, matrices.block_first[:, n]
        entries[:, column] = use.factor[:, None, None] * (block.transpose(0, 2, 1) if use.transposed else block)
    return numbers, entries


def at_nodes(table: OperatorTable) -> OperatorTable:
    """Return the table of a leg at the nodes of its steps alone: instants 1, 2, 4, 5, 7, ..."""
    matrices, points = table.matrices, table.points
    chosen = np.arange(1, len(matrices.scale)).reshape(-1, 3)[:, :2].ravel()

    def only(values: NDArray) -> NDArray:
        return np.ascontiguousarray(values[chosen])

    return OperatorTable(
        matrices._replace(
            scale=only(matrices.scale),
            range_scale=only(matrices.range_scale),
            range_first=only(matrices.range_first),
            range_stop=only(matrices.range_stop),
            block_first=only(matrices.block_first),
            block=only(matrices.block),
        ),
        table.rates,
        points._replace(
            first=only(points.first),
            rows=only(points.rows),
            row_rates=only(points.row_rates),
            flexibility=only(points.flexibility),
            flexibility_rate=only(points.flexibility_rate),
        ),
    )
