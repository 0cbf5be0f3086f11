"""Static equilibrium of any plant, its derivative by depth, and the check that all forces sum to zero."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from fem_needle import banded
from fem_needle.display import MILLIMETERS, Card, Shown, in_newtons
from fem_needle.errors import ComputationError
from fem_needle.limits import stations_on
from fem_needle.loads import LoadCase, load_case
from fem_needle.path import CutPath
from fem_needle.plant import Operators, Plant, Points, RestTerms
from fem_needle.scene import as_function

Array = NDArray[np.float64]

ROUNDING = 1e-13  # of the largest element force, by which nearly equal ones may miss each other
FORCE_SUM_TOLERANCE = 1e-6  # of the largest single force: far above round-off, far below a wrong sign


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Shown):
    """A needle at rest under the loads of one instant.

    Attributes
    ----------
    plant
        The model.
    depth, time
        Depth [m] and time [s].
    coordinates
        The plant's coordinates q.
    point_forces
        Forces on the needle at guides, lateral loads and tip [N].
    guide_forces
        Those of the guides [N].
    hub_force, hub_moment
        What the clamp exerts on the needle [N], [N m]; under ``entry`` the clamp at the surface.
    tissue_force
        Total lateral force of the tissue on the needle [N].
    """

    plant: Plant
    depth: float
    time: float
    coordinates: Array
    point_forces: Array
    guide_forces: Array
    hub_force: float
    hub_moment: float
    tissue_force: float

    def _card(self) -> Card:
        facts = (
            ("depth", f"{MILLIMETERS * self.depth:.4g} mm"),
            ("tip", f"{MILLIMETERS * self.tip_deflection:.4g} mm"),
            ("hub force", in_newtons(self.hub_force)),
            ("hub moment", f"{MILLIMETERS * self.hub_moment:.4g} N mm"),
            ("tissue force", in_newtons(self.tissue_force)),
            *((f"guide {number}", in_newtons(force)) for number, force in enumerate(self.guide_forces)),
            ("time", f"{self.time:.4g} s"),
        )
        return Card("Equilibrium", self.plant.scene.title, facts)

    @property
    def tip_deflection(self) -> float:
        """Deflection of the tip [m]."""
        return float(self.deflection(np.array([self.plant.scene.needle.length]))[0])

    def deflection(self, arc_length: Array, derivative: int = 0) -> Array:
        """Return the deflection [m] (or a derivative by arc length) at stations from the hub, 0, to the tip, l [m]."""
        stations = stations_on(arc_length, self.plant.scene.needle.length)
        return self.plant.deflection(self.coordinates, self.point_forces, self.depth, stations, derivative)


def solve_static(plant: Plant, *, depth: float, time: float = 0.0, path: CutPath | None = None) -> Equilibrium:
    """Return the equilibrium at a depth under the loads of a time.

    Parameters
    ----------
    plant
        Any model of a needle.
    depth
        Inserted length z [m], 0 to the needle's length.
    time
        Instant [s] at which loads, hub motion and stiffness factor are taken.
    path
        What the tissue rests on, as `fem_needle.linear.slow_cut.slow_cut` gives it; a straight line without one.

    Raises
    ------
    ComputationError
        If the equations have no solution or the forces do not sum to zero.
    """
    case = load_case(plant.scene, depth, time)
    if depth < plant.smallest_depth:
        return _straight(plant, depth, time, case)
    return statics_at(plant, depth, time, path).equilibrium(case)


def statics_at(plant: Plant, depth: float, time: float, path: CutPath | None = None) -> Statics:
    """Return the statics of a plant at a depth [m] and time [s], on a path or on a straight line."""
    return Statics(plant, depth, time, plant.operators(depth, time), plant.points(depth), rest_of(plant, path, depth, time))


def rest_of(plant: Plant, path: CutPath | None, depth: float, time: float) -> RestTerms | None:
    """Return what a path adds to the tissue's energy at a depth, the stiffness factor of a time included."""
    if path is None:
        return None
    terms = plant.rest_terms(path, depth, -np.inf, np.inf)
    factor = float(as_function(plant.scene.tissue.stiffness_factor).value(time))
    return RestTerms(*(factor * getattr(terms, part.name) for part in fields(RestTerms)))


def no_load_case(case: LoadCase) -> LoadCase:
    """Return a case of the same size without loads, the clamp straight."""
    return LoadCase(*(np.zeros_like(getattr(case, part.name)) for part in fields(LoadCase)))


