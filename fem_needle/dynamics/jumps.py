"""What a kink in front of a step does: jumps of speed, loads, hub and its velocity, guides that strike, a needle that is out.

With inertia coordinates and momentum stay; velocities are those of the other side. A clamp that jumps by d_c is the limit of a ramp
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
from fem_needle.dynamics.lateral import solve_nodes
from fem_needle.dynamics.names import (
    ACCELERATION,
    ANSWERS,
    ARREST_LOSS,
    ARRESTED,
    AXIAL_STATE,
    BEAM,
    BENDING_STIFFNESS,
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
    DEGREE,
    DENSE,
    END,
    FACTOR,
    FLEXIBLE,
    FORCES,
    FRONT,
    GAPS,
    GUIDES,
    HELD,
    HUB_WORK,
    INERTIA,
    INSTANT_SUMS,
    IS_PUSHED,
    KEPT_HELD,
    KEPT_LATERAL,
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
    LOAD_WORK,
    MASS,
    MASS_PER_LENGTH,
    METHOD,
    NODE_PACE_1,
    NODE_PACE_2,
    NUMBER,
    OWN_DEPTH,
    OWN_SIDE,
    PACE,
    PATH_LOAD,
    PIECE_NODES,
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
    TISSUE,
    TISSUE_BLOCKS,
    VECTORS,
    VISCOUS,
    WEIGHTS,
)
from fem_needle.dynamics.points import along, deflection_at
from fem_needle.dynamics.products import add_covered, add_product, bending_form, covered_form
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
    for c in range(integers_1(arrays, SWITCH)[PRESCRIBED]):
        if np.abs(clamp[0, c] - lateral[0, c]) > SMALLEST_JUMP:
            return True
    return False


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
    for guide in range(len(compliance)):
        if compliance[guide] == 0.0:
            return True
    return False


@inner
def answers_of_mass(arrays):
    """Set M^-1 N' of the rigid guides at the start in ``ANSWERS``, the guides' numbers in ``CHOSEN``; returns how many they are."""
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
    speed, chosen, clamped = floats_2(arrays, COURSES)[START, SPEED], integers_1(arrays, CHOSEN), integers_1(arrays, SWITCH)[PRESCRIBED]
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
def force_jump_works(arrays, jumped):
    """Add the works where the needle follows at once: mean force times jump of deflection; of a clamp that ``jumped``, what resists.

    What resists is the change of bending and tissue energy less what the points do: viscosity takes as much as time is left, and
    stands on neither side.
    """
    switches, left, held = integers_1(arrays, SWITCH), floats_2(arrays, KEPT_LATERAL)[0], floats_1(arrays, KEPT_HELD)
    rows, first, flexible = floats_3(arrays, POINT_ROWS)[START], integers_2(arrays, POINT_FIRST)[START], floats_3(arrays, FLEXIBLE)[START]
    forces, known, ledger = floats_2(arrays, FORCES)[START], floats_2(arrays, KNOWN)[START], floats_1(arrays, LEDGER_STATE)
    taken = 0.0
    for point in range(len(forces)):
        mean = 0.5 * (forces[point] + held[point])
        moved = deflection_at(point, rows, first, flexible, known, forces)
        if point >= switches[GUIDES]:
            ledger[LOAD_WORK] += mean * (moved - deflection_at(point, rows, first, flexible, left, held))
        taken += mean * (along(rows[point], first[point], known) - along(rows[point], first[point], left))
    if jumped:
        ledger[HUB_WORK] += elastic_energy(arrays, known, left) - taken


@inner
def elastic_energy(arrays, right, left):
    """Return the change of 1/2 q.(K + m G) q - m q.H from one state to another."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[START], floats_5(arrays, BEAM)
    tissue, covered, load = floats_5(arrays, TISSUE_BLOCKS)[START], floats_3(arrays, COVERED)[START], floats_2(arrays, PATH_LOAD)[START]
    beam, nodes, total = beams[beam_at(beams, START)], floats_1(arrays, PIECE_NODES), 0.0
    stretch, stiffness = course[STRETCH], floats_1(arrays, NUMBER)[BENDING_STIFFNESS]
    for side in range(2):
        q, sign = right if side == 0 else left, 1.0 if side == 0 else -1.0
        bent = bending_form(beam, switches[STRIDE], switches[DEGREE], stiffness, nodes, q) / (stretch * stretch * stretch)
        held = course[FACTOR] * stretch * covered_form(tissue, TISSUE, covered, switches[STRIDE], q, q)
        total += sign * 0.5 * (bent + held)
        if switches[CUTS]:
            total -= sign * course[FACTOR] * along(load, 0, q)
    return total


