"""Independent integration in time of any plant: its assembled, dense equations by DOP853, piece by piece between kinks.

With q' and v from the momenta,

    P = M q' + v S q,   Pi = m v + q'.S q + v q.R q        (Pi, m = rho A l: only of a pushed needle)
    P'  = v S^T q' + v^2 R q - (K + G) q - C q' - v D q + N.F
    Pi' = f - friction - cutting + dL/dz - drag

are ordinary differential equations in (q, P) of a prescribed motion, in (q, P, z, Pi) of a push. Nothing of the steppers, the
stages or the loops is used; matrices, loads and laws of motion are the plant's and the scene's own.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from fem_needle import banded
from fem_needle.initial import initial_state
from fem_needle.loads import load_case
from fem_needle.motion import depth_law, landing_times

RELATIVE = 1e-12  # of each step of DOP853


def dense(band, size):
    """A dense matrix; zeros for an absent one."""
    return np.zeros((size, size)) if band is None else banded.to_dense(band)


@dataclass(frozen=True, eq=False)
class Matrices:
    """Everything of a plant at one depth and time, dense; the clamped coordinates included."""

    mass: np.ndarray
    stiffness: np.ndarray
    convection: np.ndarray
    centrifugal: np.ndarray
    damping: np.ndarray
    drag: np.ndarray
    slip: np.ndarray
    rows: np.ndarray
    row_rates: np.ndarray


class Assembled:
    """The equations of a plant without guides under a clamp that does not move."""

    def __init__(self, plant):
        self.plant, self.scene, self.law = plant, plant.scene, depth_law(plant.scene)
        self.clamped = plant.prescribed
        self.free = slice(self.clamped, plant.size)
        start = initial_state(plant, self.law)
        assert not start.stage.points.guides
        self.start = np.concatenate([start.solution.coordinates[self.free], start.solution.momentum[self.free]])
        self.count = plant.size - self.clamped
        self.known = None

    def matrices(self, depth, time):
        """The matrices; those of the call before where neither depth nor tissue has changed."""
        fixed = isinstance(self.scene.tissue.stiffness_factor, float)
        if self.known is None or self.known[0] != depth or not fixed:
            self.known = (depth, self._matrices(depth, time))
        return self.known[1]

    def _matrices(self, depth, time):
        operators, points, size = self.plant.operators(depth, time), self.plant.points(depth), self.plant.size
        parts = ("mass", "stiffness", "convection", "centrifugal", "damping", "drag", "slip")
        found = [dense(getattr(operators, part), size)[self.free, self.free] for part in parts]
        return Matrices(*found, points.rows[:, self.free], points.row_rates[:, self.free])

    def tip(self, state, depth, time):
        """Deflection of the tip [m]."""
        return float(self.matrices(depth, time).rows[-1] @ state[: self.count])

    def rates(self, at, q, velocities, speed, forces):
        """P' of a state."""
        result = speed * (at.convection.T @ velocities) + speed**2 * (at.centrifugal @ q) - at.stiffness @ q
        return result - at.damping @ velocities - speed * (at.drag @ q) + at.rows.T @ forces

    def forces(self, depth, time):
        """Lateral loads and the tip's [N]; a depth in the layer that holds the tip."""
        return load_case(self.scene, depth, time).forces

    def kinks(self, duration):
        """Times at which something has a kink [s]."""
        return landing_times(self.scene, self.law, duration, self.plant.smallest_depth)

    def moved(self, duration):
        """Free coordinates at the end of a prescribed motion."""
        state = self.start
        for start, end in pairwise([0.0, *self.kinks(duration), duration]):
            state = self._piece(start, end, state)
        return state[: self.count]

    def _piece(self, start, end, state):
        """The state at the end of a piece between two kinks; values of the scene are taken inside."""
        first, last = np.nextafter(start, end), np.nextafter(end, start)
        middle = self.law.depth(0.5 * (start + end))

        def rate(time, y):
            time = min(max(time, first), last)
            return self.piece_rate(self.law.after(time), y, self.forces(middle, time))

        found = solve_ivp(rate, (start, end), state, method="DOP853", rtol=RELATIVE, atol=self.tolerances(state))
        assert found.success, found.message
        return found.y[:, -1]

    def piece_rate(self, instant, y, forces):
        """The rate of a state (q, P)."""
        at, q, momentum = self.matrices(instant.depth, instant.time), y[: self.count], y[self.count :]
        velocities = np.linalg.solve(at.mass, momentum - instant.speed * (at.convection @ q))
        return np.concatenate([velocities, self.rates(at, q, velocities, instant.speed, forces)])

    def tolerances(self, state):
        """Absolute tolerances of coordinates and momenta."""
        parts = [max(float(np.max(np.abs(part))), 1e-9) for part in np.split(state, 2)]
        return RELATIVE * np.repeat(parts, self.count)


class Creeping(Assembled):
    """The same without inertia: C q' = -(K + v D) q + N.F, in tissue that is viscous along the whole needle."""

    def __init__(self, plant):
        super().__init__(plant)
        self.start = self.start[: self.count]

    def piece_rate(self, instant, y, forces):
        """The rate of a state q."""
        at = self.matrices(instant.depth, instant.time)
        return np.linalg.solve(at.damping, at.rows.T @ forces - at.stiffness @ y - instant.speed * (at.drag @ y))

    def tolerances(self, state):
        """Absolute tolerances of the coordinates."""
        return np.full(self.count, RELATIVE * np.max(np.abs(state)))


