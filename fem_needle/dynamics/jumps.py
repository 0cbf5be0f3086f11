"""What a kink in front of a step does: jumps of speed, loads, hub and its velocity, guides that strike, a needle that is out.

With inertia coordinates and momentum stay; velocities are of the other side. A clamp that jumps by d_c is the limit of a ramp
that takes no time: what remains of the free coordinates' equation, integrated twice, and of the rigid guides' is

    M_ff d_f + M_fc d_c = N_f' r,   N_f d_f + N_c d_c = 0,   and integrated once   P_f jumps by -(C d)_f.

Rigid guides strike where the sides differ: P jumps by -N' r with N q' + v dN/dz q = 0 after. Without inertia the needle follows
jumps of loads and hub at once, as far as no viscosity holds it.
"""

from __future__ import annotations

import numpy as np

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cut_path import set_history
from fem_needle.dynamics.dense import solve_small
from fem_needle.dynamics.energy import bending_energy, kinetic_energy, tissue_energy
from fem_needle.dynamics.guides import soft_reactions
from fem_needle.dynamics.instant import beam_at, prepare_matrices, prepare_points
from fem_needle.dynamics.jump_works import force_jump_works, momentum_jump_works
from fem_needle.dynamics.lateral import solve_nodes
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
    clamp, lateral = floats_3(arrays, ix.CLAMP)[ix.START], floats_3(arrays, ix.LATERAL)[0]
    largest = 0.0
    for c in range(integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED]):
        largest = max(largest, np.abs(clamp[0, c] - lateral[0, c]))
    return largest > SMALLEST_JUMP


@inner
def loads_jump(arrays):
    """Return whether loads at the start are others than those before."""
    forces, held = floats_2(arrays, ix.FORCES)[ix.START], floats_1(arrays, ix.HELD)
    for point in range(integers_1(arrays, ix.SWITCH)[ix.GUIDES], len(forces)):
        if np.abs(forces[point] - held[point]) > SAME_FORCE * np.abs(held[point]):
            return True
    return False


@inner
def has_rigid_guides(arrays):
    """Return whether any guide is rigid."""
    compliance = floats_1(arrays, ix.COMPLIANCE)
    smallest = np.inf
    for guide in range(len(compliance)):
        smallest = min(smallest, compliance[guide])
    return smallest == 0.0


@inner
def answers_of_mass(arrays):
    """Set M^-1 N' of the rigid guides at the start in ``ANSWERS``, their numbers in ``CHOSEN``; returns how many."""
    rows, first = floats_3(arrays, ix.POINT_ROWS)[ix.START], integers_2(arrays, ix.POINT_FIRST)[ix.START]
    answers, chosen = floats_2(arrays, ix.ANSWERS), integers_1(arrays, ix.CHOSEN)
    compliance, stretch, count = floats_1(arrays, ix.COMPLIANCE), floats_2(arrays, ix.COURSES)[ix.START, ix.STRETCH], 0
    n = floats_2(arrays, ix.KNOWN).shape[1]
    for guide in range(len(compliance)):
        if compliance[guide] == 0.0:
            answer = answers[count][:n]
            answer[:] = 0.0
            for i in range(rows.shape[1]):
                answer[first[guide] + i] = rows[guide, i]
            solve_mass(arrays, ix.START, answer)
            for i in range(n):
                answer[i] /= stretch
            chosen[count] = guide
            count += 1
    return count


@inner
def mobility(arrays, count):
    """Set N M^-1 N' of the rigid guides in ``DENSE``."""
    rows, first = floats_3(arrays, ix.POINT_ROWS)[ix.START], integers_2(arrays, ix.POINT_FIRST)[ix.START]
    answers, chosen, dense = floats_2(arrays, ix.ANSWERS), integers_1(arrays, ix.CHOSEN), floats_2(arrays, ix.DENSE)
    for one in range(count):
        for other in range(count):
            dense[one, other] = along(rows[chosen[one]], first[chosen[one]], answers[other])


