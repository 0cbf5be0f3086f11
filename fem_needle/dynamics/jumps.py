"""What a kink in front of a step does: jumps of speed, loads, hub and its velocity, guides that strike, a needle that is out.

With inertia coordinates and momentum stay; velocities are of the other side. A clamp that jumps by d_c is the limit of a ramp
that takes no time: what remains of the free coordinates' equation, integrated twice, and of the rigid guides' is

    M_ff d_f + M_fc d_c = N_f' r,   N_f d_f + N_c d_c = 0,   and integrated once   P_f jumps by -(C d)_f.

Rigid guides strike where the sides differ: P jumps by -N' r with N q' + v dN/dz q = 0 after. Without inertia the needle follows
jumps of loads and hub at once, as far as no viscosity holds it.
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cut_path import set_history
from fem_needle.dynamics.dense import solve_small
from fem_needle.dynamics.energy import bending_energy, kinetic_energy, tissue_energy
from fem_needle.dynamics.guides import soft_reactions
from fem_needle.dynamics.instant import beam_at, prepare_matrices, prepare_points
from fem_needle.dynamics.jump_works import force_jump_works, momentum_jump_works
from fem_needle.dynamics.lateral import solve_nodes
from fem_needle.dynamics.names import (
    ACCELERATION,
    ANSWERS,
    ARREST_LOSS,
    ARRESTED,
    AXIAL_STATE,
    BEAM,
    BOUNDARY,
    CHANGED,
    CHOSEN,
    CLAMP,
    COMPLIANCE,
    COUNTED,
    COURSES,
    COVERED,
    CUTS,
    DAMPING,
    DEEPEST,
    DENSE,
    END,
    FACTOR,
    FLEXIBLE,
    FORCES,
    FRONT,
    GAPS,
    GUIDES,
    HELD,
    INERTIA,
    INSTANT_SUMS,
    IS_PUSHED,
    KINK,
    KNOWN,
    LANDED,
    LAST_ANGLE_RATE,
    LAST_AXIAL_MOMENTUM,
    LAST_AXIAL_PRODUCT,
    LAST_HUB_PRODUCT,
    LAST_HUB_RATE,
    LAST_PACE,
    LAST_POWER,
    LAST_PRODUCT,
    LATERAL,
    LEDGER_STATE,
    LENGTH,
    LIMITS,
    MASS,
    MASS_PER_LENGTH,
    METHOD,
    NODE_PACE_1,
    NODE_PACE_2,
    NUMBER,
    OWN_DEPTH,
    OWN_SIDE,
    PACE,
    POINT_FIRST,
    POINT_RATES,
    POINT_ROWS,
    PRESCRIBED,
    RATES,
    ROUNDINGS,
    S_MOMENTUM,
    S_POWER,
    SIDES,
    SMALLEST_DEPTH,
    SOFTEST,
    SPEED,
    START,
    STEPS,
    STRETCH,
    STRIDE,
    SWITCH,
    TIME,
    TISSUE_BLOCKS,
    VECTORS,
    VISCOUS,
    WEIGHTS,
)
from fem_needle.dynamics.points import along
from fem_needle.dynamics.products import add_covered, add_product
from fem_needle.dynamics.reduced import solve_mass
from fem_needle.dynamics.stepping import finish, set_path_constants, set_velocities, tip_of
from fem_needle.dynamics.works import load_product, set_sums

SMALLEST_JUMP = 1e-12  # m and rad: a smaller one is the rounding of a clamp that moves
SAME_FORCE = 1e-9  # of a force: less is no jump
JUMP_FRACTION = 1e-9  # of a step: in this time viscosity lets nothing move


@inner
def clamp_jumps(arrays):
    """Return whether the clamp stands somewhere else than the coordinates at the start say."""
    clamp, lateral = floats_3(arrays, CLAMP)[START], floats_3(arrays, LATERAL)[0]
    largest = 0.0
    for c in range(integers_1(arrays, SWITCH)[PRESCRIBED]):
        largest = max(largest, np.abs(clamp[0, c] - lateral[0, c]))
    return largest > SMALLEST_JUMP


@inner
def loads_jump(arrays):
    """Return whether loads at the start are others than those before."""
    forces, held = floats_2(arrays, FORCES)[START], floats_1(arrays, HELD)
    for point in range(integers_1(arrays, SWITCH)[GUIDES], len(forces)):
        if np.abs(forces[point] - held[point]) > SAME_FORCE * np.abs(held[point]):
            return True
    return False


@inner
def has_rigid_guides(arrays):
    """Return whether any guide is rigid."""
    compliance = floats_1(arrays, COMPLIANCE)
    smallest = np.inf
    for guide in range(len(compliance)):
        smallest = min(smallest, compliance[guide])
    return smallest == 0.0


@inner
def answers_of_mass(arrays):
    """Set M^-1 N' of the rigid guides at the start in ``ANSWERS``, their numbers in ``CHOSEN``; returns how many."""
    rows, first = floats_3(arrays, POINT_ROWS)[START], integers_2(arrays, POINT_FIRST)[START]
    answers, chosen = floats_2(arrays, ANSWERS), integers_1(arrays, CHOSEN)
    compliance, stretch, count = floats_1(arrays, COMPLIANCE), floats_2(arrays, COURSES)[START, STRETCH], 0
    n = floats_2(arrays, KNOWN).shape[1]
    for guide in range(len(compliance)):
        if compliance[guide] == 0.0:
            answer = answers[count][:n]
            answer[:] = 0.0
            for i in range(rows.shape[1]):
                answer[first[guide] + i] = rows[guide, i]
            solve_mass(arrays, START, answer)
            for i in range(n):
                answer[i] /= stretch
            chosen[count] = guide
            count += 1
    return count


