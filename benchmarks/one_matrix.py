"""Fixed steps of methods with one real matrix, compiled as the kernel is and of the kernel's own parts: prototypes to be timed.

    sdirk    L-stable, order 4, five stages, each with a matrix at its own time: Hairer and Wanner, Solving Ordinary Differential
             Equations II, table IV.6.5
    rodas    Rosenbrock, L-stable, order 4(3), six stages, one matrix a step: the same book, section IV.7
    pair     the kernel's own collocation, two coupled stages, without ledger and reactions, so that all three do the same

All on y = (q, P):  q' = M^-1 (P - E2 q),  P' = F - E0 q - E1 q',  E0 = K + m G + v D - v^2 R, E1 = C - v S', E2 = v S. With
g = gamma h, each solve is with

    M / g^2 + (E1 + E2) / g + E0
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numba.core import types

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_4, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.forces import add_bending, add_inertial_forces, add_momentum, add_point_forces, add_tissue_forces
from fem_needle.dynamics.guides import guide_columns, guide_system, hold_guides
from fem_needle.dynamics.haste import hastened
from fem_needle.dynamics.instant import prepare_matrices, prepare_points, set_loads, set_motion, set_place
from fem_needle.dynamics.lateral import solve_nodes
from fem_needle.dynamics.linking import EntranceCompiler
from fem_needle.dynamics.products import add_product
from fem_needle.dynamics.reduced import solve_mass
from fem_needle.dynamics.stepping import finish, set_given_motion, set_velocities
from fem_needle.dynamics.sweep import eliminate_one, solve_one
from fem_needle.dynamics.system import set_gaps

STAGES, TABLEAU, TRIED, FOUND = range(ix.ARRAYS, ix.ARRAYS + 4)  # arrays beside the kernel's
SDIRK, RODAS, PAIR = range(3)
GAMMA = 0.25  # of both
AHEAD = 1e-5  # of a step: how far the rate of f in time is looked for
PLACES, RATE_SHARES = 6, 7  # rows of a tableau behind A, or A and C

SDIRK_A = (
    (1 / 4,),
    (1 / 2, 1 / 4),
    (17 / 50, -1 / 25, 1 / 4),
    (371 / 1360, -137 / 2720, 15 / 544, 1 / 4),
    (25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4),
)
SDIRK_C = (1 / 4, 3 / 4, 11 / 20, 1 / 2, 1.0)
_LAST = (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950)
RODAS_A = (
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    _LAST,
    (*_LAST, 1.0),
)
RODAS_C = (
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
RODAS_PLACES = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
RODAS_RATES = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)


def tableau(method: int) -> Any:
    """Return what `take_steps` reads of a method: A, places and, of the Rosenbrock method, C and shares of the rate (14, 6)."""
    found = np.zeros((14, 6))
    if method == SDIRK:
        for stage, row in enumerate(SDIRK_A):
            found[stage, : len(row)] = row
        found[PLACES, :5] = SDIRK_C
    elif method == RODAS:
        for stage, (row, others) in enumerate(zip(RODAS_A, RODAS_C, strict=True)):
            found[stage + 1, : len(row)] = row
            found[stage + 9, : len(others)] = others
        found[PLACES], found[RATE_SHARES] = RODAS_PLACES, RODAS_RATES
    return found


@inner
def stand(arrays, at, time, middle, changed):
    """Set an instant: motion, loads, matrices, points, and the clamp's coordinates and rates."""
    switches, course = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at]
    set_motion(time, middle, floats_2(arrays, ix.SIGNALS), integers_1(arrays, ix.SIGNAL_ENDS), course)
    set_place(switches, floats_1(arrays, ix.NUMBER), course)
    set_loads(arrays, at, middle)
    prepare_matrices(arrays, at, integers_1(arrays, changed))
    prepare_points(arrays, at)


@inner
def clamp(arrays, at):
    """Let the clamp's coordinates and rates be what they have to be; the rates of the others are zero."""
    known, rates, given = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], floats_3(arrays, ix.CLAMP)[at]
    rates[:] = 0.0
    for i in range(integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED]):
        known[i], rates[i] = given[0, i], given[1, i]


@inner
def last_new(arrays, at, g):
    """Mark blocks whose part of the matrix is another than before; returns the last of them, -1 without one."""
    switches, course, covered = (
        integers_1(arrays, ix.SWITCH),
        floats_2(arrays, ix.COURSES)[at],
        floats_3(arrays, ix.COVERED)[at],
    )
    changed, key, last = integers_1(arrays, ix.CHANGED), floats_1(arrays, ix.KEY), -1
    moved, swollen = key[1] != course[ix.SPEED], key[2] != course[ix.FACTOR]
    every = key[0] != g or key[3] != course[ix.STRETCH] or (moved and switches[ix.FRAME] != 0)
    key[0], key[1], key[2], key[3] = g, course[ix.SPEED], course[ix.FACTOR], course[ix.STRETCH]
    for block in range(len(changed)):
        holds = covered[block, 0] != 0.0 or covered[block, 1] != 0.0 or covered[block, 2] != 0.0
        if every or ((moved or swollen) and holds):
            changed[block] = 1
        if changed[block]:
            last = block
    return last