class Pushed(Assembled):
    """The same with the depth among the unknowns: pushed, held by friction, cutting, without membranes."""

    def __init__(self, plant):
        super().__init__(plant)
        self.mass = self.scene.needle.mass_per_length * self.scene.needle.length
        depth = self.scene.insertion.first_depth
        self.start = np.concatenate([self.start, [depth, 0.0]])
        self.deepest = depth

    def split(self, y):
        """q, P, z, Pi of a state."""
        return y[: self.count], y[self.count : 2 * self.count], y[-2], y[-1]

    def speeds(self, y, at, *, rests):
        """q' and v from the momenta; v = 0 of a needle that rests."""
        q, momentum, _, axial = self.split(y)
        if rests:
            return np.linalg.solve(at.mass, momentum), 0.0
        coupling = at.convection @ q
        matrix = np.block([[at.mass, coupling[:, None]], [coupling[None, :], self.mass + q @ at.centrifugal @ q]])
        found = np.linalg.solve(matrix, np.append(momentum, axial))
        return found[:-1], float(found[-1])

    def axial_force(self, y, at, velocities, speed, forces, time):
        """dL/dz and the tissue's drag [N]: A without - d(dT/dv)/dt."""
        q, depth = y[: self.count], y[-2]
        whole, whole_rate = np.zeros(self.plant.size), np.zeros(self.plant.size)
        whole[self.free], whole_rate[self.free] = q, velocities
        force = -0.5 * float(whole @ self.plant.stiffness_rate_product(whole, depth, time))
        force += self.plant.kinetic_rate(whole_rate, whole, depth, speed) + float(forces @ (at.row_rates @ q))
        return force - float(velocities @ at.drag @ q) - speed * float(q @ at.slip @ q)

    def held(self, y, time):
        """Push and axial force [N] on a needle that rests, and what friction can hold."""
        at, forces = self.matrices(y[-2], time), self.forces(y[-2], time)
        velocities, _ = self.speeds(y, at, rests=True)
        coupling = at.convection @ y[: self.count]  # d(dT/dv)/dt of a needle at rest along z: q''.S q + q'.S q'
        seconds = np.linalg.solve(at.mass, self.rates(at, y[: self.count], velocities, 0.0, forces))
        force = self.axial_force(y, at, velocities, 0.0, forces, time)
        force -= float(seconds @ coupling + velocities @ at.convection @ velocities)
        return self.push(time) + force

    def push(self, time):
        """The push [N]."""
        push = self.scene.insertion.push_force
        return push if isinstance(push, float) else float(push.value(time))

    def coulomb(self, depth):
        """What Coulomb friction holds [N]."""
        return self.scene.friction.coulomb + self.scene.friction.coulomb_per_length * depth

    def rate(self, time, y, direction, cutting):
        """The rate of a state that slides (1, -1) or rests (0)."""
        at, forces = self.matrices(y[-2], time), self.forces(y[-2], time)
        velocities, speed = self.speeds(y, at, rests=direction == 0)
        lateral = self.rates(at, y[: self.count], velocities, speed, forces)
        if direction == 0:
            return np.concatenate([velocities, lateral, [0.0, 0.0]])
        friction = self.scene.friction
        slowing = direction * self.coulomb(y[-2]) + (friction.viscous + friction.viscous_per_length * y[-2]) * speed
        axial = self.push(time) - slowing - cutting + self.axial_force(y, at, velocities, speed, forces, time)
        return np.concatenate([velocities, lateral, [speed, axial]])

    def slid(self, duration, cutting=0.0):
        """(time, state, direction before) at every kink and change between sliding and resting, the end last; uniform tissue."""
        time, y, found = 0.0, self.start, []
        while time < duration:
            driving, holds = self.held(y, time), self.coulomb(y[-2])
            inward = holds + (cutting if y[-2] >= self.deepest else 0.0)
            direction = int(driving > inward * (1 + 1e-12)) - int(driving < -holds * (1 + 1e-12))
            until = min([kink for kink in self.kinks(duration) if kink > time + 1e-9 * duration] + [duration])
            time, y = self._phase(time, until, y, direction, cutting)
            self.deepest = max(self.deepest, y[-2])
            found.append((time, y, direction))
        return found

    def _phase(self, start, until, y, direction, cutting):
        cuts = cutting if direction > 0 and y[-2] >= self.deepest else 0.0

        def stops(time, state):
            speed = self.speeds(state, self.matrices(state[-2], time), rests=False)[1]
            return speed * direction + (1e-9 if time < start + 1e-6 * (until - start) else 0.0)

        def breaks(time, state):
            holds = self.coulomb(state[-2])
            inward = holds + (cutting if state[-2] >= self.deepest else 0.0)
            driving = self.held(state, time)
            return min(inward - driving, driving + holds) + (1e-9 if time < start + 1e-6 * (until - start) else 0.0)

        event = stops if direction else breaks
        event.terminal, event.direction = True, -1
        tolerance = RELATIVE * np.concatenate([np.full(self.count, 1e-3), np.full(self.count, 1e-4), [0.1, 1e-3]])
        found = solve_ivp(
            lambda time, state: self.rate(time, state, direction, cuts),
            (start, until), y, method="DOP853", rtol=RELATIVE, atol=tolerance, events=event,
        )  # fmt: skip
        assert found.success, found.message
        end = found.y[:, -1].copy()
        if found.status == 1:  # at speed 0: what momentum the lateral motion has along z
            at = self.matrices(end[-2], found.t[-1])
            velocities, _ = self.speeds(end, at, rests=True)
            end[-1] = float(velocities @ at.convection @ end[: self.count])
        return float(found.t[-1]), end
