"""How a needle gets from one time to the next: with inertia, creeping without it, or through equilibria.

All three return the same thing, a `Step`, so that the loop over time, the ledger and the output know no difference.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, nextafter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fem_needle.collocation import Collocation, gauss
from fem_needle.jumps import carried, clamp_jump
from fem_needle.ledger import StepEnd, StepParts
from fem_needle.loads import LoadCase, is_steady, load_case
from fem_needle.motion import Instant, Motion
from fem_needle.path import CutPath
from fem_needle.plant import SMALLEST_COMPLIANCE, Operators, Plant
from fem_needle.segments import ROUNDINGS, one_sided
from fem_needle.stages import (
    PathHistory,
    Stage,
    StageSolution,
    StepSystem,
    evaluate_stage,
    factor_step,
    momentum,
    solve_step,
    trivial_solution,
    velocities_of,
    with_path,
)
from fem_needle.statics import static_state

Array = NDArray[np.float64]

JUMP_FRACTION = 1e-9  # of a step: in this time viscosity lets nothing move
MOST_PATH_ITERATIONS = 50
PATH_TOLERANCE = 1e-13  # of the largest tip deflection of the step


@dataclass(frozen=True, eq=False)
class Step(StepParts):
    """One smooth step, and its factored matrix for the next one where nothing moves."""

    system: StepSystem | None = None

    def resolved(self, *, at_start: bool) -> Step:
        """Return a step with the same start, or the same end, whose polynomial resolves every rate there."""
        return self


class Stepper(Protocol):
    """Advance a state over one smooth step."""

    @property
    def plant(self) -> Plant:
        """The model as it is stepped, without inertia where that is left out."""

    @property
    def inertia(self) -> bool:
        """Whether the needle's inertia acts."""

    def start(self, law: Motion, time: float, until: float, before: StepEnd) -> StepEnd:
        """Return the state just after a time, given the state just before."""

    def advance(self, law: Motion, start: StepEnd, until: float, last: Step | None) -> Step:
        """Return the step from a state to a time."""


_Cut = tuple[PathHistory, Array]  # the path behind the step and the tips at its nodes