@inner
def fill(arrays, at, block, g):
    """Set a block's matrix."""
    course, beam = floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)[0][block]
    switches, tissue = integers_1(arrays, ix.SWITCH), floats_5(arrays, ix.TISSUE_BLOCKS)[at][block]
    matrix = floats_3(arrays, ix.MATRICES)[block]
    stretch, speed, m = course[ix.STRETCH], course[ix.SPEED], beam.shape[1]
    heavy, support, damping = stretch / (g * g), course[ix.FACTOR] * stretch, stretch / g
    for i in range(m):
        for j in range(m):
            value = heavy * beam[ix.MASS, i, j] + support * tissue[ix.TISSUE, i, j]
            value += damping * tissue[ix.DAMPING, i, j] - speed * tissue[ix.DRAG, i, j]
            if switches[ix.CONVECTED]:
                value += speed / g * (beam[ix.CONVECTION, i, j] - beam[ix.CONVECTION, j, i])
                value -= speed * speed / stretch * beam[ix.CENTRIFUGAL, i, j]
            matrix[i, j] = value
    if m == 5:
        matrix[2, 2] += beam[ix.BENDING, 2, 2] / (stretch * stretch * stretch)


@inner
def factor(arrays, at, g):
    """Form and factor what has changed of the matrix."""
    last, changed = last_new(arrays, at, g), integers_1(arrays, ix.CHANGED)
    if last < 0:
        return
    for block in range(last + 1):
        if changed[block]:
            fill(arrays, at, block, g)
    stiffness, stretch = floats_1(arrays, ix.STIFFNESSES), floats_2(arrays, ix.COURSES)[at, ix.STRETCH]
    stiffness[0] = floats_1(arrays, ix.NUMBER)[ix.BENDING_STIFFNESS] / (stretch * stretch * stretch)
    eliminate_one(
        last, integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED], floats_1(arrays, ix.PIECE_NODES), stiffness,
        floats_3(arrays, ix.MATRICES), changed, floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES),
    )  # fmt: skip
    for block in range(last + 1):
        changed[block] = 0


@inner
def solve(arrays, is_whole, at, values):
    """Replace a right-hand side by the solution; ``is_whole``: beside coordinates that are known."""
    switches, nodes, gaps = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.PIECE_NODES), floats_2(arrays, ix.BEAM_GAPS)
    gaps[:, :] = 0.0
    if is_whole:
        set_gaps(1, nodes, switches[ix.STRIDE], floats_2(arrays, ix.KNOWN)[at:], gaps)
    solve_one(
        switches[ix.PRESCRIBED], nodes, floats_1(arrays, ix.STIFFNESSES), floats_3(arrays, ix.MATRICES),
        floats_3(arrays, ix.NODE_MATRICES), floats_4(arrays, ix.SHARES), gaps, values,
    )  # fmt: skip


@inner
def hold(arrays, answer):
    """Add the guides' forces at the stage to an answer."""
    switches, columns, answers = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COLUMNS), floats_2(arrays, ix.ANSWERS)
    rows, first, flexible = floats_3(arrays, ix.POINT_ROWS), integers_2(arrays, ix.POINT_FIRST), floats_3(arrays, ix.FLEXIBLE)
    gaps, dense, forces = floats_1(arrays, ix.GAPS), floats_2(arrays, ix.DENSE), floats_2(arrays, ix.FORCES)
    guide_columns(1, switches, rows, first, columns)
    for guide in range(switches[ix.GUIDES]):
        for i in range(columns.shape[1]):
            answers[guide, i] = columns[guide, i]
        solve(arrays, guide < 0, 0, answers[guide])
    guide_system(1, switches, rows, first, flexible, floats_1(arrays, ix.COMPLIANCE), answers, dense)
    hold_guides(
        1, switches[ix.GUIDES] > 0, switches, rows, first, flexible, forces, floats_2(arrays, ix.KNOWN), answers, dense,
        floats_2(arrays, ix.SCRATCH), gaps, answer,
    )  # fmt: skip
    for guide in range(switches[ix.GUIDES]):
        forces[0, guide] = gaps[guide]


