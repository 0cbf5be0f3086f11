"""Reference for `force`: the axial and the lateral motion of a pushed needle together, event by event.

With the lateral functions of `piecewise_needle` the Lagrangian of deflection and depth gives, beside the lateral equations,

    Pi = (rho A l + q R q) v + q' S q,    Pi' = f - friction - cutting + dT/dz - dU/dz - (q' D q + v q E q);

derivatives by the depth are complex steps of the operators. Both sides are solved at the stages of one collocation method, in
turn until the speeds stay. Steps end where the tip passes a border or the end of the cut path and where the needle stops; it
breaks away where f + A exceeds what holds it. Stops and passes are found by the length of the step.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from fem_needle.scene.time_functions import as_function
from tests.references.gauss import GAUSS, RADAU
from tests.references.piecewise_motion import Motor, collocate

ROUNDS, AGREED = 60, 1e-11
NEAR = 1e-12  # m


@dataclass(frozen=True)
class State:
    """Lateral coordinates and momenta, depth, speed, axial momentum and deepest depth at an instant."""

    time: float
    q: np.ndarray
    p: np.ndarray
    depth: float
    speed: float
    momentum: float
    deepest: float


@dataclass(frozen=True)
class Pushed:
    """Time, tip [m], depth [m], and energy [J] of deflection and depth at the outputs."""

    time: np.ndarray
    tip_deflection: np.ndarray
    depth: np.ndarray
    energy: np.ndarray


class Push:
    """Axial forces of a scene, and its steps."""

    def __init__(self, scene, degree, method):
        shallow = 0.5 * scene.insertion.initial_depth
        inner = [y for layer in scene.tissue.layers for y in (layer.start, layer.far_side) if 0.0 < y < shallow]
        outer = [guide.position for guide in scene.support.guides] + [x.position for x in scene.loads if x.kind == "lateral"]
        hold = scene.insertion.model_copy(update={"kind": "hold", "push_force": None, "final_depth": None})
        self.motor = Motor(scene.model_copy(update={"insertion": hold}), sorted({0.0, *inner, *outer}), degree)
        self.scene, self.method = scene, method
        self.force, self.mass = as_function(scene.insertion.push_force), scene.needle.mass_per_length * scene.needle.length
        self.borders = sorted({y for layer in scene.tissue.layers for y in (layer.start, layer.far_side) if y < np.inf})

    def friction(self, depth):
        """Coulomb's part [N] and the viscous coefficient [N s/m]."""
        friction = self.scene.friction
        coulomb = friction.coulomb + friction.coulomb_per_length * depth
        return coulomb, friction.viscous + friction.viscous_per_length * depth

    def cutting(self, state, direction):
        """Cutting force beyond a state [N]."""
        if direction < 0.0 or state.depth < state.deepest - NEAR:
            return 0.0
        ahead = state.depth + NEAR
        return sum(layer.cutting_force for layer in self.scene.tissue.layers if layer.start <= ahead < layer.far_side)

    def membrane(self, state):
        """What must be exceeded to advance, beside friction [N]."""
        new = state.depth > state.deepest - NEAR
        found = [layer.puncture_force for layer in self.scene.tissue.layers if new and abs(layer.start - state.depth) < NEAR]
        return found[0] if found and found[0] > 0.0 else self.cutting(state, 1.0)

    def every(self, time, q, rate):
        """All coordinates and rates."""
        full, change = self.motor.complete(time, q), np.zeros((time.size, self.motor.needle.size))
        change[:, self.motor.own], change[:, self.motor.held] = rate, self.motor.hub_motion(time)[1]
        return full, change

    def pull(self, time, depth, speed, full, change):
        """dT/dz - dU/dz + drag at instants [N], and q' S q and q R q."""
        at = self.motor.needle.operators(depth + 1e-30j, self.motor.loading.factor.value(time))

        def form(left, matrix, right):
            return np.einsum("ti,tij,tj->t", left, matrix, right)

        kinetic = 0.5 * form(change, at.mass.imag, change) + speed * form(change, at.transport.imag, full)
        kinetic += 0.5 * speed**2 * form(full, at.convective.imag, full)
        rate = (kinetic - 0.5 * form(full, at.stiffness.imag, full)) / 1e-30
        drag = form(change, at.sliding.real, full) + speed * form(full, at.dragging.real, full)
        return rate - drag, form(change, at.transport.real, full), form(full, at.convective.real, full)

    def step(self, state, h, direction):
        """One step of a needle that slides in a direction, or rests (0)."""
        method, nodes = self.method, np.minimum(self.method.nodes, 1.0 - 1e-12)
        time, cutting = state.time + h * nodes, self.cutting(state, direction)
        speed = np.full(3, state.speed)
        for _ in range(ROUNDS):
            depth = state.depth + h * method.stages @ speed
            q, p, inner, rates = collocate(method, self.motor.stages(time, depth, speed), None, h, (state.q, state.p))
            if direction == 0.0:
                return self._rested(state, h, q, p)
            pull, mixed, square = self.pull(time, depth, speed, *self.every(time, inner, rates))
            coulomb, viscous = self.friction(depth)
            force = self.force.value(time) - direction * coulomb - cutting + pull
            matrix = np.diag(self.mass + square) + h * method.stages * viscous
            found = np.linalg.solve(matrix, state.momentum + h * method.stages @ force - mixed)
            change, speed = np.max(np.abs(found - speed)), found
            if change < AGREED * max(1e-3, np.max(np.abs(speed))):
                break
        momentum = state.momentum + h * method.weights @ (force - viscous * speed)
        end = replace(state, time=state.time + h, q=q, p=p, depth=state.depth + h * method.weights @ speed, momentum=momentum)
        return replace(self.with_speed(end), deepest=max(state.deepest, end.depth))

    def rates(self, state, speed):
        """All coordinates and rates at a state."""
        time, depth = np.array([state.time]), np.array([state.depth])
        at = self.motor.stages(time, depth, np.array([speed]))
        rate = np.linalg.solve(at.mass[0], state.p - at.transport[0] @ state.q - at.momentum[0])
        return time, depth, *self.every(time, state.q[None], rate[None]), at, rate

    def with_speed(self, state):
        """The speed that belongs to the momenta: linear in it, from two values."""
        misses = [self._momentum(state, speed) - state.momentum for speed in (0.0, 1.0)]
        return replace(state, speed=misses[0] / (misses[0] - misses[1]))

    def _momentum(self, state, speed):
        time, depth, full, change, _, _ = self.rates(state, speed)
        _, mixed, square = self.pull(time, depth, np.array([speed]), full, change)
        return float(mixed[0] + (self.mass + square[0]) * speed)

    def stopped(self, state):
        """The same with the speed 0; the lateral momentum stays."""
        return replace(state, speed=0.0, momentum=self._momentum(state, 0.0))

    def shown(self, state):
        """Tip [m], depth [m], and kinetic, bending and tissue energy of both motions [J]."""
        time, depth, full, change, _, _ = self.rates(state, state.speed)
        at, v = self.motor.needle.operators(depth, self.motor.loading.factor.value(time)), state.speed
        q, r = full[0], change[0]
        lateral = r @ at.mass[0] @ r + 2.0 * v * (r @ at.transport[0] @ q) + v**2 * (q @ at.convective[0] @ q)
        return state.q[self.motor.tip], state.depth, 0.5 * (lateral + q @ at.stiffness[0] @ q + self.mass * v**2)

    def _rested(self, state, h, q, p):
        return self.stopped(replace(state, time=state.time + h, q=q, p=p))

    def excess(self, state):
        """f + A of a needle that rests [N]; A = pull - d/dt(q' S q)."""
        time, depth, full, change, at, rate = self.rates(state, 0.0)
        pull = self.pull(time, depth, np.zeros(1), full, change)[0][0]
        force = at.rate[0] @ rate + at.state[0] @ state.q + at.force[0]
        second = np.zeros(self.motor.needle.size)
        second[self.motor.own] = np.linalg.solve(at.mass[0], force)  # hubs of pushed needles do not accelerate
        transport = self.motor.needle.operators(depth, np.ones(1)).transport[0]
        return float(self.force.value(time)[0] + pull - second @ transport @ full[0] - change[0] @ transport @ change[0])

    def freed(self, state):
        """Direction in which a resting needle begins to move, 0 if it does not; and by how much it is held."""
        excess, coulomb = self.excess(state), self.friction(state.depth)[0]
        inward, outward = coulomb + self.membrane(state) - excess, coulomb + excess
        return (1.0 if inward < 0.0 else -1.0 if outward < 0.0 else 0.0), min(inward, outward)

    def passing(self, state, end, direction):
        """Border that a step passes, else None."""
        marks = [*self.borders, state.deepest] if direction > 0.0 else self.borders
        between = [y for y in marks if (y - state.depth) * direction > NEAR and (end.depth - y) * direction > 0.0]
        return (min(between) if direction > 0.0 else max(between)) if between else None


