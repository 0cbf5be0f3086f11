"""A needle that is pushed by a force: the kernel's steps, which end where something happens.

Found around the kernel, on states: the needle stops or breaks away, reaches an interface, the end of its cut, a membrane, the
end of the run. An event's time is found by false position and bisection; the state then lands on it exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from fem_needle import axial
from fem_needle.dynamics import names as at
from fem_needle.dynamics.engine import Engine, failed_step
from fem_needle.dynamics.state import State
from fem_needle.motion import shortest_period
from fem_needle.sample_arrays import Samples
from fem_needle.scene import Scene, as_function
from fem_needle.segments import interfaces

Array = NDArray[np.float64]

LANDING = 1e-6  # of the depth: a located event that misses its level by more is none
LAYER_SIDE = 1e-11  # of the depth: far enough from an interface to be in the layer that the tip moves in
TIME_RESOLUTION = 1e-9  # of a step: how closely an event's time is found
STUCK_MARGIN = 10.0  # times |A|: a needle this far below its thresholds stays
STEPS_PER_PERIOD = 32  # of a swinging push: between two ends of steps it is looked for no second crossing of a threshold
SAME_END = 1e-9  # of a step: ends closer than this are one


@dataclass(frozen=True)
class RunLimits:
    """Where a push ends: depth [m] and reason."""

    final_depth: float | None
    contact: float
    contact_reason: str


def run_limits(scene: Scene) -> RunLimits:
    """Return the depths that end a run: the wanted one, and where the hub meets a guide, a lateral force or the skin."""
    length = scene.needle.length
    if scene.support.kind == "entry":
        return RunLimits(scene.insertion.final_depth, length, "full-length")
    places = [guide.position for guide in scene.support.guides]
    places += [load.position for load in scene.loads if load.kind == "lateral"]
    return RunLimits(scene.insertion.final_depth, length + min([0.0, *places]), "hub-contact")


def longest_step(scene: Scene) -> float:
    """Return the longest step [s] of a push: its swings are looked at often enough to find every stop."""
    return shortest_period(scene) / STEPS_PER_PERIOD


@dataclass
class Push:
    """A pushed needle under way.

    Attributes
    ----------
    needle
        With its state.
    scene
        What acts; a loop replaces it where something is commanded.
    limits
        Where the run ends.
    counted
        Whether works at the next kink count.
    """

    needle: Engine
    scene: Scene
    limits: RunLimits
    counted: bool = False

    @property
    def _axial(self) -> Array:
        return self.needle.live.axial

    @property
    def time(self) -> float:
        """Time [s]."""
        return float(self._axial[at.NOW])

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return float(self._axial[at.WAY])

    @property
    def speed(self) -> float:
        """Engine speed [m/s]; exactly 0 while friction holds."""
        return float(self._axial[at.PACE])

    @property
    def punctured(self) -> frozenset[int]:
        """Layers that the tip has entered, or whose membrane it has pierced."""
        entered = axial.entered_layers(self.scene, float(self._axial[at.DEEPEST]))
        return entered | ({int(self._axial[at.PIERCED]) - 1} if self._axial[at.PIERCED] else set())

    def push(self, time: float) -> float:
        """Return the push [N]."""
        return float(as_function(self.scene.insertion.push_force or 0.0).value(time))

    @property
    def _driving(self) -> float:
        return self.push(self.time) + float(self._axial[at.AXIAL_FORCE])

    def _hold(self) -> axial.Hold:
        return axial.hold_at(self.scene, self.depth, float(self._axial[at.DEEPEST]), self.punctured)

    @property
    def direction(self) -> int:
        """1 if the needle moves or begins to move in, -1 out, 0 if it rests."""
        if self.speed != 0.0:
            return int(copysign(1, self.speed))
        hold = self._hold()
        return int(self._driving > hold.inward) - int(self._driving < -hold.outward)

    def begin(self, length: float) -> None:
        """Find A at t = 0 by a trial step of some length [s] at rest."""
        before = self.needle.state()
        self._set_limits(0, None, events=False)
        self.needle.advance(np.array([[0.0, length, 1.0, 0.0]]), counted=False, from_start=True)
        found = self.needle.axial_force_at_start
        self.needle.restore(before)
        self._axial[at.AXIAL_FORCE] = found

    def go(self, end: float, length: float, *, output: bool, from_start: bool = False) -> tuple[str | None, list[Samples]]:
        """Go to a time [s] in steps of a length [s] or shorter ones, up to what happens; return why the run ends, and samples."""
        found: list[Samples] = []
        while self.time < end - 1e-12 * length:
            direction = self.direction
            level = self._next_level(direction)
            self._set_limits(direction, level, events=True)
            intervals = self._intervals(end, length, output)
            status, samples = self.needle.advance(intervals, counted=self.counted, from_start=from_start)
            from_start, self.counted = from_start and not len(samples), True
            found.append(samples)
            if status == at.DONE:
                continue
            until = self._interrupted_end(intervals)
            met = self._meet(status, until, direction, level, from_start)
            reason = self._end_reason()
            if reason is not None:
                return reason, [*found, met]
            found.append(met.rows(slice(0, int(from_start))))  # what happens under way is no output, the start is
            from_start = False
        return self._end_reason(), found

    def _intervals(self, end: float, length: float, output: bool) -> Array:
        """Return equal steps from now on and a shorter one at the end."""
        whole = int((end - self.time) / length * (1.0 + 1e-12))
        middle = self.time + whole * length
        if whole and abs(end - middle) < SAME_END * length:
            return np.array([[self.time, end, whole, float(output)]])
        rows = [[self.time, middle, whole, 0.0]] if whole else []
        return np.array([*rows, [middle if whole else self.time, end, 1.0, float(output)]])

    def _interrupted_end(self, intervals: Array) -> float:
        """Return the end [s] of the step in which something happened."""
        interval, step = (int(value) for value in self.needle.cursor[:2])
        start, end, count, _ = intervals[interval]
        return float(end if step + 1 == count else start + (step + 1) * ((end - start) / count))

    def _set_limits(self, direction: int, level: float | None, *, events: bool) -> None:
        limits, depth, deepest = self.needle.limits, self.depth, float(self._axial[at.DEEPEST])
        ahead = depth * (1 + direction * LAYER_SIDE)
        hold = self._hold()
        limits[at.IS_PUSHED], limits[at.DIRECTION], limits[at.AHEAD] = 1.0, direction, ahead
        limits[at.CUTTING_LIMIT] = axial.cutting_force(self.scene, ahead, float(direction), deepest) if direction else 0.0
        limits[at.LEVEL] = direction * inf if level is None else level
        limits[at.INWARD], limits[at.OUTWARD], limits[at.EVENTS] = hold.inward, hold.outward, float(events)

    def _next_level(self, direction: int) -> float | None:
        """Return the nearest depth [m] ahead at which something changes, None without one or at rest."""
        levels = [*interfaces(self.scene.tissue.layers), 0.0, self.limits.contact, self.needle.plant.smallest_depth]
        levels += [] if self.limits.final_depth is None else [self.limits.final_depth]
        levels.append(float(self._axial[at.DEEPEST]))
        ahead = [level for level in levels if (level - self.depth) * direction > 0]
        return min(ahead, key=lambda level: abs(level - self.depth)) if ahead else None

    def _meet(self, status: int, until: float, direction: int, level: float | None, from_start: bool) -> Samples:
        """Take the step that ends exactly where something happens; returns the sample there.

        Raises
        ------
        ComputationError
            If a step has no answer and nothing is ahead that would explain it.
        """
        time, depth = self.time, self.depth
        kind = "breaks away" if direction == 0 else "stops"
        if status == at.EVENT and direction != 0 and level is not None and self._reaches(until, direction, level):
            kind = "reaches"
        if status != at.EVENT:  # A jumps where the tip passes an interface, a guide comes to an end at the hub: stop there
            if level is None:
                raise failed_step(time, depth, WHY[status])
            kind = "reaches"
        found = self._located(kind, level or 0.0, until, direction)
        if found is None:
            raise failed_step(time, depth, "the insertion speed does not converge")
        self._set_limits(direction, level, events=False)
        _, samples = self.needle.advance(np.array([[time, found, 1.0, 1.0]]), counted=self.counted, from_start=from_start)
        self._arrive(kind, level or 0.0)
        return self._shown(samples)

    def _reaches(self, until: float, direction: int, level: float) -> bool:
        state = self._tried(self.needle.state(), until, direction, level)
        return state is not None and (float(self._way_of(state)) - level) * direction >= 0.0

    def _arrive(self, kind: str, level: float) -> None:
        self.needle.land()
        if kind != "reaches":
            self._axial[at.PACE] = 0.0
            return
        if self.speed < 0.0 and level <= self.needle.plant.smallest_depth:  # what is left of it inside is straight: it is out
            level = 0.0
        # Exactly there: a rounding beyond would count as cut, or as pierced.
        deepest = float(self._before_deepest)
        self._axial[at.WAY], self._axial[at.DEEPEST] = level, max(deepest, level)
        if self._axial[at.PIERCED] and self.scene.tissue.layers[int(self._axial[at.PIERCED]) - 1].start != level:
            self._axial[at.PIERCED] = 0.0
        self._meet_membrane()

    def _meet_membrane(self) -> None:
        """Pierce a membrane, or stop dead at it: the momentum is continuous, the speed is not."""
        hold = self._hold()
        if hold.membrane is None or self.speed <= 0.0:
            return
        if self._driving > hold.inward:
            self._axial[at.PIERCED] = hold.membrane + 1
            return
        self._axial[at.PACE], self._axial[at.ARRESTED] = 0.0, 1.0
        self._set_limits(0, None, events=False)
        self.needle.pass_kink(counted=self.counted)
        self.counted = False

    def _shown(self, samples: Samples) -> Samples:
        """Return the sample of an event as the state says: at its very depth, at rest where it has stopped."""
        last, speed, force = len(samples) - 1, self.speed, self._driving
        changes = {
            name: np.array(getattr(samples, name))
            for name in ("depth", "speed", "friction_force", "axial_kinetic_energy", "arrest_loss", "boundary_energy")
        }
        changes["depth"][last], changes["speed"][last] = self.depth, speed
        changes["arrest_loss"][last] = self.needle.live.ledger[at.ARREST_LOSS]
        if self.depth == 0.0 and speed < 0.0 and self.needle.plant.smallest_depth:  # what was inside is out, and straight
            for name in ("kinetic_energy", "bending_energy", "tissue_energy", "coordinates"):
                changes[name] = np.array(getattr(samples, name))
                changes[name][last] = 0.0
        if speed == 0.0:
            changes["friction_force"][last], changes["axial_kinetic_energy"][last] = force, 0.0
        return replace(samples, **changes)

    def _tried(self, before: State, until: float, direction: int, level: float | None) -> State | None:
        """Return the state after one step to a time, None where it cannot be taken; the needle's own state stays."""
        self.needle.restore(before)
        self._set_limits(direction, level, events=False)
        status, _ = self.needle.advance(
            np.array([[float(self.needle.axial_of(before)[at.NOW]), until, 1.0, 0.0]]), counted=self.counted
        )
        after = self.needle.state() if status == at.DONE else None
        self.needle.restore(before)
        return after

    def _way_of(self, state: State) -> float:
        return float(self.needle.axial_of(state)[at.WAY])

    def _value(self, kind: str, level: float, direction: int, state: State) -> float:
        """Return how far a state is beyond an event (positive)."""
        axial_state = self.needle.axial_of(state)
        if kind == "reaches":
            return float((axial_state[at.WAY] - level) * direction)
        if kind == "stops":
            return float(-axial_state[at.PACE] * direction)
        hold = self._hold()
        driving = self.push(float(axial_state[at.NOW])) + float(axial_state[at.AXIAL_FORCE])
        return max(driving - hold.inward, -driving - hold.outward)

    def _located(self, kind: str, level: float, until: float, direction: int) -> float | None:
        """Return the time [s] of an event inside a step, None where it is none.

        A trial that goes beyond an interface may not converge, because A jumps there, and one beyond a guide cannot be solved: it
        counts as beyond.
        """
        before = self.needle.state()
        self._before_deepest = float(self._axial[at.DEEPEST])

        def tried(time: float) -> tuple[State | None, float]:
            state = self._tried(before, time, direction, level)
            return state, inf if state is None else self._value(kind, level, direction, state)

        low, high, low_value = self.time, until, -inf
        short, (found, high_value) = None, tried(until)
        short_time, found_time = low, until
        length = high - low
        while high - low > TIME_RESOLUTION * length:
            time = _between(low, high, low_value, high_value)
            state, value = tried(time)
            if value < 0:
                low, low_value, short, short_time = time, value, state, time
                if high_value == inf:
                    found, found_time = state, time
            else:
                high, high_value = time, value
                if state is not None:
                    found, found_time = state, time
        if kind == "reaches" and short is not None:  # a node at the end of a step that goes beyond would be in the layer ahead
            found, found_time = short, short_time
        if found is None:
            return None
        if kind == "reaches" and abs(self._way_of(found) - level) > LANDING * max(abs(level), self.depth):
            return None
        return found_time

    def _end_reason(self) -> str | None:
        limits = self.limits
        if limits.final_depth is not None and self.depth >= limits.final_depth:
            return "final-depth"
        if self.depth >= limits.contact:
            return limits.contact_reason
        if self.depth <= 0.0 and self.speed < 0.0:
            return "withdrawn"
        return "stuck" if self._is_stuck() else None

    def _is_stuck(self) -> bool:
        """Return whether a resting needle will rest for ever: a constant push, far below the thresholds."""
        if self.speed != 0.0 or not isinstance(self.scene.insertion.push_force, float) or self.time == 0.0:
            return False
        hold, slack = self._hold(), STUCK_MARGIN * abs(float(self._axial[at.AXIAL_FORCE]))
        driving = self.scene.insertion.push_force
        return driving + slack < hold.inward and driving - slack > -hold.outward


WHY: dict[int, str] = {at.FAILED: "the deflection is not finite", at.DIVERGED: "the insertion speed does not converge"}


def _between(low: float, high: float, low_value: float, high_value: float) -> float:
    """Return where the line between two values crosses zero, kept inside; the middle where a value is missing."""
    share = low_value / (low_value - high_value) if isfinite(low_value) and isfinite(high_value) else 0.5
    return low + (high - low) * min(max(share, 0.05), 0.95)