@inner
def add_forces(arrays, at, out):
    """Add the forces of an instant but for bending and guides."""
    switches, course, beam = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)[0]
    known, rates, forces = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], floats_2(arrays, ix.FORCES)[at]
    tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at]
    rows, first = floats_3(arrays, ix.POINT_ROWS)[at], integers_2(arrays, ix.POINT_FIRST)[at]
    add_tissue_forces(course, tissue, covered, switches, known, rates, out)
    add_inertial_forces(course, beam, switches, known, rates, out)
    add_point_forces(switches[ix.GUIDES], rows, first, forces, out)


@inner
def sdirk_stage(arrays, stage, time, middle, h):
    """Solve a stage: its rates of q and P, of which the last one's state is that of the end."""
    stages, a, lateral = floats_3(arrays, STAGES), floats_2(arrays, TABLEAU)[stage], floats_3(arrays, ix.LATERAL)[0]
    known, rates, side = floats_2(arrays, ix.KNOWN)[0], floats_2(arrays, ix.RATES)[0], floats_1(arrays, ix.ANSWER)
    switches, course, beam = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[0], floats_5(arrays, ix.BEAM)[0]
    start, n, g = floats_2(arrays, TRIED)[0], len(known), GAMMA * h
    stand(arrays, 0, time, middle, ix.CHANGED)
    for i in range(n):
        q, p = lateral[0, i], lateral[1, i]
        for other in range(stage):
            q += h * a[other] * stages[other, 0, i]
            p += h * a[other] * stages[other, 1, i]
        known[i], start[i], side[i] = q, p, p / g
    factor(arrays, 0, g)
    clamp(arrays, 0)
    add_forces(arrays, 0, side)
    add_bending(course, beam, switches, known, side)
    add_momentum(-1.0 / g, course, beam, switches, known, rates, side)
    solve(arrays, h > 0.0, 0, side)
    if switches[ix.GUIDES]:
        hold(arrays, side)
    for i in range(n):
        known[i] += side[i]
        rates[i] += side[i] / g
        stages[stage, 0, i], stages[stage, 1, i] = rates[i], 0.0
    add_momentum(1.0, course, beam, switches, known, rates, stages[stage, 1])
    if stage == 4:
        for i in range(n):
            lateral[0, i], lateral[1, i] = known[i], stages[stage, 1, i]
    for i in range(n):
        stages[stage, 1, i] = (stages[stage, 1, i] - start[i]) / g


@inner
def slopes(arrays, at, out):
    """Set f = (q', P') at an instant, of coordinates that stand in ``KNOWN`` and of the momentum in ``TRIED``; out (2, n)."""
    switches, course, beam = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)[0]
    known, rates, right = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], floats_2(arrays, ix.VECTORS)[0]
    clamp(arrays, at)
    stretch, clamped = course[ix.STRETCH], switches[ix.PRESCRIBED]
    for i in range(len(known)):
        right[i], out[1, i] = floats_2(arrays, TRIED)[0, i], 0.0
    add_momentum(-1.0, course, beam, switches, known, rates, right)
    solve_mass(arrays, at, right)
    for i in range(clamped, len(known)):
        rates[i] = right[i] / stretch
    add_forces(arrays, at, out[1])
    add_product(beam, ix.BENDING, switches[ix.STRIDE], -1.0 / (stretch * stretch * stretch), known, out[1])
    for i in range(len(known)):
        out[0, i] = rates[i] if i >= clamped else 0.0


@inner
def rodas_state(arrays, stage, at):
    """Set coordinates and momentum of a stage."""
    stages, a, lateral = floats_3(arrays, STAGES), floats_2(arrays, TABLEAU)[stage], floats_3(arrays, ix.LATERAL)[0]
    known, momentum = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, TRIED)[0]
    for i in range(len(known)):
        q, p = lateral[0, i], lateral[1, i]
        for other in range(stage):
            q += a[other] * stages[other, 0, i]
            p += a[other] * stages[other, 1, i]
        known[i], momentum[i] = q, p


