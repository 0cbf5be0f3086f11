"""Force-driven insertion: the depth follows from a push, friction, cutting, puncture and the needle's own axial force A.

    rho A l dv/dt = f - friction - cutting + A

In momentum form with Pi = rho A l v + dT/dv (the lateral kinetic energy depends on v under ``entry``), at the nodes of the
lateral method:  Pi' = f - friction - cutting + (A without -d(dT/dv)/dt). A step iterates between the lateral stages on a trial
motion and the 2 x 2 axial equations, in which viscous friction is implicit; it contracts by about (step)^2 times dA/dz over the
mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial
from fem_needle.banded import SingularMatrixError
from fem_needle.collocation import Collocation
from fem_needle.ledger import StepEnd, Works, axial_momentum, configuration_force
from fem_needle.motion import Instant
from fem_needle.samples import axial_force_at
from fem_needle.scene import Scene, as_function
from fem_needle.steppers import DynamicStepper, Step

Array = NDArray[np.float64]

MOST_ITERATIONS = 60
SPEED_TOLERANCE = 1e-15  # of the largest speed of a step
SPEED_ROUNDING = 1e-6  # of the largest speed: an iteration that no longer approaches below it has met rounding
LANDING = 1e-6  # of a level's depth: a located event that misses it by more is none
LAYER_SIDE = 1e-11  # of the depth: far enough from an interface to be in the layer that the tip moves in
TIME_RESOLUTION = 1e-9  # of a step: how closely an event's time is found (the state lands on it exactly)


@dataclass(frozen=True, eq=False)
class StepMotion:
    """Trial motion over one step: speeds at the start, the nodes and the end.

    Meets what a stepper asks of a depth law.
    """

    method: Collocation
    time: float
    length: float
    start_depth: float
    speeds: Array
    direction: int

    def layer_depth(self, start: float, end: float) -> float:
        """Return a depth just ahead of the start: a step ends at an interface, also while it is being tried."""
        return self.start_depth * (1 + self.direction * LAYER_SIDE)

    def depth(self, time: float) -> float:
        """Return z: the collocation polynomial, whose slope is the line through the nodes' speeds."""
        x = (time - self.time) / self.length
        first, second = self.method.nodes
        slope = (self.speeds[2] - self.speeds[1]) / (second - first)
        return self.start_depth + float(self.length * (self.speeds[1] * x + slope * (0.5 * x * x - first * x)))

    def after(self, time: float) -> Instant:
        """Return the motion at the start or a node."""
        x = (time - self.time) / self.length
        number = 0 if x <= 0.0 else 1 + int(np.argmin(np.abs(self.method.nodes - x)))
        changes = self.speeds[1:3] - self.speeds[0]
        slopes = self.method.start_slope if number == 0 else self.method.inverse[number - 1]
        return Instant(time, self.depth(time), float(self.speeds[number]), float(slopes @ changes) / self.length)

    def before(self, time: float) -> Instant:
        """Return the motion at the end."""
        changes = self.speeds[1:3] - self.speeds[0]
        rate = float(self.method.end_slope @ changes) / self.length
        return Instant(time, self.depth(time), float(self.speeds[3]), rate)


@dataclass(frozen=True, eq=False)
class PushState:
    """State of a pushed needle.

    Attributes
    ----------
    end
        Lateral state.
    depth, speed
        z [m], v [m/s]; exactly 0 while friction holds.
    deepest
        Deepest z so far [m].
    punctured
        Layers that the tip has entered.
    axial_force
        A at this instant [N].
    """

    end: StepEnd
    depth: float
    speed: float
    deepest: float
    punctured: frozenset[int]
    axial_force: float

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.end.stage.instant.time


@dataclass(frozen=True, eq=False)
class PushStep:
    """One step of a pushed needle: lateral step, state at its end, axial works, and what ended it early (None: nothing)."""

    lateral: Step
    state: PushState
    works: Works
    event: str | None = None


