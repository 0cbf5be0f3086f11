"""The works of a step: every term is evaluated on its own, nothing is what is missing (docs/theory.md, "Energy").

Products with a rate that is not known are integrated by parts: integral F dw = [F deflection] - integral F' deflection dt.
"""

from __future__ import annotations

from fem_needle.dynamics import names as ix
from fem_needle.dynamics.arrays import floats_1, floats_2, floats_3, integers_1, integers_2
from fem_needle.dynamics.axial import friction_force
from fem_needle.dynamics.compilation import inner
from fem_needle.dynamics.energy import axial_momentum, contact_force, dissipation, energy_force, tissue_energy
from fem_needle.dynamics.forces import clamp_forces
from fem_needle.dynamics.points import deflection_at


@inner
def set_sums(arrays, at, is_whole):
    """Set at an instant -(v d(T - U)/dz + v' dT/dv), dT/dv and, where wanted, the axial force without -d(dT/dv)/dt."""
    course, sums = floats_2(arrays, ix.COURSES)[at], floats_2(arrays, ix.INSTANT_SUMS)[at]
    force, momentum = energy_force(arrays, at), axial_momentum(arrays, at)
    sums[ix.S_POWER] = -course[ix.SPEED] * force - course[ix.ACCELERATION] * momentum
    sums[ix.S_MOMENTUM], sums[ix.S_CONFIGURATION] = momentum, force + (contact_force(arrays, at) if is_whole else 0.0)


@inner
def reached(arrays, at, point):
    """Return the deflection at a point at an instant."""
    return deflection_at(
        point, floats_3(arrays, ix.POINT_ROWS)[at], integers_2(arrays, ix.POINT_FIRST)[at], floats_3(arrays, ix.FLEXIBLE)[at],
        floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.FORCES)[at],
    )  # fmt: skip


@inner
def load_product(arrays, at):
    """Return the sum of loads times deflections at their points."""
    forces, total = floats_2(arrays, ix.FORCES)[at], 0.0
    for point in range(integers_1(arrays, ix.SWITCH)[ix.GUIDES], len(forces)):
        if forces[point] != 0.0:
            total += forces[point] * reached(arrays, at, point)
    return total


@inner
def add_node(arrays, at, weight):
    """Add a node's share of the integrals over a step."""
    switches, course, clamp = integers_1(arrays, ix.SWITCH), floats_2(arrays, ix.COURSES)[at], floats_3(arrays, ix.CLAMP)[at]
    ledger, pair, speed = floats_1(arrays, ix.LEDGER_STATE), floats_1(arrays, ix.PAIR), course[ix.SPEED]
    force_rates, momenta = floats_2(arrays, ix.FORCE_RATES)[at], floats_2(arrays, ix.MOMENTA)
    for number in range(len(floats_2(arrays, ix.FORCES)[at]) - switches[ix.GUIDES]):
        if force_rates[number] != 0.0:
            ledger[ix.LOAD_WORK] -= weight * force_rates[number] * reached(arrays, at, switches[ix.GUIDES] + number)
    if course[ix.FACTOR_RATE] != 0.0:
        ledger[ix.TISSUE_WORK] += weight * course[ix.FACTOR_RATE] * tissue_energy(arrays, at)
    ledger[ix.DISSIPATION] += weight * dissipation(arrays, at)
    if clamp[1, 0] != 0.0 or clamp[1, 1] != 0.0:
        clamp_forces(arrays, at, floats_2(arrays, ix.KNOWN)[at], floats_2(arrays, ix.RATES)[at], pair)
        ledger[ix.HUB_WORK] -= weight * (clamp[1, 0] * pair[0] + clamp[1, 1] * pair[1])
    if switches[ix.INERTIA] and (clamp[2, 0] != 0.0 or clamp[2, 1] != 0.0):
        ledger[ix.HUB_WORK] -= weight * (clamp[2, 0] * momenta[at, 0] + clamp[2, 1] * momenta[at, 1])
    if speed != 0.0:
        ledger[ix.BOUNDARY] -= weight * speed * contact_force(arrays, at)
        ledger[ix.FRICTION_LOSS] += weight * speed * friction_force(floats_1(arrays, ix.NUMBER), course[ix.OWN_DEPTH], speed)
    if not switches[ix.INERTIA]:
        ledger[ix.BOUNDARY] += weight * floats_2(arrays, ix.INSTANT_SUMS)[at, ix.S_POWER]


@inner
def add_ends(arrays, h):
    """Add what the ends of a step say: products of loads, of the speed and of the hub, and the trapezoid of the power."""
    axial, ledger, lateral = floats_1(arrays, ix.AXIAL_STATE), floats_1(arrays, ix.LEDGER_STATE), floats_3(arrays, ix.LATERAL)[0]
    sums, clamp, course = floats_2(arrays, ix.INSTANT_SUMS), floats_3(arrays, ix.CLAMP), floats_2(arrays, ix.COURSES)
    product = load_product(arrays, ix.END)
    ledger[ix.LOAD_WORK] += product - axial[ix.LAST_PRODUCT]
    axial[ix.LAST_PRODUCT] = product
    if integers_1(arrays, ix.SWITCH)[ix.INERTIA]:
        moved = course[ix.END, ix.SPEED] * sums[ix.END, ix.S_MOMENTUM]
        ledger[ix.BOUNDARY] += moved - axial[ix.LAST_AXIAL_PRODUCT] + 0.5 * h * (axial[ix.LAST_POWER] + sums[ix.END, ix.S_POWER])
        axial[ix.LAST_AXIAL_PRODUCT], axial[ix.LAST_POWER] = moved, sums[ix.END, ix.S_POWER]
        axial[ix.LAST_AXIAL_MOMENTUM] = sums[ix.END, ix.S_MOMENTUM]
        hub = clamp[ix.END, 1, 0] * lateral[1, 0] + clamp[ix.END, 1, 1] * lateral[1, 1]
        ledger[ix.HUB_WORK] += hub - axial[ix.LAST_HUB_PRODUCT]
        axial[ix.LAST_HUB_PRODUCT] = hub


@inner
def row_correction(arrays, which, h):
    """Return what the first (0) or the last (1) step of a row of equal steps adds to the trapezoid: Euler and Maclaurin."""
    slopes, sums = floats_2(arrays, ix.POWER_SLOPES)[which], floats_2(arrays, ix.INSTANT_SUMS)
    slope = slopes[0] * sums[ix.START, ix.S_POWER] + slopes[1] * sums[0, ix.S_POWER]
    slope += slopes[2] * sums[1, ix.S_POWER] + slopes[3] * sums[ix.END, ix.S_POWER]
    return h / 12.0 * (slope if which == 0 else -slope)