@inner
def rodas_solve(arrays, stage, h, slope):
    """Set a stage's increments from f there, the increments before it and the rate of f in time."""
    stages, rate, row = floats_3(arrays, STAGES), floats_3(arrays, STAGES)[7], floats_2(arrays, TABLEAU)[8 + stage]
    switches, course, beam = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[ix.START], floats_5(arrays, ix.BEAM)[0]
    side, still, n, g = floats_1(arrays, ix.ANSWER), floats_2(arrays, TRIED)[1], rate.shape[1], GAMMA * h
    pull, share, up = floats_2(arrays, ix.VECTORS)[1], floats_2(arrays, TABLEAU)[RATE_SHARES, stage], stages[stage, 1]
    still[:] = 0.0
    pull[:] = 0.0
    for k in range(2):
        for i in range(n):
            for other in range(stage):
                slope[k, i] += row[other] / h * stages[other, k, i]
            slope[k, i] += h * share * rate[k, i]
    tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[ix.START], floats_3(arrays, ix.COVERED)[ix.START]
    add_tissue_forces(course, tissue, covered, switches, still, slope[0], pull)
    add_inertial_forces(course, beam, switches, still, slope[0], pull)
    for i in range(n):
        side[i] = slope[1, i] - pull[i]
    add_product(beam, ix.MASS, switches[ix.STRIDE], course[ix.STRETCH] / g, slope[0], side)
    solve(arrays, h < 0.0, ix.START, side)
    for i in range(n):
        stages[stage, 0, i], up[i] = side[i], 0.0
        still[i] = side[i] / g - slope[0, i]
    add_momentum(1.0, course, beam, switches, side, still, up)
    for i in range(switches[ix.PRESCRIBED]):
        up[i] = 0.0


@inner
def rodas_step(arrays, t, h, until):
    """Take a step with the matrix of its start."""
    stages, places, middle = floats_3(arrays, STAGES), floats_2(arrays, TABLEAU)[PLACES], t + 0.5 * h
    slope, rate, lateral = stages[6], stages[7], floats_3(arrays, ix.LATERAL)[0]
    stand(arrays, ix.START, t, middle, ix.CHANGED)
    factor(arrays, ix.START, GAMMA * h)
    rodas_state(arrays, 0, ix.START)
    slopes(arrays, ix.START, slope)
    stand(arrays, 0, t + AHEAD * h, middle, ix.OTHER_CHANGED)
    rodas_state(arrays, 0, 0)
    slopes(arrays, 0, rate)
    for k in range(2):
        for i in range(rate.shape[1]):
            rate[k, i] = (rate[k, i] - slope[k, i]) / (AHEAD * h)
    for stage in range(6):
        if stage:
            if stage < 5:
                stand(arrays, 0, until if places[stage] == 1.0 else t + places[stage] * h, middle, ix.OTHER_CHANGED)
            rodas_state(arrays, stage, 0)
            slopes(arrays, 0, slope)
        rodas_solve(arrays, stage, h, slope)
    known, momentum = floats_2(arrays, ix.KNOWN)[0], floats_2(arrays, TRIED)[0]
    for i in range(len(known)):
        lateral[0, i], lateral[1, i] = known[i] + stages[5, 0, i], momentum[i] + stages[5, 1, i]


@inner
def pair_step(arrays, t, h, until):
    """Take a step of the kernel's collocation, and no works."""
    middle = t + 0.5 * h
    set_given_motion(arrays, t, h, until)
    for at in (0, 1, ix.END):
        set_loads(arrays, at, middle)
    for at in range(2):
        prepare_matrices(arrays, at, integers_1(arrays, ix.CHANGED))
        prepare_points(arrays, at)
    solve_nodes(arrays, h)
    finish(arrays)
    set_velocities(arrays, ix.END)
    for i in range(floats_2(arrays, ix.KNOWN).shape[1]):
        floats_2(arrays, ix.RATES)[ix.START, i] = floats_2(arrays, ix.RATES)[ix.END, i]


def _take_steps(arrays):
    intervals, kept = floats_2(arrays, ix.INTERVALS), floats_3(arrays, FOUND)
    which, row = integers_1(arrays, ix.CURSOR)[0], 0
    for number in range(intervals.shape[0]):
        begin, end, count = intervals[number, 0], intervals[number, 1], int(intervals[number, 2])
        h = (end - begin) / count
        for step in range(count):
            t, until = begin + step * h, end if step + 1 == count else begin + (step + 1) * h
            if which == SDIRK:
                for stage in range(5):
                    place = floats_2(arrays, TABLEAU)[PLACES, stage]
                    sdirk_stage(arrays, stage, until if place == 1.0 else t + place * h, t + 0.5 * h, h)
            elif which == RODAS:
                rodas_step(arrays, t, h, until)
            else:
                pair_step(arrays, t, h, until)
        if intervals[number, 3] != 0.0:
            for k in range(2):
                for i in range(kept.shape[2]):
                    kept[row, k, i] = floats_3(arrays, ix.LATERAL)[0, k, i]
            row += 1
    return 0


_SETTINGS: dict[str, Any] = {
    "error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}, "_nrt": False, "no_cfunc_wrapper": True,
    "pipeline_class": EntranceCompiler,
}  # fmt: skip
take_steps = njit(**_SETTINGS)(_take_steps)


def prepare() -> None:
    """Compile the steps."""
    with hastened():
        take_steps.compile((types.Array(types.int64, 2, "C"),))
