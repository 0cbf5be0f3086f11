"""What is kept of an output: energies, reactions and works at the end of a step, or at the start of the first one."""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1
from fem_needle.dynamics.axial import cutting_force, friction_force
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.energy import bending_energy, kinetic_energy, tissue_energy
from fem_needle.dynamics.forces import add_tissue_forces, clamp_forces
from fem_needle.dynamics.names import (
    ACCELERATION,
    AXIAL_ACTS,
    COMPLIANCE,
    COURSES,
    COVERED,
    CUTS,
    END_SLOPE,
    FACTOR,
    FORCES,
    GUIDES,
    INERTIA,
    INSTANT_SUMS,
    KNOWN,
    LAYER,
    LEDGER,
    LEDGER_STATE,
    LENGTH,
    MASS_PER_LENGTH,
    METHOD,
    MOMENTA,
    NUMBER,
    ONE,
    OWN_DEPTH,
    PAIR,
    PATH_COUNT,
    PATH_LOAD,
    R_AXIAL,
    R_BENDING,
    R_DEPTH,
    R_ELASTIC,
    R_FRICTION,
    R_GUIDE,
    R_HUB,
    R_INSERTION,
    R_KINETIC,
    R_MOMENT,
    R_PIECES,
    R_PUSH,
    R_SPEED,
    R_TIME,
    R_TIP,
    R_TISSUE,
    R_WORKS,
    RATES,
    RECORD,
    S_CONFIGURATION,
    S_MOMENTUM,
    SMALLEST_DEPTH,
    SPEED,
    START,
    START_SLOPE,
    STRETCH,
    SWITCH,
    TIME,
    TISSUE_BLOCKS,
    TURNS,
    VECTORS,
    WEIGHTS,
)
from fem_needle.dynamics.points import along
from fem_needle.dynamics.works import reached


@inner
def axial_force(arrays, at, count, h):
    """Return A at the end or the start of a step: dT/dv is differentiated on the step's own polynomial."""
    switches, sums = integers_1(arrays, SWITCH), floats_2(arrays, INSTANT_SUMS)
    slopes = floats_2(arrays, METHOD)[START_SLOPE if at == START else END_SLOPE]
    if not switches[AXIAL_ACTS]:
        return 0.0
    force = sums[at, S_CONFIGURATION]
    if switches[INERTIA]:
        for node in range(count):
            force -= slopes[node] / h * (sums[node, S_MOMENTUM] - sums[START, S_MOMENTUM])
    return force


@inner
def set_reactions(arrays, at, count, h, velocity, row):
    """Set the tissue's force, and force and moment of the clamp; ``velocity``: rates of the coordinates."""
    switches, numbers, course = integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), floats_2(arrays, COURSES)[at]
    q, forces, momenta = floats_2(arrays, KNOWN)[at], floats_2(arrays, FORCES)[at], floats_2(arrays, MOMENTA)
    pair, total, one = floats_1(arrays, PAIR), floats_2(arrays, VECTORS)[0], floats_1(arrays, ONE)
    slopes = floats_2(arrays, METHOD)[START_SLOPE if at == START else END_SLOPE]
    total[:] = 0.0
    add_tissue_forces(course, floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at], switches, q, velocity, total)
    row[R_TISSUE] = along(total, 0, one)
    if switches[CUTS]:
        row[R_TISSUE] += course[FACTOR] * along(floats_2(arrays, PATH_LOAD)[at], 0, one)
    clamp_forces(arrays, at, q, velocity, pair)
    for c in range(2):
        pair[c] = -pair[c]
        if switches[INERTIA]:
            for node in range(count):
                pair[c] += slopes[node] / h * (momenta[node, c] - momenta[START, c])
    row[R_HUB], row[R_MOMENT] = pair[0], 0.0 if switches[TURNS] else pair[1] * course[STRETCH]
    if course[OWN_DEPTH] < numbers[SMALLEST_DEPTH]:  # the surface carries the tip force of a needle that is hardly inserted
        row[R_HUB], row[R_MOMENT] = -forces[len(forces) - 1], 0.0


@inner
def shown_velocity(arrays, at, count, h):
    """Set the rates of the coordinates in the second work vector: without inertia those of the step's own polynomial."""
    known, velocity, rates = floats_2(arrays, KNOWN), floats_2(arrays, VECTORS)[1], floats_2(arrays, RATES)
    slopes = floats_2(arrays, METHOD)[START_SLOPE if at == START else END_SLOPE]
    for i in range(len(velocity)):
        velocity[i] = rates[at, i]
        if not integers_1(arrays, SWITCH)[INERTIA]:
            velocity[i] = 0.0
            for node in range(count):
                velocity[i] += slopes[node] / h * (known[node, i] - known[START, i])


@inner
def keep_output(arrays, at, count, h, deepest, row):
    """Set a row of the record from an instant, the end or the start of a step of length h with ``count`` nodes."""
    switches, numbers, course = integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), floats_2(arrays, COURSES)[at]
    forces, q, compliance = floats_2(arrays, FORCES), floats_2(arrays, KNOWN)[at], floats_1(arrays, COMPLIANCE)
    n, points, guides, weights = len(q), forces.shape[1], switches[GUIDES], floats_2(arrays, METHOD)[WEIGHTS]
    depth, speed, mass = course[OWN_DEPTH], course[SPEED], numbers[MASS_PER_LENGTH] * numbers[LENGTH]
    row[R_TIME], row[R_DEPTH], row[R_SPEED] = course[TIME], depth, speed
    row[R_FRICTION] = friction_force(numbers, depth, speed)
    row[R_AXIAL] = axial_force(arrays, at, count, h)
    row[R_PUSH] = mass * course[ACCELERATION] + row[R_FRICTION] - row[R_AXIAL]
    row[R_PUSH] += cutting_force(floats_2(arrays, LAYER), depth, speed, deepest)
    shown_velocity(arrays, at, count, h)
    set_reactions(arrays, at, count, h, floats_2(arrays, VECTORS)[1], row)
    row[R_KINETIC], row[R_BENDING] = kinetic_energy(arrays, at), bending_energy(arrays, at)
    row[R_GUIDE] = 0.0
    for guide in range(guides):
        row[R_GUIDE] += 0.5 * compliance[guide] * forces[at, guide] * forces[at, guide]
    row[R_ELASTIC] = course[FACTOR] * tissue_energy(arrays, at) + row[R_GUIDE]
    row[R_INSERTION] = 0.5 * mass * speed * speed
    row[R_TIP] = reached(arrays, at, points - 1)
    row[R_PIECES] = integers_1(arrays, PATH_COUNT)[0] if at != START else 0
    for work in range(LEDGER):
        row[R_WORKS + work] = floats_1(arrays, LEDGER_STATE)[work] if at != START else 0.0
    for i in range(n):
        row[RECORD + i] = q[i]
    for point in range(points):
        row[RECORD + n + point] = forces[at, point]
    for guide in range(guides):  # of a rigid guide the mean over the step, about which its multiplier alternates
        shown = forces[at, guide]
        if switches[INERTIA] and compliance[guide] == 0.0:
            shown = 0.0
            for node in range(count):
                shown += weights[node] * forces[node, guide]
        row[RECORD + n + points + guide] = shown
