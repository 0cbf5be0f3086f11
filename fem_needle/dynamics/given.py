"""Models that the kernel asks for their matrices at every depth: they keep their own form (docs/decisions/0023-one-kernel.md).

Equations with mistakes in them, columns that move with the depth, models of another package: everything that meets
`fem_needle.plant.Plant`.
"""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.beam_needle import points_of
from fem_needle.dynamics import names as at
from fem_needle.dynamics.callback import Callback
from fem_needle.dynamics.drive import bevel_of
from fem_needle.dynamics.model import Model, layer_rows, numbers_of
from fem_needle.dynamics.work import Work
from fem_needle.loads import turns_with_needle
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Plant
from fem_needle.scene import TipLoad, as_function
from fem_needle.segments import one_sided

Array = NDArray[np.float64]


def given_model(plant: Plant, *, inertia: bool, viscous: bool) -> Model:
    """Return the arrays of a model that is asked: no shapes, room for its matrices at every instant."""
    scene, n = plant.scene, plant.size
    depth = max(scene.insertion.first_depth, plant.smallest_depth)
    operators, points = plant.operators(depth, 0.0), plant.points(depth)
    switches = np.zeros(at.SWITCHES, dtype=np.int64)
    switches[at.FRAME], switches[at.PRESCRIBED], switches[at.GUIDES] = at.FIXED, plant.prescribed, points.guides
    switches[at.POINTS], switches[at.TIPS] = len(points.rows), sum(isinstance(load, TipLoad) for load in scene.loads)
    switches[at.DEGREE], switches[at.INERTIA] = 0, inertia
    switches[at.VISCOUS] = viscous and operators.damping is not None
    switches[at.CONVECTED] = operators.convection is not None
    switches[at.CUTS] = scene.tissue.rest_line == "cut-path"
    switches[at.TURNS], switches[at.AXIAL_ACTS] = turns_with_needle(scene), plant.axial_force_acts
    switches[at.PRINTED] = operators.positional_error is not None or operators.velocity_error is not None
    switches[at.GIVEN] = 1
    arrays = {
        at.SWITCH: switches,
        at.NUMBER: numbers_of(plant),
        at.LAYER: layer_rows(scene),
        at.POSITION: np.array([point.position for point in points_of(scene)]),
        at.COMPLIANCE: np.asarray(points.guide_compliance, dtype=float),
        at.BEVEL: bevel_of(scene),
        at.ONE: np.asarray(plant.deflection_at_one, dtype=float),
        at.MASS_FACTOR: np.zeros((n, n)),
        at.PASCAL: np.ones((1, 1)),
        at.PIECE_NODES: np.array([0.0, 1.0]),
        at.COEFFICIENTS: np.zeros((1, n, 1)),
        at.RULE: np.zeros((2, 1)),
        at.UNIT: np.zeros((1, 4, 1, 1)),
        at.UNIT_SUMS: np.zeros((1, 4, 1, 1)),
        at.BEAM: np.zeros((at.INSTANTS, 1, 4, n, n)),
    }
    return Model(n, len(points.rows), {name: np.ascontiguousarray(array) for name, array in arrays.items()})


