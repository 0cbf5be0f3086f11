"""Reference for `entry`: the growing beam by a spectral Galerkin method in stretched coordinates.

Weak form of rho A D^2w/Dt^2 + EI w'''' + c w_t + k w = 0 with w'' = 0, EI w''' = -F at y = z, against test functions
psi_i(y / z) that are clamped at y = 0. With w = sum_j q_j(t) psi_j(xi), xi = y / z, v = z':

- at fixed material point xi moves at (1 - xi) v / z, at fixed y at -xi v / z, so Dw/Dt = sum_j q_j' psi_j + q_j (v / z)
  chi_j with chi = (1 - xi) psi', and w_t likewise with chi = -xi psi';
- int_0^z psi_i rho A D^2w/Dt^2 dy = d/dt int_0^z rho A psi_i Dw/Dt dy - int_0^z rho A Dw/Dt Dpsi_i/Dt dy: Reynolds'
  theorem over material points leaves a boundary term at y = 0 only, where material enters, and psi_i vanishes there;
- hence p' = rho A v (S^T q' + (v / z) R q) + forces, p = rho A (z M q' + v S q), S_ij = int psi_i chi_j, R = int chi chi.

`fixed-frame` is Hamilton's principle for T = 1/2 rho A int_0^z w_t^2 dy: the same with chi = -xi psi' (its boundary term
rho A v w_t psi_i at the moving tip is inside d/dt p). Expanding p' gives section 4 of the physics page term for term; they agree.

Polynomials of the stretched coordinate resolve a homogeneous tissue to round-off; a layer border inside is a jump of w'''' and
leaves an error that falls as the fifth power of the degree.
"""

import numpy as np

from tests.references.gauss import GAUSS, Coefficients, integrate
from tests.references.polynomials import clamped_polynomials
from tests.references.scenes import Loading, Motion


