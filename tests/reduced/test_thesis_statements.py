"""The thesis' statements on control, asked of two assumed modes and of finite elements."""

import numpy as np
import pytest

from fem_needle import FiniteElementNeedle
from reduced_model import AssumedModeNeedle
from reduced_model.thesis_statements import thesis_scene, thesis_statements

ANSWERS = (False, True, False, False, True, False, True, False)


def by_modes(scene):
    return AssumedModeNeedle(scene, modes=2)


def by_elements(scene):
    return FiniteElementNeedle(scene, elements=2)


MAKERS = {"two modes": (by_modes, 8), "two elements": (by_elements, 16)}


@pytest.mark.parametrize("speed", [0.0, 0.01])
@pytest.mark.parametrize("depth", [0.05, 0.18])
@pytest.mark.parametrize("name", MAKERS)
def test_statements(name, depth, speed):
    make, states = MAKERS[name]
    found = thesis_statements(depth=depth, speed=speed, scene=thesis_scene().with_value("model.kind", "fem"), make=make)
    assert tuple(statement.holds for statement in found) == ANSWERS
    zero, somewhere, outputs, criterion, lateral, deficiency, amplitudes, both = (one.numbers for one in found)
    assert (zero["controllable"], zero["states"]) == (4, states)
    assert zero["largest share of the bending that is reached"] == 0.0
    assert zero["least share of depth, base and rates that is reached"] == pytest.approx(1.0)
    assert (somewhere["controllable, bent"], somewhere["missing, straight"]) == (states, states - 4)
    assert somewhere["lowest squared frequency [rad^2/s^2]"] > 0.0
    assert outputs["largest C A^k B, straight"] == 0.0
    assert (outputs["rank, straight"], outputs["rank, bent"]) == (0, 1)
    assert (criterion["inputs"], criterion["outputs"]) == (2, 1)
    assert (lateral["rank by the lateral force"], lateral["rank by the push"]) == (1, 0)
    assert (deficiency["missing, straight"], deficiency["missing, bent"]) == (4, 2)
    assert amplitudes["least share that is seen, straight"] == pytest.approx(1.0)
    assert both["share of the base rotation that is seen, bent"] == 0.0
    assert all(np.isfinite(number) for statement in found for number in statement.numbers.values())


def test_the_variant_with_the_axial_force_answers_alike():
    scene = thesis_scene().with_values({"model.kind": "fem", "model.variant": "conservative"})
    found = thesis_statements(scene=scene, make=by_modes)
    assert tuple(statement.holds for statement in found) == ANSWERS
