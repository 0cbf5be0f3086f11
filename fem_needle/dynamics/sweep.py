"""Elimination along a beam of elements, from the tip to the clamp, with bending as a flexibility.

An element of length e carries shear force and moment p = (V, M) at its second node; its two nodes obey

    u_2 = T u_1 + F p - c,   T = [1 e; 0 1],   F = [e^3/3 e^2/2; e^2/2 e] / EI,

and the balance at the nodes takes +p at the second and -T' p at the first. Everything else (tissue, mass, damping) is a matrix G
of the element's own coordinates, from which the bubble is eliminated first. With (A, g) what is left at node 2 of all that lies
behind it, A' = A + G_22,

    (I + F A') u_2 = (T - F G_21) u_1 + F g - c          ->  u_2 = X u_1 + Y
    A_1 = G_11 + G_12 X + T' (A' X + G_21),   g_1 = f_1 + T' (g - A' Y) - G_12 Y.

Nothing is divided by e: rounding costs an element one digit of the deflection, not (l / e)^3 of them. ``width`` unknowns stand
for each coordinate: 1 of an equilibrium, 2 (the stages) of a time step; unknown s of a coordinate is at width - 1 - s. Matrices
of nodes are small, their size is known to the compiler: functions are made for a width. No pivots: docs/theory.md, "In one call".
"""

from __future__ import annotations

from typing import Any

from fem_needle.dynamics.compilation import inner


def _inverse_of(size: int) -> Any:
    """Return the function that replaces a matrix of a size by its inverse, Gauss and Jordan without pivots."""

    @inner
    def invert(a):
        for k in range(size):
            pivot = 1.0 / a[k, k]
            a[k, k] = 1.0
            for j in range(size):
                a[k, j] *= pivot
            for i in range(size):
                if i != k:
                    share = a[i, k]
                    a[i, k] = 0.0
                    for j in range(size):
                        a[i, j] -= share * a[k, j]

    return invert


def _bubble_product_of(width: int) -> Any:
    """Return the function that replaces a bubble's values by its inverse matrix times them."""
    bubble = 2 * width

    @inner
    def multiply(a, x):
        if width == 1:
            x[bubble] *= a[bubble, bubble]
        else:
            one, other = x[bubble], x[bubble + 1]
            x[bubble] = a[bubble, bubble] * one + a[bubble, bubble + 1] * other
            x[bubble + 1] = a[bubble + 1, bubble] * one + a[bubble + 1, bubble + 1] * other

    return multiply


def _condensation_of(width: int) -> Any:
    """Return the function that eliminates an element's bubble: its inverse and its answer to the others stay in the matrix."""
    bubble, invert = 2 * width, _inverse_of(width)

    @inner
    def condense(a):
        invert(a[bubble : bubble + width, bubble : bubble + width])
        for j in range(a.shape[1]):
            if j < bubble or j >= bubble + width:
                if width == 1:
                    a[bubble, j] *= a[bubble, bubble]
                else:
                    one, other = a[bubble, j], a[bubble + 1, j]
                    a[bubble, j] = a[bubble, bubble] * one + a[bubble, bubble + 1] * other
                    a[bubble + 1, j] = a[bubble + 1, bubble] * one + a[bubble + 1, bubble + 1] * other
        for i in range(a.shape[0]):
            if i < bubble or i >= bubble + width:
                for k in range(bubble, bubble + width):
                    share = a[i, k]
                    for j in range(bubble):
                        a[i, j] -= share * a[k, j]
                    for j in range(bubble + width, a.shape[1]):
                        a[i, j] -= share * a[k, j]

    return condense


def _transfer_of(width: int) -> Any:
    """Return the function that sets A' (in carry), I + F A' (in inverse) and T - F G_21 (in x) of an element of length e."""
    size = 2 * width

    @inner
    def transfer(e, stiffness, a, behind, x, inverse, carry):
        right = a.shape[0] - size
        for i in range(size):
            for j in range(size):
                carry[i, j] = behind[i, j] + a[right + i, right + j]
        for s in range(width):
            f0 = e * e * e / (3.0 * stiffness[s])
            f1, f2 = e * e / (2.0 * stiffness[s]), e / stiffness[s]
            w, t = width - 1 - s, 2 * width - 1 - s
            for j in range(size):
                inverse[w, j] = f0 * carry[w, j] + f1 * carry[t, j]
                inverse[t, j] = f1 * carry[w, j] + f2 * carry[t, j]
                x[w, j] = -f0 * a[right + w, j] - f1 * a[right + t, j]
                x[t, j] = -f1 * a[right + w, j] - f2 * a[right + t, j]
            x[w, w] += 1.0
            x[w, t] += e
            x[t, t] += 1.0
        for i in range(size):
            inverse[i, i] += 1.0

    return transfer


def _node_of(width: int) -> Any:
    """Return the function that sets X, A_1 and, in carry, T' A' + G_12, from what `_transfer_of` has set."""
    size = 2 * width

    @inner
    def pass_on(e, a, x, inverse, carry, target):  # noqa: PLR0912 (loops over small matrices)
        right = a.shape[0] - size
        for i in range(size):
            for j in range(size):
                total = 0.0
                for k in range(size):
                    total += inverse[i, k] * x[k, j]
                target[i, j] = total
        for i in range(size):
            for j in range(size):
                x[i, j] = target[i, j]
        for i in range(size):  # A' X + G_21
            for j in range(size):
                total = a[right + i, j]
                for k in range(size):
                    total += carry[i, k] * x[k, j]
                target[i, j] = total
        for s in range(width):  # T' of it, and T' A'
            for j in range(size):
                target[2 * width - 1 - s, j] += e * target[width - 1 - s, j]
                carry[2 * width - 1 - s, j] += e * carry[width - 1 - s, j]
        for i in range(size):
            for j in range(size):
                total = target[i, j] + a[i, j]
                for k in range(size):
                    total += a[i, right + k] * x[k, j]
                target[i, j] = total
                carry[i, j] += a[i, right + j]

    return pass_on


