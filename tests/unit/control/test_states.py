"""Controllers and states never change: the same state and reading always give the same answer."""

import pickle
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem_needle import build_plant
from fem_needle.control import controller_of
from tests.unit.control.scenes import ENCODER, TIP, TISSUE, tube

SENSORS = [TIP | {"pixel_size": 1e-4}, TISSUE | {"pixel_size": 1e-4}, ENCODER]
LIMITS = {"lateral_force": {"minimum": -2.0, "maximum": 2.0, "rate": 20.0}}
CONTROLLERS = {
    "none": {},
    "pid": {"kind": "pid", "gains": {"derivative": 1.0}},
    "pid by the gain": {"kind": "pid", "schedule": "model-gain", "output": "image_error"},
    "inverse dynamics": {"kind": "inverse-dynamics"},
    "incremental": {"kind": "incremental", "schedule": "model-gain"},
    "proportional": {"kind": "proportional", "schedule": "model-gain"},
    "as printed": {"kind": "proportional", "variant": "as-printed"},
}
NAMES = ("tip_deflection", "tissue_displacement", "needle_angle")
LENGTHS = st.floats(-0.01, 0.01)
READINGS = st.lists(
    st.fixed_dictionaries({}, optional=dict.fromkeys(NAMES, LENGTHS) | {"tissue_deformation": st.floats(0.0, 1e-3)}),
    min_size=1,
    max_size=12,
)


@pytest.fixture(scope="module")
def controllers():
    plant = build_plant(tube())
    return {name: controller_of(tube(data, sensors=SENSORS, actuators=LIMITS), plant) for name, data in CONTROLLERS.items()}


def walk(controller, readings):
    """Return every state and command; the needle goes from 50 to 80 mm and every second depth is missing at first."""
    states, found = [controller.begin()], []
    for number, reading in enumerate(readings):
        place = {"depth": 0.05 + 0.03 * number / 12} if number > 1 else {}
        state, command = controller.update(states[-1], number / 30, reading | place)
        states.append(state)
        found.append(command)
    return states, found


@settings(max_examples=25, deadline=None)
@given(readings=READINGS)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_an_update_changes_nothing(name, readings, controllers):
    controller = controllers[name]
    before = pickle.dumps((readings, controller.begin()))
    states, found = walk(controller, readings)
    copies = [pickle.dumps(state) for state in states]
    assert walk(controller, readings) == (states, found)
    assert [pickle.dumps(state) for state in states] == copies
    assert pickle.dumps((readings, controller.begin())) == before
    assert all(isinstance(hash(state), int) for state in states)


@settings(max_examples=25, deadline=None)
@given(readings=READINGS)
@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name not in {"none", "as printed"}])
def test_commands_are_plain_numbers_within_the_limits(name, readings, controllers):
    _, found = walk(controllers[name], readings)
    values = [0.0] + [command["lateral_force"] for command in found]
    assert all(type(value) is float for value in values)
    assert max(map(abs, values)) <= 2.0
    steps = [abs(after - before) for before, after in pairwise(values)]
    assert max(steps) <= 20.0 / 30 * (1 + 1e-12)
