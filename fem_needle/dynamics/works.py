"""The works of a step: every term is evaluated on its own, nothing is what is missing (docs/theory.md, "Energy").

Products with a rate that is not known are integrated by parts: integral F dw = [F deflection] - integral F' deflection dt.
"""

from __future__ import annotations

from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, integers_1, integers_2
from fem_needle.dynamics.axial import friction_force
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.energy import axial_momentum, contact_force, dissipation, energy_force, tissue_energy
from fem_needle.dynamics.forces import clamp_forces
from fem_needle.dynamics.names import (
    ACCELERATION,
    AXIAL_STATE,
    BOUNDARY,
    CLAMP,
    COURSES,
    DISSIPATION,
    END,
    FACTOR_RATE,
    FLEXIBLE,
    FORCE_RATES,
    FORCES,
    FRICTION_LOSS,
    GUIDES,
    HUB_WORK,
    INERTIA,
    INSTANT_SUMS,
    KNOWN,
    LAST_AXIAL_MOMENTUM,
    LAST_AXIAL_PRODUCT,
    LAST_HUB_PRODUCT,
    LAST_POWER,
    LAST_PRODUCT,
    LATERAL,
    LEDGER_STATE,
    LOAD_WORK,
    MOMENTA,
    NUMBER,
    OWN_DEPTH,
    PAIR,
    POINT_FIRST,
    POINT_ROWS,
    POWER_SLOPES,
    RATES,
    S_CONFIGURATION,
    S_MOMENTUM,
    S_POWER,
    SPEED,
    START,
    SWITCH,
    TISSUE_WORK,
)
from fem_needle.dynamics.points import deflection_at


@inner
def set_sums(arrays, at, is_whole):
    """Set at an instant -(v d(T - U)/dz + v' dT/dv), dT/dv and, where wanted, the axial force without -d(dT/dv)/dt."""
    course, sums = floats_2(arrays, COURSES)[at], floats_2(arrays, INSTANT_SUMS)[at]
    force, momentum = energy_force(arrays, at), axial_momentum(arrays, at)
    sums[S_POWER] = -course[SPEED] * force - course[ACCELERATION] * momentum
    sums[S_MOMENTUM], sums[S_CONFIGURATION] = momentum, force + (contact_force(arrays, at) if is_whole else 0.0)


@inner
def reached(arrays, at, point):
    """Return the deflection at a point at an instant."""
    return deflection_at(
        point, floats_3(arrays, POINT_ROWS)[at], integers_2(arrays, POINT_FIRST)[at], floats_3(arrays, FLEXIBLE)[at],
        floats_2(arrays, KNOWN)[at], floats_2(arrays, FORCES)[at],
    )  # fmt: skip


@inner
def load_product(arrays, at):
    """Return the sum of loads times deflections at their points."""
    forces, total = floats_2(arrays, FORCES)[at], 0.0
    for point in range(integers_1(arrays, SWITCH)[GUIDES], len(forces)):
        if forces[point] != 0.0:
            total += forces[point] * reached(arrays, at, point)
    return total


@inner
def add_node(arrays, at, weight):
    """Add a node's share of the integrals over a step."""
    switches, course, clamp = integers_1(arrays, SWITCH), floats_2(arrays, COURSES)[at], floats_3(arrays, CLAMP)[at]
    ledger, pair, speed = floats_1(arrays, LEDGER_STATE), floats_1(arrays, PAIR), course[SPEED]
    force_rates, momenta = floats_2(arrays, FORCE_RATES)[at], floats_2(arrays, MOMENTA)
    for number in range(len(floats_2(arrays, FORCES)[at]) - switches[GUIDES]):
        if force_rates[number] != 0.0:
            ledger[LOAD_WORK] -= weight * force_rates[number] * reached(arrays, at, switches[GUIDES] + number)
    if course[FACTOR_RATE] != 0.0:
        ledger[TISSUE_WORK] += weight * course[FACTOR_RATE] * tissue_energy(arrays, at)
    ledger[DISSIPATION] += weight * dissipation(arrays, at)
    if clamp[1, 0] != 0.0 or clamp[1, 1] != 0.0:
        clamp_forces(arrays, at, floats_2(arrays, KNOWN)[at], floats_2(arrays, RATES)[at], pair)
        ledger[HUB_WORK] -= weight * (clamp[1, 0] * pair[0] + clamp[1, 1] * pair[1])
    if switches[INERTIA] and (clamp[2, 0] != 0.0 or clamp[2, 1] != 0.0):
        ledger[HUB_WORK] -= weight * (clamp[2, 0] * momenta[at, 0] + clamp[2, 1] * momenta[at, 1])
    if speed != 0.0:
        ledger[BOUNDARY] -= weight * speed * contact_force(arrays, at)
        ledger[FRICTION_LOSS] += weight * speed * friction_force(floats_1(arrays, NUMBER), course[OWN_DEPTH], speed)
    if not switches[INERTIA]:
        ledger[BOUNDARY] += weight * floats_2(arrays, INSTANT_SUMS)[at, S_POWER]


@inner
def add_ends(arrays, h):
    """Add what the ends of a step say: products of loads, of the speed and of the hub, and the trapezoid of the power."""
    axial, ledger, lateral = floats_1(arrays, AXIAL_STATE), floats_1(arrays, LEDGER_STATE), floats_3(arrays, LATERAL)[0]
    sums, clamp, course = floats_2(arrays, INSTANT_SUMS), floats_3(arrays, CLAMP), floats_2(arrays, COURSES)
    product = load_product(arrays, END)
    ledger[LOAD_WORK] += product - axial[LAST_PRODUCT]
    axial[LAST_PRODUCT] = product
    if integers_1(arrays, SWITCH)[INERTIA]:
        moved = course[END, SPEED] * sums[END, S_MOMENTUM]
        ledger[BOUNDARY] += moved - axial[LAST_AXIAL_PRODUCT] + 0.5 * h * (axial[LAST_POWER] + sums[END, S_POWER])
        axial[LAST_AXIAL_PRODUCT], axial[LAST_POWER] = moved, sums[END, S_POWER]
        axial[LAST_AXIAL_MOMENTUM] = sums[END, S_MOMENTUM]
        hub = clamp[END, 1, 0] * lateral[1, 0] + clamp[END, 1, 1] * lateral[1, 1]
        ledger[HUB_WORK] += hub - axial[LAST_HUB_PRODUCT]
        axial[LAST_HUB_PRODUCT] = hub


@inner
def row_correction(arrays, which, h):
    """Return what the first (0) or the last (1) step of a row of equal steps adds to the trapezoid: Euler and Maclaurin."""
    slopes, sums = floats_2(arrays, POWER_SLOPES)[which], floats_2(arrays, INSTANT_SUMS)
    slope = slopes[0] * sums[START, S_POWER] + slopes[1] * sums[0, S_POWER]
    slope += slopes[2] * sums[1, S_POWER] + slopes[3] * sums[END, S_POWER]
    return h / 12.0 * (slope if which == 0 else -slope)
