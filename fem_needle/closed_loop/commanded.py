"""Commands as the kernel takes them: rows of the signals that they replace."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.course import Stretch
from fem_needle.closed_loop.inputs import Inputs, Ramp
from fem_needle.closed_loop.motion import CommandedMotion
from fem_needle.dynamics import names as at
from fem_needle.dynamics.drive import Drive, drive_of, moving_rows
from fem_needle.loads import turns_with_needle
from fem_needle.scene import Scene, TipLoad

Array = NDArray[np.float64]

_LINE = slice(at.ROW_START, at.ROW_SLOPE + 1)  # start, value, slope
_OF_THE_HUB = {"hub_deflection": at.HUB_SIGNAL, "hub_angle": at.ANGLE_SIGNAL, "push_force": at.PUSH_SIGNAL}


class CommandedDrive:
    """The signals of a scene, some of them commanded.

    Parameters
    ----------
    scene
        Whose signals act where nothing is commanded.

    Attributes
    ----------
    drive
        What the kernel takes; another object where a signal has got another number of rows, else changed in place.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.drive: Drive = drive_of(scene)
        self._ramps: dict[str, Ramp] = {}
        self._numbers: dict[str, list[int]] = {}
        self._rows: dict[int, Array] = {}

    def follow(self, inputs: Inputs, stretch: Stretch) -> bool:
        """Let inputs act over a stretch; returns whether the drive is another object now."""
        is_new = False
        for name, ramp in inputs.ramps.items():
            if self._ramps.get(name) is not ramp:
                self._ramps[name] = ramp
                if name not in self._numbers:
                    self._numbers[name] = signals_of(self._scene, name)
                for number in self._numbers[name]:
                    is_new |= self._put(number, ramp)
        if stretch.motion is not None:
            is_new |= self._move(stretch.motion)
        return is_new

    def follows(self, inputs: Inputs, stretch: Stretch) -> bool:
        """Return whether nothing is commanded but some of the inputs."""
        return set(self._ramps) <= set(inputs.ramps) and (at.DEPTH_SIGNAL not in self._rows or stretch.motion is not None)

    def _move(self, motion: CommandedMotion) -> bool:
        rows = moving_rows(motion.origin)
        is_new = at.DEPTH_SIGNAL not in self._rows
        if is_new:
            self._make_room(at.DEPTH_SIGNAL, rows)
        self._rows[at.DEPTH_SIGNAL][:] = rows
        return is_new

    def _put(self, number: int, ramp: Ramp) -> bool:
        is_new = number not in self._rows
        if is_new:
            self._make_room(number, np.zeros((2, at.ROW)))
        set_ramp(self._rows[number], ramp)
        return is_new

    def _make_room(self, number: int, rows: Array) -> None:
        self.drive = self.drive.replaced({number: rows})
        offsets, known = self.drive.offsets, [*self._rows, number]
        self._rows = {one: self.drive.rows[offsets[one] : offsets[one + 1]] for one in known}


def signals_of(scene: Scene, name: str) -> list[int]:
    """Return the numbers of the signals that an input of a scene is; a speed is none, its depth is."""
    if name in _OF_THE_HUB:
        return [_OF_THE_HUB[name]]
    lateral = len(scene.lateral_loads)
    tips = sum(isinstance(load, TipLoad) for load in scene.loads)
    torque = at.LOAD_SIGNAL + lateral
    first = torque + turns_with_needle(scene)
    found = {
        "lateral_force": list(range(at.LOAD_SIGNAL, torque)),
        "hub_torque": [torque] if turns_with_needle(scene) else [],
        "tip_direction": [first + 2 * tip + 1 for tip in range(tips)],  # of each tip load its force, then its direction
    }
    return found.get(name, [])


def set_ramp(rows: Array, ramp: Ramp) -> None:
    """Set the rows (2, ROW) of an input on its way and after its arrival."""
    arrival = ramp.arrival
    jumps = arrival == ramp.time
    rows[0, _LINE] = ramp.time, ramp.target if jumps else ramp.start, 0.0 if jumps else ramp.slope(ramp.time)
    rows[1, _LINE] = arrival, ramp.target, 0.0
