from itertools import pairwise

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, solve_static
from fem_needle.exact import exact_static
from fem_needle.ledger import Works, energies
from fem_needle.loads import load_case
from fem_needle.motion import Instant
from fem_needle.scene import Guide, LateralLoad, TipLoad
from fem_needle.stages import StageSolution, evaluate_stage
from tests.consistency.scenes import GEL, LAYERS, MASS, held, scene_of


def stage_of(scene, depth=0.1, speed=0.0, elements=32):
    plant = FiniteElementNeedle(scene, elements=elements)
    return plant, evaluate_stage(plant, Instant(0.0, depth, speed, 0.0), load_case(scene, depth, 0.0))


def test_works_add_term_by_term():
    one = Works(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
    assert one + one == Works(2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0)
    assert one.lateral == 1.0 + 2.0 + 3.0 + 5.0 - 4.0


def state(coordinates, velocities, forces):
    return StageSolution(coordinates, velocities, np.zeros_like(coordinates), forces)


@pytest.mark.parametrize("guides", [[], [Guide(position=-0.0317)], [Guide(position=-0.0317, stiffness=800.0)]])
def test_energy_of_equilibrium_is_half_the_work_of_the_loads(guides):
    """Clapeyron: 1/2 sum of force times exact deflection."""
    scene = scene_of(
        "hub", held(0.1), LAYERS, [TipLoad(force=0.1), LateralLoad(position=-0.0123, force=0.3)], support={"guides": guides}
    )
    plant, stage = stage_of(scene)
    rest, exact = solve_static(plant, depth=0.1), exact_static(scene, 0.1)
    found = energies(stage, state(rest.coordinates, np.zeros(plant.size), rest.point_forces), inertia=True)
    expected = 0.5 * (0.1 * exact.tip_deflection + 0.3 * float(exact.deflection(0.1 - 0.0123)))
    assert found.total == pytest.approx(expected, rel=1e-7)
    assert found.kinetic == 0.0
    springs = [800.0] if guides and guides[0].stiffness != "rigid" else []
    assert found.guide == pytest.approx(
        sum(0.5 * k * float(exact.deflection(0.1 - 0.0317)) ** 2 for k in springs), rel=1e-6, abs=1e-16
    )


@pytest.mark.parametrize("kinematics", ["material", "fixed-frame"])
def test_kinetic_energy_is_that_of_the_kinematics(kinematics):
    """1/2 rho A times the square of w_t + v w_y (material) or of w_t (fixed-frame), by quadrature of differences in time."""
    scene = scene_of("entry", held(0.1), GEL, model={"kinematics": kinematics})
    plant, stage = stage_of(scene, speed=2.0, elements=4)
    shape, rate = np.random.default_rng(2).normal(0.0, 1e-3, (2, plant.size))
    shape[:2] = rate[:2] = 0.0
    found = energies(stage, state(shape, rate, stage.case.forces), inertia=True).kinetic

    step, total = 1e-7, 0.0
    points, weights = np.polynomial.legendre.leggauss(6)
    edges = np.linspace(1e-7, 0.1 - 1e-7, 201)
    for low, high in pairwise(edges):
        y = low + (high - low) * (points + 1) / 2
        values = []
        for sign in (-1.0, 1.0):
            depth = 0.1 + sign * step * 2.0
            # A material point moves in y with the needle; a fixed one does not.
            where = y + (sign * step * 2.0 if kinematics == "material" else 0.0)
            values.append(plant.deflection(shape + sign * step * rate, np.zeros(1), depth, np.minimum(0.2 - depth + where, 0.2)))
        total += 0.5 * MASS * (high - low) / 2 * weights @ ((values[1] - values[0]) / (2 * step)) ** 2
    assert found == pytest.approx(total, rel=1e-3)
