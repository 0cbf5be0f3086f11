"""Three-stage Gauss collocation (order 6, symplectic, A-stable) for linear systems in momentum form.

    p = M q' + B q + g,    p' = D q' + E q + f

with matrices and vectors that vary in time. The momentum p and q are continuous where the rates of the
coefficients jump, so steps only have to land on those instants.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class Collocation:
    """Nodes c, weights b and matrix a of a collocation method."""

    nodes: np.ndarray
    weights: np.ndarray
    stages: np.ndarray

    @classmethod
    def at(cls, nodes):
        """Collocation at given nodes: a_ij = int_0^(c_i), b_j = int_0^1 of the j-th Lagrange polynomial."""
        nodes = np.array(nodes)
        powers = np.arange(nodes.size)
        lagrange = np.linalg.inv(nodes[:, None] ** powers)  # column j: coefficients of the j-th polynomial
        antiderivative = lagrange / (powers + 1.0)[:, None]
        return cls(nodes, antiderivative.sum(axis=0), nodes[:, None] ** (powers + 1.0) @ antiderivative)


GAUSS = Collocation.at([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
RADAU = Collocation.at([(4.0 - np.sqrt(6.0)) / 10.0, (4.0 + np.sqrt(6.0)) / 10.0, 1.0])
_CHUNK = 64  # steps whose coefficients are computed together


@dataclass(frozen=True)
class Coefficients:
    """M, B, D, E of shape (nt, n, n) and g, f of shape (nt, n) at nt times."""

    mass: np.ndarray
    transport: np.ndarray
    rate: np.ndarray
    state: np.ndarray
    momentum: np.ndarray
    force: np.ndarray

    def part(self, where):
        """The coefficients at some of the times."""
        return Coefficients(*(getattr(self, name)[where] for name in self.__dataclass_fields__))

    def velocity(self, q, p, index=0):
        """q' that belongs to q and p."""
        return np.linalg.solve(self.mass[index], p - self.transport[index] @ q - self.momentum[index])


def step_grid(outputs, kinks, steps_per_second):
    """Starts and lengths of steps that land on all outputs and kinks, and which steps end at an output."""
    inner = [t for t in kinks if outputs[0] < t < outputs[-1]]
    near = 1e-12 * (outputs[-1] - outputs[0])
    landings = list(outputs)
    landings += [t for t in inner if np.min(np.abs(outputs - t)) > near]
    landings = np.unique(landings)
    landings = landings[np.concatenate([[True], np.diff(landings) > near])]
    starts, lengths, ends_at_output = [], [], []
    for a, b in pairwise(landings):
        count = max(1, int(np.ceil((b - a) * steps_per_second - 1e-9)))
        starts.append(a + (b - a) * np.arange(count) / count)
        lengths.append(np.full(count, (b - a) / count))
        ends_at_output += [False] * (count - 1) + [bool(np.min(np.abs(outputs - b)) <= near)]
    return np.concatenate(starts), np.concatenate(lengths), np.array(ends_at_output)


def integrate(method, coefficients, q, p, outputs, kinks, steps_per_second):
    """Return q and p at the outputs, shapes (nt, n) each; ``coefficients(times)`` gives `Coefficients`."""
    starts, lengths, keep = step_grid(outputs, kinks, steps_per_second)
    nodes = np.minimum(method.nodes, 1.0 - 1e-12)  # a stage at the end of a step is before the jump there
    saved = [(q, p)]
    for first in range(0, starts.size, _CHUNK):
        chunk = slice(first, first + _CHUNK)
        h = lengths[chunk]
        stages = coefficients((starts[chunk, None] + h[:, None] * nodes).ravel())
        for advance, stored in zip(_steps(method, stages, h), keep[chunk], strict=True):
            q, p = advance(q, p)
            if stored:
                saved.append((q, p))
    return np.array([pair[0] for pair in saved]), np.array([pair[1] for pair in saved])


def _steps(method, stages, lengths):
    """Yield one function (q, p) -> (q, p) for each step."""
    n = stages.mass.shape[-1]
    m, b, d, e = (a.reshape(-1, 3, n, n) for a in (stages.mass, stages.transport, stages.rate, stages.state))
    g, f = stages.momentum.reshape(-1, 3, n), stages.force.reshape(-1, 3, n)
    h = lengths[:, None, None, None, None]
    block = h * np.einsum("il,sinm->sinlm", method.stages, b) - h * np.einsum("il,slnm->sinlm", method.stages, d)
    block -= h**2 * np.einsum("ij,jl,sjnm->sinlm", method.stages, method.stages, e)
    for i in range(3):
        block[:, i, :, i, :] += m[:, i]
    block = block.reshape(-1, 3 * n, 3 * n)
    for s, step in enumerate(lengths):
        yield _step(method, block[s], b[s], d[s], e[s], g[s], f[s], step)


def _step(method, block, b, d, e, g, f, h):
    def advance(q, p):
        pull = e @ q + f
        right = p - b @ q - g + h * method.stages @ pull
        rate = np.linalg.solve(block, right.ravel()).reshape(3, -1)
        inner = q + h * method.stages @ rate
        force = np.einsum("inm,im->in", d, rate) + np.einsum("inm,im->in", e, inner) + f
        return q + h * method.weights @ rate, p + h * method.weights @ force

    return advance