@dataclass(frozen=True, eq=False)
class DynamicStepper:
    """Collocation in momentum form (`stages`), with or without inertia.

    Attributes
    ----------
    plant
        The model; a `Massless` one creeps.
    method
        Collocation method.
    inertia
        Whether the plant has any.
    """

    plant: Plant
    method: Collocation
    inertia: bool = True
    _steady: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_steady", is_steady(self.plant.scene))

    def start(self, law: Motion, time: float, until: float, before: StepEnd) -> StepEnd:
        """Carry coordinates and momentum over a possible jump of speed, of the loads, of the hub or of its velocity."""
        middle = law.layer_depth(time, until)
        instant = self._one_sided(law.after(time), middle)
        stage = evaluate_stage(self.plant, instant, load_case(self.plant.scene, middle, time), before.stage)
        solution, guides, path = before.solution, stage.points.guides, before.path
        if path is not None:
            stage = with_path(self.plant, stage, path)
        forces = np.concatenate([solution.forces[:guides], stage.case.forces])
        same = np.allclose(forces[guides:], solution.forces[guides:], rtol=1e-9, atol=0.0)
        jump = clamp_jump(stage, solution.coordinates)
        if self.inertia:
            carrying = solution if jump is None else carried(stage, solution, jump)
            if jump is not None or not same:
                forces = self._with_reactions(stage, carrying.coordinates, forces)
            return self._struck(self._state(stage, carrying.coordinates, carrying.momentum, forces, path))
        after = self._state(stage, solution.coordinates, solution.momentum, forces, path)
        if time > 0.0 and same and jump is None:  # at t = 0 a needle without inertia need not be where the loads hold it
            return after
        return self._followed(after, until, jump)

    def _one_sided(self, instant: Instant, layer_depth: float) -> Instant:
        layers = self.plant.scene.tissue.layers
        return replace(instant, depth=one_sided(layers, instant.depth, layer_depth))

    def _struck(self, start: StepEnd) -> StepEnd:
        """Let rigid guides strike a needle whose speed or hub has jumped: N q' + v dN/dz q = 0 holds again."""
        stage, solution, clamped = start.stage, start.solution, self.plant.prescribed
        points = stage.points
        rigid = np.flatnonzero(points.guide_compliance == 0.0)
        if not len(rigid):
            return start
        sliding = points.rows[rigid] @ solution.velocities
        sliding = sliding + stage.instant.speed * (points.row_rates[rigid] @ solution.coordinates)
        rows = points.rows[rigid, clamped:]
        mobility = rows @ stage.operators.mass_factorization.solve(rows.T)
        struck = solution.momentum.copy()
        struck[clamped:] -= rows.T @ np.linalg.solve(mobility, sliding)
        return self._state(stage, solution.coordinates, struck, solution.forces, start.path)

    def _followed(self, start: StepEnd, until: float, jump: Array | None) -> StepEnd:
        """Let a needle without inertia follow a jump of the loads or of the hub: what no viscosity holds moves at once."""
        instant = start.stage.instant
        frozen = _Frozen(replace(instant, speed=0.0, acceleration=0.0))
        # Long enough to be told from the instant itself: after a kink a few ulps of the time may be all that is left.
        ending = max(instant.time + JUMP_FRACTION * (until - instant.time), nextafter(instant.time, inf))
        length = ending - instant.time
        rates = np.zeros(2)
        if jump is not None:
            rates[: len(jump)] = jump / length
        step = self._attempt(frozen, start, ending, None, None, rates)
        return StepEnd(start.stage, step.ends[1].solution, start.path)

    def advance(self, law: Motion, start: StepEnd, until: float, last: Step | None) -> Step:
        """Solve the stages and extrapolate their polynomial to the end.

        Where the tip cuts a path, the path under the stages depends on their own tips: solved by iteration, which contracts by
        about the step's advance over the tissue's characteristic length.
        """
        if start.path is None:
            return self._attempt(law, start, until, last, None)
        history, tips = PathHistory(start.path), self._predicted_tips(start, until, last)
        for _ in range(MOST_PATH_ITERATIONS):
            last = self._attempt(law, start, until, last, (history, tips))
            found = np.array([self._tip(*pair) for pair in zip(last.stages, last.solutions, strict=True)])
            if np.max(np.abs(found - tips)) <= PATH_TOLERANCE * np.max(np.abs(found)):
                return last
            tips = found
        raise FloatingPointError("the cut path does not converge")

    def _attempt(
        self, law: Motion, start: StepEnd, until: float, last: Step | None, cut: _Cut | None, rates: Array | None = None
    ) -> Step:
        """Solve one step, with the path cut through given tips at the nodes where there is one, and given rates of the clamp."""
        time = start.stage.instant.time
        length, middle = until - time, law.layer_depth(time, until)
        stages = self._stages(law, start, until, last, cut)
        if rates is not None:
            stages = _with_clamp_rates(stages[0], rates), _with_clamp_rates(stages[1], rates)
        system = _reusable(last, stages, length) or factor_step(self.plant, stages, self.method, length)
        begin = start.solution
        solutions = solve_step(self.plant, stages, self.method, length, system, begin.coordinates, begin.momentum)
        end_coordinates = self._extrapolated(begin.coordinates, [state.coordinates for state in solutions])
        end_momentum = self._extrapolated(begin.momentum, [state.momentum for state in solutions])
        case = self._loads(middle, nextafter(until, time), stages[1])
        end_coordinates[: self.plant.prescribed] = case.clamp[: self.plant.prescribed]
        stage = evaluate_stage(self.plant, self._one_sided(law.before(until), middle), case, stages[1])
        path = start.path
        if path is not None and cut is not None:
            depths, (history, tips) = [*(s.instant.depth for s in stages), stage.instant.depth], cut
            path = self._cut(start, path, depths, [*tips, float(stage.points.rows[-1] @ end_coordinates)])
            stage = with_path(self.plant, stage, path, history)
        elif path is not None:
            stage = with_path(self.plant, stage, path)
        forces = np.concatenate([self.guide_reactions(stage, end_coordinates, solutions), case.forces])
        end = self._state(stage, end_coordinates, end_momentum, forces, path)
        return Step(self.plant, self.method, length, (start, end), stages, solutions, system)

    def _predicted_tips(self, start: StepEnd, until: float, last: Step | None) -> Array:
        """Return the tips at the nodes as the last step's polynomial continues, the present tip without one."""
        tip, length = self._tip(start.stage, start.solution), until - start.stage.instant.time
        if last is None:
            return np.full(len(self.method.nodes), tip)
        found = [self._tip(*pair) for pair in zip(last.stages, last.solutions, strict=True)]
        before = self._tip(last.ends[0].stage, last.ends[0].solution)
        rate = float(self.method.end_slope @ (np.array(found) - before)) / last.length
        return tip + rate * self.method.nodes * length

    def _cut(self, start: StepEnd, path: CutPath, depths: list[float], tips: list[float]) -> CutPath:
        """Return the path after the tip has passed given depths with given deflections."""
        if depths[-1] <= path.deepest * (1 + ROUNDINGS):
            return path.seen_from(depths[-1] * (1 + ROUNDINGS), tips[-1])
        return path.extended([start.stage.instant.depth, *depths], [self._tip(start.stage, start.solution), *tips])

    def _tip(self, stage: Stage, solution: StageSolution) -> float:
        return float(stage.points.rows[-1] @ solution.coordinates)

    def _extrapolated(self, start: Array, values: list[Array]) -> Array:
        """Return the value at the end of the polynomial through the start and the nodes."""
        result = start.copy()
        for weight, value in zip(self.method.end, values, strict=True):
            result += weight * (value - start)
        return result

    def _loads(self, depth: float, time: float, earlier: Stage) -> LoadCase:
        """Return the loads; the earlier ones where nothing can have changed."""
        if self._steady and depth == earlier.instant.depth:
            return earlier.case
        return load_case(self.plant.scene, depth, time)

    def guide_reactions(self, stage: Stage, coordinates: Array, solutions: tuple[StageSolution, ...]) -> Array:
        """Return the guides' forces at the end of a step from the deflections there.

        N q + B P + compliance R = 0 for all guides together, except those rigid ones at a node, whose B vanishes: the mean over
        the step, about which the values at the nodes alternate (an index-3 multiplier).
        """
        guides = stage.points.guides
        if not guides:
            return np.zeros(0)
        weighted = [w * s.forces[:guides] for w, s in zip(self.method.weights, solutions, strict=True)]
        return self._with_reactions(stage, coordinates, np.concatenate([np.sum(weighted, axis=0), stage.case.forces]))[:guides]

    def _with_reactions(self, stage: Stage, coordinates: Array, forces: Array) -> Array:
        """Return the forces at points with those of the guides, but of rigid ones at a node, that belong to the deflections."""
        points, guides, forces = stage.points, stage.points.guides, forces.copy()
        compliance = points.flexibility[:guides, :guides] + np.diag(points.guide_compliance)
        # Beside the compliance of the whole needle seen from the guide, which B cannot exceed.
        soft = np.flatnonzero(np.diag(compliance) > SMALLEST_COMPLIANCE * self.compliance_scale)
        if len(soft):
            others = np.delete(np.arange(len(forces)), soft)
            gap = points.rows[soft] @ coordinates + points.flexibility[np.ix_(soft, others)] @ forces[others]
            forces[soft] = np.linalg.solve(compliance[np.ix_(soft, soft)], -gap)
        return forces

    @property
    def compliance_scale(self) -> float:
        """Return l^3 / (48 EI) [m/N], the compliance of the needle on two supports."""
        needle = self.plant.scene.needle
        return needle.length**3 / (48 * needle.bending_stiffness)

    def _stages(
        self, law: Motion, start: StepEnd, until: float, last: Step | None, cut: _Cut | None
    ) -> tuple[Stage, Stage]:
        time, earlier = start.stage.instant.time, start.stage
        length, middle, latest = until - time, law.layer_depth(time, until), nextafter(until, time)
        found: list[Stage] = []
        for number, node in enumerate(self.method.nodes):
            instant = self._one_sided(law.before(until), middle) if node == 1.0 else law.after(time + node * length)
            if last is not None and last.stages[number].instant.depth == instant.depth:
                earlier = last.stages[number]
            # A node at the end belongs to this step: loads, swelling and layers just before a kink.
            instant = replace(instant, time=min(instant.time, latest))
            case = self._loads(middle, instant.time, start.stage)
            earlier = evaluate_stage(self.plant, instant, case, earlier)
            found.append(earlier)
        if cut is not None and start.path is not None:
            history, tips = cut
            depths = [stage.instant.depth for stage in found]
            whole = self._cut(start, start.path, depths, tips.tolist())
            found = [
                with_path(self.plant, stage, whole.seen_from(stage.instant.depth, tip), history)
                for stage, tip in zip(found, tips.tolist(), strict=True)
            ]
        elif start.path is not None:
            found = [with_path(self.plant, stage, start.path) for stage in found]
        return found[0], found[1]

    def _state(
        self, stage: Stage, coordinates: Array, start_momentum: Array, forces: Array, path: CutPath | None
    ) -> StepEnd:
        if not self.inertia:
            return StepEnd(stage, StageSolution(coordinates, np.zeros_like(coordinates), start_momentum, forces), path)
        velocities = velocities_of(self.plant, stage, coordinates, start_momentum)
        full = momentum(stage, coordinates, velocities)
        return StepEnd(stage, StageSolution(coordinates, velocities, full, forces), path)


