"""What is kept of a loop at its samples: the kernel's record, commands and readings, a row of numbers for each sample."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from fem_needle.closed_loop.inputs import Inputs
from fem_needle.closed_loop.rows import Rows
from fem_needle.dynamics.names import R_TIME
from fem_needle.scene import Scene
from fem_needle.scene.signals import INPUT_UNITS

Array = NDArray[np.float64]


class LoopRecord:
    """The samples of a loop.

    Parameters
    ----------
    scene
        Whose inputs and sensors are recorded.
    width
        Numbers of the kernel's record.

    Attributes
    ----------
    rows
        The record, what was commanded, what was read; nan where there was none yet.
    """

    def __init__(self, scene: Scene, width: int) -> None:
        self._scene, self._width = scene, width
        self._inputs = {name: width + index for index, name in enumerate(INPUT_UNITS)}
        self._readings: dict[str, slice] = {}
        end = width + len(self._inputs)
        for sensor in scene.sensors:
            for name in sensor.readings:
                size = sensor.stations if name == "needle_shape" else 1
                self._readings[name] = slice(end, end + size)
                end += size
        self.rows = Rows(end)

    def add(self, record: Array, inputs: Inputs, commands: Iterable[str], known: Mapping[str, float | Array]) -> None:
        """Keep a sample."""
        self._fill(self.rows.add(), record, inputs, commands, known)

    def with_last(self, record: Array, inputs: Inputs, commands: Iterable[str], known: Mapping[str, float | Array]) -> Array:
        """Return all rows and one more, which is not kept."""
        last = np.empty((1, self.rows.width))
        self._fill(last[0], record, inputs, commands, known)
        return np.concatenate([self.rows.array(), last])

    def records(self, rows: Array) -> Array:
        """Return the kernel's part of rows."""
        return rows[:, : self._width]

    def signals(self, rows: Array, times: Array, inputs: Inputs, commands: Iterable[str]) -> dict[str, Array]:
        """Return commands and readings over rows; the scene's own input where there was no command yet."""
        found: dict[str, Array] = {}
        for name in sorted(commands):
            values = rows[:, self._inputs[name]].copy()
            for index in np.flatnonzero(np.isnan(values)):
                values[index] = inputs.own_value(name, float(times[index]))
            found[f"command_{name}"] = values
        for name, place in self._readings.items():
            values = rows[:, place].copy()
            found[f"measurement_{name}"] = values if name == "needle_shape" else values[:, 0]
        return found

    def _fill(
        self, row: Array, record: Array, inputs: Inputs, commands: Iterable[str], known: Mapping[str, float | Array]
    ) -> None:
        row[: self._width], row[self._width :] = record, np.nan
        time = float(record[R_TIME])
        for name in commands:
            row[self._inputs[name]] = inputs.value(name, time)
        for name, value in known.items():
            row[self._readings[name]] = value
