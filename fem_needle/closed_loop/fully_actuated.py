"""Inverse dynamics with a force on every coordinate: the thesis' controller, which no actuator can build.

With forces F on the depth and on every lateral coordinate that cancel the model's own dynamics, each error obeys

    e'' + k_v e' + k_p e = 0,   e = z_d - z and e_i = -q_i,

whatever the needle and the tissue. The motion is thus known in closed form, and the forces that it needs follow from the model:

    F_q = d/dt (M q' + v S q) - v S^T q' - v^2 R q + (K + m G) q + C q' + v D q - N.forces

It is no sampled controller and sees every coordinate; it is kept to be compared with what can be built.
"""

from __future__ import annotations

import time as clock
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import ceil
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from fem_needle.axial import friction_force
from fem_needle.closed_loop.outcome import Effort, first_arrival, outcome
from fem_needle.collocation import collocation
from fem_needle.dynamics.grid import output_times
from fem_needle.errors import SceneError
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd, StepParts, Works, step_works
from fem_needle.loads import load_case
from fem_needle.motion import Instant, depth_law
from fem_needle.plant import Plant
from fem_needle.samples import Sample, sample_step, stacked
from fem_needle.scene import Scene
from fem_needle.skipping import unneeded_terms
from fem_needle.stages import StageSolution, evaluate_stage, internal_force, momentum
from fem_needle.trajectory import Trajectory, summary_of, trajectory_from_samples

Array = NDArray[np.float64]

STEPS_PER_DECAY = 40  # in the time constant of the errors, over which forces and works are integrated
DIFFERENCE = 1e-2  # of a step: of the four instants that give the rate of the momentum
OUTPUTS = 200


@dataclass(frozen=True, eq=False)
class ErrorDynamics:
    """e'' + k_v e' + k_p e = 0.

    Attributes
    ----------
    position, velocity
        k_p [1/s^2] and k_v [1/s].
    """

    position: float
    velocity: float

    def at(self, error: Any, rate: Any, time: float) -> tuple[Any, Any, Any]:
        """Return error, its rate and its second derivative after a time [s]."""
        matrix = np.array([[0.0, 1.0], [-self.position, -self.velocity]])
        flow = scipy.linalg.expm(time * matrix)
        now, rate_now = flow[0, 0] * error + flow[0, 1] * rate, flow[1, 0] * error + flow[1, 1] * rate
        return now, rate_now, -self.position * now - self.velocity * rate_now

    @property
    def time_constant(self) -> float:
        """How fast the quickest part of it changes [s]."""
        return 1.0 / float(np.max(np.abs(np.roots([1.0, self.velocity, self.position]))))


@dataclass(frozen=True, eq=False)
class IdealMotion:
    """The needle under fully actuated inverse dynamics.

    Attributes
    ----------
    plant
        The model, which is also the one that the law cancels.
    errors
        The dynamics of the errors.
    """

    plant: Plant
    errors: ErrorDynamics

    @cached_property
    def _start(self) -> StepEnd:
        return initial_state(self.plant, depth_law(self.plant.scene))

    def instant(self, time: float) -> Instant:
        """Return the insertion: prescribed, or, of a push, on its way to the target's depth."""
        scene = self.plant.scene
        if scene.insertion.kind != "force":
            return depth_law(scene).after(time)
        goal = goal_depth(scene)
        error, rate, second = self.errors.at(goal - scene.insertion.first_depth, 0.0, time)
        return Instant(time, goal - error, -rate, -second)

    def state(self, time: float) -> StepEnd:
        """Return the needle at a time [s]."""
        instant = self.instant(time)
        case = load_case(self.plant.scene, instant.depth, time)
        stage = evaluate_stage(self.plant, instant, case)
        clamped, first = self.plant.prescribed, self._start.solution
        coordinates, velocities, _ = self.errors.at(first.coordinates, first.velocities, time)
        coordinates[:clamped], velocities[:clamped] = case.clamp[:clamped], case.clamp_rates[:clamped]
        found = StageSolution(coordinates, velocities, momentum(stage, coordinates, velocities), case.forces)
        return StepEnd(stage, found)

    def force(self, time: float, difference: float) -> tuple[Array, Array]:
        """Return F_q and q' at a time [s]; the momentum is differentiated over four instants a ``difference`` apart [s]."""
        end = self.state(time)
        ahead, back = self._momentum(time + difference), self._momentum(time - difference)
        far_ahead, far_back = self._momentum(time + 2 * difference), self._momentum(time - 2 * difference)
        rate = (8.0 * (ahead - back) - (far_ahead - far_back)) / (12.0 * difference)
        solution = end.solution
        needed = rate - internal_force(end.stage, solution.coordinates, solution.velocities)
        needed = needed - end.stage.points.rows.T @ solution.forces
        needed[: self.plant.prescribed] = 0.0
        return needed, solution.velocities

    def _momentum(self, time: float) -> Array:
        return self.state(time).solution.momentum

    def step(self, start: StepEnd, until: float) -> StepParts:
        """Return what happens up to a time as a step, from which forces and works are taken."""
        method, time = collocation(1.0), start.stage.instant.time
        nodes = [self.state(time + node * (until - time)) for node in method.nodes]
        stages, solutions = tuple(node.stage for node in nodes), tuple(node.solution for node in nodes)
        return StepParts(self.plant, method, until - time, (start, self.state(until)), stages, solutions)


def goal_depth(scene: Scene) -> float:
    """Return the depth [m] to which a push is brought.

    Raises
    ------
    SceneError
        If the scene names none.
    """
    goal = scene.target.depth if scene.target.depth is not None else scene.insertion.final_depth
    if goal is None:
        raise SceneError("target.depth: is required by fully-actuated inverse dynamics of a push (allowed above 0 m)")
    return goal


