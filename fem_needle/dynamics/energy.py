"""Energies of an instant, and how they change with the depth: the axial force A of the lateral state.

A = dL/dz - d/dt (dT/dv) + drag,   L = T - U,   dT/dv = q'.S q + v q.R q                     (docs/theory.md, "Energy")
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.callback import ask
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import locate, place_of, place_rate, shapes_at
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.points import along
from fem_needle.dynamics.products import bending_form, covered_form, form_of


@inner
def value_at(x, order, nodes, coef, stride, shape, q):
    """Return the value (0), slope (1) or curvature (2) of the function with coordinates q at a place."""
    piece = locate(nodes, x)
    shapes_at(coef, nodes, piece, x, shape)
    return along(shape[order], stride * piece, q)


@inner
def moving_ends(course, nodes, coef, switches, numbers, layers, shape, q):
    """Return q.(dG/dz) q of the ends of the layers' parts, which move along the shapes, for a factor of 1."""
    frame, length, depth, stride, total = switches[ix.FRAME], numbers[ix.LENGTH], course[ix.DEPTH], switches[ix.STRIDE], 0.0
    for number in range(layers.shape[0]):
        layer, k = layers[number], layers[number, ix.MODULUS] * course[ix.STRETCH]
        if k == 0.0 or not course[ix.SIDE] > layer[ix.LAYER_START]:
            continue
        moves = place_rate(layer[ix.LAYER_START], depth, frame)
        if moves != 0.0:
            w = value_at(place_of(layer[ix.LAYER_START], depth, frame, length), 0, nodes, coef, stride, shape, q)
            total -= k * moves * w * w
        if course[ix.SIDE] > layer[ix.LAYER_END]:
            moves = place_rate(layer[ix.LAYER_END], depth, frame)
            if moves != 0.0:
                w = value_at(place_of(layer[ix.LAYER_END], depth, frame, length), 0, nodes, coef, stride, shape, q)
                total += k * moves * w * w
        elif frame == ix.FIXED:
            w = value_at(depth, 0, nodes, coef, stride, shape, q)
            total += k * w * w
    if numbers[ix.TIP_STIFFNESS] != 0.0 and frame == ix.FIXED:
        w = value_at(depth, 0, nodes, coef, stride, shape, q)
        total += 2.0 * numbers[ix.TIP_STIFFNESS] * w * along(shape[1], stride * locate(nodes, depth), q)
    return total


@inner
def path_force(arrays, at):
    """Return m (q.dH/dz - dc/dz), what a cut path adds to d(T - U)/dz."""
    if not integers_1(arrays, ix.SWITCH)[ix.CUTS]:
        return 0.0
    moved = along(floats_2(arrays, ix.PATH_LOAD_RATE)[at], 0, floats_2(arrays, ix.KNOWN)[at])
    return floats_2(arrays, ix.COURSES)[at, ix.FACTOR] * (moved - floats_2(arrays, ix.PATH_CONSTANTS)[at, 1])


@inner
def energy_force(arrays, at):
    """Return d(T - U)/dz of an instant at fixed coordinates, velocities and speed."""
    switches, numbers, course = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_2(arrays, ix.COURSES)[at]
    nodes, coef, shape = floats_1(arrays, ix.PIECE_NODES), floats_3(arrays, ix.COEFFICIENTS), floats_2(arrays, ix.SHAPE)
    q, rate, beams = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], floats_5(arrays, ix.BEAM)
    if switches[ix.GIVEN]:
        ask(integers_1(arrays, ix.ASKED)[0], at, ix.ASK_ENERGY_FORCE)
        return floats_1(arrays, ix.ANSWERED)[0] + path_force(arrays, at)
    frame, stretch, stride, speed = switches[ix.FRAME], course[ix.STRETCH], switches[ix.STRIDE], course[ix.SPEED]
    beam, force = beams[beam_at(beams, at)], 0.0
    rise = course[ix.FACTOR] * moving_ends(course, nodes, coef, switches, numbers, floats_2(arrays, ix.LAYER), shape, q)
    if frame == ix.STRETCHED:
        bending = bending_form(beam, stride, switches[ix.DEGREE], numbers[ix.BENDING_STIFFNESS], nodes, q)
        rise -= 3.0 * bending / (stretch * stretch * stretch * stretch)
        if numbers[ix.TIP_STIFFNESS] == 0.0:  # a spring at the tip is not stretched
            tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at]
            rise += course[ix.FACTOR] * covered_form(tissue, ix.TISSUE, covered, stride, q, q)
        if switches[ix.INERTIA]:
            spin = speed / stretch
            force += 0.5 * form_of(beam, ix.MASS, stride, rate, rate)
            force -= 0.5 * spin * spin * form_of(beam, ix.CENTRIFUGAL, stride, q, q)
    elif frame == ix.FIXED:
        bend = value_at(course[ix.DEPTH], 2, nodes, coef, stride, shape, q)
        rise += numbers[ix.BENDING_STIFFNESS] * bend * bend
        if switches[ix.INERTIA]:
            velocity = value_at(course[ix.DEPTH], 0, nodes, coef, stride, shape, rate)
            if switches[ix.CONVECTED]:
                velocity += speed * along(shape[1], stride * locate(nodes, course[ix.DEPTH]), q)
            force += 0.5 * numbers[ix.MASS_PER_LENGTH] * velocity * velocity
    return force - 0.5 * rise + path_force(arrays, at)


