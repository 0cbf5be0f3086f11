"""Energies of an instant, and how they change with the depth: the axial force A of the lateral state.

A = dL/dz - d/dt (dT/dv) + drag,   L = T - U,   dT/dv = q'.S q + v q.R q                     (docs/theory.md, "Energy")
"""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, floats_5, integers_1, integers_2
from fem_needle.dynamics.callback import ask
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.cover import locate, place_of, place_rate, shapes_at
from fem_needle.dynamics.instant import beam_at
from fem_needle.dynamics.names import (
    ANSWERED,
    ASK_ENERGY_FORCE,
    ASKED,
    BEAM,
    BENDING_STIFFNESS,
    CENTRIFUGAL,
    COEFFICIENTS,
    CONVECTED,
    CONVECTION,
    COURSES,
    COVERED,
    CUTS,
    DAMPING,
    DEGREE,
    DEPTH,
    DRAG,
    FACTOR,
    FIXED,
    FLEXIBLE,
    FLEXIBLE_RATE,
    FORCES,
    FRAME,
    GIVEN,
    INERTIA,
    KNOWN,
    LAYER,
    LAYER_END,
    LAYER_START,
    LENGTH,
    MASS,
    MASS_PER_LENGTH,
    MODULUS,
    NUMBER,
    PATH_CONSTANTS,
    PATH_LOAD,
    PATH_LOAD_RATE,
    PIECE_NODES,
    POINT_FIRST,
    POINT_RATES,
    RATES,
    SHAPE,
    SIDE,
    SLIP,
    SPEED,
    STRETCH,
    STRETCHED,
    STRIDE,
    SWITCH,
    TIP_STIFFNESS,
    TISSUE,
    TISSUE_BLOCKS,
    VISCOUS,
)
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
    frame, length, depth, stride, total = switches[FRAME], numbers[LENGTH], course[DEPTH], switches[STRIDE], 0.0
    for number in range(layers.shape[0]):
        layer, k = layers[number], layers[number, MODULUS] * course[STRETCH]
        if k == 0.0 or not course[SIDE] > layer[LAYER_START]:
            continue
        moves = place_rate(layer[LAYER_START], depth, frame)
        if moves != 0.0:
            w = value_at(place_of(layer[LAYER_START], depth, frame, length), 0, nodes, coef, stride, shape, q)
            total -= k * moves * w * w
        if course[SIDE] > layer[LAYER_END]:
            moves = place_rate(layer[LAYER_END], depth, frame)
            if moves != 0.0:
                w = value_at(place_of(layer[LAYER_END], depth, frame, length), 0, nodes, coef, stride, shape, q)
                total += k * moves * w * w
        elif frame == FIXED:
            w = value_at(depth, 0, nodes, coef, stride, shape, q)
            total += k * w * w
    if numbers[TIP_STIFFNESS] != 0.0 and frame == FIXED:
        w = value_at(depth, 0, nodes, coef, stride, shape, q)
        total += 2.0 * numbers[TIP_STIFFNESS] * w * along(shape[1], stride * locate(nodes, depth), q)
    return total


@inner
def path_force(arrays, at):
    """Return m (q.dH/dz - dc/dz), what a cut path adds to d(T - U)/dz."""
    if not integers_1(arrays, SWITCH)[CUTS]:
        return 0.0
    moved = along(floats_2(arrays, PATH_LOAD_RATE)[at], 0, floats_2(arrays, KNOWN)[at])
    return floats_2(arrays, COURSES)[at, FACTOR] * (moved - floats_2(arrays, PATH_CONSTANTS)[at, 1])


@inner
def energy_force(arrays, at):
    """Return d(T - U)/dz of an instant at fixed coordinates, velocities and speed."""
    switches, numbers, course = integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), floats_2(arrays, COURSES)[at]
    nodes, coef, shape = floats_1(arrays, PIECE_NODES), floats_3(arrays, COEFFICIENTS), floats_2(arrays, SHAPE)
    q, rate, beams = floats_2(arrays, KNOWN)[at], floats_2(arrays, RATES)[at], floats_5(arrays, BEAM)
    if switches[GIVEN]:
        ask(integers_1(arrays, ASKED)[0], at, ASK_ENERGY_FORCE)
        return floats_1(arrays, ANSWERED)[0] + path_force(arrays, at)
    frame, stretch, stride, speed = switches[FRAME], course[STRETCH], switches[STRIDE], course[SPEED]
    beam, force = beams[beam_at(beams, at)], 0.0
    rise = course[FACTOR] * moving_ends(course, nodes, coef, switches, numbers, floats_2(arrays, LAYER), shape, q)
    if frame == STRETCHED:
        bending = bending_form(beam, stride, switches[DEGREE], numbers[BENDING_STIFFNESS], nodes, q)
        rise -= 3.0 * bending / (stretch * stretch * stretch * stretch)
        if numbers[TIP_STIFFNESS] == 0.0:  # a spring at the tip is not stretched
            tissue, covered = floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at]
            rise += course[FACTOR] * covered_form(tissue, TISSUE, covered, stride, q, q)
        if switches[INERTIA]:
            spin = speed / stretch
            force += 0.5 * form_of(beam, MASS, stride, rate, rate)
            force -= 0.5 * spin * spin * form_of(beam, CENTRIFUGAL, stride, q, q)
    elif frame == FIXED:
        bend = value_at(course[DEPTH], 2, nodes, coef, stride, shape, q)
        rise += numbers[BENDING_STIFFNESS] * bend * bend
        if switches[INERTIA]:
            velocity = value_at(course[DEPTH], 0, nodes, coef, stride, shape, rate)
            if switches[CONVECTED]:
                velocity += speed * along(shape[1], stride * locate(nodes, course[DEPTH]), q)
            force += 0.5 * numbers[MASS_PER_LENGTH] * velocity * velocity
    return force - 0.5 * rise + path_force(arrays, at)