def check_fully_actuated(scene: Scene) -> None:
    """Refuse what the law cannot cancel or has no meaning with it.

    Raises
    ------
    SceneError
        If the scene has guides, a cut path, no duration or another analysis than "dynamic".
    """
    mistakes = []
    if scene.support.guides:
        mistakes.append("support.guides: fully-actuated inverse dynamics knows no constraints (allowed none)")
    if scene.tissue.rest_line != "straight":
        mistakes.append("tissue.rest_line: fully-actuated inverse dynamics knows no path (got 'cut-path'; allowed 'straight')")
    if scene.insertion.kind == "force" and scene.run.duration is None:
        mistakes.append("run.duration: is required by fully-actuated inverse dynamics, whose needle only nears its depth")
    if scene.numerics.analysis not in {"auto", "dynamic"}:
        found = scene.numerics.analysis
        mistakes.append(f"numerics.analysis: inverse dynamics needs inertia (got '{found}'; allowed 'auto', 'dynamic')")
    if scene.model.variant == "as-printed":
        mistakes.append("model.variant: the printed equations have no consistent force (got 'as-printed'; allowed the others)")
    if mistakes:
        raise SceneError(mistakes)


def fully_actuated(plant: Plant) -> Trajectory:
    """Return the run of a needle under fully actuated inverse dynamics.

    Raises
    ------
    SceneError
        As `check_fully_actuated`.

    Notes
    -----
    The work of the forces on the lateral coordinates stands in ``load_work``, so that the ledger closes.
    """
    scene = plant.scene
    check_fully_actuated(scene)
    begun = clock.perf_counter()
    duration = scene.duration
    gains = scene.controller.gains
    pace = 20.0 / duration  # default: critically damped, gone long before the end
    errors = ErrorDynamics(gains.position or pace**2, gains.velocity or 2.0 * (gains.position or pace**2) ** 0.5)
    given = scene.numerics.output_step
    outputs = output_times(duration, given if isinstance(given, float) else duration / OUTPUTS)
    motion, run = IdealMotion(plant, errors), _Account(plant)
    step_time = errors.time_constant / STEPS_PER_DECAY
    state = motion.state(0.0)
    for start, end in pairwise(outputs):
        count = ceil((end - start) / step_time)
        for number in range(1, count + 1):
            step = motion.step(state, end if number == count else start + number * (end - start) / count)
            if not run.samples:
                run.samples.append(_sample(plant, step, Works(), at_start=True))
            run.add(motion, step)
            state = step.ends[1]
        run.samples.append(_sample(plant, step, run.works, at_start=False))
    return _trajectory(plant, run, outputs, clock.perf_counter() - begun)


@dataclass
class _Account:
    """Samples and works so far."""

    plant: Plant
    samples: list[Sample] = field(default_factory=list)
    works: Works = field(default_factory=Works)
    lateral_work: float = 0.0

    def add(self, motion: IdealMotion, step: StepParts) -> None:
        """Add what a step does: the plant's own works and that of the forces on the coordinates."""
        found, scene, power = step_works(step, inertia=True), self.plant.scene, 0.0
        friction = 0.0
        for weight, stage in zip(step.method.weights * step.length, step.stages, strict=True):
            force, velocities = motion.force(stage.instant.time, DIFFERENCE * step.length)
            power = float(force @ velocities)
            self.lateral_work += weight * abs(power)
            friction += weight * stage.instant.speed * friction_force(scene, stage.instant.depth, stage.instant.speed)
            found = replace(found, load_work=found.load_work + weight * power)
        self.works = self.works + replace(found, friction_dissipation=friction)


def _sample(plant: Plant, step: StepParts, works: Works, *, at_start: bool) -> Sample:
    depth = step.ends[0 if at_start else 1].stage.instant.depth
    return sample_step(plant, step, works, depth, depth, at_start=at_start, inertia=True)


def _trajectory(plant: Plant, run: _Account, outputs: tuple[float, ...], elapsed: float) -> Trajectory:
    scene, samples = plant.scene, run.samples
    found = trajectory_from_samples(plant, stacked(samples), {}, scene)
    arrival, efforts = first_arrival(scene, samples[0].depth, float(found.tip_deflection[0])), {}
    for time, depth, tip in zip(found.time, found.depth, found.tip_deflection, strict=True):
        arrival = arrival.followed(scene, float(time), float(depth), float(tip))
    if scene.insertion.kind == "force":  # the push follows from the motion, and its work from the balance
        push = found.push_force
        found.series["push_work"] = found.axial_energy_residual + found.push_work
        found.series["axial_energy_residual"] = np.zeros_like(push)
        found.signals["command_push_force"] = push.copy()
        efforts["push_force"] = Effort(float(np.trapezoid(np.abs(push), found.time)), float(np.max(np.abs(push))))
    steps = {"time_step": outputs[1] - outputs[0], "steps": len(outputs) - 1, "analysis": "dynamic"}
    skipped = {"skipped": [asdict(one) for one in unneeded_terms(scene)]}
    wrong = "fully-actuated inverse dynamics needs a force on every coordinate of the needle: no actuator can build it"
    found.summary.update(
        plant.describe()
        | steps
        | skipped
        | summary_of(found)
        | outcome(scene, arrival, efforts)
        | {"lateral_work": float(run.lateral_work), "error_estimate": None, "warnings": [wrong, *plant.warnings]}
        | {"stop_reason": "duration", "solve_time": elapsed, "wall_time": elapsed}
    )
    return found
