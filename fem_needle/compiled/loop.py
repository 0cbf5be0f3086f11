"""The compiled loop over steps of the collocation methods (equations: `fem_needle.stages`).

A stage's equations, with operators that hold speed and swelling (`OPERATORS`): E0 = K + m G and v D - v^2 R, E1 = C - v S^T,
E2 = v S and M,

    P = M q' + E2 q,   P' = -E0 q - E1 q' + N.forces.

Unknown are the increments of the free coordinates at both stages, the second stage's first: in that order every leading part of
the matrix is regular for all the methods of `fem_needle.collocation`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fem_needle.compiled.bands import ENTRANCE, EXACT, INNER, add_product, factor, solve, solve_dense

OPERATORS = 5
# M, K + m G, E1, E2, and v D - v^2 R: not added to the stiffness, whose every digit counts.
MASS, POSITION, VELOCITY, TRANSPORT, MOTION = range(OPERATORS)


@njit(**EXACT)
def _assemble(at, bases, local, stride, sums, ranges, range_scale, range_ends, blocks, block, operators):
    """Add up the operators (5, 2 b + 1, n) of an instant: multiples of bases, ranges of elements of bases, small blocks.

    ``at``: the instant. ``sums``: multiples. ``ranges``: operator and base of each range; ``blocks``: operator and first
    coordinate.
    """
    for operator in range(OPERATORS):
        for row in range(operators.shape[1]):
            target = operators[operator, row]
            for column in range(len(target)):
                target[column] = 0.0
            for base in range(bases.shape[0]):
                scale = sums[at, operator, base]
                if scale != 0.0:
                    source = bases[base, row]
                    for column in range(len(target)):
                        target[column] += scale * source[column]
    _add_parts(at, local, stride, ranges, range_scale, range_ends, blocks, block, operators)


@njit(**EXACT)
def _add_parts(at, local, stride, ranges, range_scale, range_ends, blocks, block, operators):
    """Add ranges of elements, and blocks."""
    count, rows = local.shape[2], operators.shape[1]
    for number in range(ranges.shape[0]):
        base, scale = ranges[number, 1], range_scale[at, number]
        for element in range(range_ends[at, number, 0], range_ends[at, number, 1]):
            for row in range(count):
                for column in range(count):
                    entry = scale * local[base, element, row, column]
                    operators[ranges[number, 0], rows // 2 + row - column, stride * element + column] += entry
    for number in range(blocks.shape[1]):
        first = blocks[at, number, 1]
        for row in range(block.shape[2]):
            for column in range(block.shape[2]):
                entry = block[at, number, row, column]
                operators[blocks[at, number, 0], rows // 2 + row - column, first + column] += entry


@njit(**INNER)
def _fill_matrix(operators, inverse, length, clamped, rows):
    """Fill the matrix of a step from the operators (2, 5, 2 b + 1, n) at its stages."""
    middle, size = operators.shape[2] // 2, operators.shape[3]
    width = 2 * middle + 1
    rows[:, :] = 0.0
    for stage in range(2):
        for other in range(2):
            slope = inverse[stage, other] / length
            first = inverse[stage, 0] * inverse[0, other] / (length * length)
            second = inverse[stage, 1] * inverse[1, other] / (length * length)
            for row in range(width):
                shift = row - middle
                start, stop = max(clamped, clamped - shift), min(size, size - shift)
                diagonal = width - 2 * shift + stage - other
                for column in range(start, stop):
                    entry = first * operators[0, MASS, row, column] + second * operators[1, MASS, row, column]
                    entry += slope * (operators[stage, VELOCITY, row, column] + operators[other, TRANSPORT, row, column])
                    if stage == other:
                        entry += operators[stage, POSITION, row, column] + operators[stage, MOTION, row, column]
                    rows[2 * (column + shift - clamped) + 1 - stage, diagonal] = entry


@njit(**INNER)
def _fill_right_side(first, operators, inverse, length, clamp, state, known, side, answer):
    """Fill the right-hand side with what the increments do not change; returns the stages' coordinates without them in ``known``.

    The clamp moves as ``clamp`` says (instant, deflection and angle or their rates, two numbers), the rest stays.
    """
    size, clamped = state.shape[1], clamp.shape[2]
    for stage in range(2):
        for index in range(size):
            known[stage, index], side[stage, index] = state[0, index], 0.0
        for index in range(clamped):
            known[stage, index] = clamp[first + stage, 0, index]
    rates = known[2]
    for stage in range(2):
        add_product(operators[stage, POSITION], -1.0, known[stage], side[stage])
        add_product(operators[stage, MOTION], -1.0, known[stage], side[stage])
        moves = False
        for index in range(size):
            rates[index] = 0.0
        for index in range(clamped):
            rates[index] = clamp[first + stage, 1, index]
            moves = moves or rates[index] != 0.0
        if moves:
            add_product(operators[stage, VELOCITY], -1.0, rates, side[stage])
        for other in range(2):
            slope = inverse[other, stage] / length
            add_product(operators[stage, TRANSPORT], -slope, known[stage], side[other])
            if moves:
                add_product(operators[stage, MASS], -slope, rates, side[other])
            for index in range(size):
                side[other, index] += slope * state[1, index]
    for stage in range(2):
        for index in range(size - clamped):
            answer[2 * index + 1 - stage] += side[stage, clamped + index]


@njit(**INNER)
def _add_forces(at, rows, firsts, loads, clamped, stage, answer):
    """Add the loads, the last points, whose rows (instants, points, m) begin at ``firsts``, to a stage's right-hand side."""
    skipped = rows.shape[1] - loads.shape[1]
    for load in range(loads.shape[1]):
        for column in range(rows.shape[2]):
            index = firsts[at, skipped + load] + column - clamped
            if index >= 0:
                answer[2 * index + 1 - stage] += loads[at, load] * rows[at, skipped + load, column]


