"""The two-mode equations once more, by textbook modes, adaptive quadrature and an adaptive Runge-Kutta method."""

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

LENGTH = 0.2
ROOTS = np.array([brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, *ends, xtol=1e-15) for ends in ((1.5, 2.5), (4.0, 5.5))])
RATIOS = (np.sin(ROOTS) - np.sinh(ROOTS)) / (np.cos(ROOTS) + np.cosh(ROOTS))  # minus the ratio of sine to cosine parts
NODES, WEIGHTS = leggauss(40)


def mode(y, derivative=0):
    """phi_1, phi_2 at y, shape (2, ...), normalised over the length."""
    waves = (ROOTS / LENGTH).reshape(2, *[1] * np.ndim(y))
    ratios = RATIOS.reshape(waves.shape)
    t = waves * np.asarray(y)
    even = (np.cosh(t) - np.cos(t), np.sinh(t) + np.sin(t), np.cosh(t) + np.cos(t))[derivative]
    odd = (np.sinh(t) - np.sin(t), np.cosh(t) - np.cos(t), np.sinh(t) + np.sin(t))[derivative]
    return waves**derivative * (even + ratios * odd) / np.sqrt(LENGTH)


def integral(left, right, depth):
    """int_0^z of products of modes, or derivatives of them."""
    y, weights = depth * (NODES + 1.0) / 2.0, depth * WEIGHTS / 2.0
    return (mode(y, left) * weights) @ mode(y, right).T


class TwoModes:
    """The thesis' equations done right, with or without the axial force A, fixed-frame; foundation or tip spring."""

    def __init__(self, stiffness, mass, modulus=0.0, spring=0.0, tip_force=0.0, axial=True):
        self.stiffness, self.mass, self.modulus, self.spring = stiffness, mass, modulus, spring
        self.tip_force, self.axial = tip_force, axial

    def lateral(self, q, rates, depth, speed):
        """q''"""
        tip = mode(depth)
        matrix = self.mass * integral(0, 0, depth)
        potential = self.stiffness * integral(2, 2, depth) + self.modulus * integral(0, 0, depth)
        potential = potential + self.spring * np.outer(tip, tip)
        force = self.tip_force * tip - potential @ q - self.mass * speed * tip * (tip @ rates)
        return np.linalg.solve(matrix, force)

    def axial_force(self, q, rates, depth):
        tip, slope, curvature = mode(depth) @ q, mode(depth, 1) @ q, mode(depth, 2) @ q
        energy = 0.5 * self.mass * (mode(depth) @ rates) ** 2 - 0.5 * self.stiffness * curvature**2 - 0.5 * self.modulus * tip**2
        return energy + self.tip_force * slope - self.spring * tip * slope

    def pushed(self, state, push, coulomb, viscous):
        """Rates of (q, q', z, v)."""
        q, rates, depth, speed = state[:2], state[2:4], state[4], state[5]
        force = push - coulomb - viscous * speed + (self.axial_force(q, rates, depth) if self.axial else 0.0)
        return np.concatenate([rates, self.lateral(q, rates, depth, speed), [speed, force / (self.mass * LENGTH)]])

    def push(self, start, depth, times, push, coulomb=0.0, viscous=0.0):
        """Tip deflection, depth and speed at times, from rest with amplitudes q."""
        state = np.concatenate([start, np.zeros(2), [depth, 0.0]])
        found = solve_ivp(
            lambda _, y: self.pushed(y, push, coulomb, viscous), (0.0, times[-1]), state, "DOP853", times, rtol=1e-11, atol=1e-14
        )
        tips = np.array([mode(z) @ q for z, q in zip(found.y[4], found.y[:2].T, strict=True)])
        return tips, found.y[4], found.y[5]

    def moved(self, start, rates, depth, times):
        """Tip deflection at times for a prescribed depth(t), speed(t)."""
        def right(t, y):
            z, v = depth(t)
            return np.concatenate([y[2:], self.lateral(y[:2], y[2:], z, v)])

        found = solve_ivp(right, (0.0, times[-1]), np.concatenate([start, rates]), "DOP853", times, rtol=1e-11, atol=1e-14)
        return np.array([mode(depth(t)[0]) @ q for t, q in zip(times, found.y[:2].T, strict=True)])