@dataclass(frozen=True, eq=False)
class Pusher:
    """Advances a pushed needle, laterally with a given stepper."""

    stepper: DynamicStepper

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.stepper.plant.scene

    @property
    def mass(self) -> float:
        """Mass of the needle [kg]."""
        return self.scene.needle.mass_per_length * self.scene.needle.length

    def push(self, time: float) -> float:
        """Return the push [N]."""
        return float(as_function(self.scene.insertion.push_force or 0.0).value(time))

    def direction(self, state: PushState) -> int:
        """Return 1 if the needle moves or begins to move in, -1 out, 0 if it rests."""
        if state.speed != 0.0:
            return int(copysign(1, state.speed))
        hold = axial.hold_at(self.scene, state.depth, state.deepest, state.punctured)
        driving = self.push(state.time) + state.axial_force
        return int(driving > hold.inward) - int(driving < -hold.outward)

    def step(self, state: PushState, until: float, last: Step | None, direction: int) -> PushStep:
        """Advance to a time in one direction, or at rest, without looking for events."""
        if direction == 0:
            return self._rest(state, until, last)
        return self._slide(state, until, last, direction)

    def _rest(self, state: PushState, until: float, last: Step | None) -> PushStep:
        motion = StepMotion(self.stepper.method, state.time, until - state.time, state.depth, np.zeros(4), 0)
        start = self.stepper.start(motion, state.time, until, state.end)
        lateral = self.stepper.advance(motion, start, until, last)
        after = replace(state, end=lateral.ends[1], speed=0.0, axial_force=self.axial_force(lateral))
        return PushStep(lateral, after, Works())

    def _slide(self, state: PushState, until: float, last: Step | None, direction: int) -> PushStep:
        method, length = self.stepper.method, until - state.time
        speeds, before = np.full(4, state.speed), inf
        for _ in range(MOST_ITERATIONS):
            motion = StepMotion(method, state.time, length, state.depth, speeds, direction)
            start = self.stepper.start(motion, state.time, until, state.end)
            last = self.stepper.advance(motion, start, until, last)
            found, forces = self._speeds(last, state, direction)
            change, largest = float(np.max(np.abs(found - speeds))), float(np.max(np.abs(found)))
            if change <= SPEED_TOLERANCE * largest or before <= change <= SPEED_ROUNDING * largest:
                return self._slid(state, last, motion, forces)
            speeds, before = found, change
        raise FloatingPointError("the insertion speed does not converge")

    def _speeds(self, step: Step, state: PushState, direction: int) -> tuple[Array, _AxialForces]:
        """Return the speeds at start, nodes and end that the axial equations give on the lateral solution of a trial motion."""
        method, length, inertia = step.method, step.length, self.stepper.inertia
        forces = self._forces(step, state, direction)
        begin = self.mass * state.speed + _momentum(step.ends[0], inertia)
        momenta = np.array([_momentum(StepEnd(s, q), inertia) for s, q in zip(step.stages, step.solutions, strict=True)])
        matrix = np.linalg.inv(method.inverse) * length
        equations = self.mass * np.eye(2) + matrix * forces.viscous
        nodes = np.linalg.solve(equations, begin - momenta + matrix @ forces.constant)
        change = float(method.end @ (self.mass * nodes + momenta - begin))
        end = (begin + change - _momentum(step.ends[1], inertia)) / self.mass
        return np.array([state.speed, *nodes, end]), forces

    def _forces(self, step: Step, state: PushState, direction: int) -> _AxialForces:
        constant, viscous = [], []
        ahead = state.depth * (1 + direction * LAYER_SIDE)
        cutting = axial.cutting_force(self.scene, ahead, float(direction), state.deepest)
        for stage, solution in zip(step.stages, step.solutions, strict=True):
            time, depth = stage.instant.time, stage.instant.depth
            lateral = 0.0
            if self.stepper.plant.axial_force_acts:
                lateral = configuration_force(self.stepper.plant, stage, solution, inertia=self.stepper.inertia)
            friction = direction * axial.coulomb_force(self.scene, depth)
            constant.append(self.push(time) - friction - cutting + lateral)
            viscous.append(axial.viscous_coefficient(self.scene, depth))
        return _AxialForces(np.array(constant), np.array(viscous), cutting)

    def _slid(self, state: PushState, step: Step, motion: StepMotion, forces: _AxialForces) -> PushStep:
        nodes, weights = motion.speeds[1:3], step.method.weights * step.length
        pushes = np.array([self.push(stage.instant.time) for stage in step.stages])
        coulomb = np.array([axial.coulomb_force(self.scene, stage.instant.depth) for stage in step.stages])
        works = Works(
            friction_dissipation=float(weights @ (coulomb * np.abs(nodes) + forces.viscous * nodes**2)),
            cutting_work=forces.cutting * float(weights @ nodes),
            push_work=float(weights @ (pushes * nodes)),
        )
        end = step.ends[1]
        depth = motion.depth(end.stage.instant.time)
        after = PushState(
            end,
            depth,
            float(motion.speeds[3]),
            max(state.deepest, depth),
            state.punctured | axial.entered_layers(self.scene, depth),
            self.axial_force(step),
        )
        return PushStep(step, after, works)

    def axial_force(self, step: Step, *, at_start: bool = False) -> float:
        """Return A [N] at the end, or the start, of a step."""
        return axial_force_at(self.stepper.plant, step, at_start=at_start, inertia=self.stepper.inertia)


