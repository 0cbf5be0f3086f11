"""The compiled loop of `fem_needle.batch`: an ``entry`` needle in one layer, in its own vibrations (theory: docs/theory.md).

In the vibrations of the stretched part, K_1 phi_i = lambda_i M_1 phi_i, everything but the convection is diagonal:

    P = rho A (z a' + v S a),   P' = rho A (v S^T a' + v^2 / z R a) - (EI lambda / z^3 + k z) a - c (z a' + v D a) + F phi(tip).

The lowest vibrations move, the others follow the force at once: their compliance at the tip is added at the outputs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from fem_needle.batch.columns import (
    AMPLITUDE,
    ARRIVAL,
    DEPTH,
    DURATION,
    FORCE,
    FREQUENCY,
    MASS,
    MODULUS,
    OUTPUT_STEP,
    PHASE,
    SPEED,
    START,
    STIFFNESS,
    TIME_STEP,
    VISCOSITY,
)

# Sums may be reordered; NaN and infinity keep their meaning. Nothing is allocated, so no references are counted.
FAST = {"contract", "reassoc", "nsz"}
ARITHMETIC: dict[str, Any] = {"error_model": "numpy", "fastmath": FAST, "_nrt": False, "no_cfunc_wrapper": True}
INNER = ARITHMETIC | {"no_cpython_wrapper": True}
ENTRANCE = ARITHMETIC | {"cache": True, "nogil": True}


@njit(**INNER)
def _force(run, time):
    """Return the tip force [N]."""
    if run[AMPLITUDE] == 0.0:
        return run[FORCE]
    return run[FORCE] + run[AMPLITUDE] * np.sin(run[FREQUENCY] * time + run[PHASE])


@njit(**INNER)
def _depth(run, time):
    """Return z [m]."""
    return run[DEPTH] + run[SPEED] * min(time, run[ARRIVAL])


@njit(**INNER)
def _release_force(run, roots, tips):
    """Return the tip force [N] that holds the shape which is let go."""
    bending, tissue, compliance = run[STIFFNESS] / run[DEPTH] ** 3, run[MODULUS] * run[DEPTH], 0.0
    for i in range(len(roots)):
        compliance += tips[i] * tips[i] / (bending * roots[i] + tissue)
    return run[START] / compliance


@njit(**INNER)
def _set_vibration(run, roots, tips, outputs):
    """Set the tips of a held needle without damping under a constant force: all its vibrations, turned from output to output."""
    bending, tissue, force = run[STIFFNESS] / run[DEPTH] ** 3, run[MODULUS] * run[DEPTH], run[FORCE]
    away, last = _release_force(run, roots, tips) - force, len(outputs) - 1
    outputs[:] = 0.0
    for i in range(len(roots)):
        stiffness = bending * roots[i] + tissue
        frequency, amplitude = np.sqrt(stiffness / (run[MASS] * run[DEPTH])), tips[i] * tips[i] / stiffness
        cosine, sine = np.cos(frequency * run[OUTPUT_STEP]), np.sin(frequency * run[OUTPUT_STEP])
        real, imaginary = amplitude * away, 0.0
        for output in range(last):
            outputs[output] += amplitude * force + real
            real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        outputs[last] += amplitude * force + amplitude * away * np.cos(frequency * run[DURATION])


@njit(**INNER)
def _start(run, roots, tips, convection, state):
    """Set amplitudes and momenta at t = 0: of a shape that is let go, or of the equilibrium, moving as equilibria do."""
    if not np.isnan(run[START]):
        bending, tissue, force = run[STIFFNESS] / run[DEPTH] ** 3, run[MODULUS] * run[DEPTH], _release_force(run, roots, tips)
        for i in range(convection.shape[0]):
            state[0, i], state[1, i] = force * tips[i] / (bending * roots[i] + tissue), 0.0
        return
    z, force, speed = run[DEPTH], _force(run, 0.0), run[SPEED] if run[ARRIVAL] > 0.0 else 0.0
    count = convection.shape[0]
    for i in range(count):
        bending = run[STIFFNESS] * roots[i] / z**3
        stiffness = bending + run[MODULUS] * z
        state[0, i] = force * tips[i] / stiffness
        rate = -state[0, i] * (run[MODULUS] - 3.0 * bending / z) / stiffness
        state[1, i] = z * speed * rate
    for i in range(count):
        moved = 0.0
        for j in range(count):
            moved += convection[i, j] * state[0, j]
        state[1, i] = run[MASS] * (state[1, i] + speed * moved)


@njit(**INNER)
def _tip(run, time, roots, tips, count, amplitudes):
    """Return the tip deflection [m]: what moves, and the rest at equilibrium."""
    z, moving, resting = _depth(run, time), 0.0, 0.0
    for i in range(count):
        moving += tips[i] * amplitudes[i]
    bending, tissue = run[STIFFNESS] / z**3, run[MODULUS] * z
    for i in range(count, len(roots)):
        resting += tips[i] * tips[i] / (bending * roots[i] + tissue)
    return moving + _force(run, time) * resting


@njit(**INNER)
def _step(run, time, length, speed, roots, tips, convection, centrifugal, drag, method, state, matrix, right):
    """Fill matrix and right-hand side of a step of a collocation method with two stages.

    ``method``: its nodes, A^-1 and b A^-1 (4, 2).
    """
    count, mass, rate = convection.shape[0], run[MASS], 1.0 / length
    early, late = _depth(run, time + method[0, 0] * length), _depth(run, time + method[0, 1] * length)
    first, second = mass * early * rate * rate, mass * late * rate * rate
    for stage in range(2):
        z = late if stage else early
        force = _force(run, time + method[0, stage] * length)
        bending, tissue = run[STIFFNESS] / (z * z * z), run[MODULUS] * z
        known = (method[1 + stage, 0] + method[1 + stage, 1]) * rate
        for other in range(2):  # A^-1 M A^-1 and C A^-1, of every vibration alike
            inertia = method[1 + stage, 0] * method[1, other] * first + method[1 + stage, 1] * method[2, other] * second
            inertia += method[1 + stage, other] * rate * run[VISCOSITY] * z
            for i in range(count):
                matrix[2 * i + stage, 2 * i + other] = inertia
        for i in range(count):
            stiffness = bending * roots[i] + tissue
            matrix[2 * i + stage, 2 * i + stage] += stiffness
            right[2 * i + stage] = force * tips[i] - stiffness * state[0, i] + known * state[1, i]
        if speed != 0.0:
            _add_convection(run, z, speed, rate, stage, convection, centrifugal, drag, method, state, matrix, right)


@njit(**INNER)
def _add_convection(run, z, speed, rate, stage, convection, centrifugal, drag, method, state, matrix, right):
    """Add what moving along the tissue does at a stage: v S - v S^T, - v^2 R and v D."""
    count, mass = convection.shape[0], run[MASS]
    momentum, known = mass * speed, (method[1 + stage, 0] + method[1 + stage, 1]) * rate
    viscous, falling = run[VISCOSITY] * speed, mass * speed * speed / z
    own, other = method[1 + stage, stage] * rate * momentum, method[1 + stage, 1 - stage] * rate * momentum
    for i in range(count):
        row = 2 * i + stage
        for j in range(count):
            here, skew = viscous * drag[i, j] - falling * centrifugal[i, j], convection[i, j] - convection[j, i]
            right[row] -= (here + known * momentum * convection[i, j]) * state[0, j]
            if i == j:
                matrix[row, 2 * j + stage] += here
            else:
                matrix[row, 2 * j + stage] = here + own * skew
                matrix[row, 2 * j + 1 - stage] = other * skew


@njit(**INNER)
def _solve(matrix, right):
    """Replace the right-hand side by the solution, without pivoting."""
    size = len(right)
    for i in range(size):
        inverse = 1.0 / matrix[i, i]
        matrix[i, i] = inverse
        for k in range(i + 1, size):
            share = matrix[k, i] * inverse
            right[k] -= share * right[i]
            for j in range(i + 1, size):
                matrix[k, j] -= share * matrix[i, j]
    for i in range(size - 1, -1, -1):
        total = right[i]
        for j in range(i + 1, size):
            total -= matrix[i, j] * right[j]
        right[i] = total * matrix[i, i]


@njit(**INNER)
def _advance(run, time, length, speed, convection, method, right, state):
    """Extrapolate amplitudes and momenta to the end of a step."""
    count, mass = convection.shape[0], run[MASS]
    first, second = method[3, 0], method[3, 1]
    early, late = _depth(run, time + method[0, 0] * length), _depth(run, time + method[0, 1] * length)
    for i in range(count):
        slow = (method[1, 0] * right[2 * i] + method[1, 1] * right[2 * i + 1]) / length
        fast = (method[2, 0] * right[2 * i] + method[2, 1] * right[2 * i + 1]) / length
        momentum = (1.0 - first - second) * state[1, i] + mass * (first * early * slow + second * late * fast)
        if speed != 0.0:
            for j in range(count):
                mean = (first + second) * state[0, j] + first * right[2 * j] + second * right[2 * j + 1]
                momentum += mass * speed * convection[i, j] * mean
        state[1, i] = momentum
    for i in range(count):
        state[0, i] += first * right[2 * i] + second * right[2 * i + 1]


@njit(**ENTRANCE)
def compute_runs(runs, roots, tips, convection, centrifugal, drag, method, outputs, state, matrix, right):
    """Compute the tips of runs at their outputs; returns the number of time steps.

    Parameters
    ----------
    runs
        A row each (`fem_needle.batch.columns`).
    roots, tips
        lambda_i and phi_i(tip) of all vibrations (all,).
    convection, centrifugal, drag
        S, R, D of those that move (n, n).
    method
        Nodes, A^-1, b A^-1 (4, 2).
    outputs
        Where the tips go (runs, outputs); as many of a row as the run has.
    state, matrix, right
        Work space (2, n), (2 n, 2 n), (2 n,).
    """
    steps, count = 0, convection.shape[0]
    for number in range(runs.shape[0]):
        run = runs[number]
        last = int(np.floor(run[DURATION] / run[OUTPUT_STEP] * (1.0 + 1e-12)))
        if last * run[OUTPUT_STEP] <= run[DURATION] * (1.0 - 1e-12):
            last += 1
        if run[SPEED] == 0.0 and run[VISCOSITY] == 0.0 and run[AMPLITUDE] == 0.0 and not np.isnan(run[START]):
            _set_vibration(run, roots, tips, outputs[number, : last + 1])
            continue
        _start(run, roots, tips, convection, state)
        outputs[number, 0] = _tip(run, 0.0, roots, tips, count, state[0])
        for output in range(1, last + 1):
            time, until = (output - 1) * run[OUTPUT_STEP], min(output * run[OUTPUT_STEP], run[DURATION])
            while count and time < until:
                end = run[ARRIVAL] if time < run[ARRIVAL] * (1.0 - 1e-12) and run[ARRIVAL] < until else until
                parts = max(1, int(np.ceil((end - time) / run[TIME_STEP] - 1e-9)))
                speed = run[SPEED] if 0.5 * (time + end) < run[ARRIVAL] else 0.0
                length = (end - time) / parts
                matrix[:, :] = 0.0
                for part in range(parts):
                    begin = time + part * length
                    _step(run, begin, length, speed, roots, tips, convection, centrifugal, drag, method, state, matrix, right)
                    _solve(matrix, right)
                    _advance(run, begin, length, speed, convection, method, right, state)
                steps += parts
                time = end
            outputs[number, output] = _tip(run, until, roots, tips, count, state[0])
    return steps