@inner
def contact_force(arrays, at):
    """Return what points and viscous tissue add to the axial force at an instant."""
    switches, course, q = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_2(arrays, KNOWN)[at]
    forces, flexible_rate = floats_2(arrays, FORCES)[at], floats_3(arrays, FLEXIBLE_RATE)[at]
    rates, first = floats_3(arrays, POINT_RATES)[at], integers_2(arrays, POINT_FIRST)[at]
    total = 0.0
    for point in range(len(forces)):
        if forces[point] != 0.0:
            total += forces[point] * along(rates[point], first[point], q)
            for other in range(len(forces)):
                total += 0.5 * forces[point] * flexible_rate[point, other] * forces[other]
    if switches[VISCOUS]:
        tissue, covered, stride = floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at], switches[STRIDE]
        total += covered_form(tissue, DRAG, covered, stride, floats_2(arrays, RATES)[at], q)
        total -= course[SPEED] / course[STRETCH] * covered_form(tissue, SLIP, covered, stride, q, q)
    return total


@inner
def dissipation(arrays, at):
    """Return the power lost in the tissue's viscosity at an instant."""
    switches, course = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at]
    if not switches[VISCOUS]:
        return 0.0
    tissue, covered = floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at]
    q, rate, stride, speed = floats_2(arrays, KNOWN)[at], floats_2(arrays, RATES)[at], switches[STRIDE], course[SPEED]
    power = course[STRETCH] * covered_form(tissue, DAMPING, covered, stride, rate, rate)
    if speed != 0.0:
        power -= 2.0 * speed * covered_form(tissue, DRAG, covered, stride, rate, q)
        power += speed * speed / course[STRETCH] * covered_form(tissue, SLIP, covered, stride, q, q)
    return power


@inner
def axial_momentum(arrays, at):
    """Return dT/dv of an instant."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_5(arrays, BEAM)
    if not (switches[INERTIA] and switches[CONVECTED]):
        return 0.0
    q, stride, beam = floats_2(arrays, KNOWN)[at], switches[STRIDE], beams[beam_at(beams, at)]
    moved = course[SPEED] / course[STRETCH] * form_of(beam, CENTRIFUGAL, stride, q, q)
    return form_of(beam, CONVECTION, stride, floats_2(arrays, RATES)[at], q) + moved


@inner
def kinetic_energy(arrays, at):
    """Return T of an instant."""
    switches, course, beams = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_5(arrays, BEAM)
    if not switches[INERTIA]:
        return 0.0
    q, rate, beam = floats_2(arrays, KNOWN)[at], floats_2(arrays, RATES)[at], beams[beam_at(beams, at)]
    stride, speed = switches[STRIDE], course[SPEED]
    energy = 0.5 * course[STRETCH] * form_of(beam, MASS, stride, rate, rate)
    if switches[CONVECTED] and speed != 0.0:
        energy += speed * form_of(beam, CONVECTION, stride, rate, q)
        energy += 0.5 * speed * speed / course[STRETCH] * form_of(beam, CENTRIFUGAL, stride, q, q)
    return energy


@inner
def bending_energy(arrays, at):
    """Return the bending energy of an instant, kinks at points included."""
    switches, numbers, beams = integers_1(arrays, SWITCH), floats_1(arrays, NUMBER), floats_5(arrays, BEAM)
    stretch, q = floats_2(arrays, COURSES)[at, STRETCH], floats_2(arrays, KNOWN)[at]
    forces, flexible = floats_2(arrays, FORCES)[at], floats_3(arrays, FLEXIBLE)[at]
    beam, nodes = beams[beam_at(beams, at)], floats_1(arrays, PIECE_NODES)
    total = bending_form(beam, switches[STRIDE], switches[DEGREE], numbers[BENDING_STIFFNESS], nodes, q)
    total /= stretch * stretch * stretch
    for point in range(len(forces)):
        for other in range(len(forces)):
            total += forces[point] * flexible[point, other] * forces[other]
    return 0.5 * total


@inner
def tissue_energy(arrays, at):
    """Return 1/2 q.G q - q.H + c of an instant, for a factor of 1."""
    switches, q = integers_1(arrays, SWITCH), floats_2(arrays, KNOWN)[at]
    tissue, covered = floats_5(arrays, TISSUE_BLOCKS)[at], floats_3(arrays, COVERED)[at]
    energy = 0.5 * floats_2(arrays, COURSES)[at, STRETCH] * covered_form(tissue, TISSUE, covered, switches[STRIDE], q, q)
    if switches[CUTS]:
        energy += floats_2(arrays, PATH_CONSTANTS)[at, 0] - along(floats_2(arrays, PATH_LOAD)[at], 0, q)
    return energy