def _advance(push, state, until, direction):
    """Go on to an instant or to the next event; return the state and the direction behind it."""
    h = until - state.time
    end = push.step(state, h, direction)

    def first(miss):
        part = brentq(lambda part: miss(push.step(state, part, direction)), 1e-9 * h, h, xtol=1e-14 * h)
        return push.step(state, part, direction)

    if direction == 0.0:
        if push.freed(end)[0] == 0.0:
            return end, 0.0
        if push.freed(push.step(state, 1e-9 * h, 0.0))[0] != 0.0:
            return state, push.freed(push.step(state, 1e-9 * h, 0.0))[0]
        free = first(lambda there: push.freed(there)[1])
        return free, push.freed(end)[0]
    border = push.passing(state, end, direction)
    if border is not None:
        end = replace(first(lambda there: there.depth - border), depth=border)
        end = replace(end, deepest=max(end.deepest, border) if direction > 0.0 else end.deepest)
        if direction > 0.0 and push.membrane(end) > push.cutting(end, 1.0):
            still = push.stopped(end)
            return (end, direction) if push.freed(still)[0] > 0.0 else (still, 0.0)
        return end, direction
    if end.speed * direction < 0.0:
        soon = push.step(state, 1e-9 * h, direction)  # an instant to land on may be that of a stop
        end = push.stopped(first(lambda there: there.speed) if soon.speed * direction > 0.0 else state)
        return end, push.freed(end)[0]
    return end, direction