@inner
def mobility(arrays, count):
    """Set N M^-1 N' of the rigid guides in ``DENSE``."""
    rows, first = floats_3(arrays, POINT_ROWS)[START], integers_2(arrays, POINT_FIRST)[START]
    answers, chosen, dense = floats_2(arrays, ANSWERS), integers_1(arrays, CHOSEN), floats_2(arrays, DENSE)
    for one in range(count):
        for other in range(count):
            dense[one, other] = along(rows[chosen[one]], first[chosen[one]], answers[other])


@inner
def carry(arrays):
    """Let the clamp jump: coordinates follow as the mass lets them, and the viscous tissue leaves a momentum."""
    switches, lateral, beams = integers_1(arrays, SWITCH), floats_3(arrays, LATERAL)[0], floats_5(arrays, BEAM)
    course, moved, pulled = floats_2(arrays, COURSES)[START], floats_2(arrays, VECTORS)[1], floats_2(arrays, VECTORS)[0]
    rows, first = floats_3(arrays, POINT_ROWS)[START], integers_2(arrays, POINT_FIRST)[START]
    clamped, gaps, chosen = switches[PRESCRIBED], floats_1(arrays, GAPS), integers_1(arrays, CHOSEN)
    moved[:] = 0.0
    pulled[:] = 0.0
    for c in range(clamped):
        moved[c] = floats_3(arrays, CLAMP)[START, 0, c] - lateral[0, c]
    add_product(beams[beam_at(beams, START)], MASS, switches[STRIDE], -1.0, moved, pulled)
    solve_mass(arrays, START, pulled)
    for i in range(clamped, len(moved)):
        moved[i] = pulled[i]
    count = answers_of_mass(arrays)
    if count:
        mobility(arrays, count)
        for one in range(count):
            gaps[one] = -along(rows[chosen[one]], first[chosen[one]], moved)
        solve_small(floats_2(arrays, DENSE), gaps, count)
        for one in range(count):
            for i in range(clamped, len(moved)):
                moved[i] += gaps[one] * floats_2(arrays, ANSWERS)[one, i]
    pulled[:] = 0.0
    if switches[VISCOUS]:
        tissue, covered = floats_5(arrays, TISSUE_BLOCKS)[START], floats_3(arrays, COVERED)[START]
        add_covered(tissue, DAMPING, covered, switches[STRIDE], -course[STRETCH], moved, pulled)
    for i in range(len(moved)):
        lateral[0, i] += moved[i]
        if i >= clamped:
            lateral[1, i] += pulled[i]


@inner
def strike(arrays):
    """Let rigid guides strike: N q' + v dN/dz q = 0 holds again."""
    rates, first = floats_3(arrays, POINT_RATES)[START], integers_2(arrays, POINT_FIRST)[START]
    rows, lateral, gaps = floats_3(arrays, POINT_ROWS)[START], floats_3(arrays, LATERAL)[0], floats_1(arrays, GAPS)
    speed, chosen, clamped = (
        floats_2(arrays, COURSES)[START, SPEED],
        integers_1(arrays, CHOSEN),
        integers_1(arrays, SWITCH)[PRESCRIBED],
    )
    count = answers_of_mass(arrays)
    mobility(arrays, count)
    for one in range(count):
        guide = chosen[one]
        gaps[one] = along(rows[guide], first[guide], floats_2(arrays, RATES)[START])
        gaps[one] += speed * along(rates[guide], first[guide], floats_2(arrays, KNOWN)[START])
    solve_small(floats_2(arrays, DENSE), gaps, count)
    for one in range(count):
        guide = chosen[one]
        for i in range(rows.shape[1]):
            if first[guide] + i >= clamped:
                lateral[1, first[guide] + i] -= gaps[one] * rows[guide, i]
    set_velocities(arrays, START)


