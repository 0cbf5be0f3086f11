"""Reference for `entry` and `hub`, straight rest line or cut path: polynomials on pieces, Gauss or Radau collocation in time.

Where the tip stays beyond a layer's border for the rest of the run, the border becomes a break: the old solution is a polynomial
on both new pieces, so nothing is lost. So is the depth at which a cut path begins, where the rest line jumps.
"""


import numpy as np
from scipy.linalg.lapack import dgesv

from fem_needle.scene.time_functions import as_function
from tests.references.cut_path import CutMemory
from tests.references.gauss import GAUSS, RADAU, Coefficients, step_grid
from tests.references.piecewise_needle import PiecewiseNeedle, local_functions
from tests.references.scenes import Loading

ROOM = 0.003  # m between the tip and a border that becomes a break


class Motor:
    """Coefficients of a needle on one set of pieces."""

    def __init__(self, scene, breaks, degree):
        self.scene, self.loading = scene, Loading(scene)
        self.needle = PiecewiseNeedle(scene, breaks, degree)
        self.hub = [as_function(scene.support.hub_deflection), as_function(scene.support.hub_angle)]
        self.own, size = self.needle.own, self.needle.size
        self.tip = int(np.flatnonzero(self.own == self.needle.tip)[0])
        self.held = np.setdiff1d(np.arange(size), self.own)

    def hub_motion(self, time):
        """All prescribed coordinates and their rates, shape (nt, h)."""
        value, rate = np.zeros((2, time.size, self.held.size))
        if self.scene.support.kind == "hub":
            for column, function in enumerate(self.hub):
                value[:, column], rate[:, column] = function.value(time), function.derivative(time)
        return value, rate

    def loads(self, time, depth):
        """Forces on all coordinates, shape (nt, n)."""
        total = np.zeros((time.size, self.needle.size))
        total[:, self.needle.tip] = self.loading.tip_force(time, depth)
        for load in self.loading.laterals:
            total[:, self.needle.node(load.position)] += as_function(load.force).value(time)
        return total

    def stages(self, time, depth, speed, found=None):
        """Coefficients at instants; the operators there may be given."""
        found = found or self.needle.operators(depth, self.loading.factor.value(time))
        v = speed[:, None, None]
        transport = v * found.transport
        rate = transport.swapaxes(1, 2) - found.damping
        state = v**2 * found.convective - found.stiffness - v * found.sliding
        hub, hub_rate = self.hub_motion(time)
        momentum = _held(found.mass, hub_rate, self) + _held(transport, hub, self)
        force = self.loads(time, depth)[:, self.own] + _held(rate, hub_rate, self) + _held(state, hub, self)
        own = np.ix_(range(time.size), self.own, self.own)
        return Coefficients(found.mass[own], transport[own], rate[own], state[own], momentum, force)

    def start(self, depth, speed):
        """q and p at t = 0; the rate is that of statics in a straight rest line, as the theory page has it."""
        initial, zero, own = self.scene.initial, np.zeros(1), self.own
        hub = self.hub_motion(zero)[0][0]
        one = self.needle.operators(np.array([depth + 1e-30j]), self.loading.factor.value(zero))
        stiffness = one.stiffness[0]
        if initial.shape == "straight":
            return self.straight(depth, hub), np.zeros(own.size)
        clamp = -stiffness[np.ix_(own, self.held)] @ hub
        if initial.shape == "tip-displaced":
            right = np.stack([np.eye(own.size)[self.tip], clamp.real], axis=1)
            unit, shape = np.linalg.solve(stiffness[np.ix_(own, own)].real, right).T
            return shape + unit * (initial.tip_deflection - shape[self.tip]) / unit[self.tip], np.zeros(own.size)
        right = self.loads(zero, np.array([depth]))[0, own] + clamp
        q = np.linalg.solve(stiffness[np.ix_(own, own)], right).real
        slope = np.linalg.solve(stiffness[np.ix_(own, own)], right).imag / 1e-30
        every = self.complete(zero, q[None])[0]
        p = one.mass[0][np.ix_(own, own)].real @ slope + one.transport[0][own].real @ every
        return q, speed * p

    def straight(self, depth, hub):
        """A straight line from the hub."""
        every = np.zeros(self.needle.size)
        if self.scene.support.kind == "hub":
            for number, y in enumerate([depth - self.needle.length, *self.needle.breaks, depth]):
                every[2 * number : 2 * number + 2] = hub[0] + hub[1] * (y - depth + self.needle.length), hub[1]
        return every[self.own]

    def complete(self, time, q):
        """All coordinates, shape (nt, n)."""
        every = np.zeros((time.size, self.needle.size))
        every[:, self.own], every[:, self.held] = q, self.hub_motion(time)[0]
        return every