@inner
def carry(arrays):
    """Let the clamp jump: coordinates follow as the mass lets them, and the viscous tissue leaves a momentum."""
    switches, lateral, beams = integers_1(arrays, ix.SWITCH), floats_3(arrays, ix.LATERAL)[0], floats_5(arrays, ix.BEAM)
    course, moved, pulled = (
        floats_2(arrays, ix.COURSES)[ix.START],
        floats_2(arrays, ix.VECTORS)[1],
        floats_2(arrays, ix.VECTORS)[0],
    )
    rows, first = floats_3(arrays, ix.POINT_ROWS)[ix.START], integers_2(arrays, ix.POINT_FIRST)[ix.START]
    clamped, gaps, chosen = switches[ix.PRESCRIBED], floats_1(arrays, ix.GAPS), integers_1(arrays, ix.CHOSEN)
    moved[:] = 0.0
    pulled[:] = 0.0
    for c in range(clamped):
        moved[c] = floats_3(arrays, ix.CLAMP)[ix.START, 0, c] - lateral[0, c]
    add_product(beams[beam_at(beams, ix.START)], ix.MASS, switches[ix.STRIDE], -1.0, moved, pulled)
    solve_mass(arrays, ix.START, pulled)
    for i in range(clamped, len(moved)):
        moved[i] = pulled[i]
    count = answers_of_mass(arrays)
    if count:
        mobility(arrays, count)
        for one in range(count):
            gaps[one] = -along(rows[chosen[one]], first[chosen[one]], moved)
        solve_small(floats_2(arrays, ix.DENSE), gaps, count)
        for one in range(count):
            for i in range(clamped, len(moved)):
                moved[i] += gaps[one] * floats_2(arrays, ix.ANSWERS)[one, i]
    pulled[:] = 0.0
    if switches[ix.VISCOUS]:
        tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[ix.START], floats_3(arrays, ix.COVERED)[ix.START]
        add_covered(tissue, ix.DAMPING, covered, switches[ix.STRIDE], -course[ix.STRETCH], moved, pulled)
    for i in range(len(moved)):
        lateral[0, i] += moved[i]
        if i >= clamped:
            lateral[1, i] += pulled[i]


@inner
def strike(arrays):
    """Let rigid guides strike: N q' + v dN/dz q = 0 holds again."""
    rates, first = floats_3(arrays, ix.POINT_RATES)[ix.START], integers_2(arrays, ix.POINT_FIRST)[ix.START]
    rows, lateral, gaps = floats_3(arrays, ix.POINT_ROWS)[ix.START], floats_3(arrays, ix.LATERAL)[0], floats_1(arrays, ix.GAPS)
    speed, chosen, clamped = (
        floats_2(arrays, ix.COURSES)[ix.START, ix.SPEED],
        integers_1(arrays, ix.CHOSEN),
        integers_1(arrays, ix.SWITCH)[ix.PRESCRIBED],
    )
    count = answers_of_mass(arrays)
    mobility(arrays, count)
    for one in range(count):
        guide = chosen[one]
        gaps[one] = along(rows[guide], first[guide], floats_2(arrays, ix.RATES)[ix.START])
        gaps[one] += speed * along(rates[guide], first[guide], floats_2(arrays, ix.KNOWN)[ix.START])
    solve_small(floats_2(arrays, ix.DENSE), gaps, count)
    for one in range(count):
        guide = chosen[one]
        for i in range(rows.shape[1]):
            if first[guide] + i >= clamped:
                lateral[1, first[guide] + i] -= gaps[one] * rows[guide, i]
    set_velocities(arrays, ix.START)


@inner
def follow(arrays, h):
    """Let a needle without inertia follow a jump of the loads or of the hub: what no viscosity holds moves at once."""
    course, clamp, forces = floats_2(arrays, ix.COURSES), floats_3(arrays, ix.CLAMP), floats_2(arrays, ix.FORCES)
    time, switches = course[ix.START, ix.TIME], integers_1(arrays, ix.SWITCH)
    length = max(JUMP_FRACTION * h, 4.0 * np.finfo(np.float64).eps * np.abs(time))
    for at in (0, 1, ix.END):
        for i in range(course.shape[1]):
            course[at, i] = course[ix.START, i]
        course[at, ix.SPEED], course[at, ix.ACCELERATION] = 0.0, 0.0
        for c in range(switches[ix.PRESCRIBED]):
            clamp[at, 0, c] = clamp[ix.START, 0, c]
            jump = clamp[ix.START, 0, c] - floats_3(arrays, ix.LATERAL)[0, 0, c]
            clamp[at, 1, c] = jump / length if np.abs(jump) > SMALLEST_JUMP else 0.0
        for point in range(forces.shape[1]):
            forces[at, point] = forces[ix.START, point]
    for s in range(2):
        prepare_matrices(arrays, s, integers_1(arrays, ix.CHANGED))
        prepare_points(arrays, s)
    solve_nodes(arrays, length)
    finish(arrays)
    weights = floats_2(arrays, ix.METHOD)[ix.WEIGHTS]
    for guide in range(switches[ix.GUIDES]):
        forces[ix.START, guide] = weights[0] * forces[0, guide] + weights[1] * forces[1, guide]
    for i in range(floats_2(arrays, ix.KNOWN).shape[1]):
        floats_2(arrays, ix.KNOWN)[ix.START, i] = floats_3(arrays, ix.LATERAL)[0, 0, i]
    soften(arrays)


