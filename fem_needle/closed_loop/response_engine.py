"""A needle without inertia and memory, for loops that ask for nothing but its tip: the tip is linear in the inputs.

    tip(z, u) = y0(z) + sum_j g_j(z) u_j

with the gains of the plant itself (`fem_needle.control.model_response`), interpolated over the depth. A decision then costs
microseconds, whatever the number of elements; a whole equilibrium is computed where somebody asks for it: at a sample, or for a
sensor of forces or shapes. Works over time are left out: they would ask for an equilibrium at every decision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from math import inf, nan
from typing import Any

from fem_needle.closed_loop.inputs import Driven, Inputs, Ramp
from fem_needle.control.model_response import STATIC_INPUTS, ModelResponse, depth_range, model_response
from fem_needle.control.signals import own_value
from fem_needle.errors import SceneError
from fem_needle.initial import initial_state
from fem_needle.ledger import StepEnd, Works
from fem_needle.loads import is_steady
from fem_needle.motion import depth_law, run_duration
from fem_needle.plant import Plant
from fem_needle.samples import Sample, sample_step
from fem_needle.scene import Scene
from fem_needle.steppers import StaticStepper, Step, Stepper

MOMENT = 1e-3  # s: the step that a sample is taken from, at its start
UNKNOWN = Works(*[nan] * len(fields(Works)))


def why_no_response(scene: Scene, stepper: Stepper) -> str:
    """Return why the tip of a scene is not known from gains alone, "" where it is."""
    if not isinstance(stepper, StaticStepper):
        return "only of a needle without inertia and viscosity (analysis 'quasi-static' or 'static')"
    if scene.insertion.kind == "force":
        return "not of a push"
    if not is_steady(scene):
        return "not under loads that vary in time"
    return "" if scene.controller.input in STATIC_INPUTS else f"not for the input '{scene.controller.input}'"


class ResponseEngine:
    """A needle whose tip follows from gains; meets `fem_needle.closed_loop.engine.Engine`."""

    has_works = False

    def __init__(self, plant: Plant, stepper: StaticStepper) -> None:
        scene = plant.scene
        self._plant, self._base, self._inputs = plant, stepper, Inputs(scene)
        self._law = depth_law(scene)
        self._depth_at = depth_function(scene)
        self._first = self._response(scene.controller.input)
        self._others: dict[str, ModelResponse] = {}
        self._input = Ramp(0.0, *(2 * [own_value(scene, self._first.input)]))
        self._crossings: dict[float, tuple[float, ...]] = {}
        self._before = initial_state(stepper.plant, self._law)  # an equilibrium does not ask what was before it
        self.time, self.steps = 0.0, 0
        self.depth = self._depth_at(0.0)
        self.deepest = self.depth
        self.tip_deflection = self._tip()

    def _response(self, name: str) -> ModelResponse:
        return model_response(self._plant, name, depths=depth_range(self._plant.scene))

    @property
    def speed(self) -> float:
        """Insertion speed [m/s]."""
        return self._law.speed(self.time)

    @property
    def end(self) -> StepEnd:
        """The equilibrium at this instant."""
        return self._driven().start(self._law, self.time, self.time, self._before)

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on; one that has no static gain is refused."""
        for name in inputs.ramps:
            if name != self._first.input and name not in self._others:
                if name not in STATIC_INPUTS:
                    raise SceneError(f"command: '{name}' needs the whole needle (use energies = True)")
                self._others[name] = self._response(name)
        self._inputs = inputs
        self._input = inputs.ramps.get(self._first.input, self._input)

    def advance(self, until: float) -> str | None:
        """Go to a time [s]."""
        self.time, self.steps = until, self.steps + 1
        self.depth = self._depth_at(until)
        self.deepest = max(self.deepest, self.depth)
        self.tip_deflection = self._tip()
        return None

    def passing_time(self, level: float) -> float:
        """Return when the tip will pass a depth [m] [s]; infinity where it will not."""
        if level not in self._crossings:
            self._crossings[level] = self._law.crossings(level, run_duration(self._plant.scene))
        return next((time for time in self._crossings[level] if time > self.time), inf)

    def sample(self) -> Sample:
        """Return the equilibrium at this instant; what has been done on the way is not known."""
        return self.sample_later()()

    def sample_later(self) -> Callable[[], Sample]:
        """Return the function that computes the equilibrium of this instant, when nothing is in a hurry."""
        time, depth, deepest, stepper = self.time, self.depth, self.deepest, self._driven()

        def computed() -> Sample:
            start, nodes = stepper.start(self._law, time, time, self._before), len(stepper.method.nodes)
            # Equilibria have no rates that anything here would ask for: a step that goes nowhere will do.
            still = (start.stage,) * nodes, (start.solution,) * nodes
            step = Step(self._plant, stepper.method, MOMENT, (start, start), *still)
            return sample_step(self._plant, step, UNKNOWN, deepest, depth, at_start=True, inertia=False)

        return computed

    def _tip(self) -> float:
        depth, inputs, time = self.depth, self._inputs, self.time
        tip = self._first.output(depth, self._input.value(time))
        for name, response in self._others.items():
            tip += response.gain(depth) * (inputs.value(name, time) - inputs.own_value(name, time))
        return tip

    def _driven(self) -> StaticStepper:
        plant: Any = Driven(self._base.plant, self._inputs.driven_scene(self.time))
        return replace(self._base, plant=plant)


def depth_function(scene: Scene) -> Callable[[float], float]:
    """Return z(t) [m], quick for a constant speed."""
    insertion = scene.insertion
    if insertion.kind == "hold":
        return lambda _: insertion.first_depth
    speed, rest = insertion.speed, insertion.rest_time
    if insertion.kind == "speed" and isinstance(speed, float) and rest is not None and insertion.final_depth is not None:
        start, end = insertion.first_depth, insertion.final_depth
        return lambda time: end if time >= rest else start + speed * time
    return depth_law(scene).depth