def _with_clamp_rates(stage: Stage, rates: Array) -> Stage:
    return replace(stage, case=replace(stage.case, clamp_rates=rates))


def _reusable(last: Step | None, stages: tuple[Stage, Stage], length: float) -> StepSystem | None:
    """Return the last step's factors where neither matrices nor step have changed."""
    if last is None or last.system is None or abs(last.length - length) > 1e-12 * length:
        return None
    same = all(
        new.operators is old.operators and new.instant.speed == old.instant.speed
        for new, old in zip(stages, last.stages, strict=True)
    )
    return last.system if same else None


@dataclass(frozen=True)
class _Frozen:
    """A needle held at one instant."""

    instant: Instant

    def layer_depth(self, start: float, end: float) -> float:
        """Return the depth [m]."""
        return self.instant.depth

    def depth(self, time: float) -> float:
        """Return the depth [m]."""
        return self.instant.depth

    def after(self, time: float) -> Instant:
        """Return the instant."""
        return self.instant

    def before(self, time: float) -> Instant:
        """Return the instant."""
        return self.instant


class Massless:
    """A plant whose inertia is left out; everything else is the plant's own."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices with M = S = R = 0."""
        operators = self._plant.operators(depth, time)
        return replace(operators, mass=np.zeros_like(operators.mass), convection=None, centrifugal=None)

    def kinetic_rate(self, velocities: Array, coordinates: Array, depth: float, speed: float) -> float:
        """Return 0."""
        return 0.0


