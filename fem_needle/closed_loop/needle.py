"""A needle under way whose inputs are commanded: the kernel's steps, from one kink to the next."""

from __future__ import annotations

from math import ceil, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.commanded import CommandedDrive
from fem_needle.closed_loop.course import SAME_TIME, Course, Stretch
from fem_needle.closed_loop.inputs import Inputs, with_inputs
from fem_needle.closed_loop.kernel import LoopEngine, LoopPush
from fem_needle.dynamics import names as at
from fem_needle.dynamics.engine import DYNAMIC, NUMBERS_OF_A_CALL, REST, failed_step
from fem_needle.dynamics.massless import massless
from fem_needle.dynamics.push import WHY, longest_step, run_limits
from fem_needle.dynamics.run import Integration
from fem_needle.dynamics.state import State
from fem_needle.errors import ComputationError
from fem_needle.initial import initial_state
from fem_needle.plant import Plant
from fem_needle.sample_arrays import Samples
from fem_needle.threads import one_thread

Array = NDArray[np.float64]


class Call(NamedTuple):
    """A call of the kernel: where it began and was to end [s], its steps, and what else was before it.

    Attributes
    ----------
    steps
        Their number; of a push the length of each [s].
    pieces
        Of the path that was there.
    counted
        Of a push: whether works of the next kink counted.
    """

    start: float
    end: float
    steps: float
    pieces: int
    counted: bool


class NeedleState(NamedTuple):
    """Everything that a driven needle remembers.

    Attributes
    ----------
    engine
        Coordinates, momenta, insertion, works, path.
    before, call
        Values before the last call, and that call.
    row, is_shown
        The last record, and whether it is that of the present instant.
    inputs
        What is commanded.
    stretch
        What goes on; None where the next step begins another one.
    driving
        The inputs and the stretch that the kernel was told last.
    tip_deflection
        [m].
    counted
        Of a push: whether works of the next kink count.
    """

    engine: State
    before: Array
    call: Call
    row: Array
    is_shown: bool
    inputs: Inputs
    stretch: Stretch | None
    driving: tuple[Inputs, Stretch]
    tip_deflection: float
    counted: bool