def _held(matrix, values, motor):
    return np.einsum("tij,tj->ti", matrix[:, motor.own][:, :, motor.held], values)


def transferred(old, new, state, instant):
    """Return q and p of the old pieces on the new ones, at (time, depth, speed)."""
    (q, p), (time, depth, speed) = state, instant
    when, there = np.array([time]), np.array([depth])
    at = old.stages(when, there, np.array([speed]))
    every = old.complete(when, q[None])[0]
    change = np.zeros(old.needle.size)
    change[old.own] = np.linalg.solve(at.mass[0], p - at.transport[0] @ q - at.momentum[0])
    change[old.held] = old.hub_motion(when)[1][0]
    result, momentum = np.zeros(new.needle.size), np.zeros(new.needle.size)
    for number, piece in enumerate(new.needle.pieces):
        start, end = (float(y) for y in piece.ends(depth, old.needle.length))
        y = start + (end - start) * new.needle.nodes
        rows = old.needle.at(y[None], there)[0]
        velocity = rows @ change + speed * old.needle.at(y[None], there, rate=True)[0] @ every
        edges = old.needle.at(np.array([[start, start * (1 - 1e-15) + 1e-15 * end, end]]), there)[0] @ every
        values = local_functions(new.needle.nodes, piece.index.size)[0]
        values[:, [1, 3]] *= end - start
        result[piece.index] = np.linalg.lstsq(values, rows @ every, rcond=None)[0]
        result[2 * number] = edges[0]
        weight = old.scene.needle.mass_per_length * (end - start) * new.needle.weights
        momentum[piece.index] += values.T @ (weight * velocity)
    return result[new.own], momentum[new.own]


def collocate(method, at, coupling, h, state):
    """One step of p = M q' + B q + g, p' = D q' + E q + f + sum_j coupling_ij (tip of stage j): q, p, stages' q, stages' q'.

    ``coupling`` is (3, 3, n, n) or None.
    """
    q, p = state
    a, n = h * method.stages, q.size
    block = a[:, None, :, None] * (at.transport[:, :, None] - at.rate.swapaxes(0, 1)[None])  # (i, n, k, m)
    twice = (a[:, :, None] * a[None]).swapaxes(1, 2)  # a_ij a_jk as (i, k, j)
    block = block - np.tensordot(twice, at.state, 1).swapaxes(1, 2)
    for i in range(3):
        block[i, :, i] += at.mass[i]
    held = at.state @ q + at.force
    if coupling is not None:
        block -= np.einsum("ij,jlnm,lk->inkm", a, coupling, a, optimize=["einsum_path", (0, 1), (0, 1)])
        held = held + np.sum(coupling @ q, axis=1)
    right = p - at.transport @ q - at.momentum + a @ held
    rates = dgesv(block.reshape(3 * n, 3 * n), right.ravel())[2].reshape(3, n)
    inner = q + a @ rates
    force = np.einsum("inm,im->in", at.rate, rates) + np.einsum("inm,im->in", at.state, inner) + at.force
    if coupling is not None:
        force += np.einsum("ilnm,lm->in", coupling, inner)
    return q + h * method.weights @ rates, p + h * method.weights @ force, inner, rates


class Insertion:
    """Depths, breaks and steps of a run whose depth is prescribed."""

    def __init__(self, scene, time, degree):
        self.scene, self.degree, self.loading = scene, degree, Loading(scene)
        self.law, self.cuts = self.loading.law, scene.tissue.rest_line == "cut-path"
        self.time, self.samples = time, np.linspace(0.0, time[-1], 4001)
        self.ahead = np.minimum.accumulate(self.law.depth(self.samples)[::-1])[::-1]
        self.borders = [y for layer in scene.tissue.layers for y in (layer.start, layer.far_side) if 0.0 < y < np.inf]
        if self.cuts:
            self.borders.append(float(self.law.depth(0.0)))
        self.landings = self._landings()

    def breaks(self, time):
        """Breaks from an instant on."""
        ahead = np.interp(time, self.samples, self.ahead)
        inner = [y for y in self.borders if y < ahead - ROOM]
        if self.scene.support.kind == "entry":
            return sorted({0.0, *inner})
        outer = [guide.position for guide in self.scene.support.guides] + [load.position for load in self.loading.laterals]
        return sorted({0.0, *outer, *inner})

    def _landings(self):
        """Kinks, and where a cut path is reached again."""
        kinks = self.loading.kinks(self.time[-1])
        if self.cuts:
            turns = self.law.depth(np.array([0.0, *self.law.kinks()]))
            kinks = [*kinks, *self.law.passes(np.unique(turns), self.time[-1])]
        return kinks