@inner
def contact_force(arrays, at):
    """Return what points and viscous tissue add to the axial force at an instant."""
    switches, course, q = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_2(arrays, ix.KNOWN)[at]
    forces, flexible_rate = floats_2(arrays, ix.FORCES)[at], floats_3(arrays, ix.FLEXIBLE_RATE)[at]
    rates, first = floats_3(arrays, ix.POINT_RATES)[at], integers_2(arrays, ix.POINT_FIRST)[at]
    total = 0.0
    for point in range(len(forces)):
        if forces[point] != 0.0:
            total += forces[point] * along(rates[point], first[point], q)
            for other in range(len(forces)):
                total += 0.5 * forces[point] * flexible_rate[point, other] * forces[other]
    if switches[ix.VISCOUS]:
        tissue, covered, stride = floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at], switches[ix.STRIDE]
        total += covered_form(tissue, ix.DRAG, covered, stride, floats_2(arrays, ix.RATES)[at], q)
        total -= course[ix.SPEED] / course[ix.STRETCH] * covered_form(tissue, ix.SLIP, covered, stride, q, q)
    return total


@inner
def dissipation(arrays, at):
    """Return the power lost in the tissue's viscosity at an instant."""
    switches, course = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at]
    if not switches[ix.VISCOUS]:
        return 0.0
    tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at]
    q, rate, stride, speed = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], switches[ix.STRIDE], course[ix.SPEED]
    power = course[ix.STRETCH] * covered_form(tissue, ix.DAMPING, covered, stride, rate, rate)
    if speed != 0.0:
        power -= 2.0 * speed * covered_form(tissue, ix.DRAG, covered, stride, rate, q)
        power += speed * speed / course[ix.STRETCH] * covered_form(tissue, ix.SLIP, covered, stride, q, q)
    return power


@inner
def axial_momentum(arrays, at):
    """Return dT/dv of an instant."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)
    if not (switches[ix.INERTIA] and switches[ix.CONVECTED]):
        return 0.0
    q, stride, beam = floats_2(arrays, ix.KNOWN)[at], switches[ix.STRIDE], beams[beam_at(beams, at)]
    moved = course[ix.SPEED] / course[ix.STRETCH] * form_of(beam, ix.CENTRIFUGAL, stride, q, q)
    return form_of(beam, ix.CONVECTION, stride, floats_2(arrays, ix.RATES)[at], q) + moved


@inner
def kinetic_energy(arrays, at):
    """Return T of an instant."""
    switches, course, beams = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_5(arrays, ix.BEAM)
    if not switches[ix.INERTIA]:
        return 0.0
    q, rate, beam = floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], beams[beam_at(beams, at)]
    stride, speed = switches[ix.STRIDE], course[ix.SPEED]
    energy = 0.5 * course[ix.STRETCH] * form_of(beam, ix.MASS, stride, rate, rate)
    if switches[ix.CONVECTED] and speed != 0.0:
        energy += speed * form_of(beam, ix.CONVECTION, stride, rate, q)
        energy += 0.5 * speed * speed / course[ix.STRETCH] * form_of(beam, ix.CENTRIFUGAL, stride, q, q)
    return energy


@inner
def bending_energy(arrays, at):
    """Return the bending energy of an instant, kinks at points included."""
    switches, numbers, beams = integers_1(arrays, ix.SWITCH), floats_1(arrays, ix.NUMBER), floats_5(arrays, ix.BEAM)
    stretch, q = floats_2(arrays, ix.COURSES)[at, ix.STRETCH], floats_2(arrays, ix.KNOWN)[at]
    forces, flexible = floats_2(arrays, ix.FORCES)[at], floats_3(arrays, ix.FLEXIBLE)[at]
    beam, nodes = beams[beam_at(beams, at)], floats_1(arrays, ix.PIECE_NODES)
    total = bending_form(beam, switches[ix.STRIDE], switches[ix.DEGREE], numbers[ix.BENDING_STIFFNESS], nodes, q)
    total /= stretch * stretch * stretch
    for point in range(len(forces)):
        for other in range(len(forces)):
            total += forces[point] * flexible[point, other] * forces[other]
    return 0.5 * total


@inner
def tissue_energy(arrays, at):
    """Return 1/2 q.G q - q.H + c of an instant, for a factor of 1."""
    switches, q = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.KNOWN)[at]
    tissue, covered = floats_5(arrays, ix.TISSUE_BLOCKS)[at], floats_3(arrays, ix.COVERED)[at]
    energy = (
        0.5 * floats_2(arrays, ix.COURSES)[at, ix.STRETCH] * covered_form(tissue, ix.TISSUE, covered, switches[ix.STRIDE], q, q)
    )
    if switches[ix.CUTS]:
        energy += floats_2(arrays, ix.PATH_CONSTANTS)[at, 0] - along(floats_2(arrays, ix.PATH_LOAD)[at], 0, q)
    return energy
