"""Guides as multipliers: N q + B P + compliance R = 0 at every guide, at a node of a step or at rest."""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.dense import solve_small
from fem_needle.dynamics.names import GUIDES, METHOD, PLACES, PRESCRIBED


@inner
def ends_at_node(arrays, count):
    """Return whether the last of ``count`` nodes is the end of a step: guides' multipliers there are the solution's own."""
    return floats_2(arrays, METHOD)[PLACES, count - 1] == 1.0


@inner
def guide_columns(width, switches, rows, first, columns):
    """Set the right-hand sides of unit guide forces (width guides, width n)."""
    guides, m = switches[GUIDES], rows.shape[2]
    for number in range(width * guides):
        stage, guide = number // guides, number % guides
        columns[number, :] = 0.0
        for i in range(m):
            at = first[stage, guide] + i
            if at >= switches[PRESCRIBED]:
                columns[number, width * at + width - 1 - stage] = rows[stage, guide, i]


@inner
def guide_system(width, switches, rows, first, flexible, compliance, answers, dense):
    """Set the matrix of the guides' forces from the answers to unit forces."""
    guides, m = switches[GUIDES], rows.shape[2]
    for number in range(width * guides):
        stage, guide = number // guides, number % guides
        for other in range(width * guides):
            entry = 0.0
            for i in range(m):
                entry += rows[stage, guide, i] * answers[other, width * (first[stage, guide] + i) + width - 1 - stage]
            if stage == other // guides:
                entry += flexible[stage, guide, other % guides]
                if number == other:
                    entry += compliance[guide]
            dense[number, other] = entry


@inner
def hold_guides(width, is_whole, switches, rows, first, flexible, forces, known, answers, dense, scratch, gaps, answer):
    """Add the guides' forces to an answer; what is ``known`` besides, and known forces, open gaps where ``is_whole``.

    The forces are left in ``gaps`` (width guides,).
    """
    guides, m, points = switches[GUIDES], rows.shape[2], rows.shape[1]
    for number in range(width * guides):
        stage, guide = number // guides, number % guides
        gap = 0.0
        for i in range(m):
            at = first[stage, guide] + i
            gap -= rows[stage, guide, i] * answer[width * at + width - 1 - stage]
            if is_whole:
                gap -= rows[stage, guide, i] * known[stage, at]
        if is_whole:
            for point in range(guides, points):
                gap -= flexible[stage, guide, point] * forces[stage, point]
        gaps[number] = gap
        for other in range(width * guides):
            scratch[number, other] = dense[number, other]
    solve_small(scratch, gaps, width * guides)
    for number in range(width * guides):
        for i in range(len(answer)):
            answer[i] += gaps[number] * answers[number, i]


@inner
def soft_reactions(switches, softest, rows, first, flexible, compliance, q, forces, dense, gaps, chosen):
    """Set the forces of guides that give way from the deflections there; those of rigid ones at a node stay as they are."""
    guides, count = switches[GUIDES], 0
    for guide in range(guides):
        if flexible[guide, guide] + compliance[guide] > softest:
            chosen[count] = guide
            count += 1
    for number in range(count):
        guide = chosen[number]
        gap = 0.0
        for i in range(rows.shape[1]):
            gap -= rows[guide, i] * q[first[guide] + i]
        for point in range(rows.shape[0]):
            is_unknown = False
            for other in range(count):
                is_unknown = is_unknown or chosen[other] == point
            if not is_unknown:
                gap -= flexible[guide, point] * forces[point]
        for other in range(count):
            dense[number, other] = flexible[guide, chosen[other]] + (compliance[guide] if number == other else 0.0)
        gaps[number] = gap
    solve_small(dense, gaps, count)
    for number in range(count):
        forces[chosen[number]] = gaps[number]