@inner
def follow(arrays, h):
    """Let a needle without inertia follow a jump of the loads or of the hub: what no viscosity holds moves at once."""
    course, clamp, forces = floats_2(arrays, COURSES), floats_3(arrays, CLAMP), floats_2(arrays, FORCES)
    time, switches = course[START, TIME], integers_1(arrays, SWITCH)
    length = max(JUMP_FRACTION * h, 4.0 * np.finfo(np.float64).eps * np.abs(time))
    for at in (0, 1, END):
        for i in range(course.shape[1]):
            course[at, i] = course[START, i]
        course[at, SPEED], course[at, ACCELERATION] = 0.0, 0.0
        for c in range(switches[PRESCRIBED]):
            clamp[at, 0, c] = clamp[START, 0, c]
            jump = clamp[START, 0, c] - floats_3(arrays, LATERAL)[0, 0, c]
            clamp[at, 1, c] = jump / length if np.abs(jump) > SMALLEST_JUMP else 0.0
        for point in range(forces.shape[1]):
            forces[at, point] = forces[START, point]
    for s in range(2):
        prepare_matrices(arrays, s, integers_1(arrays, CHANGED))
        prepare_points(arrays, s)
    solve_nodes(arrays, length)
    finish(arrays)
    weights = floats_2(arrays, METHOD)[WEIGHTS]
    for guide in range(switches[GUIDES]):
        forces[START, guide] = weights[0] * forces[0, guide] + weights[1] * forces[1, guide]
    for i in range(floats_2(arrays, KNOWN).shape[1]):
        floats_2(arrays, KNOWN)[START, i] = floats_3(arrays, LATERAL)[0, 0, i]
    soften(arrays)


@inner
def soften(arrays):
    """Set the forces at the start of guides that give way from the deflections there."""
    if integers_1(arrays, SWITCH)[GUIDES]:
        soft_reactions(
            integers_1(arrays, SWITCH), floats_1(arrays, NUMBER)[SOFTEST], floats_3(arrays, POINT_ROWS)[START],
            integers_2(arrays, POINT_FIRST)[START], floats_3(arrays, FLEXIBLE)[START], floats_1(arrays, COMPLIANCE),
            floats_2(arrays, KNOWN)[START], floats_2(arrays, FORCES)[START], floats_2(arrays, DENSE), floats_1(arrays, GAPS),
            integers_1(arrays, CHOSEN),
        )  # fmt: skip


@inner
def drop(arrays):
    """Let a needle that is hardly inserted be straight; its energy goes with the part that is dropped."""
    switches, lateral, ledger = integers_1(arrays, SWITCH), floats_3(arrays, LATERAL)[0], floats_1(arrays, LEDGER_STATE)
    energy = kinetic_energy(arrays, START) + bending_energy(arrays, START)
    ledger[BOUNDARY] -= energy + floats_2(arrays, COURSES)[START, FACTOR] * tissue_energy(arrays, START)
    for i in range(lateral.shape[1]):
        lateral[0, i], lateral[1, i] = 0.0, 0.0
        floats_2(arrays, KNOWN)[START, i], floats_2(arrays, RATES)[START, i] = 0.0, 0.0
    for guide in range(switches[GUIDES]):
        floats_2(arrays, FORCES)[START, guide] = 0.0


@inner
def left_velocities(arrays, pace):
    """Set the velocities just before a kink in ``SIDES``: from the momentum and the other side's speed and hub."""
    axial, clamp, course = floats_1(arrays, AXIAL_STATE), floats_3(arrays, CLAMP)[START], floats_2(arrays, COURSES)[START]
    rate, turn, speed = clamp[1, 0], clamp[1, 1], course[SPEED]
    clamp[1, 0], clamp[1, 1], course[SPEED] = axial[LAST_HUB_RATE], axial[LAST_ANGLE_RATE], pace
    set_velocities(arrays, START)
    clamp[1, 0], clamp[1, 1], course[SPEED] = rate, turn, speed
    for i in range(floats_2(arrays, RATES).shape[1]):
        floats_2(arrays, SIDES)[0, i] = floats_2(arrays, RATES)[START, i]


