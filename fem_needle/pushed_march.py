"""The loop over time of a force-driven insertion: steps that end where something happens."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from fem_needle import axial
from fem_needle.banded import SingularMatrixError
from fem_needle.errors import ComputationError
from fem_needle.initial import initial_state
from fem_needle.ledger import Works, jump_works, row_correction, step_works
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
class _Run:
    """What changes while the loop goes on."""

    state: PushState
    works: Works
    last: Step | None = None
    steps: int = 0
    landed: bool = False


def march_pushed(plant: Plant, stepper: DynamicStepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Yield a sample at each output time until the run ends; the generator's value says how it ended.

    Raises
    ------
    ComputationError
        If a step cannot be solved; says at which time and depth.
    """
    pusher, limits = Pusher(stepper), run_limits(plant.scene)
    run = _Run(_initial_push_state(pusher, grid), Works())
    for start, end, count in grid.intervals():
        length = min((end - start) / count, shortest_period(plant.scene) / STEPS_PER_PERIOD)
        while run.state.time < end - 1e-12 * length:
            until = min(run.state.time + length, end)
            until = end if end - until < 1e-9 * length else until
            step = _guarded(pusher, run, until, limits)
            if run.steps == 0:
                yield _sample(pusher, run, step, at_start=True)
            _take(pusher, run, step)
            reason = _end_reason(pusher, run, limits)
            if reason is not None:
                yield _sample(pusher, run, step, at_start=False)
                return RunEnd(reason, run.steps)
        if end in grid.outputs:
            yield _sample(pusher, run, step, at_start=False)
    return RunEnd("duration", run.steps)


def _initial_push_state(pusher: Pusher, grid: TimeGrid) -> PushState:
    """Return the state at t = 0, at rest; A there comes from a trial step at rest."""
    plant = pusher.stepper.plant
    scene, depth = plant.scene, plant.scene.insertion.first_depth
    entered = axial.entered_layers(scene, depth)
    state = PushState(initial_state(pusher.stepper.plant, depth_law(scene)), depth, 0.0, depth, entered, 0.0)
    first, end, count = next(grid.intervals())
    trial = pusher.step(state, first + (end - first) / count, None, 0).lateral
    return replace(state, axial_force=pusher.axial_force(trial, at_start=True))


def _guarded(pusher: Pusher, run: _Run, until: float, limits: RunLimits) -> PushStep:
    state = run.state
    try:
        direction, levels = pusher.direction(state), _levels(pusher, state, limits)
        try:
            step = pusher.step(state, until, run.last, direction)
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


def _levels(pusher: Pusher, state: PushState, limits: RunLimits) -> Limits:
    levels = [*interfaces(pusher.scene.tissue.layers), 0.0, limits.contact, pusher.stepper.plant.smallest_depth]
    if limits.final_depth is not None:
        levels.append(limits.final_depth)
    return Limits((*levels, state.deepest))


def _take(pusher: Pusher, run: _Run, step: PushStep) -> None:
    """Add a step's works, and stop a needle dead at a membrane that it cannot pierce."""
    lateral = step.lateral
    run.works = run.works + jump_works(run.state.end, lateral.ends[0]) if pusher.stepper.inertia and run.steps else run.works
    inertia = pusher.stepper.inertia
    run.works = run.works + row_change(run.last, lateral, landed=run.landed, inertia=inertia)
    run.works = run.works + step.works + step_works(lateral, inertia=inertia)
    run.landed = step.event is not None
    run.state, run.last, run.steps = step.state, lateral, run.steps + 1
    if step.event == "reaches":
        _meet_membrane(pusher, run)


def _meet_membrane(pusher: Pusher, run: _Run) -> None:
    state = run.state
    hold = axial.hold_at(pusher.scene, state.depth, state.deepest, state.punctured)
    if hold.membrane is None or state.speed <= 0.0:
        return
    if pusher.push(state.time) + state.axial_force > hold.inward:
        run.state = replace(state, punctured=state.punctured | {hold.membrane})
        return
    # Arrested: momentum P is continuous, the speed is not; what the lateral motion does not take is lost.
    stopped = StepMotion(pusher.stepper.method, state.time, 1.0, state.depth, np.zeros(4), 0)
    after = pusher.stepper.start(stopped, state.time, state.time, state.end)
    jump = jump_works(state.end, after) if pusher.stepper.inertia else Works()
    lost = 0.5 * pusher.mass * state.speed**2 - jump.boundary_energy
    run.works = run.works + jump + Works(arrest_loss=lost)
    run.state = replace(state, end=after, speed=0.0)


def _end_reason(pusher: Pusher, run: _Run, limits: RunLimits) -> str | None:
    state = run.state
    if limits.final_depth is not None and state.depth >= limits.final_depth:
        return "final-depth"
    if state.depth >= limits.contact:
        return limits.contact_reason
    if state.depth <= 0.0 and state.speed < 0.0:
        return "withdrawn"
    return "stuck" if _is_stuck(pusher, state) else None


def _is_stuck(pusher: Pusher, state: PushState) -> bool:
    """Return whether a resting needle will rest for ever: a constant push, far below the thresholds."""
    scene = pusher.scene
    if state.speed != 0.0 or not isinstance(scene.insertion.push_force, float) or state.time == 0.0:
        return False
    hold = axial.hold_at(scene, state.depth, state.deepest, state.punctured)
    driving, slack = scene.insertion.push_force, STUCK_MARGIN * abs(state.axial_force)
    return driving + slack < hold.inward and driving - slack > -hold.outward


def _sample(pusher: Pusher, run: _Run, step: PushStep, *, at_start: bool) -> Sample:
    state, scene, inertia = run.state, pusher.scene, pusher.stepper.inertia
    shown = run.works if at_start else run.works + row_correction(step.lateral, inertia=inertia, at_start=False)
    sample = sample_step(
        pusher.stepper.plant,
        step.lateral,
        shown,
        state.deepest,
        state.depth,
        at_start=at_start,
        inertia=inertia,
    )
    push = pusher.push(sample.time)
    friction = axial.friction_force(scene, state.depth, state.speed) if state.speed else push + state.axial_force
    kinetic = 0.5 * pusher.mass * state.speed**2
    return replace(sample, speed=state.speed, push_force=push, friction_force=friction, axial_kinetic_energy=kinetic)
