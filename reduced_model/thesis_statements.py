"""What the thesis says of controllability and observability (sections 3.2.5 to 3.2.7 and 5.1), tested point by point.

States there: length outside d (here the depth), base rotation theta, amplitudes q1 and q2, and their rates; inputs: insertion
force and base torque; output: the tip's deflection. Each statement is asked of the linear model at a straight needle, the
operating point of 3.2.5, and at one that a tip force has bent, by the means of `fem_needle.analysis.controllability`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.analysis.controllability import (
    Balanced,
    Subspace,
    balance,
    controllable_modes,
    controllable_subspace,
    observable_modes,
    observable_subspace,
    output_controllability,
)
from fem_needle.linear.linearization import linearize, with_lateral_force
from fem_needle.linear.model import LinearModel
from fem_needle.models import build_plant
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.scene_file import load_scene

Array = NDArray[np.float64]

BASE_INERTIA = 1.0626e-9  # Table III, a second moment of area [m^4] that is used as a moment of inertia [kg m^2]
TIP_FORCE = 0.1  # N, bends the needle for the second operating point
INPUTS = ("push", "torque")
AXIAL = ("depth", "speed", "base_angle", "base_angle_rate")
FINGER = -0.005  # m, where a lateral force acts on a needle that is held at the hub


@dataclass(frozen=True)
class Statement:
    """A statement, whether it holds, and why.

    Attributes
    ----------
    section
        Of the thesis.
    claim
        What it says, in other words.
    holds
        Whether that is so.
    finding
        What was found instead, or where it is so.
    numbers
        The numbers that it rests on; singular values are dimensionless.
    """

    section: str
    claim: str
    holds: bool
    finding: str
    numbers: dict[str, float]


@dataclass(frozen=True, eq=False)
class _Point:
    """A linear model with the thesis' inputs and output, and what they reach and see."""

    model: LinearModel
    system: Balanced
    reached: Subspace
    seen: Subspace

    @property
    def size(self) -> int:
        return len(self.model.states)

    def share(self, space: Subspace, *, axial: bool) -> Array:
        """Return how much of the axial, or of the lateral, states lies in a subspace."""
        chosen = [(signal.name in AXIAL) == axial for signal in self.model.states]
        return space.participation[chosen]

    @property
    def largest_markov_parameter(self) -> float:
        """Largest |C A^k B|, each by |A|^k, of the balanced system: only whether it is exactly 0 is asked."""
        unit = self.system.A / np.linalg.norm(self.system.A, 2)
        column, largest = self.system.B, 0.0
        for _ in range(self.size):
            largest = max(largest, float(np.max(np.abs(self.system.C @ column))))
            column = unit @ column
        return largest


def thesis_scene() -> Scene:
    """Return the thesis' needle without loads, its base free, on two modes of the derivation done right."""
    return load_scene("thesis").with_values(
        {
            "support.hub_rotation": "free",
            "support.hub_rotational_inertia": BASE_INERTIA,
            "loads.0.force": 0.0,
            "model.kind": "assumed-modes",
            "model.variant": "corrected",
        }
    )


def thesis_statements(
    *, depth: float = 0.1, speed: float = 0.0, scene: Scene | None = None, make: Callable[[Scene], Plant] = build_plant
) -> tuple[Statement, ...]:
    """Test the statements at a depth.

    Parameters
    ----------
    depth, speed
        z [m] and v [m/s] of the operating points.
    scene
        Default: `thesis_scene`.
    make
        How a plant is made of a scene; default: as the scene says.

    Returns
    -------
    tuple of Statement
        In the order of the thesis.

    Raises
    ------
    SceneError, ComputationError
        If the scene cannot be linearized there.
    """
    scene = thesis_scene() if scene is None else scene
    straight = _point(make(scene), depth, speed, INPUTS)
    bent = _point(make(scene.with_value("loads.0.force", TIP_FORCE)), depth, speed, INPUTS)
    return (
        _controllable_at_zero(straight),
        _controllable_somewhere(straight, bent),
        _output_controllable(straight, bent),
        _criterion(bent),
        _lateral_force(make(_held_at_the_hub(scene)), depth),
        _deficiency(straight, bent),
        _amplitudes_observable(straight, bent),
        _both(straight, bent),
    )


def _point(plant: Plant, depth: float, speed: float, inputs: tuple[str, ...]) -> _Point:
    model = linearize(plant, depth=depth, speed=speed)
    columns = [[signal.name for signal in model.inputs].index(name) for name in inputs]
    system = balance(model.A, model.B[:, columns], model.C[:1])
    return _Point(model, system, controllable_subspace(system), observable_subspace(system))


def _held_at_the_hub(scene: Scene) -> Scene:
    """Return the scene with the needle clamped at a fixed hub, and a lateral force between hub and skin."""
    changes = {
        "support.kind": "hub",
        "support.hub_rotation": "fixed",
        "support.hub_rotational_inertia": None,
        "model.kinematics": None,
        "model.variant": None,
    }
    return with_lateral_force(scene.with_values(changes), FINGER)