@inner
def set_left(arrays, jumped):
    """Set coordinates and guides' forces at the start to those before; let a needle with inertia follow a clamp that jumps."""
    known, lateral = floats_2(arrays, KNOWN), floats_3(arrays, LATERAL)[0]
    if jumped and integers_1(arrays, SWITCH)[INERTIA]:
        carry(arrays)
    for i in range(known.shape[1]):
        known[START, i] = lateral[0, i]
    for guide in range(integers_1(arrays, SWITCH)[GUIDES]):
        floats_2(arrays, FORCES)[START, guide] = floats_1(arrays, HELD)[guide]
    if integers_1(arrays, SWITCH)[CUTS]:
        set_history(arrays, START)


@inner
def set_start_path(arrays):
    """Set the path's terms at the start; a needle that has followed a jump cuts on from where it is."""
    axial, tip = floats_1(arrays, AXIAL_STATE), tip_of(arrays, START)
    if floats_2(arrays, COURSES)[START, OWN_DEPTH] >= axial[DEEPEST] * (1.0 - ROUNDINGS):
        axial[FRONT] = tip
    set_history(arrays, START)
    set_path_constants(arrays, START, tip)


@inner
def book_arrest(arrays, pace, gained):
    """Book what is lost of the needle's own energy where a membrane has stopped it and the lateral motion did not take it."""
    numbers, axial = floats_1(arrays, NUMBER), floats_1(arrays, AXIAL_STATE)
    if axial[ARRESTED] != 0.0:
        kinetic = 0.5 * numbers[MASS_PER_LENGTH] * numbers[LENGTH] * pace * pace
        floats_1(arrays, LEDGER_STATE)[ARREST_LOSS] += kinetic - gained
    axial[ARRESTED], axial[LAST_PACE] = 0.0, floats_2(arrays, COURSES)[START, SPEED]


@inner
def remember(arrays):
    """Keep what the works of the first step need of its start."""
    axial, sums, course = floats_1(arrays, AXIAL_STATE), floats_2(arrays, INSTANT_SUMS)[START], floats_2(arrays, COURSES)[START]
    lateral, clamp = floats_3(arrays, LATERAL)[0], floats_3(arrays, CLAMP)[START]
    for point in range(len(floats_1(arrays, HELD))):
        floats_1(arrays, HELD)[point] = floats_2(arrays, FORCES)[START, point]
    axial[LAST_POWER], axial[LAST_AXIAL_MOMENTUM] = sums[S_POWER], sums[S_MOMENTUM]
    axial[LAST_PRODUCT], axial[LAST_AXIAL_PRODUCT] = load_product(arrays, START), course[SPEED] * sums[S_MOMENTUM]
    axial[LAST_HUB_PRODUCT] = clamp[1, 0] * lateral[1, 0] + clamp[1, 1] * lateral[1, 1]


@inner
def land(arrays, h):
    """Begin a call or a row of steps: the instant at its start, what a kink does to the state, and its works."""
    axial, limits, course = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LIMITS), floats_2(arrays, COURSES)[START]
    inertia, pace = integers_1(arrays, SWITCH)[INERTIA] != 0, axial[LAST_PACE]
    is_kink, counted = axial[LANDED] == KINK, limits[COUNTED] != 0.0 and axial[LANDED] == KINK
    jumped, changed = clamp_jumps(arrays) and is_kink, loads_jump(arrays) and is_kink
    strikes = (is_kink or limits[IS_PUSHED] != 0.0) and inertia and has_rigid_guides(arrays)
    for i in range(floats_2(arrays, KNOWN).shape[1]):
        floats_2(arrays, KNOWN)[START, i] = floats_3(arrays, LATERAL)[0, 0, i]
    if inertia and (jumped or strikes):
        left_velocities(arrays, pace)
    set_left(arrays, jumped)
    if inertia and (jumped or changed):
        soften(arrays)
    set_velocities(arrays, START)
    if strikes:
        strike(arrays)
    if not inertia and is_kink and (jumped or changed or not counted):
        follow(arrays, h)
    if integers_1(arrays, SWITCH)[CUTS]:
        set_start_path(arrays)
    if is_kink and course[OWN_SIDE] < floats_1(arrays, NUMBER)[SMALLEST_DEPTH]:
        drop(arrays)
    elif counted:
        force_jump_works(arrays, jumped)
    set_sums(arrays, START, h > 0.0)
    axial[PACE] = course[SPEED]
    if is_kink:
        axial[NODE_PACE_1], axial[NODE_PACE_2] = course[SPEED], course[SPEED]
    before = floats_1(arrays, LEDGER_STATE)[BOUNDARY]
    if inertia and (counted or (strikes and axial[STEPS] > 0.0)):
        momentum_jump_works(arrays, pace, jumped)
    book_arrest(arrays, pace, floats_1(arrays, LEDGER_STATE)[BOUNDARY] - before)
    remember(arrays)