class Answers:
    """Answers to what the kernel asks of a model."""

    def __init__(self, plant: Plant, work: Work) -> None:
        self._plant, self._work = plant, work
        self._factor = as_function(plant.scene.tissue.stiffness_factor)
        self.callback = Callback(self._answer)
        work[at.ASKED][0] = self.callback.address

    def _answer(self, instant: int, question: int) -> None:
        answers = {
            at.ASK_MATRICES: self._matrices,
            at.ASK_ENERGY_FORCE: self._energy_force,
            at.ASK_HISTORY: self._history,
            at.ASK_FRESH: self._fresh,
        }
        answers[question](instant)

    def _place(self, instant: int) -> tuple[float, float]:
        """Return depth [m], on the side of an interface that the step is on, and time [s] of an instant."""
        course = self._work[at.COURSES][instant]
        depth = one_sided(self._plant.scene.tissue.layers, float(course[at.DEPTH]), float(course[at.SIDE]))
        return depth, float(course[at.TIME])

    def _matrices(self, instant: int) -> None:
        depth, time = self._place(instant)
        work, operators, points = self._work, self._plant.operators(depth, time), self._plant.points(depth)
        factor = self._factor.value(time)
        beam, tissue = work[at.BEAM][instant, 0], work[at.TISSUE_BLOCKS][instant, 0]
        for kind, band in enumerate((operators.mass, operators.bending, operators.convection, operators.centrifugal)):
            beam[kind] = _dense(band, self._plant.size)
        tissue[at.TISSUE] = _dense(operators.tissue, self._plant.size) / (factor or 1.0)
        tissue[at.DAMPING], tissue[at.SLIP] = _dense(operators.damping, len(beam[0])), _dense(operators.slip, len(beam[0]))
        tissue[at.DRAG] = -_dense(operators.drag, len(beam[0]))
        if not work[at.SWITCH][at.VISCOUS]:
            tissue[at.DAMPING :] = 0.0
        work[at.POINT_ROWS][instant], work[at.POINT_RATES][instant] = points.rows, points.row_rates
        work[at.FLEXIBLE][instant], work[at.FLEXIBLE_RATE][instant] = points.flexibility, points.flexibility_rate
        self._directions(instant, operators)

    def _directions(self, instant: int, operators: Operators) -> None:
        work = self._work
        if operators.subspace is not None:
            clamped, rank = self._plant.prescribed, operators.subspace.shape[1]
            work[at.RANKS][instant] = rank
            work[at.SUBSPACE][instant, clamped:, :rank] = operators.subspace
        if work[at.SWITCH][at.PRINTED]:
            errors = work[at.PRINTED_ERRORS][instant]
            errors[0] = _dense(operators.positional_error, self._plant.size)
            errors[1] = _dense(operators.velocity_error, self._plant.size)

    def _energy_force(self, instant: int) -> None:
        """Answer d(T - U)/dz without what a path adds."""
        depth, time = self._place(instant)
        work, speed = self._work, float(self._work[at.COURSES][instant, at.SPEED])
        coordinates, velocities = work[at.KNOWN][instant], work[at.RATES][instant]
        force = -0.5 * float(coordinates @ self._plant.stiffness_rate_product(coordinates, depth, time))
        if work[at.SWITCH][at.INERTIA]:
            force += self._plant.kinetic_rate(velocities, coordinates, depth, speed)
        work[at.ANSWERED][0] = force

    def _history(self, instant: int) -> None:
        """Answer what the path behind the step adds to H and dH/dz, without what the tip itself does."""
        count = int(self._work[at.PATH_COUNT][0])
        edges, cubics = self._work[at.PATH_EDGES][: count + 1], self._work[at.PATH_CUBICS][:count]
        depth, _ = self._place(instant)
        self._rest(CutPath(edges.copy(), cubics.copy()), depth, -inf, min(depth, float(edges[-1])))

    def _fresh(self, instant: int) -> None:
        """Answer the same for the piece that is being cut, a cubic about the deepest point."""
        deepest = float(self._work[at.AXIAL_STATE][at.DEEPEST])
        depth, _ = self._place(instant)
        path = CutPath(np.array([deepest, depth]), self._work[at.ANSWERED][None].copy())
        self._rest(path, depth, deepest, depth)

    def _rest(self, path: CutPath, depth: float, lower: float, upper: float) -> None:
        found = self._plant.rest_terms(path, depth, lower, upper)
        self._work[at.ANSWERED_LOAD][0], self._work[at.ANSWERED_LOAD][1] = found.load, found.load_rate


def _dense(band: Array | None, size: int) -> Array:
    return np.zeros((size, size)) if band is None else banded.to_dense(band)