@inner
def momentum_jump_works(arrays, pace, jumped):
    """Add the works at a jump of speed or of the hub's velocity: mean velocity times jump of momentum."""
    axial, ledger, clamp = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LEDGER_STATE), floats_3(arrays, CLAMP)[START]
    lateral, left, rates = floats_3(arrays, LATERAL)[0], floats_2(arrays, KEPT_LATERAL), floats_2(arrays, RATES)[START]
    sums, speed, struck = floats_2(arrays, INSTANT_SUMS)[START], floats_2(arrays, COURSES)[START, SPEED], 0.0
    ledger[BOUNDARY] += 0.5 * (pace + speed) * (sums[S_MOMENTUM] - axial[LAST_AXIAL_MOMENTUM])
    rate, turn = 0.5 * (axial[LAST_HUB_RATE] + clamp[1, 0]), 0.5 * (axial[LAST_ANGLE_RATE] + clamp[1, 1])
    ledger[HUB_WORK] += rate * (lateral[1, 0] - left[1, 0]) + turn * (lateral[1, 1] - left[1, 1])
    for i in range(integers_1(arrays, SWITCH)[PRESCRIBED], len(rates)):
        change = lateral[1, i] - left[1, i]
        if change != 0.0:  # a guide's strike, or the momentum that viscous tissue leaves
            struck += 0.5 * (floats_2(arrays, SIDES)[0, i] + rates[i]) * change
    ledger[HUB_WORK if jumped else BOUNDARY] += struck


@inner
def land(arrays, h):
    """Begin a call or a row of steps: the instant at its start, what a kink does to the state, and its works."""
    switches, axial, limits = integers_1(arrays, SWITCH), floats_1(arrays, AXIAL_STATE), floats_1(arrays, LIMITS)
    lateral, known, clamp = floats_3(arrays, LATERAL)[0], floats_2(arrays, KNOWN), floats_3(arrays, CLAMP)[START]
    course, pace = floats_2(arrays, COURSES)[START], axial[LAST_PACE]
    is_kink, counted = axial[LANDED] == KINK, limits[COUNTED] != 0.0 and axial[LANDED] == KINK
    jumped, changed = clamp_jumps(arrays) and is_kink, loads_jump(arrays)
    is_held = limits[IS_PUSHED] != 0.0
    strikes = (is_kink or is_held) and switches[INERTIA] != 0 and has_rigid_guides(arrays)
    for i in range(known.shape[1]):
        known[START, i] = lateral[0, i]
    if switches[INERTIA] and (jumped or strikes):
        left_velocities(arrays, pace)
    if jumped and switches[INERTIA]:
        carry(arrays)
        for i in range(known.shape[1]):
            known[START, i] = lateral[0, i]
    for guide in range(switches[GUIDES]):
        floats_2(arrays, FORCES)[START, guide] = floats_1(arrays, HELD)[guide]
    if switches[CUTS]:
        set_history(arrays, START)
    if switches[INERTIA] and (jumped or changed) and is_kink:
        soften(arrays)
    set_velocities(arrays, START)
    if strikes:
        strike(arrays)
    if not switches[INERTIA] and is_kink and (jumped or changed or not counted):
        follow(arrays, h)
    if switches[CUTS]:
        if course[OWN_DEPTH] >= axial[DEEPEST] * (1.0 - ROUNDINGS):
            axial[FRONT] = tip_of(arrays, START)  # a needle that has followed a jump cuts on from where it is
        set_history(arrays, START)
        set_path_constants(arrays, START, tip_of(arrays, START))
    if is_kink and course[OWN_SIDE] < floats_1(arrays, NUMBER)[SMALLEST_DEPTH]:
        drop(arrays)
    elif counted:
        force_jump_works(arrays, jumped)
    set_sums(arrays, START, known.shape[1] > 0)
    axial[PACE] = course[SPEED]
    if is_kink:
        axial[NODE_PACE_1], axial[NODE_PACE_2] = course[SPEED], course[SPEED]
    if (counted or (strikes and axial[STEPS] > 0.0)) and switches[INERTIA]:
        before = floats_1(arrays, LEDGER_STATE)[BOUNDARY]
        momentum_jump_works(arrays, pace, jumped)
        gained = floats_1(arrays, LEDGER_STATE)[BOUNDARY] - before
        if axial[ARRESTED] != 0.0:  # what the lateral motion does not take of the needle's own energy is lost
            mass = floats_1(arrays, NUMBER)[MASS_PER_LENGTH] * floats_1(arrays, NUMBER)[LENGTH]
            floats_1(arrays, LEDGER_STATE)[ARREST_LOSS] += 0.5 * mass * pace * pace - gained
    elif axial[ARRESTED] != 0.0:
        mass = floats_1(arrays, NUMBER)[MASS_PER_LENGTH] * floats_1(arrays, NUMBER)[LENGTH]
        floats_1(arrays, LEDGER_STATE)[ARREST_LOSS] += 0.5 * mass * pace * pace
    axial[ARRESTED], axial[LAST_PACE] = 0.0, course[SPEED]
    for point in range(len(floats_1(arrays, HELD))):
        floats_1(arrays, HELD)[point] = floats_2(arrays, FORCES)[START, point]
    sums = floats_2(arrays, INSTANT_SUMS)[START]
    axial[LAST_POWER], axial[LAST_AXIAL_MOMENTUM] = sums[S_POWER], sums[S_MOMENTUM]
    axial[LAST_PRODUCT], axial[LAST_AXIAL_PRODUCT] = load_product(arrays, START), course[SPEED] * sums[S_MOMENTUM]
    axial[LAST_HUB_PRODUCT] = clamp[1, 0] * lateral[1, 0] + clamp[1, 1] * lateral[1, 1]
