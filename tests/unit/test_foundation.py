from itertools import pairwise

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle, banded
from fem_needle.scene import Layer
from tests.consistency.scenes import LAYERS, held, scene_of

DAMPED = tuple(layer.model_copy(update={"damping": 7.0 + index}) for index, layer in enumerate(LAYERS))


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_the_tissue_matrix_is_linear_in_the_moduli(kind):
    """G = sum k_i F_i: F_i is the derivative by a modulus."""
    plant = FiniteElementNeedle(scene_of(kind, held(0.13), LAYERS), elements=7)
    total = sum(layer.foundation_modulus * plant.foundation.unit_stiffness(i, 0.13) for i, layer in enumerate(LAYERS))
    assert plant.foundation.stiffness(0.13) == pytest.approx(total, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("kind", ["entry", "hub"])
def test_undamped_tissue_has_no_matrices(kind):
    plant = FiniteElementNeedle(scene_of(kind, held(0.13), LAYERS), elements=7)
    assert plant.foundation.damping(0.13) == (None, None, None)


@pytest.mark.parametrize("kind", ["entry", "hub"])
@pytest.mark.parametrize("speed", [0.0, 1.7, -1.7])
def test_power_lost_is_the_integral_of_the_viscosity(kind, speed):
    """c times (dw/dt at a fixed y)^2 over the layers, by quadrature of the deflections at two near times."""
    plant = FiniteElementNeedle(scene_of(kind, held(0.13), DAMPED), elements=5)
    rate, shape = np.random.default_rng(3).normal(0.0, 1e-3, (2, plant.size))
    for vector in (rate, shape):
        vector[: plant.prescribed] = 0.0
    operators = plant.operators(0.13, 0.0)
    found = rate @ banded.multiply(operators.damping, rate)
    found += 2 * speed * (rate @ banded.multiply(operators.drag, shape)) + speed**2 * (
        shape @ banded.multiply(operators.slip, shape)
    )

    step, expected = 1e-7, 0.0
    for layer in DAMPED:
        end = min(layer.far_side, 0.13 - 1e-6)
        # Elements have kinks in w'' only: many Gauss points on many pieces.
        points, weights = np.polynomial.legendre.leggauss(6)
        for low, high in pairwise(np.linspace(layer.start, end, 201)):
            y = low + (high - low) * (points + 1) / 2
            moved = [
                plant.deflection(
                    shape + sign * step * rate, np.zeros(1), 0.13 + sign * step * speed, 0.2 - 0.13 - sign * step * speed + y
                )
                for sign in (-1.0, 1.0)
            ]
            expected += layer.damping * (high - low) / 2 * weights @ ((moved[1] - moved[0]) / (2 * step)) ** 2
    assert found == pytest.approx(expected, rel=1e-3)


def test_matrices_vanish_with_the_tissue():
    plant = FiniteElementNeedle(scene_of("hub", held(0.05), (Layer(start=0.1, foundation_modulus=1e4),)), elements=4)
    assert np.all(plant.foundation.stiffness(0.05) == 0.0)
    assert np.any(plant.foundation.stiffness(0.1001) != 0.0)