class DrivenNeedle:
    """A needle under way, its depth given, following a commanded speed, or pushed; what sensors ask of it, it tells.

    Parameters
    ----------
    plant
        The needle.
    integration
        With or without inertia, or through equilibria, and by which method.
    time_step
        Largest step [s].
    state
        Where it begins, of a needle of the same plant; default: at t = 0.

    Attributes
    ----------
    time
        [s].
    tip_deflection
        Lateral displacement of the tip [m].
    inputs
        What is commanded.
    """

    def __init__(self, plant: Plant, integration: Integration, time_step: float, state: NeedleState | None = None) -> None:
        scene = plant.scene
        self._plant, self._scene, self._time_step = plant, scene, time_step
        self._settings = (integration, time_step)
        self._push: LoopPush | None = None
        self._engine = LoopEngine(plant, integration.kind, integration.method)
        if scene.insertion.kind == "force" and integration.kind != REST:
            self._push = LoopPush(self._engine, scene, run_limits(scene))
            self._time_step = min(time_step, longest_step(scene))
        self._same, self._longest = SAME_TIME * self._time_step, max(1, NUMBERS_OF_A_CALL // plant.size) * self._time_step
        self._live, self._axial = self._engine.live, self._engine.live.axial
        self._course, self._drive = Course(plant, self._time_step), CommandedDrive(scene)
        self.inputs = Inputs(scene)
        self._stretch: Stretch | None = None
        self._driving = (self.inputs, Stretch(0.0))
        self._before, self._call = np.zeros_like(self._live.values), Call(0.0, 0.0, 1.0, 0, False)
        self.time = 0.0
        if state is not None:
            self.restore(state)
        else:
            self._begin(plant if integration.kind == DYNAMIC else massless(plant))

    @property
    def depth(self) -> float:
        """Inserted length [m]."""
        return self._axial.item(at.WAY)

    @property
    def width(self) -> int:
        """Numbers of a record."""
        return len(self._engine.row)

    @property
    def speed(self) -> float:
        """Insertion speed [m/s], just before the instant."""
        return self._axial.item(at.PACE)

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return int(self._axial[at.STEPS])

    @property
    def hub_force(self) -> float:
        """Lateral force of the clamp on the needle [N]."""
        return self.row().item(at.R_HUB)

    @property
    def hub_moment(self) -> float:
        """Moment of the clamp on the needle [N m]."""
        return self.row().item(at.R_MOMENT)

    @property
    def push_force(self) -> float:
        """Axial force that the insertion needs [N]."""
        return self.row().item(at.R_PUSH)

    @one_thread
    def deflection(self, arc_length: Array) -> Array:
        """Return the deflection [m] at stations from the hub, 0, to the tip, l; shape of ``arc_length``."""
        return self._plant.deflection(self._live.lateral[0, 0], self._live.held, self.depth, arc_length)

    def samples(self, rows: Array) -> Samples:
        """Return rows, as `row` gives them, as samples of a run."""
        return self._engine.samples(rows)

    def row(self) -> Array:
        """Return the record of the present instant; where the last call kept none, that call is repeated."""
        if not self._is_shown:
            after, call = self._engine.state(), self._call
            self._live.values[:], self._live.count[0] = self._before, call.pieces
            if self._push is not None:
                self._push.counted = call.counted
            self._take(call, is_output=True)
            self._engine.restore(after)
        return self._engine.row

    def command(self, inputs: Inputs) -> None:
        """Take inputs from now on; what they do is told to the kernel when it goes on."""
        if inputs is not self.inputs:
            self.inputs, self._stretch = inputs, None

    def advance(self, until: float, *, is_output: bool) -> str | None:
        """Go to a time [s], with a record there if asked; returns why the run ends before, None where it goes on."""
        while until - self.time > self._same:
            stretch = self._stretch
            if stretch is None:
                reason = self._course.end_reason(self.time, self.depth, self.inputs)
                if reason is not None:
                    return reason
                stretch = self._turn()
            end = stretch.until if stretch.until <= until + self._same else until
            reason = self._go(min(end, self.time + self._longest), is_output and end >= until - self._same)
            if self.time == stretch.until:
                self._stretch = None
                reason = reason or self._course.end_reason(self.time, self.depth, self.inputs)
            if reason is not None:
                return reason
        return None

    def passing_time(self, level: float) -> float:
        """Return when the tip will pass a depth [m] as things are [s]; infinity where it will not, or nobody knows."""
        if self._push is not None:
            return inf
        if "speed" not in self.inputs.ramps:
            return self._course.crossing(level, self.time)
        stretch = self._stretch or self._next_stretch()
        return inf if stretch.motion is None else min(stretch.motion.passing_time(level), stretch.until)

    def state(self) -> NeedleState:
        """Return a copy of everything that is remembered."""
        counted = self._push is not None and self._push.counted
        return NeedleState(
            self._engine.state(), self._before.copy(), self._call, self._engine.row.copy(), self._is_shown, self.inputs,
            self._stretch, self._driving, self.tip_deflection, counted,
        )  # fmt: skip

    def restore(self, state: NeedleState) -> None:
        """Go back to a state of this needle, or of another one of the same plant and settings."""
        self._engine.restore(state.engine)
        self._before[:], self._engine.row[:] = state.before, state.row
        self._call, self._is_shown, self.inputs, self._stretch = state.call, state.is_shown, state.inputs, state.stretch
        self.time, self.tip_deflection = self._axial.item(at.NOW), state.tip_deflection
        if self._driving is not state.driving:
            if not self._drive.follows(*state.driving):
                self._drive = CommandedDrive(self._scene)
                self._engine.drive(self._drive.drive)
            self._tell(*state.driving)
        if self._push is not None:
            self._push.counted = state.counted

    def twin(self) -> DrivenNeedle:
        """Return another needle in the same state."""
        return DrivenNeedle(self._plant, *self._settings, self.state())

    def _begin(self, resting: Plant) -> None:
        """Take a trial step for the record at t = 0, and the state there as what was before: its own kink does no work."""
        engine, push, law = self._engine, self._push, self._course.law
        engine.begin(initial_state(resting, law), law.depth(0.0))
        length = min(self._time_step, self._next_stretch().until)
        if push is not None:
            push.begin(self._time_step)
        before = engine.state()
        if push is None:
            status, first = engine.advance(np.array([[0.0, length, 1.0, 0.0]]), counted=False, from_start=True)
            if status != at.DONE:
                raise self._failure(status)
        else:
            first = next(block for block in push.go(length, length, output=False, from_start=True)[1] if len(block))
        engine.restore(before)
        engine.keep(first)
        if push is not None:
            push.settle(length)
        else:
            engine.settle(length)
        tip = self._plant.deflection(
            first.coordinates[0], first.point_forces[0], self.depth, np.array([self._scene.needle.length])
        )
        self.tip_deflection, self._is_shown = float(tip[0]), True
        engine.row[at.R_TIP] = self.tip_deflection

    def _next_stretch(self) -> Stretch:
        return self._course.stretch(self.time, self.depth, self._axial.item(at.DEEPEST), self.inputs)

    def _turn(self) -> Stretch:
        """Begin another stretch, with the inputs as they are now."""
        self._stretch = stretch = self._next_stretch()
        self._tell(self.inputs, stretch)
        self._engine.land()
        return stretch

    def _tell(self, inputs: Inputs, stretch: Stretch) -> None:
        """Let the kernel know what acts."""
        if self._drive.follow(inputs, stretch):
            self._engine.drive(self._drive.drive)
        self._driving = (inputs, stretch)
        if self._push is not None and "push_force" in inputs.ramps:
            self._push.scene = with_inputs(self._scene, {"push_force": inputs.ramps["push_force"].function(self.time)})

    def _go(self, end: float, is_output: bool) -> str | None:
        """Take equal steps to a time; a push returns why it ends before."""
        np.copyto(self._before, self._live.values)
        start, push = self.time, self._push
        count = max(1, ceil((end - start) / self._time_step - 1e-9))
        pieces = self._live.count.item(0)
        if push is None:
            self._call = Call(start, end, count, pieces, True)
        else:
            self._call = Call(start, end, (end - start) / count, pieces, push.counted)
        reason = self._take(self._call, is_output)
        self.time = end if push is None else push.time
        # Whoever commands the push can push harder.
        return None if reason == "stuck" and "push_force" in self.inputs.ramps else reason

    def _take(self, call: Call, is_output: bool) -> str | None:
        """Make a call of the kernel."""
        engine, reason = self._engine, None
        if self._push is None:
            status = engine.go(call.start, call.end, call.steps, is_output)
            if status != at.DONE:
                raise self._failure(status)
            self._is_shown = is_output
        else:
            reason, blocks = self._push.go(call.end, call.steps, output=is_output)
            shown = [block for block in blocks if len(block) and block.time[-1] == self._push.time]
            self._is_shown = bool(shown)
            if shown:
                engine.keep(shown[-1])
        self.tip_deflection = engine.tip_deflection
        if self._is_shown:
            engine.row[at.R_TIP] = self.tip_deflection
        return reason

    def _failure(self, status: int) -> ComputationError:
        return failed_step(self._axial.item(at.NOW), self.depth, WHY[status])
