"""PyElastica: a straight Cosserat rod fixed at one end, the tissue as a force at each node, position Verlet.

Its time step is bound by the axial and shear waves of steel, and by the elements turning against their shear stiffness. They play
no part here, so the shear stiffness is lowered as far as the tip hardly notices (1e-4); density, bending stiffness and mass are
those of the needle. The fixed end holds the direction of a whole element, so the rod begins half an element before the clamp: the
error is of second order then, not of first. S is relaxed with its analytical damper.
"""

import contextlib
import io
from typing import ClassVar

import elastica as ea
import numpy as np

from fem_needle.benchmark.cases import Case
from fem_needle.benchmark.growing_beam import GrowingBeam
from fem_needle.benchmark.methods import Method, Setting, Solve, over
from fem_needle.benchmark.reference import growing_beam

PACKAGE = "pyelastica"
DENSITY, YOUNGS_MODULUS = 8000.0, 200e9
SHEAR_SHARE = 1e-4  # of the tip's deflection
STABLE = 0.75  # of the longest stable step of an explicit integrator, 2 / largest frequency
SETTLED = 12.0


class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """What its documentation calls a simulator."""


class Tissue(ea.NoForces):
    """Springs at the nodes."""

    def __init__(self, springs: np.ndarray) -> None:
        super().__init__()
        self.springs = springs

    def apply_forces(self, system: ea.CosseratRod, time: float = 0.0) -> None:
        """Pull every node back to the axis."""
        system.external_forces[1] -= self.springs * system.position_collection[1]


class Rod:
    """A rod in a simulator, and its time step [s]."""

    def __init__(self, beam: GrowingBeam, elements: int, force: float, rate: float) -> None:
        depth, area = beam.first_depth, beam.mass_per_length / DENSITY
        self.size, radius = depth / (elements - 0.5), float(np.sqrt(area / np.pi))
        size, along, across = self.size, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
        place = (elements, -size / 2 * along, along, across, size * elements)
        self.rod = ea.CosseratRod.straight_rod(*place, radius, DENSITY, youngs_modulus=YOUNGS_MODULUS)
        stiffness = 3 * beam.bending_stiffness / (SHEAR_SHARE * depth**2)
        self.rod.bend_matrix[:2] *= beam.bending_stiffness / self.rod.bend_matrix[0, 0, 0]
        self.rod.shear_matrix[:] = stiffness * np.eye(3)[:, :, None]
        inertia = float(self.rod.mass_second_moment_of_inertia[0, 0, 0]) / size
        fastest = max(2 / size * np.sqrt(stiffness / beam.mass_per_length), np.sqrt(stiffness / inertia))
        self.step = STABLE * 2 / float(fastest)
        self.simulator = self._simulator(beam, elements, force, rate)

    def _simulator(self, beam: GrowingBeam, elements: int, force: float, rate: float) -> Simulator:
        simulator = Simulator()
        simulator.append(self.rod)
        fixed = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
        simulator.constrain(self.rod).using(ea.OneEndFixedBC, **fixed)
        springs = np.full(elements + 1, beam.foundation_modulus * self.size)
        springs[-1] /= 2
        simulator.add_forcing_to(self.rod).using(Tissue, springs)
        if force:
            tip = np.array([0.0, force, 0.0])
            simulator.add_forcing_to(self.rod).using(ea.EndpointForces, np.zeros(3), tip, ramp_up_time=1e-9)
        if rate:
            damper = {"uniform_damping_constant": rate, "time_step": self.step}
            simulator.dampen(self.rod).using(ea.AnalyticalLinearDamper, **damper)
        simulator.finalize()
        return simulator

    @property
    def tip(self) -> float:
        """Deflection of the tip [m]."""
        return float(self.rod.position_collection[1, -1])

    def run(self, duration: float, step: float) -> None:
        """Go on for a time [s] with steps [s]."""
        with contextlib.redirect_stdout(io.StringIO()):
            ea.integrate(ea.PositionVerlet(), self.simulator, duration, max(1, round(duration / step)), progress_bar=False)


def relaxed(beam: GrowingBeam, elements: int, force: float) -> Rod:
    """Return the rod at rest under a tip force [N]."""
    bending = beam.bending_stiffness * (3.516 / beam.first_depth**2) ** 2
    lowest = float(np.sqrt((bending + beam.foundation_modulus) / beam.mass_per_length))
    rod = Rod(beam, elements, force, 2 * lowest)
    rod.run(SETTLED / lowest, rod.step)
    return rod


def released(beam: GrowingBeam, shape: Rod, elements: int, times: np.ndarray) -> np.ndarray:
    """Return the tips [m] at times [s] after a shape is let go."""
    rod = Rod(beam, elements, 0.0, 0.0)
    rod.rod.position_collection[:] = shape.rod.position_collection
    rod.rod.director_collection[:] = shape.rod.director_collection
    tips = [rod.tip]
    output = float(times[1] - times[0])
    step = output / np.ceil(output / rod.step)
    for _ in times[1:]:
        rod.run(output, step)
        tips.append(rod.tip)
    return np.array(tips)


class Elastica(Method):
    """PyElastica with springs at the nodes."""

    name = "PyElastica"
    limited = "at most 20 elements, on D these alone: 0.1 s take 600 000 steps; no M, a rod does not grow"
    choices: ClassVar = {"S": over((10, 20)), "D": over((20,))}

    def prepare(self, case: Case, setting: Setting) -> Solve:
        """Return the relaxation, or the steps after a relaxation."""
        beam, elements = growing_beam(case.scene), setting.elements or 1
        if case.at_rest:
            return lambda: np.array([relaxed(beam, elements, beam.tip_force(0.0)).tip])
        force = 0.1  # N, of S
        shape = relaxed(beam, elements, force)
        return lambda: released(beam, shape, elements, case.times)


METHODS: tuple[Method, ...] = (Elastica(),)