def _controllable_at_zero(straight: _Point) -> Statement:
    pencil = controllable_modes(straight.system)
    reached, missed = straight.share(straight.reached, axial=True), straight.share(straight.reached, axial=False)
    return Statement(
        "3.2.5, 3.2.6",
        "linearized where q = q' = 0 the needle is controllable by insertion force and base torque",
        pencil.holds,
        "only depth and base rotation with their rates are reached, and nothing of the bending",
        {
            "controllable": straight.reached.dimension,
            "states": straight.size,
            "smallest singular value": float(np.min(pencil.singular_values)),
            "least share of depth, base and rates that is reached": float(np.min(reached)),
            "largest share of the bending that is reached": float(np.max(missed)),
        },
    )


def _controllable_somewhere(straight: _Point, bent: _Point) -> Statement:
    pencil = controllable_modes(bent.system)
    lateral = [index for index, one in enumerate(straight.model.states[: straight.size // 2]) if one.name not in AXIAL]
    parts = straight.model.second_order
    mass, stiffness = (matrix[np.ix_(lateral, lateral)] for matrix in (parts.mass, parts.stiffness))
    softest = float(np.min(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
    return Statement(
        "3.2.6",
        "around some operating points the needle is fully controllable, around others ranks are missing",
        pencil.holds and bent.reached.dimension == bent.size and straight.reached.dimension < straight.size,
        "ranks are missing where the needle is straight; all are there where it is bent, which without a load is no equilibrium",
        {
            "controllable, bent": bent.reached.dimension,
            "missing, straight": straight.size - straight.reached.dimension,
            "states": bent.size,
            "smallest singular value, bent": float(np.min(pencil.singular_values)),
            "lowest squared frequency [rad^2/s^2]": softest,
        },
    )


def _output_controllable(straight: _Point, bent: _Point) -> Statement:
    tests = [output_controllability(point.system) for point in (straight, bent)]
    return Statement(
        "3.2.6",
        "around most operating points the tip is not output controllable",
        not tests[0].holds and not tests[1].holds,
        "so where the needle is straight: every C A^k B is zero; bent, the insertion force does move the tip",
        {
            "largest C A^k B, straight": straight.largest_markov_parameter,
            "rank, straight": tests[0].rank,
            "rank, bent": tests[1].rank,
            "singular value, bent": float(tests[1].singular_values[0]),
        },
    )


def _criterion(bent: _Point) -> Statement:
    outputs, inputs = len(bent.system.C), bent.system.B.shape[1]
    return Statement(
        "3.2.6",
        "output controllability asks of [C B, C A B, ..., D] as many ranks as there are inputs",
        outputs >= inputs,
        "it has as many rows as outputs, so with one output it never has the rank 2 of two inputs; outputs are to be counted",
        {"inputs": inputs, "outputs": outputs, "rank, bent": output_controllability(bent.system).rank},
    )


def _lateral_force(plant: Plant, depth: float) -> Statement:
    force, push = (_point(plant, depth, 0.0, (name,)) for name in ("lateral_force", "push"))
    tests = [output_controllability(point.system) for point in (force, push)]
    return Statement(
        "3.2.6",
        "to move the tip the surgeon needs a lateral force besides (or turns the bevel)",
        tests[0].holds and not tests[1].holds,
        "so: on a straight needle that is held at its hub a lateral force before the skin moves the tip, the push does not",
        {
            "rank by the lateral force": tests[0].rank,
            "rank by the push": tests[1].rank,
            "singular value by the lateral force": float(tests[0].singular_values[0]),
        },
    )


def _deficiency(straight: _Point, bent: _Point) -> Statement:
    missing = [point.size - point.seen.dimension for point in (straight, bent)]
    return Statement(
        "3.2.7",
        "two ranks are missing of observability",
        missing == [2, 2],
        "so where the needle is bent (the base rotation and its rate); straight, depth and speed are invisible too",
        {
            "missing, straight": missing[0],
            "missing, bent": missing[1],
            "smallest singular value, bent": float(np.min(observable_modes(bent.system).singular_values)),
        },
    )


def _amplitudes_observable(straight: _Point, bent: _Point) -> Statement:
    shares = [float(np.min(point.share(point.seen, axial=False))) for point in (straight, bent)]
    return Statement(
        "3.2.7",
        "the amplitudes, which nobody can measure, are observable from the tip",
        min(shares) > 1 - 1e-6,
        "so, straight and bent",
        {"least share that is seen, straight": shares[0], "least share that is seen, bent": shares[1]},
    )


def _both(straight: _Point, bent: _Point) -> Statement:
    full = [point.size for point in (straight, bent)]
    seen = [point.seen.dimension for point in (straight, bent)]
    base = [signal.name.startswith("base") for signal in bent.model.states]
    return Statement(
        "5.1",
        "around most operating points the needle is controllable and observable",
        seen == full,
        "observable around none: the base turns without moving the needle; 3.2.7 itself says that two ranks are missing",
        {
            "observable, straight": seen[0],
            "observable, bent": seen[1],
            "states": full[0],
            "share of the base rotation that is seen, bent": float(np.max(bent.seen.participation[base])),
        },
    )