@njit(**INNER)
def _hold_guides(first, matrix, rows, firsts, known, clamped, answer, target, guides):
    """Add the guides' forces: N q + B P + compliance R = 0 at both stages; arrays as `run_steps` takes them."""
    compliance, opened, kept, columns, answers, dense, gaps = guides
    count = compliance.shape[1]
    columns[:, :] = 0.0
    for number in range(2 * count):
        stage, guide = number // count, number % count
        gaps[number] = -opened[first + stage, guide]
        for column in range(rows.shape[2]):
            index, entry = firsts[first + stage, guide] + column, rows[first + stage, guide, column]
            gaps[number] -= entry * known[stage, index]
            if index >= clamped:
                columns[number, 2 * (index - clamped) + 1 - stage] = entry
        for index in range(len(answer)):
            answers[number, index] = columns[number, index]
        solve(matrix, matrix.shape[1] // 2, answers[number])
        for index in range(len(answer)):
            gaps[number] -= columns[number, index] * answer[index]
    for number in range(2 * count):
        for other in range(2 * count):
            entry, stage = 0.0, number // count
            if stage == other // count:
                entry = compliance[first + stage, number % count, other % count]
            for index in range(len(answer)):
                entry += columns[number, index] * answers[other, index]
            dense[number, other] = entry
    solve_dense(dense, gaps)
    for number in range(2 * count):
        for index in range(len(answer)):
            answer[index] += gaps[number] * answers[number, index]
        if target >= 0:
            kept[target, number // count, number % count] = gaps[number]


@njit(**INNER)
def _finish(first, operators, inverse, length, end_shares, clamp, known, answer, stages, end, state):
    """Set the stages (2, n) and the state at the end, coordinates and momentum (2, n), from the increments."""
    size, clamped = state.shape[1], clamp.shape[2]
    rates, momentum = known[2], known[3]
    for index in range(size):
        end[0, index], end[1, index] = state[0, index], state[1, index]
    for stage in range(2):
        for index in range(size):
            rates[index], momentum[index] = 0.0, 0.0
        for index in range(clamped):
            rates[index] = clamp[first + stage, 1, index]
        for index in range(size - clamped):
            early, late = answer[2 * index + 1], answer[2 * index]
            rates[clamped + index] = (inverse[stage, 0] * early + inverse[stage, 1] * late) / length
            known[stage, clamped + index] += late if stage else early
        add_product(operators[stage, MASS], 1.0, rates, momentum)
        add_product(operators[stage, TRANSPORT], 1.0, known[stage], momentum)
        share, total = end_shares[stage], 0.0
        for index in range(size):
            stages[stage, index] = known[stage, index]
            end[0, index] += share * (known[stage, index] - state[0, index])
            end[1, index] += share * (momentum[index] - state[1, index])
            total += end[0, index]
    return np.isfinite(total)


@njit(**INNER)
def _copy(source, target):
    for row in range(source.shape[0]):
        for column in range(source.shape[1]):
            target[row, column] = source[row, column]


@njit(**ENTRANCE)
def run_steps(begin, stop, terms, points, course, scheme, state, kept, work, guides):
    """Go through some of the steps; returns ``stop``, or the step whose equations have no finite answer.

    Parameters
    ----------
    begin, stop
        First step, and the one after the last; the next call goes on where this one stopped.
    terms
        Bases (bases, 2 b + 1, n), their element matrices (bases, elements, m, m), stride; at the nodes (2 steps,): sums, ranges
        (operator and base), range_scale, range_ends, blocks (operator and first coordinate), block; see `_assemble`.
    points
        Rows (2 steps, points, m) and first coordinates, the guides first.
    course
        Lengths of the steps, loads (2 steps, loads), clamp (2 steps, 2, clamped), clamp at the ends (steps, clamped), the row of
        ``kept`` that receives each step, -1: none, and whether a step has other operators than the one before (steps,).
    scheme
        A^-1 (2, 2) and b A^-1 (2,).
    state
        Coordinates and momentum (2, n), at the start and, afterwards, at the end of the last step done.
    kept
        Coordinates at the stages (kept, 2, n) and end state (kept, 2, n).
    work
        Operators (2, 5, 2 b + 1, n), matrix (2 free, 4 b + 3), known (4, n), side (2, n), answer (2 free,), end (2, n), stages
        (2, n).
    guides
        None, or compliance (2 steps, guides, guides), gaps that known forces open (2 steps, guides), the record of the forces
        (kept, 2, guides), and to work on: columns and answers (2 guides, 2 free), dense (2 guides, 2 guides), gaps (2 guides,).
        With None all that concerns guides is not even compiled.
    """
    bases, local, stride, sums, ranges, range_scale, range_ends, blocks, block = terms
    rows, firsts = points
    lengths, loads, clamp, end_clamp, target, is_new = course
    inverse, end_shares = scheme
    kept_stages, kept_ends = kept
    operators, matrix, known, side, answer, end, stages = work
    clamped, width = end_clamp.shape[1], matrix.shape[1] // 2
    for step in range(begin, stop):
        length, first = lengths[step], 2 * step
        for index in range(len(answer)):
            answer[index] = 0.0
        for stage in range(2):
            at, part = first + stage, operators[stage]
            if is_new[step]:
                _assemble(at, bases, local, stride, sums, ranges, range_scale, range_ends, blocks, block, part)
            _add_forces(at, rows, firsts, loads, clamped, stage, answer)
        if is_new[step]:
            _fill_matrix(operators, inverse, length, clamped, matrix)
            if not factor(matrix, width):
                return step
        _fill_right_side(first, operators, inverse, length, clamp, state, known, side, answer)
        solve(matrix, width, answer)
        if guides is not None:
            _hold_guides(first, matrix, rows, firsts, known, clamped, answer, target[step], guides)
        if not _finish(first, operators, inverse, length, end_shares, clamp, known, answer, stages, end, state):
            return step
        for index in range(clamped):
            end[0, index] = end_clamp[step, index]
        if target[step] >= 0:
            _copy(stages, kept_stages[target[step]])
            _copy(end, kept_ends[target[step]])
        _copy(end, state)
    return stop