class Inviscid(Massless):
    """A plant whose inertia and viscosity are left out: equilibria know no rates."""

    def operators(self, depth: float, time: float) -> Operators:
        """Return the matrices without M, S, R and without C, D, E."""
        return replace(super().operators(depth, time), damping=None, drag=None, slip=None)


@dataclass(frozen=True, eq=False)
class StaticStepper:
    """A sequence of equilibria; the nodes between serve the works."""

    plant: Plant
    inertia: bool = False
    method: Collocation = field(default_factory=lambda: gauss(3))

    def start(self, law: Motion, time: float, until: float, before: StepEnd) -> StepEnd:
        """Return the equilibrium just after a time."""
        return self._rest(law, law.after(time).time, law.layer_depth(time, until), after=True)

    def advance(self, law: Motion, start: StepEnd, until: float, last: Step | None) -> Step:
        """Return the equilibria at the nodes and at the end."""
        time = start.stage.instant.time
        length, middle = until - time, law.layer_depth(time, until)
        nodes = [self._rest(law, time + node * length, middle, after=True) for node in self.method.nodes]
        end = self._rest(law, until, middle, after=False)
        stages, solutions = tuple(node.stage for node in nodes), tuple(node.solution for node in nodes)
        return Step(self.plant, self.method, length, (start, end), stages, solutions)

    def _rest(self, law: Motion, time: float, layer_depth: float, *, after: bool) -> StepEnd:
        instant = law.after(time) if after else law.before(time)
        case = load_case(self.plant.scene, layer_depth, time if after else nextafter(time, -inf))
        stage = evaluate_stage(self.plant, instant, case)
        if instant.depth < self.plant.smallest_depth:
            return StepEnd(stage, trivial_solution(self.plant, stage))
        coordinates, forces = static_state(
            self.plant, stage.operators, stage.points, case, depth=instant.depth, time=instant.time
        )
        zero = np.zeros(self.plant.size)
        return StepEnd(stage, StageSolution(coordinates, zero, zero, forces))