def _backward_of(width: int) -> Any:
    """Return the function that turns an element's loads into Y, in the second node's place, and what is left to the first."""
    size, bubble, multiply = 2 * width, 2 * width, _bubble_product_of(width)

    @inner
    def carry_back(e, stiffness, a, inverse, carry, gap, x):
        right = a.shape[0] - size
        if right > size:
            multiply(a, x)
            for k in range(bubble, bubble + width):
                for i in range(size):
                    x[i] -= a[i, k] * x[k]
                    x[right + i] -= a[right + i, k] * x[k]
        g = x[right:]
        for s in range(width):  # T' g to the first node; F g - c
            w, t = width - 1 - s, 2 * width - 1 - s
            x[w] += g[w]
            x[t] += e * g[w] + g[t]
            f1 = e * e / (2.0 * stiffness[s])
            moved = e * e * e / (3.0 * stiffness[s]) * g[w] + f1 * g[t] - gap[w]
            g[t] = f1 * g[w] + e / stiffness[s] * g[t] - gap[t]
            g[w] = moved
        if width == 1:
            g0, g1 = g[0], g[1]
            g[0] = inverse[0, 0] * g0 + inverse[0, 1] * g1
            g[1] = inverse[1, 0] * g0 + inverse[1, 1] * g1
        else:
            g0, g1, g2, g3 = g[0], g[1], g[2], g[3]
            for i in range(4):
                g[i] = inverse[i, 0] * g0 + inverse[i, 1] * g1 + inverse[i, 2] * g2 + inverse[i, 3] * g3
        for i in range(size):
            total = 0.0
            for k in range(size):
                total += carry[i, k] * g[k]
            x[i] -= total

    return carry_back


def _forward_of(width: int) -> Any:
    """Return the function that completes an element's second node, u_2 = X u_1 + Y, and its bubble."""
    size, bubble = 2 * width, 2 * width

    @inner
    def carry_on(a, shift, x):
        right = a.shape[0] - size
        for i in range(size):
            total = x[right + i]
            for k in range(size):
                total += shift[i, k] * x[k]
            x[right + i] = total
        if right > size:
            for k in range(bubble, bubble + width):
                total = x[k]
                for j in range(size):
                    total -= a[k, j] * x[j] + a[k, right + j] * x[right + j]
                x[k] = total

    return carry_on


def _clamp_of(width: int) -> Any:
    """Return the function that solves at the clamp: a hub that turns has a free angle."""

    @inner
    def hold(clamped, free, values):
        for i in range(width):
            values[i] = 0.0
            if clamped == 2:
                values[width + i] = 0.0
        if clamped == 1:
            if width == 1:
                values[1] *= free[1, 1]
            else:
                one, other = values[2], values[3]
                values[2] = free[2, 2] * one + free[2, 3] * other
                values[3] = free[3, 2] * one + free[3, 3] * other

    return hold


def sweep_of(width: int) -> tuple[Any, Any]:
    """Return the functions that eliminate and solve with so many unknowns for each coordinate.

    Returns
    -------
    eliminate(last, clamped, nodes, stiffness, matrices, is_new, node, shares)
        Eliminates bubbles of the elements' matrices (B, width m, width m) that are new, and goes from element ``last`` to the
        clamp; node (B + 1, k, k), k = 2 width, gets A of every node and, of the clamp, the free part's inverse; shares
        (B, 3, k, k) X, the inverse of I + F A', and T' A' + G_12.
    solve(clamped, nodes, stiffness, matrices, node, shares, gaps, values)
        Replaces a right-hand side (width n,) by the solution; gaps (B, k): c.
    """
    size, invert, invert_free = 2 * width, _inverse_of(2 * width), _inverse_of(width)
    condense, transfer, pass_on = _condensation_of(width), _transfer_of(width), _node_of(width)
    carry_back, carry_on, hold = _backward_of(width), _forward_of(width), _clamp_of(width)

    @inner
    def eliminate(last, clamped, nodes, stiffness, matrices, is_new, node, shares):
        if last == matrices.shape[0] - 1:
            node[last + 1, :, :] = 0.0
        for element in range(last, -1, -1):
            a, e, share = matrices[element], nodes[element + 1] - nodes[element], shares[element]
            if is_new[element] and a.shape[0] > 2 * size:
                condense(a)
            transfer(e, stiffness, a, node[element + 1], share[0], share[1], share[2])
            invert(share[1])
            pass_on(e, a, share[0], share[1], share[2], node[element])
        if clamped == 1:
            invert_free(node[0][width:, width:])

    @inner
    def solve(clamped, nodes, stiffness, matrices, node, shares, gaps, values):
        step = matrices.shape[1] - size
        for element in range(matrices.shape[0] - 1, -1, -1):
            at, e, share = step * element, nodes[element + 1] - nodes[element], shares[element]
            x = values[at : at + step + size]
            carry_back(e, stiffness, matrices[element], share[1], share[2], gaps[element], x)
        hold(clamped, node[0], values)
        for element in range(matrices.shape[0]):
            at = step * element
            carry_on(matrices[element], shares[element, 0], values[at : at + step + size])

    return eliminate, solve


eliminate_one, solve_one = sweep_of(1)
eliminate_two, solve_two = sweep_of(2)
