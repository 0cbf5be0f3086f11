"""The loop over time of a force-driven insertion: steps that end where something happens."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from fem_needle import axial
from fem_needle.banded import SingularMatrixError
from fem_needle.errors import ComputationError
from fem_needle.initial import initial_state
from fem_needle.ledger import Works, jump_works, landing_works, row_correction, step_works
from fem_needle.limits import check_steps
from fem_needle.march import RunEnd, TimeGrid, row_change
from fem_needle.motion import depth_law, shortest_period
from fem_needle.plant import Plant
from fem_needle.pushing import Limits, Pusher, PushState, PushStep, StepMotion, first_event, locate
from fem_needle.samples import Sample, sample_step
from fem_needle.scene import Scene
from fem_needle.segments import interfaces
from fem_needle.steppers import DynamicStepper, Step

STEPS_PER_PERIOD = 32  # of a swinging push: between two ends of steps it is looked for no second crossing of a threshold
TRIAL_ERRORS = (FloatingPointError, np.linalg.LinAlgError, SingularMatrixError)
STUCK_MARGIN = 10.0  # times |A|: a needle this far below its thresholds stays


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


@dataclass
class PushMarching:
    """A pushed run between two steps; whoever closes a loop changes the pusher where something is commanded.

    Attributes
    ----------
    pusher, limits
        How it steps, and where it ends.
    state, last
        The needle now, and the lateral step that led there (None at the start).
    start
        The needle at t = 0.
    works
        Since the start, without the correction at the end of a row of steps.
    steps
        How many were taken.
    landed
        Whether the next step begins at a kink.
    started
        Whether the needle has begun under the scene's own inputs, so that works count from the first step on.
    """

    pusher: Pusher
    limits: RunLimits
    state: PushState
    start: PushState
    works: Works
    last: Step | None = None
    steps: int = 0
    landed: bool = False
    started: bool = False

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.state.time

    def advance(self, until: float) -> str | None:
        """Take one step, to a time or to what happens before it; returns why the run ends there, None where it goes on."""
        step = self._guarded(until)
        self._take(step)
        return self._end_reason()

    def sample(self, *, at_start: bool = False) -> Sample:
        """Return the sample after the last step, or in front of it, where it was the first one."""
        if self.last is None:
            raise ComputationError("there is no sample before the first step")
        pusher, inertia = self.pusher, self.pusher.stepper.inertia
        state, shown = self.start, Works()
        if not at_start:
            state, shown = self.state, self.works + row_correction(self.last, inertia=inertia, at_start=False)
        found = sample_step(
            pusher.stepper.plant, self.last, shown, state.deepest, state.depth, at_start=at_start, inertia=inertia
        )
        push, speed = pusher.push(found.time), state.speed
        friction = axial.friction_force(pusher.scene, state.depth, speed) if speed else push + state.axial_force
        kinetic = 0.5 * pusher.mass * speed**2
        return replace(found, speed=speed, push_force=push, friction_force=friction, axial_kinetic_energy=kinetic)

    def _guarded(self, until: float) -> PushStep:
        state, pusher = self.state, self.pusher
        try:
            direction, levels = pusher.direction(state), self._levels()
            try:
                step = pusher.step(state, until, self.last, direction)
            except TRIAL_ERRORS:  # A jumps where the tip passes an interface, a guide comes to an end at the hub: stop there
                event = levels.next(state.depth, direction)
                if event is None:
                    raise
                return locate(pusher, state, until, direction, ("reaches", event))
            found = first_event(pusher, state, step, direction, levels)
            return step if found is None else locate(pusher, state, until, direction, found)
        except (SingularMatrixError, np.linalg.LinAlgError, FloatingPointError) as error:
            raise ComputationError(
                f"the step at time {state.time:g} s, depth {state.depth:g} m failed: {error}; use a smaller time_step"
            ) from error

    def _levels(self) -> Limits:
        plant, limits = self.pusher.stepper.plant, self.limits
        levels = [*interfaces(plant.scene.tissue.layers), 0.0, limits.contact, plant.smallest_depth]
        if limits.final_depth is not None:
            levels.append(limits.final_depth)
        return Limits((*levels, self.state.deepest))

    def _take(self, step: PushStep) -> None:
        """Add a step's works, and stop a needle dead at a membrane that it cannot pierce."""
        lateral, inertia = step.lateral, self.pusher.stepper.inertia
        if self.steps or self.started:
            self.works = self.works + landing_works(self.state.end, lateral.ends[0], inertia=inertia)
        self.works = self.works + row_change(self.last, lateral, landed=self.landed, inertia=inertia)
        self.works = self.works + step.works + step_works(lateral, inertia=inertia)
        self.landed = step.event is not None
        self.state, self.last, self.steps = step.state, lateral, self.steps + 1
        if step.event == "reaches":
            self._meet_membrane()

    def _meet_membrane(self) -> None:
        state, pusher = self.state, self.pusher
        hold = axial.hold_at(pusher.scene, state.depth, state.deepest, state.punctured)
        if hold.membrane is None or state.speed <= 0.0:
            return
        if pusher.push(state.time) + state.axial_force > hold.inward:
            self.state = replace(state, punctured=state.punctured | {hold.membrane})
            return
        # Arrested: momentum P is continuous, the speed is not; what the lateral motion does not take is lost.
        stopped = StepMotion(pusher.stepper.method, state.time, 1.0, state.depth, np.zeros(4), 0)
        after = pusher.stepper.start(stopped, state.time, state.time, state.end)
        jump = jump_works(state.end, after) if pusher.stepper.inertia else Works()
        lost = 0.5 * pusher.mass * state.speed**2 - jump.boundary_energy
        self.works = self.works + jump + Works(arrest_loss=lost)
        self.state = replace(state, end=after, speed=0.0)

    def _end_reason(self) -> str | None:
        state, limits = self.state, self.limits
        if limits.final_depth is not None and state.depth >= limits.final_depth:
            return "final-depth"
        if state.depth >= limits.contact:
            return limits.contact_reason
        if state.depth <= 0.0 and state.speed < 0.0:
            return "withdrawn"
        return "stuck" if _is_stuck(self.pusher, state) else None