@dataclass(frozen=True, eq=False)
class _AxialForces:
    """At the nodes: all forces but the viscous one [N], its coefficient [N s/m], the cutting force [N]."""

    constant: Array
    viscous: Array
    cutting: float


def _momentum(end: StepEnd, inertia: bool) -> float:
    return axial_momentum(end.stage, end.solution.coordinates, end.solution.velocities) if inertia else 0.0


def first_event(pusher: Pusher, state: PushState, step: PushStep, direction: int, limits: Limits) -> tuple[str, float] | None:
    """Return the first thing that happens in a step and the depth (or speed 0, force margin 0) at which it does."""
    if direction == 0:
        return ("breaks away", 0.0) if pusher.direction(step.state) != 0 else None
    levels = limits.between(state.depth, step.state.depth)
    turned = step.state.speed * direction <= 0.0
    if levels:
        return "reaches", levels[0]
    return ("stops", 0.0) if turned else None


@dataclass(frozen=True)
class Limits:
    """Depths [m] at which something changes: interfaces, the end of the cut path, the ends of the run."""

    levels: tuple[float, ...]

    def next(self, depth: float, direction: int) -> float | None:
        """Return the nearest level ahead, None without one or at rest."""
        ahead = [level for level in self.levels if (level - depth) * direction > 0]
        return min(ahead, key=lambda level: abs(level - depth)) if ahead else None

    def between(self, start: float, end: float) -> list[float]:
        """Return the levels strictly after the start and up to the end, nearest first."""
        if end >= start:
            return sorted(level for level in self.levels if start < level <= end)
        return sorted((level for level in self.levels if end <= level < start), reverse=True)


def locate(pusher: Pusher, state: PushState, until: float, direction: int, event: tuple[str, float]) -> PushStep:
    """Return the step that ends exactly at an event, found by false position and bisection in time.

    A trial that goes beyond an interface may not converge, because A jumps there, and one beyond a guide cannot be solved: it
    counts as beyond.
    """
    kind, level = event

    def tried(time: float) -> tuple[PushStep | None, float]:
        try:
            step = pusher.step(state, time, None, direction)
        except (FloatingPointError, np.linalg.LinAlgError, SingularMatrixError):
            return None, inf
        if kind == "reaches":
            return step, (step.state.depth - level) * direction
        return step, -step.state.speed * direction if kind == "stops" else -_margin(pusher, step.state)

    length = until - state.time
    low, high = state.time, until
    short: PushStep | None = None
    low_value, (found, high_value) = -inf, tried(until)
    while high - low > TIME_RESOLUTION * length:
        time = _between(low, high, low_value, high_value)
        step, value = tried(time)
        if value < 0:
            low, low_value, short = time, value, step
            found = step if high_value == inf else found
        else:
            high, high_value, found = time, value, step or found
    if kind == "reaches":  # a node at the end of a step that goes beyond would be in the layer ahead
        found = short or found
    if found is None or (kind == "reaches" and abs(found.state.depth - level) > LANDING * (abs(level) + abs(state.depth))):
        raise FloatingPointError("the insertion speed does not converge")
    if kind != "reaches":
        return replace(found, state=replace(found.state, speed=0.0), event=kind)
    # Exactly there: a rounding beyond would count as cut, or as pierced.
    entered = state.punctured | axial.entered_layers(pusher.scene, level)
    landed = replace(found.state, depth=level, deepest=max(state.deepest, level), punctured=entered)
    return replace(found, state=landed, event=kind)


def _between(low: float, high: float, low_value: float, high_value: float) -> float:
    """Return where the line between two values crosses zero, kept inside; the middle where a value is missing."""
    share = low_value / (low_value - high_value) if isfinite(low_value) and isfinite(high_value) else 0.5
    return low + (high - low) * min(max(share, 0.05), 0.95)


def _margin(pusher: Pusher, state: PushState) -> float:
    """Return how far push and A are below the nearer threshold (positive) or beyond it (negative) [N]."""
    hold = axial.hold_at(pusher.scene, state.depth, state.deepest, state.punctured)
    driving = pusher.push(state.time) + state.axial_force
    return min(hold.inward - driving, driving + hold.outward)
