"""What is kept of an output: energies, reactions and works at the end of a step, or at the start of the first one."""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1
from fem_needle.dynamics.axial import cutting_force, friction_force
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.energy import bending_energy, kinetic_energy, tissue_energy
from fem_needle.dynamics.forces import add_tissue_forces, clamp_forces
from fem_needle.dynamics.guides import ends_at_node
from fem_needle.dynamics.points import along
from fem_needle.dynamics.works import reached


@inner
def axial_force(arrays, at, count, h):
    """Return A at the end or the start of a step: dT/dv is differentiated on the step's own polynomial."""
    switches, sums = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.INSTANT_SUMS)
    slopes = floats_2(arrays, ix.METHOD)[ix.START_SLOPE if at == ix.START else ix.END_SLOPE]
    if not switches[ix.AXIAL_ACTS]:
        return 0.0
    force = sums[at, ix.S_CONFIGURATION]
    if switches[ix.INERTIA]:
        for node in range(count):
            force -= slopes[node] / h * (sums[node, ix.S_MOMENTUM] - sums[ix.START, ix.S_MOMENTUM])
    return force


@inner
def set_reactions(arrays, at, count, h, velocity, row):
    """Set the tissue's force, and force and moment of the clamp; ``velocity``: rates of the coordinates."""
    switches, numbers, course = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_2(arrays, ix.COURSES)[at]
    q, forces, momenta = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.FORCES)[at], floats_2(arrays, ix.MOMENTA)
    pair, total, one = floats_1(arrays, ix.PAIR), floats_2(arrays, ix.VECTORS)[0], floats_1(arrays, ix.ONE)
    slopes = floats_2(arrays, ix.METHOD)[ix.START_SLOPE if at == ix.START else ix.END_SLOPE]
    total[:] = 0.0
    add_tissue_forces(
        course, floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at], switches, q, velocity, total
    )
    row[ix.R_TISSUE] = along(total, 0, one)
    if switches[ix.CUTS]:
        row[ix.R_TISSUE] += course[ix.FACTOR] * along(floats_2(arrays, ix.PATH_LOAD)[at], 0, one)
    clamp_forces(arrays, at, q, velocity, pair)
    for c in range(2):
        pair[c] = -pair[c]
        if switches[ix.INERTIA]:
            for node in range(count):
                pair[c] += slopes[node] / h * (momenta[node, c] - momenta[ix.START, c])
    row[ix.R_HUB], row[ix.R_MOMENT] = pair[0], 0.0 if switches[ix.TURNS] else pair[1] * course[ix.STRETCH]
    if course[ix.OWN_DEPTH] < numbers[ix.SMALLEST_DEPTH]:  # the surface carries the tip force of a needle that is hardly inserted
        row[ix.R_HUB], row[ix.R_MOMENT] = -forces[len(forces) - 1], 0.0


@inner
def shown_velocity(arrays, at, count, h):
    """Set the rates of the coordinates in the second work vector: without inertia those of the step's own polynomial."""
    known, velocity, rates = floats_2(arrays, ix.KNOWN), floats_2(arrays, ix.VECTORS)[1], floats_2(arrays, ix.RATES)
    slopes = floats_2(arrays, ix.METHOD)[ix.START_SLOPE if at == ix.START else ix.END_SLOPE]
    for i in range(len(velocity)):
        velocity[i] = rates[at, i]
        if not integers_1(arrays, ix.SWITCH)[ix.INERTIA]:
            velocity[i] = 0.0
            for node in range(count):
                velocity[i] += slopes[node] / h * (known[node, i] - known[ix.START, i])


@inner
def keep_rates(arrays, at, count, h, row):
    """Set the rates of the coordinates, which the second work vector holds, and with inertia their accelerations."""
    velocity, rates = floats_2(arrays, ix.VECTORS)[1], floats_2(arrays, ix.RATES)
    slopes = floats_2(arrays, ix.METHOD)[ix.START_SLOPE if at == ix.START else ix.END_SLOPE]
    n = len(velocity)
    first = ix.RECORD + n + floats_2(arrays, ix.FORCES).shape[1] + integers_1(arrays, ix.SWITCH)[ix.GUIDES]
    for i in range(n):
        row[first + i], acceleration = velocity[i], 0.0
        if integers_1(arrays, ix.SWITCH)[ix.INERTIA]:
            for node in range(count):
                acceleration += slopes[node] / h * (rates[node, i] - rates[ix.START, i])
        row[first + n + i] = acceleration


@inner
def keep_output(arrays, at, count, h, deepest, row):
    """Set a row of the record from an instant, the end or the start of a step of length h with ``count`` nodes."""
    switches, numbers, course = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_2(arrays, ix.COURSES)[at]
    forces, q, compliance = floats_2(arrays, ix.FORCES), floats_2(arrays, ix.KNOWN)[at], floats_1(arrays, ix.COMPLIANCE)
    n, points, guides, weights = len(q), forces.shape[1], switches[ix.GUIDES], floats_2(arrays, ix.METHOD)[ix.WEIGHTS]
    depth, speed, mass = course[ix.OWN_DEPTH], course[ix.SPEED], numbers[ix.MASS_PER_LENGTH] * numbers[ix.LENGTH]
    row[ix.R_TIME], row[ix.R_DEPTH], row[ix.R_SPEED] = course[ix.TIME], depth, speed
    row[ix.R_FRICTION] = friction_force(numbers, depth, speed)
    row[ix.R_AXIAL] = axial_force(arrays, at, count, h)
    row[ix.R_PUSH] = mass * course[ix.ACCELERATION] + row[ix.R_FRICTION] - row[ix.R_AXIAL]
    row[ix.R_CUTTING] = cutting_force(floats_2(arrays, ix.LAYER), depth, speed, deepest)
    row[ix.R_PUSH] += row[ix.R_CUTTING]
    shown_velocity(arrays, at, count, h)
    set_reactions(arrays, at, count, h, floats_2(arrays, ix.VECTORS)[1], row)
    keep_rates(arrays, at, count, h, row)
    row[ix.R_KINETIC], row[ix.R_BENDING] = kinetic_energy(arrays, at), bending_energy(arrays, at)
    row[ix.R_GUIDE] = 0.0
    for guide in range(guides):
        row[ix.R_GUIDE] += 0.5 * compliance[guide] * forces[at, guide] * forces[at, guide]
    row[ix.R_ELASTIC] = course[ix.FACTOR] * tissue_energy(arrays, at) + row[ix.R_GUIDE]
    row[ix.R_INSERTION] = 0.5 * mass * speed * speed
    row[ix.R_TIP] = reached(arrays, at, points - 1)
    row[ix.R_PIECES] = integers_1(arrays, ix.PATH_COUNT)[0] if at != ix.START else 0
    for work in range(ix.LEDGER):
        row[ix.R_WORKS + work] = floats_1(arrays, ix.LEDGER_STATE)[work] if at != ix.START else 0.0
    for i in range(n):
        row[ix.RECORD + i] = q[i]
    for point in range(points):
        row[ix.RECORD + n + point] = forces[at, point]
    for guide in range(guides):  # of a rigid guide the mean over the step, about which its multiplier alternates
        shown = forces[at, guide]
        if switches[ix.INERTIA] and compliance[guide] == 0.0 and not ends_at_node(arrays, count):
            shown = 0.0
            for node in range(count):
                shown += weights[node] * forces[node, guide]
        row[ix.RECORD + n + points + guide] = shown