def march_pushed(plant: Plant, stepper: DynamicStepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Yield a sample at each output time until the run ends; the generator's value says how it ended.

    Raises
    ------
    ComputationError
        If a step cannot be solved; says at which time and depth.
    """
    check_steps(grid.outputs[-1], shortest_period(plant.scene) / STEPS_PER_PERIOD)
    first, end, count = next(grid.intervals())
    run = started_push(plant, stepper, (end - first) / count)
    outputs = set(grid.outputs)
    for start, end, count in grid.intervals():
        length = min((end - start) / count, shortest_period(plant.scene) / STEPS_PER_PERIOD)
        while run.time < end - 1e-12 * length:
            until = min(run.time + length, end)
            reason = run.advance(end if end - until < 1e-9 * length else until)
            if run.steps == 1:
                yield run.sample(at_start=True)
            if reason is not None:
                yield run.sample()
                return RunEnd(reason, run.steps)
        if end in outputs:
            yield run.sample()
    return RunEnd("duration", run.steps)


def started_push(plant: Plant, stepper: DynamicStepper, length: float) -> PushMarching:
    """Return a pushed run at t = 0, at rest; A there comes from a trial step of some length [s] at rest."""
    pusher, scene = Pusher(stepper), plant.scene
    depth = scene.insertion.first_depth
    entered = axial.entered_layers(scene, depth)
    state = PushState(initial_state(stepper.plant, depth_law(scene)), depth, 0.0, depth, entered, 0.0)
    trial = pusher.step(state, length, None, 0).lateral
    state = replace(state, axial_force=pusher.axial_force(trial, at_start=True))
    return PushMarching(pusher, run_limits(scene), state, state, Works())


def _is_stuck(pusher: Pusher, state: PushState) -> bool:
    """Return whether a resting needle will rest for ever: a constant push, far below the thresholds."""
    scene = pusher.scene
    if state.speed != 0.0 or not isinstance(scene.insertion.push_force, float) or state.time == 0.0:
        return False
    hold = axial.hold_at(scene, state.depth, state.deepest, state.punctured)
    driving, slack = scene.insertion.push_force, STUCK_MARGIN * abs(state.axial_force)
    return driving + slack < hold.inward and driving - slack > -hold.outward