class GrowingBeam:
    """Coefficients of the growing beam in momentum form."""

    def __init__(self, scene, degree):
        self.scene, self.loading, self.count = scene, Loading(scene), degree - 1
        nodes, weights = np.polynomial.legendre.leggauss(degree + 3)
        self.nodes, self.weights = (nodes + 1.0) / 2.0, weights / 2.0
        psi, first, second = clamped_polynomials(self.nodes, self.count)
        material = scene.model.kinematics == "material"
        chi = ((1.0 - self.nodes) if material else -self.nodes)[:, None] * first
        self.tip = clamped_polynomials(np.array(1.0), self.count)[0]
        self.transport = self._integral(psi, chi)
        self.convective = self._integral(chi, chi)
        self.bending = scene.needle.bending_stiffness * self._integral(second, second)
        self.unit = np.eye(self.count)

    def _integral(self, left, right):
        return np.einsum("g,gi,gj->ij", self.weights, left, right)

    def layer_integrals(self, layer, depth):
        """int psi_i psi_j and int psi_i (-xi psi_j') over the part of a layer, shapes (nt, n, n); depth may be complex."""
        lower = np.minimum(layer.start / depth.real, 1.0)
        upper = np.minimum(layer.far_side / depth.real, 1.0)
        if np.iscomplexobj(depth):
            lower = np.where(lower < 1.0, layer.start / depth, 1.0)
            upper = np.where(upper < 1.0, layer.far_side / depth, 1.0) if np.isfinite(layer.far_side) else 1.0 + 0 * lower
        if np.all(lower == lower[0]) and np.all(upper == upper[0]):
            lower, upper = lower[:1], upper[:1]
        span = upper - lower
        xi = lower[:, None] + span[:, None] * self.nodes
        psi, first, _ = clamped_polynomials(xi, self.count)
        weighted = (psi * (span[:, None] * self.weights)[..., None]).swapaxes(1, 2)
        shape = (depth.size, self.count, self.count)
        return np.broadcast_to(weighted @ psi, shape), np.broadcast_to(weighted @ (-xi[..., None] * first), shape)

    def stiffness(self, depth, time):
        """Bending and tissue stiffness, shape (nt, n, n)."""
        z = depth[:, None, None]
        total = self.bending / z**3
        for layer in self.loading.layers:
            modulus = layer.foundation_modulus * self.loading.factor.value(time)[:, None, None]
            total = total + modulus * z * self.layer_integrals(layer, depth)[0]
        return total

    def coefficients(self, time):
        depth, speed = self.loading.law.depth(time), self.loading.law.speed(time)
        z, v = depth[:, None, None], speed[:, None, None]
        mass = self.scene.needle.mass_per_length
        rate = mass * v * self.transport.T + 0.0 * z
        state = mass * v**2 / z * self.convective - self.stiffness(depth, time)
        for layer in self.loading.layers:
            if layer.damping:
                damping, moving = self.layer_integrals(layer, depth)
                rate, state = rate - layer.damping * z * damping, state - layer.damping * v * moving
        force = self.loading.tip_force(time, depth)[:, None] * self.tip
        return Coefficients(mass * z * self.unit, mass * v * self.transport, rate, state, 0.0 * force, force)

    def rest(self, depth, force):
        """Static coordinates at t = 0 under a tip force; a complex depth gives the derivative by depth."""
        return np.linalg.solve(self.stiffness(np.array([depth]), np.zeros(1))[0], force * self.tip)

    def start(self):
        """q and p at t = 0."""
        shape, zero = self.scene.initial.shape, np.zeros(1)
        depth = float(self.loading.law.depth(zero)[0])
        nothing = np.zeros(self.count)
        if shape == "straight":
            return nothing, nothing
        if shape == "tip-displaced":
            q = self.rest(depth, 1.0)
            return q * self.scene.initial.tip_deflection / (self.tip @ q), nothing
        force = float(self.loading.tip_force(zero, np.array([depth]))[0])
        stepped = self.rest(depth + 1e-30j, force)
        q, slope = stepped.real, stepped.imag / 1e-30
        at = self.coefficients(zero)
        return q, at.mass[0] @ (slope * self.loading.law.speed(zero)[0]) + at.transport[0] @ q

    def energy(self, time, q, rate):
        """Kinetic, bending and tissue energy [J], shape (nt,)."""
        depth, speed = self.loading.law.depth(time), self.loading.law.speed(time)
        ratio, mass = speed / depth, self.scene.needle.mass_per_length
        kinetic = np.sum(rate * rate, axis=1) + 2.0 * ratio * np.einsum("ti,ij,tj->t", rate, self.transport, q)
        kinetic += ratio**2 * np.einsum("ti,ij,tj->t", q, self.convective, q)
        return 0.5 * (mass * depth * kinetic + np.einsum("ti,tij,tj->t", q, self.stiffness(depth, time), q))

    def deflection(self, time, q, arc_length):
        """w [m] at stations [m], shape (nt, n); zero outside."""
        depth = self.loading.law.depth(time)[:, None]
        xi = (np.asarray(arc_length, dtype=float) - self.scene.needle.length) / depth + 1.0
        psi = clamped_polynomials(np.clip(xi, 0.0, 1.0), self.count)[0]
        return np.einsum("tsi,ti->ts", psi, q)


def entry_motion(scene, duration, output_times, degree=20, steps_per_second=None):
    """Solve the growing beam of a scene with support `entry`.

    Parameters
    ----------
    scene
        Straight rest line; depth from its insertion, above 0 throughout.
    duration
        [s], at least the last output time.
    output_times
        Rising from 0 [s].
    degree
        Of the polynomials of xi.
    steps_per_second
        Default 2000 steps over the duration.

    Returns
    -------
    Motion
        At the output times.
    """
    beam = GrowingBeam(scene, degree)
    time = np.asarray(output_times, dtype=float)
    q, p = beam.start()
    kinks = beam.loading.kinks(duration)
    q, p = integrate(GAUSS, beam.coefficients, q, p, time, kinks, steps_per_second or 2000.0 / duration)
    at = [beam.coefficients(np.array([t])) for t in time]
    rate = np.array([c.velocity(a, b) for c, a, b in zip(at, q, p, strict=True)])
    return Motion(
        time=time,
        depth=beam.loading.law.depth(time),
        tip_deflection=q @ beam.tip,
        tip_velocity=rate @ beam.tip,
        energy=beam.energy(time, q, rate),
        deflection=lambda arc_length: beam.deflection(time, q, arc_length),
        coordinates=q,
        rates=rate,
    )
