"""Rows of signals under command: which ones they are, and what they say."""

import numpy as np
import pytest

from fem_needle.closed_loop.commanded import CommandedDrive, signals_of
from fem_needle.closed_loop.course import Stretch
from fem_needle.closed_loop.inputs import Inputs
from fem_needle.closed_loop.motion import CommandedMotion
from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import drive_of
from fem_needle.motion import Instant
from fem_needle.scene import LateralLoad, TipLoad
from tests.consistency.closed_loop_scenes import FREE_HUB, loop_scene

LOADS = [TipLoad(force=0.1), LateralLoad(position=-0.01, force=0.2), TipLoad(bevel_coefficient=1e-6)]
SCENE = loop_scene(loads=LOADS).with_value("actuators.lateral_force", {"rate": 4.0})


def rows_of(drive, number):
    return drive.rows[drive.offsets[number] : drive.offsets[number + 1]]


def test_where_inputs_are():
    assert signals_of(SCENE, "lateral_force") == [at.LOAD_SIGNAL]
    assert signals_of(SCENE, "tip_direction") == [at.LOAD_SIGNAL + 2, at.LOAD_SIGNAL + 4]
    assert signals_of(SCENE, "hub_angle") == [at.ANGLE_SIGNAL]
    assert signals_of(SCENE, "speed") == signals_of(SCENE, "hub_torque") == []
    free = loop_scene(loads=LOADS, support=FREE_HUB)
    assert signals_of(free, "hub_torque") == [at.LOAD_SIGNAL + 1]
    assert signals_of(free, "tip_direction") == [at.LOAD_SIGNAL + 3, at.LOAD_SIGNAL + 5]


def test_a_ramp_has_a_row_on_its_way_and_one_after_it():
    drive, inputs = CommandedDrive(SCENE), Inputs(SCENE).commanded(1.0, {"lateral_force": 1.2, "hub_angle": 0.1})
    assert drive.follow(inputs, Stretch(2.0))
    line = [at.ROW_START, at.ROW_VALUE, at.ROW_SLOPE]
    assert rows_of(drive.drive, at.LOAD_SIGNAL)[:, line].tolist() == [[1.0, 0.2, 4.0], [pytest.approx(1.25), 1.2, 0.0]]
    assert rows_of(drive.drive, at.ANGLE_SIGNAL)[:, line].tolist() == [[1.0, 0.1, 0.0]] * 2
    before = drive.drive
    assert not drive.follow(inputs.commanded(1.5, {"hub_angle": -0.2}), Stretch(2.0)) and drive.drive is before
    assert rows_of(drive.drive, at.ANGLE_SIGNAL)[:, at.ROW_VALUE].tolist() == [-0.2] * 2


def test_what_is_not_commanded_is_the_scenes():
    drive, own = CommandedDrive(SCENE), drive_of(SCENE)
    drive.follow(Inputs(SCENE).commanded(0.0, {"tip_direction": 0.5}), Stretch(1.0))
    for number in set(range(len(own.offsets) - 1)) - set(signals_of(SCENE, "tip_direction")):
        assert np.array_equal(rows_of(drive.drive, number), rows_of(own, number))


def test_a_commanded_speed_is_a_depth():
    drive = CommandedDrive(SCENE)
    assert drive.follow(Inputs(SCENE), Stretch(1.0, CommandedMotion(Instant(0.5, 0.04, 2.0, -6.0))))
    row = rows_of(drive.drive, at.DEPTH_SIGNAL)[0]
    assert row[[at.ROW_START, at.ROW_VALUE, at.ROW_SLOPE, at.ROW_CURVE]].tolist() == [0.5, 0.04, 2.0, -3.0]
    assert not drive.follows(Inputs(SCENE), Stretch(1.0))
    assert CommandedDrive(SCENE).follows(Inputs(SCENE), Stretch(1.0))