@inner
def soften(arrays):
    """Set the forces at the start of guides that give way from the deflections there."""
    if integers_1(arrays, ix.SWITCH)[ix.GUIDES]:
        soft_reactions(
            integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER)[ix.SOFTEST], floats_3(arrays, ix.POINT_ROWS)[ix.START],
            integers_2(arrays, ix.POINT_FIRST)[ix.START], floats_3(arrays, ix.FLEXIBLE)[ix.START],
            floats_1(arrays, ix.COMPLIANCE), floats_2(arrays, ix.KNOWN)[ix.START], floats_2(arrays, ix.FORCES)[ix.START],
            floats_2(arrays, ix.DENSE), floats_1(arrays, ix.GAPS), integers_1(arrays, ix.CHOSEN),
        )  # fmt: skip


@inner
def drop(arrays):
    """Let a needle that is hardly inserted be straight; its energy goes with the part that is dropped."""
    switches, lateral, ledger = integers_1(arrays, ix.SWITCH), floats_3(arrays, ix.LATERAL)[0], floats_1(arrays, ix.LEDGER_STATE)
    energy = kinetic_energy(arrays, ix.START) + bending_energy(arrays, ix.START)
    ledger[ix.BOUNDARY] -= energy + floats_2(arrays, ix.COURSES)[ix.START, ix.FACTOR] * tissue_energy(arrays, ix.START)
    for i in range(lateral.shape[1]):
        lateral[0, i], lateral[1, i] = 0.0, 0.0
        floats_2(arrays, ix.KNOWN)[ix.START, i], floats_2(arrays, ix.RATES)[ix.START, i] = 0.0, 0.0
    for guide in range(switches[ix.GUIDES]):
        floats_2(arrays, ix.FORCES)[ix.START, guide] = 0.0


@inner
def left_velocities(arrays, pace):
    """Set the velocities just before a kink in ``SIDES``: from the momentum and the other side's speed and hub."""
    axial, clamp, course = (
        floats_1(arrays, ix.AXIAL_STATE),
        floats_3(arrays, ix.CLAMP)[ix.START],
        floats_2(arrays, ix.COURSES)[ix.START],
    )
    rate, turn, speed = clamp[1, 0], clamp[1, 1], course[ix.SPEED]
    clamp[1, 0], clamp[1, 1], course[ix.SPEED] = axial[ix.LAST_HUB_RATE], axial[ix.LAST_ANGLE_RATE], pace
    set_velocities(arrays, ix.START)
    clamp[1, 0], clamp[1, 1], course[ix.SPEED] = rate, turn, speed
    for i in range(floats_2(arrays, ix.RATES).shape[1]):
        floats_2(arrays, ix.SIDES)[0, i] = floats_2(arrays, ix.RATES)[ix.START, i]


@inner
def set_left(arrays, jumped):
    """Set coordinates and guides' forces at the start to those before; let a needle with inertia follow a clamp that jumps."""
    known, lateral = floats_2(arrays, ix.KNOWN), floats_3(arrays, ix.LATERAL)[0]
    if jumped and integers_1(arrays, ix.SWITCH)[ix.INERTIA]:
        carry(arrays)
    for i in range(known.shape[1]):
        known[ix.START, i] = lateral[0, i]
    for guide in range(integers_1(arrays, ix.SWITCH)[ix.GUIDES]):
        floats_2(arrays, ix.FORCES)[ix.START, guide] = floats_1(arrays, ix.HELD)[guide]
    if integers_1(arrays, ix.SWITCH)[ix.CUTS]:
        set_history(arrays, ix.START)


@inner
def set_start_path(arrays):
    """Set the path's terms at the start; a needle that has followed a jump cuts on from where it is."""
    axial, tip = floats_1(arrays, ix.AXIAL_STATE), tip_of(arrays, ix.START)
    if floats_2(arrays, ix.COURSES)[ix.START, ix.OWN_DEPTH] >= axial[ix.DEEPEST] * (1.0 - ix.ROUNDINGS):
        axial[ix.FRONT] = tip
    set_history(arrays, ix.START)
    set_path_constants(arrays, ix.START, tip)