def piecewise_motion(scene, output_times, degree=16, steps_per_second=None, method=None):
    """Solve a scene whose depth is prescribed, above 0 throughout.

    Parameters
    ----------
    scene
        With `material` kinematics and a clamped hub.
    output_times
        Rising from 0 [s].
    degree
        Of the polynomials on a piece in tissue; pieces outside have half of it, 8 at least.
    steps_per_second
        Default 2000 over the run.
    method
        Default Radau's where the tissue damps, else Gauss's.

    Returns
    -------
    numpy.ndarray
        Tips at the output times [m].
    """
    time = np.asarray(output_times, dtype=float)
    run = Insertion(scene, time, degree)
    damped = any(layer.damping for layer in scene.tissue.layers)
    method = method or (RADAU if damped else GAUSS)
    starts, lengths, keep = step_grid(time, run.landings, steps_per_second or 2000.0 / time[-1])
    motor = Motor(scene, run.breaks(0.0), degree)
    state = motor.start(float(run.law.depth(0.0)), float(run.law.speed(0.0)))
    memory = CutMemory(motor.loading, degree) if run.cuts else None
    tips = [state[0][motor.tip]]
    for group in _groups(run, starts, lengths):
        breaks = run.breaks(starts[group[0]])
        if breaks != _tissue_breaks(motor):
            newer = Motor(scene, breaks, degree)
            instant = starts[group[0]], float(run.law.depth(starts[group[0]])), float(run.law.speed(starts[group[0]]))
            motor, state = newer, transferred(motor, newer, state, instant)
        found = list(_advanced(method, motor, memory, (starts[group], lengths[group]), state))
        tips += [q[motor.tip] for (q, _), kept in zip(found, keep[group], strict=True) if kept]
        state = found[-1]
    return np.array(tips)


def _tissue_breaks(motor):
    return sorted({0.0, *motor.needle.breaks})


def _groups(run, starts, lengths):
    """Rows of steps that share their pieces, at most 60; of a cut path steps of one length between two landings."""
    breaks = [run.breaks(start) for start in starts]
    corners = np.unique([*run.time, *run.landings])
    first = 0
    for i in range(1, starts.size + 1):
        if i < starts.size and i - first < 60 and breaks[i] == breaks[first] and not (run.cuts and _lands(corners, starts[i])):
            continue
        yield np.arange(first, i)
        first = i


def _lands(corners, time):
    near = np.searchsorted(corners, time)
    return np.min(np.abs(corners[max(near - 1, 0) : near + 1] - time)) < 1e-12 * corners[-1]


def _advanced(method, motor, memory, steps, state):
    """Yield the states at the ends of a group of steps."""
    starts, lengths = steps
    nodes = np.minimum(method.nodes, 1.0 - 1e-12)  # a stage at the end of a step is before the jump there
    instants = (starts[:, None] + lengths[:, None] * nodes).ravel()
    law = motor.loading.law
    depth, speed = law.depth(instants), law.speed(instants)
    every = motor.stages(instants, depth, speed)
    if memory is not None:
        memory.begin(motor, instants, depth, speed, law.depth(starts[0]))
    for number, h in enumerate(lengths):
        three = slice(3 * number, 3 * number + 3)
        at, coupling = every.part(three), None
        if memory is not None:
            at.force[...] += memory.loads(three)
            coupling = memory.coupling(method, three, h)
        q, p, inner, _ = collocate(method, at, coupling, h, state)
        state = q, p
        if memory is not None:
            memory.extend(method, three, h, inner[:, motor.tip])
        yield state
    if memory is not None:
        memory.close(float(law.depth(starts[-1] + lengths[-1])))