def pushed_motion(scene, output_times, degree=14, steps_per_second=2000.0, method=None):
    """Solve a pushed needle from rest.

    Parameters
    ----------
    scene
        Straight rest line, `material` kinematics, a clamped hub that is at rest, no final depth.
    output_times
        Rising from 0 [s].
    degree
        Of the polynomials on a piece.
    steps_per_second
        At least this many.
    method
        Default Radau's where the tissue damps, else Gauss's.

    Returns
    -------
    Pushed
        At the output times.
    """
    time = np.asarray(output_times, dtype=float)
    damped = any(layer.damping for layer in scene.tissue.layers)
    push = Push(scene, degree, method or (RADAU if damped else GAUSS))
    depth = scene.insertion.initial_depth
    q, p = push.motor.start(depth, 0.0)
    state = push.stopped(State(0.0, q, p, depth, 0.0, 0.0, depth))
    direction, kept = push.freed(state)[0], [push.shown(state)]
    kinks = [t for t in [*push.force.breakpoints, *push.motor.loading.kinks(time[-1])] if 0.0 < t < time[-1]]
    landings = np.unique([*time, *(t for t in kinks if np.min(np.abs(time - t)) > 1e-12 * time[-1])])
    for start, end in pairwise(landings):
        count = int(np.ceil((end - start) * steps_per_second - 1e-9))
        for number in range(1, count + 1):
            until = start + (end - start) * number / count
            while until - state.time > 1e-13 * time[-1]:
                state, direction = _advance(push, state, until, direction)
        if np.min(np.abs(time - end)) <= 1e-12 * time[-1]:
            kept.append(push.shown(state))
    return Pushed(time, *np.array(kept).T)
