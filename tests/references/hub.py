"""Reference for `hub`: the whole needle by a spectral Galerkin method in material coordinates.

u(s, t) = h(t) + s theta(t) + sum_j q_j(t) psi_j(s / l) with clamped polynomials psi_j. Tissue, guides and lateral forces stay
at their y and so move through the material: s = y + l - z(t). Weak form of the equation of motion against psi_i:

    p_i' = - int EI u'' psi_i'' ds - int (k u + c (u_t - v u_s)) psi_i ds + sum P_j psi_i(s_j) - sum k_g u(s_g) psi_i(s_g)
           + F psi_i(l),    p_i = int rho A u_t psi_i ds

The hub enters through u_t in p, so a jump of its velocity leaves p continuous, as it must: the impulse of the clamp does no
work on functions that are clamped. A rigid guide is a spring of `PIN` EI / l^3.

Polynomials resolve a jump of u''' (guide, lateral force) with an error that falls as the third power of the degree, a jump of
u'''' (layer border) as the fifth; tests/references/test_references.py states what was measured.
"""

import numpy as np

from fem_needle.scene.time_functions import as_function
from tests.references.gauss import RADAU, Coefficients, integrate
from tests.references.polynomials import clamped_polynomials
from tests.references.scenes import Loading, Motion

PIN = 1e8
HUB, OWN = slice(0, 2), slice(2, None)  # the first two functions, 1 and x = s / l, belong to the hub


class WholeNeedle:
    """Coefficients of the whole needle in momentum form."""

    def __init__(self, scene, degree):
        self.scene, self.loading, self.degree = scene, Loading(scene), degree
        self.length = scene.needle.length
        stiffness = scene.needle.bending_stiffness / self.length**3
        self.guides = [(g.position, PIN * stiffness if g.stiffness == "rigid" else g.stiffness) for g in scene.support.guides]
        self.hub = [as_function(scene.support.hub_deflection), as_function(scene.support.hub_angle)]
        nodes, weights = np.polynomial.legendre.leggauss(degree + 3)
        self.nodes, self.weights = (nodes + 1.0) / 2.0, weights / 2.0
        phi, _, second = self.functions(self.nodes)
        self.mass = scene.needle.mass_per_length * self.length * _product(self.weights, phi, phi)
        self.bending = stiffness * _product(self.weights, second, second)

    def functions(self, x):
        """1, x and the polynomials at x of any shape: values and two derivatives, shape (3, ..., n + 2)."""
        one, zero = np.ones(np.shape(x)), np.zeros(np.shape(x))
        hub = np.stack([np.stack([one, x], -1), np.stack([zero, one], -1), np.stack([zero, zero], -1)])
        return np.concatenate([hub, clamped_polynomials(x, self.degree - 1)], axis=-1)

    def at(self, y, depth):
        """Values of all functions at fixed y, shape (nt, n + 2)."""
        return self.functions((y + self.length - depth) / self.length)[0]

    def layer_integrals(self, layer, depth):
        """int Phi Phi ds and int Phi Phi_s ds over the part of the needle in a layer, shapes (nt, n + 2, n + 2)."""
        lower, upper = (self._place(y, depth) for y in (layer.start, layer.far_side))
        if np.all(lower == lower[0]) and np.all(upper == upper[0]):
            lower, upper = lower[:1], upper[:1]
        span = (upper - lower)[:, None]
        phi, first, _ = self.functions(lower[:, None] + span * self.nodes)
        weight = span * self.weights
        shape = (depth.size, phi.shape[-1], phi.shape[-1])
        both = self.length * _product(weight, phi, phi), _product(weight, phi, first)
        return [np.broadcast_to(matrix, shape) for matrix in both]

    def _place(self, y, depth):
        """x = s / l of a fixed y, between 0 and 1."""
        x = (min(y, 2.0 * self.length) + self.length - depth) / self.length
        return np.where(x.real <= 0.0, 0.0, np.where(x.real >= 1.0, 1.0, x))

    def stiffness(self, depth, time):
        """Bending, tissue and guides, shape (nt, n + 2, n + 2)."""
        factor, total = self.loading.factor.value(time)[:, None, None], self.bending
        for layer in self.loading.layers:
            total = total + layer.foundation_modulus * factor * self.layer_integrals(layer, depth)[0]
        for y, spring in self.guides:
            phi = self.at(y, depth)
            total = total + spring * phi[:, :, None] * phi[:, None, :]
        return np.broadcast_to(total, (depth.size, *self.bending.shape))

    def loads(self, depth, time):
        """Load vector, shape (nt, n + 2)."""
        total = self.loading.tip_force(time, depth.real)[:, None] * self.functions(np.ones(depth.size))[0]
        for load in self.loading.laterals:
            total = total + as_function(load.force).value(time)[:, None] * self.at(load.position, depth)
        return total

    def hub_motion(self, time):
        """Coefficients of 1 and x, and their rates, shapes (nt, 2)."""
        scale = np.array([1.0, self.length])
        value = np.stack([f.value(time) for f in self.hub], axis=-1) * scale
        return value, np.stack([f.derivative(time) for f in self.hub], axis=-1) * scale

    def coefficients(self, time):
        depth, speed = self.loading.law.depth(time), self.loading.law.speed(time)
        state = -self.stiffness(depth, time)
        rate = np.zeros(state.shape)
        for layer in self.loading.layers:
            if layer.damping:
                resting, sliding = self.layer_integrals(layer, depth)
                rate = rate - layer.damping * resting
                state = state + layer.damping * speed[:, None, None] * sliding
        hub, hub_rate = self.hub_motion(time)
        mass = np.broadcast_to(self.mass, state.shape)
        force = self.loads(depth, time)[:, OWN] + _times(state, hub) + _times(rate, hub_rate)
        own = (slice(None), OWN, OWN)
        return Coefficients(mass[own], 0.0 * mass[own], rate[own], state[own], momentum=_times(mass, hub_rate), force=force)

    def rest(self, depth):
        """Static coordinates at t = 0 under all loads, and under a unit tip force alone, shape (2, n).

        A complex depth gives the derivatives by depth as well.
        """
        at, zero = np.array([depth]), np.zeros(1)
        stiffness = self.stiffness(at, zero)
        right = self.loads(at, zero)[:, OWN] - _times(stiffness, self.hub_motion(zero)[0])
        tip = self.functions(np.ones(1))[0][:, OWN]
        return np.linalg.solve(stiffness[0, OWN, OWN], np.stack([right[0], tip[0]], axis=-1)).T

    def start(self):
        """q and p at t = 0."""
        initial, zero = self.scene.initial, np.zeros(1)
        nothing = np.zeros(self.degree - 1)
        if initial.shape == "straight":
            return nothing, nothing
        stepped, unit = self.rest(float(self.loading.law.depth(zero)[0]) + 1e-30j)
        q, slope = stepped.real, stepped.imag / 1e-30
        if initial.shape == "tip-displaced":  # no load but a tip force, beside what the hub itself displaces
            tip, hub = self.functions(np.ones(1))[0][0], self.hub_motion(zero)[0]
            stiffness = self.stiffness(self.loading.law.depth(zero), zero)
            q = -np.linalg.solve(stiffness[0, OWN, OWN], _times(stiffness, hub)[0])
            missing = initial.tip_deflection - tip[OWN] @ q - tip[HUB] @ hub[0]
            return q + unit.real * missing / (tip[OWN] @ unit.real), nothing
        return q, self.mass[OWN, OWN] @ slope * self.loading.law.speed(zero)[0]

    def complete(self, time, q, rate):
        """All coordinates and rates, the hub's included, shapes (nt, n + 2)."""
        hub, hub_rate = self.hub_motion(time)
        return np.concatenate([hub, q], axis=1), np.concatenate([hub_rate, rate], axis=1)

    def energy(self, time, q, rate):
        """Kinetic, bending, tissue and guide energy [J], shape (nt,)."""
        every, change = self.complete(time, q, rate)
        kinetic = np.einsum("ti,ij,tj->t", change, self.mass, change)
        stiffness = self.stiffness(self.loading.law.depth(time), time)
        return 0.5 * (kinetic + np.einsum("ti,tij,tj->t", every, stiffness, every))

    def deflection(self, time, q, arc_length):
        """u [m] at stations [m], shape (nt, n)."""
        phi = self.functions(np.asarray(arc_length, dtype=float) / self.length)[0]
        return self.complete(time, q, q)[0] @ phi.T