@inner
def book_arrest(arrays, pace, gained):
    """Book what is lost of the needle's own energy where a membrane has stopped it and the lateral motion did not take it."""
    numbers, axial = floats_1(arrays, ix.NUMBER), floats_1(arrays, ix.AXIAL_STATE)
    if axial[ix.ARRESTED] != 0.0:
        kinetic = 0.5 * numbers[ix.MASS_PER_LENGTH] * numbers[ix.LENGTH] * pace * pace
        floats_1(arrays, ix.LEDGER_STATE)[ix.ARREST_LOSS] += kinetic - gained
    axial[ix.ARRESTED], axial[ix.LAST_PACE] = 0.0, floats_2(arrays, ix.COURSES)[ix.START, ix.SPEED]


@inner
def remember(arrays):
    """Keep what the works of the first step need of its start."""
    axial, sums, course = (
        floats_1(arrays, ix.AXIAL_STATE),
        floats_2(arrays, ix.INSTANT_SUMS)[ix.START],
        floats_2(arrays, ix.COURSES)[ix.START],
    )
    lateral, clamp = floats_3(arrays, ix.LATERAL)[0], floats_3(arrays, ix.CLAMP)[ix.START]
    for point in range(len(floats_1(arrays, ix.HELD))):
        floats_1(arrays, ix.HELD)[point] = floats_2(arrays, ix.FORCES)[ix.START, point]
    axial[ix.LAST_POWER], axial[ix.LAST_AXIAL_MOMENTUM] = sums[ix.S_POWER], sums[ix.S_MOMENTUM]
    axial[ix.LAST_PRODUCT], axial[ix.LAST_AXIAL_PRODUCT] = load_product(arrays, ix.START), course[ix.SPEED] * sums[ix.S_MOMENTUM]
    axial[ix.LAST_HUB_PRODUCT] = clamp[1, 0] * lateral[1, 0] + clamp[1, 1] * lateral[1, 1]


@inner
def land(arrays, h):
    """Begin a call or a row of steps: the instant at its start, what a kink does to the state, and its works."""
    axial, limits, course = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LIMITS), floats_2(arrays, ix.COURSES)[ix.START]
    inertia, pace = integers_1(arrays, ix.SWITCH)[ix.INERTIA] != 0, axial[ix.LAST_PACE]
    is_kink, counted = axial[ix.LANDED] == ix.KINK, limits[ix.COUNTED] != 0.0 and axial[ix.LANDED] == ix.KINK
    jumped, changed = clamp_jumps(arrays) and is_kink, loads_jump(arrays) and is_kink
    strikes = (is_kink or limits[ix.IS_PUSHED] != 0.0) and inertia and has_rigid_guides(arrays)
    for i in range(floats_2(arrays, ix.KNOWN).shape[1]):
        floats_2(arrays, ix.KNOWN)[ix.START, i] = floats_3(arrays, ix.LATERAL)[0, 0, i]
    if inertia and (jumped or strikes):
        left_velocities(arrays, pace)
    set_left(arrays, jumped)
    if inertia and (jumped or changed):
        soften(arrays)
    set_velocities(arrays, ix.START)
    if strikes:
        strike(arrays)
    if not inertia and is_kink and (jumped or changed or not counted):
        follow(arrays, h)
    if integers_1(arrays, ix.SWITCH)[ix.CUTS]:
        set_start_path(arrays)
    if is_kink and course[ix.OWN_SIDE] < floats_1(arrays, ix.NUMBER)[ix.SMALLEST_DEPTH]:
        drop(arrays)
    elif counted:
        force_jump_works(arrays, jumped)
    set_sums(arrays, ix.START, h > 0.0)
    axial[ix.PACE] = course[ix.SPEED]
    if is_kink:
        axial[ix.NODE_PACE_1], axial[ix.NODE_PACE_2] = course[ix.SPEED], course[ix.SPEED]
    before = floats_1(arrays, ix.LEDGER_STATE)[ix.BOUNDARY]
    if inertia and (counted or (strikes and axial[ix.STEPS] > 0.0)):
        momentum_jump_works(arrays, pace, jumped)
    book_arrest(arrays, pace, floats_1(arrays, ix.LEDGER_STATE)[ix.BOUNDARY] - before)
    remember(arrays)