@dataclass(frozen=True, eq=False)
class Statics:
    """The equations of a plant at rest, K q = N.P + m H, for any loads.

    Attributes
    ----------
    plant
        The model.
    depth, time
        Where and when [m], [s].
    operators, points
        Of the plant there.
    rest
        Of the path on which the tissue rests, the stiffness factor included; None: a straight line.
    """

    plant: Plant
    depth: float
    time: float
    operators: Operators
    points: Points
    rest: RestTerms | None = None

    def state(self, case: LoadCase) -> tuple[Array, Array]:
        """Return coordinates and point forces under a load case.

        Raises
        ------
        ComputationError
            If the equations have no solution.
        """
        return self._supported(case)[:2]

    def tip(self, case: LoadCase) -> float:
        """Return the tip's deflection [m] under a load case; errors as of `state`."""
        return float(self.points.deflections(*self.state(case))[-1])

    def equilibrium(self, case: LoadCase) -> Equilibrium:
        """Return the equilibrium under a load case; errors as of `solve_static`."""
        coordinates, forces, support = self._supported(case)
        hub_force, hub_moment = self.plant.clamp_reactions(support, self.depth)
        tissue = -float(self.plant.deflection_at_one @ self._resisted(coordinates))
        held = forces[: self.points.guides]
        rest = Equilibrium(self.plant, self.depth, self.time, coordinates, forces, held, hub_force, hub_moment, tissue)
        rounding = 0.0
        if self.operators.beam is None:
            rounding = ROUNDING * float(np.max(np.abs(self.operators.stiffness)) * np.max(np.abs(coordinates)))
        return check_force_sum(rest, self.points, rounding)

    def derivative(self, rest: Equilibrium) -> tuple[Array, Array]:
        """Return what `depth_derivative` does."""
        points, moved = self.points, self.plant.stiffness_rate_product(rest.coordinates, self.depth, self.time)
        if self.rest is not None:
            moved = moved - self.rest.load_rate
        guides, force = points.guides, points.row_rates.T @ rest.point_forces - moved
        drift = points.row_rates[:guides] @ rest.coordinates + points.flexibility_rate[:guides] @ rest.point_forces
        return solve_guided(self.plant, self.operators, points, force, drift)

    def _resisted(self, coordinates: Array) -> Array:
        """Return m G q - m H."""
        resisted = banded.multiply(self.operators.tissue, coordinates)
        return resisted if self.rest is None else resisted - self.rest.load

    def _supported(self, case: LoadCase) -> tuple[Array, Array, Array]:
        """Return also what the clamped coordinates' equations lack."""
        points, plant = self.points, self.plant
        guides, known = points.guides, known_coordinates(plant, case)
        resisted = self._resisted(known)  # a straight needle has no bending
        force = points.rows[guides:].T @ case.forces - resisted
        gap = points.rows[:guides] @ known + points.flexibility[:guides, guides:] @ case.forces
        try:
            free, guide_forces, support = _solve_supported(plant, self.operators, points, force, gap)
        except (banded.SingularMatrixError, np.linalg.LinAlgError) as error:
            raise ComputationError(
                f"no static solution at time {self.time:g} s, depth {self.depth:g} m: {error}; "
                "check stiffnesses and use fewer elements"
            ) from error
        forces, clamped = np.concatenate([guide_forces, case.forces]), plant.prescribed
        return known + free, forces, support + resisted[:clamped] - points.rows[:, :clamped].T @ forces


def known_coordinates(plant: Plant, case: LoadCase) -> Array:
    """Return the coordinates of the straight needle that stands as the clamp does."""
    return plant.straight(*(float(value) for value in (*case.clamp[: plant.prescribed], 0.0, 0.0)[:2]))


def solve_guided(
    plant: Plant, operators: Operators, points: Points, force: Array, gap: Array
) -> tuple[Array, Array]:
    """Solve K x = force + N.R for the free coordinates, with N x + (B + compliance) R = -gap at the guides.

    Returns x (zero at the clamp) and the guide forces R [N] on the needle.
    """
    return _solve_supported(plant, operators, points, force, gap)[:2]


def _solve_supported(
    plant: Plant, operators: Operators, points: Points, force: Array, gap: Array
) -> tuple[Array, Array, Array]:
    """Return also K x in the clamp's rows."""
    clamped, guides = plant.prescribed, points.guides
    rows = points.rows[:guides, clamped:]
    answers, support = operators.stiffness_factorization.solve_supported(np.column_stack([force[clamped:], rows.T]))
    result = np.zeros(plant.size)
    result[clamped:] = answers[:, 0]
    if not guides:
        return result, np.zeros(0), support[:, 0]
    reached = answers[:, 1:]
    compliance = rows @ reached + points.flexibility[:guides, :guides] + np.diag(points.guide_compliance)
    reactions = np.asarray(np.linalg.solve(compliance, -(rows @ answers[:, 0] + gap)), dtype=float)
    result[clamped:] += reached @ reactions
    return result, reactions, support[:, 0] + support[:, 1:] @ reactions


def check_force_sum(rest: Equilibrium, points: Points, rounding: float = 0.0) -> Equilibrium:
    """Return the state if support, guides, loads and tissue balance.

    Raises
    ------
    ComputationError
        If their sum exceeds ``FORCE_SUM_TOLERANCE`` of the largest of them, and ``rounding`` [N], what is lost in forming them.
    """
    if not rest.plant.prescribed:
        return rest  # without a clamp in the coordinates there is no support force to add up
    # A force's row gives 1 for the function 1, a torque's gives 0.
    lateral = rest.point_forces * (points.rows @ rest.plant.deflection_at_one)
    forces = [rest.hub_force, rest.tissue_force, *lateral]
    largest = max(abs(force) for force in forces)
    if abs(sum(forces)) > FORCE_SUM_TOLERANCE * largest + rounding:
        raise ComputationError(
            f"forces do not balance at time {rest.time:g} s, depth {rest.depth:g} m: their sum is {sum(forces):.3g} N, "
            f"the largest {largest:.3g} N; round-off: use fewer elements"
        )
    return rest


def depth_derivative(plant: Plant, rest: Equilibrium, path: CutPath | None = None) -> tuple[Array, Array]:
    """Return dq/dz and the guides' dR/dz of the static solution at frozen loads.

    K dq/dz = N.dR/dz + dN/dz.P - d(K + m G)/dz q + m dH/dz, the guides still holding; H of the path, which the tip cuts on.
    """
    if rest.depth < plant.smallest_depth:
        return np.zeros(plant.size), np.zeros(0)
    return statics_at(plant, rest.depth, rest.time, path).derivative(rest)


def _straight(plant: Plant, depth: float, time: float, case: LoadCase) -> Equilibrium:
    """An ``entry`` needle that is hardly inserted is straight; the surface carries the tip force."""
    tip = float(case.forces[-1])
    return Equilibrium(plant, depth, time, np.zeros(plant.size), case.forces, np.zeros(0), -tip, 0.0, 0.0)
