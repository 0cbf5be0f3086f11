"""A needle with inertia or viscosity, stepped by compiled code between two decisions, for loops that need no energy balance.

Matrices at all coming steps are prepared at once; a step then costs what its equations cost. Only forces may be commanded: they
are the only part of the equations that a decision then changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.engine import SAME_TIME, Kinks
from fem_needle.closed_loop.inputs import Driven, Inputs, Ramp, with_inputs
from fem_needle.closed_loop.lean import FORCES, Upcoming
from fem_needle.closed_loop.response_engine import UNKNOWN, depth_function
from fem_needle.compiled.arguments import NodeCourse, arguments, at_nodes
from fem_needle.compiled.loop import run_steps
from fem_needle.compiled.notice import announced
from fem_needle.errors import SceneError
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd
from fem_needle.legs.course import instants_of
from fem_needle.loads import LoadCase, load_case, load_cases
from fem_needle.march import failed_step
from fem_needle.motion import depth_law, run_duration
from fem_needle.plant import Plant
from fem_needle.samples import Sample, sample_step
from fem_needle.stages import StageSolution, evaluate_stage, velocities_of
from fem_needle.steppers import DynamicStepper

Array = NDArray[np.float64]
MOST_STEPS = 200  # prepared at once


@dataclass(eq=False)
class _Block:
    """Prepared steps.

    Attributes
    ----------
    times
        Ends of the steps, the start included (steps + 1,).
    arguments
        Of `run_steps`; forces at the nodes are changed where something is commanded.
    node_times, tip_forces
        At the nodes (2 steps,): times, and the sum of tip loads in the direction 1 [N].
    couplings
        What the loads open at the guides, at the nodes (2 steps, guides, loads); None without guides.
    tip_rows, tip_firsts
        The tip's row at the ends of the steps.
    done
        How many steps were taken.
    """

    times: list[float]
    arguments: tuple[Any, ...]
    node_times: Array
    tip_forces: Array
    couplings: Array | None
    tip_rows: Array
    tip_firsts: list[int]
    done: int = 0


class CompiledEngine:
    """A needle on a prescribed way under commanded forces; meets `fem_needle.closed_loop.engine.Engine`.

    Parameters
    ----------
    plant, stepper, time_step
        As for the others.
    upcoming
        Returns the times after a time [s] at which something is expected to happen, rising: decisions, readings, samples.
        Wrong ones cost time, not accuracy.
    """

    has_works = False

    def __init__(self, plant: Plant, stepper: DynamicStepper, time_step: float, upcoming: Upcoming) -> None:
        scene = plant.scene
        self._plant, self._base, self._time_step, self._upcoming = plant, stepper, time_step, upcoming
        self._inputs, self._law, self._kinks = Inputs(scene), depth_law(scene), Kinks(plant)
        self._depth_at, self._kink, self._ran = depth_function(scene), 0.0, False
        self._unturned = with_inputs(scene, {"tip_direction": 1.0})
        self._crossings: dict[float, tuple[float, ...]] = {}
        self._same = SAME_TIME * time_step
        before = initial_state(stepper.plant, self._law)
        start = stepper.start(self._law, 0.0, time_step, before)
        self._state_now = np.stack([start.solution.coordinates, start.solution.momentum])
        self._block: _Block | None = None
        self.time, self.steps, self.depth = 0.0, 0, self._law.depth(0.0)
        self.deepest = self.depth
        self.tip_deflection = float(start.stage.points.deflections(start.solution.coordinates, start.solution.forces)[-1])

    @property
    def speed(self) -> float:
        """Insertion speed [m/s]."""
        return self._law.speed(self.time)

    @property
    def end(self) -> StepEnd:
        """The lateral state."""
        return self._end(self.time, self._state_now, self._inputs)

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on; anything but a force is refused."""
        for name in inputs.ramps:
            if name not in FORCES:
                raise SceneError(f"command: '{name}' needs the whole ledger (use energies = True)")
        self._inputs = inputs
        if self._block is not None:
            self._set_forces(self._block)

    def advance(self, until: float) -> str | None:
        """Go to a time [s]."""
        while until - self.time > self._same:
            block, end = self._block, min(until, self._inputs.next_kink(self.time + self._same))
            if block is None or block.times[block.done + 1] > end + self._same:
                block = self._prepare(end)
            stop = block.done + 1
            while stop < len(block.times) - 1 and block.times[stop + 1] <= end + self._same:
                stop += 1
            self._run(block, stop)
        return None

    def passing_time(self, level: float) -> float:
        """Return when the tip will pass a depth [m] [s]; infinity where it will not."""
        if level not in self._crossings:
            self._crossings[level] = self._law.crossings(level, run_duration(self._plant.scene))
        return next((time for time in self._crossings[level] if time > self.time), np.inf)

    def sample(self) -> Sample:
        """Return what is known of this instant; what has been done on the way is not."""
        return self.sample_later()()

    def sample_later(self) -> Callable[[], Sample]:
        """Return the function that computes energies and reactions of this instant, when nothing is in a hurry."""
        time, depth, deepest, inputs, state = self.time, self.depth, self.deepest, self._inputs, self._state_now.copy()

        def computed() -> Sample:
            stepper, start = self._driven(inputs, time), self._end(time, state, inputs)
            step = stepper.advance(self._law, start, time + self._time_step, None)
            reactions = stepper.guide_reactions(start.stage, start.solution.coordinates, step.solutions)
            held = replace(start.solution, forces=np.concatenate([reactions, start.stage.case.forces]))
            step = replace(step, ends=(replace(start, solution=held), step.ends[1]))
            return sample_step(self._plant, step, UNKNOWN, deepest, depth, at_start=True, inertia=stepper.inertia)

        return computed

    def _run(self, block: _Block, stop: int) -> None:
        if self._ran:
            done = int(run_steps(block.done, stop, *block.arguments))
        else:
            with announced():
                done = int(run_steps(block.done, stop, *block.arguments))
            self._ran = True
        if done < stop:
            raise failed_step(block.times[done], self._law.depth(block.times[done]), "the equations have no finite answer")
        self.steps += stop - block.done
        block.done, self.time = stop, block.times[stop]
        self.depth = self._depth_at(self.time)
        self.deepest = max(self.deepest, self.depth)
        first = block.tip_firsts[stop]
        row = block.tip_rows[stop]
        self.tip_deflection = float(row @ self._state_now[0, first : first + len(row)])
        if stop == len(block.times) - 1:
            self._block = None

    def _prepare(self, until: float) -> _Block:
        """Prepare the steps up to a time, and on to what is expected after it, at most to the next kink."""
        start = self._landing() if self.time > 0.0 and abs(self.time - self._kink) <= self._same else self.end
        times = self._planned(until)
        instants = instants_of(self._base.plant, self._law, self._base.method, np.array(times), start.stage)
        table = self._base.plant.table(instants.depths)
        nodes = np.arange(1, len(instants.times)).reshape(-1, 3)[:, :2].ravel()
        loads, lengths = instants.loads, np.diff(times)
        forces = loads.forces[nodes].copy()
        course = NodeCourse(
            instants.speeds[nodes],
            instants.factor[nodes],
            forces,
            loads.clamp[nodes],
            loads.clamp_rates[nodes],
            loads.clamp[3::3],
            lengths,
            np.full(len(lengths), -1),
        )
        here = at_nodes(table)
        given = arguments(
            here, course, self._base.method, self._plant.prescribed, self._state_now, inertia=self._base.inertia
        )
        guides, points = here.points.guides, table.points
        middles = self._law.depths(0.5 * (np.array(times[1:]) + np.array(times[:-1])))
        unturned = load_cases(self._unturned, np.repeat(middles, 2), instants.times[nodes]).forces[:, -1]
        self._block = _Block(
            times,
            given,
            instants.times[nodes],
            unturned,
            here.points.flexibility[:, :guides, guides:] if guides else None,
            np.ascontiguousarray(points.rows[::3, -1]),
            points.first[::3, -1].tolist(),
        )
        self._set_forces(self._block)
        return self._block

    def _landing(self) -> StepEnd:
        """Return the state just after this instant, with what a kink does to it."""
        stepper = self._driven(self._inputs, self.time)
        start = stepper.start(self._law, self.time, self.time + self._same, self.end)
        self._state_now[:] = start.solution.coordinates, start.solution.momentum
        return start

    def _planned(self, until: float) -> list[float]:
        """Return the ends of the coming steps [s], the present time first."""
        self._kink = kink = self._kinks.after(self.time + self._same)
        marks = [until, *self._upcoming(until).tolist()]
        times = [self.time]
        for mark in marks:
            end = kink if mark >= kink - self._same else mark
            length = end - times[-1]
            if length > self._same:
                count = max(1, ceil(length / self._time_step - 1e-9))
                times += [times[-1] + length * (number + 1) / count for number in range(count - 1)] + [end]
            if end == kink or len(times) > MOST_STEPS:
                break
        return times

    def _set_forces(self, block: _Block) -> None:
        """Let what is commanded act at the nodes of all steps that are still to come."""
        first = 2 * block.done
        forces = block.arguments[2][1]
        column = {"lateral_force": 0, "hub_torque": forces.shape[1] - 2, "tip_direction": forces.shape[1] - 1}
        for name, ramp in self._inputs.ramps.items():
            values = _values(ramp, block.node_times[first:])
            if name == "tip_direction":
                values = values * block.tip_forces[first:]
            forces[first:, column[name]] = values
        if block.couplings is not None and self._inputs.ramps:
            opened = block.arguments[-1][1]
            opened[first:] = np.einsum("tgl,tl->tg", block.couplings[first:], forces[first:])

    def _driven(self, inputs: Inputs, time: float) -> DynamicStepper:
        plant: Any = Driven(self._base.plant, inputs.driven_scene(time))
        return replace(self._base, plant=plant)

    def _end(self, time: float, state: Array, inputs: Inputs) -> StepEnd:
        """Return a state as a step leaves it."""
        plant = self._driven(inputs, time).plant
        instant = self._law.after(time)
        case: LoadCase = load_case(plant.scene, instant.depth, time)
        stage = evaluate_stage(plant, instant, case)
        coordinates, momentum = state[0].copy(), state[1].copy()
        velocities = velocities_of(plant, stage, coordinates, momentum) if self._base.inertia else np.zeros_like(coordinates)
        forces = np.concatenate([np.zeros(stage.points.guides), case.forces])
        return StepEnd(stage, StageSolution(coordinates, velocities, momentum, forces))


def _values(ramp: Ramp, times: Array) -> Array | float:
    """Return an input at times."""
    if len(times) == 0 or times[0] >= ramp.arrival:
        return ramp.target
    return np.interp(times, [ramp.time, ramp.arrival], [ramp.start, ramp.target])