def _product(weight, left, right):
    return (left * weight[..., None]).swapaxes(-1, -2) @ right


def _times(matrix, hub):
    """Own rows of a matrix times the hub's coordinates."""
    return np.einsum("tij,tj->ti", matrix[:, OWN, HUB], hub)


def hub_motion(scene, duration, output_times, degree=40, steps_per_second=None):
    """Solve the whole needle of a scene with support `hub`.

    Parameters
    ----------
    scene
        Straight rest line.
    duration
        [s], at least the last output time.
    output_times
        Rising from 0 [s].
    degree
        Of the polynomials of s.
    steps_per_second
        Default 2000 steps over the duration.

    Returns
    -------
    Motion
        At the output times.
    """
    needle = WholeNeedle(scene, degree)
    time = np.asarray(output_times, dtype=float)
    q, p = needle.start()
    kinks = needle.loading.kinks(duration)
    q, p = integrate(RADAU, needle.coefficients, q, p, time, kinks, steps_per_second or 2000.0 / duration)
    at = [needle.coefficients(np.array([t])) for t in time]
    rate = np.array([c.velocity(a, b) for c, a, b in zip(at, q, p, strict=True)])
    every, change = needle.complete(time, q, rate)
    tip = needle.functions(np.array(1.0))[0]
    return Motion(
        time=time,
        depth=needle.loading.law.depth(time),
        tip_deflection=every @ tip,
        tip_velocity=change @ tip,
        energy=needle.energy(time, q, rate),
        deflection=lambda arc_length: needle.deflection(time, q, arc_length),
        coordinates=q,
        rates=rate,
    )
