"""What varies in time, as rows for the kernel (`fem_needle.dynamics.signals`): the insertion, swelling, hub, push and loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from fem_needle.dynamics import names as ix
from fem_needle.loads import turns_with_needle
from fem_needle.motion import DepthLaw, Instant, depth_law
from fem_needle.scene import Scene, Sinusoid, Table, TipLoad, as_function

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Value = float | Table | Sinusoid

FIRST = -inf  # when the first row of a signal begins to hold


@dataclass(frozen=True, eq=False)
class Drive:
    """Signals of a scene.

    Attributes
    ----------
    rows
        Of all signals (total, ROW).
    offsets
        Where each signal's rows begin, and the end (signals + 1,).
    """

    rows: Array
    offsets: Integers

    @property
    def arrays(self) -> tuple[Array, Integers]:
        """What the kernel takes."""
        return self.rows, self.offsets

    def replaced(self, changes: dict[int, Array]) -> Drive:
        """Return the drive with other rows for some signals."""
        parts = [self.rows[a:b] for a, b in zip(self.offsets[:-1], self.offsets[1:], strict=True)]
        return joined([changes.get(number, part) for number, part in enumerate(parts)])


def joined(signals: Sequence[Array]) -> Drive:
    """Return the drive of signals, rows (n, ROW) each."""
    return Drive(np.ascontiguousarray(np.concatenate(signals)), np.cumsum([0, *(len(rows) for rows in signals)]))


def value_rows(value: Value) -> Array:
    """Return the rows of a scene's value."""
    if isinstance(value, Sinusoid):
        row = np.zeros((1, ix.ROW))
        row[0, ix.ROW_VALUE], row[0, ix.ROW_AMPLITUDE] = value.mean, value.amplitude
        row[0, ix.ROW_OMEGA], row[0, ix.ROW_PHASE] = 2 * pi * value.frequency, value.phase
        return row
    if not isinstance(value, Table):
        row = np.zeros((1, ix.ROW))
        row[0, ix.ROW_VALUE] = float(value)
        return row
    times, values = np.array(value.time), np.array(value.values)
    rows = np.zeros((len(times) + 1, ix.ROW))
    rows[0, ix.ROW_START], rows[1:, ix.ROW_START] = min(times[0], 0.0) - 1.0, times  # in front of the first point: constant
    rows[0, ix.ROW_VALUE], rows[1:, ix.ROW_VALUE] = values[0], values
    rows[1:-1, ix.ROW_SLOPE] = np.diff(values) / np.diff(times)
    return rows


def summed_rows(start: float, value: Value) -> Array:
    """Return the rows of start + integral of a scene's value from 0 on."""
    rows, function = value_rows(value), as_function(value)
    result = rows.copy()
    begins = np.maximum(rows[:, ix.ROW_START], 0.0) if isinstance(value, Table) else np.zeros(1)
    at = rows[:, ix.ROW_VALUE] + rows[:, ix.ROW_SLOPE] * (begins - rows[:, ix.ROW_START])
    result[:, ix.ROW_START], result[:, ix.ROW_VALUE] = begins, start + function.integral(begins)
    result[:, ix.ROW_SLOPE], result[:, ix.ROW_CURVE] = at, 0.5 * rows[:, ix.ROW_SLOPE]
    if isinstance(value, Sinusoid):
        result[:, ix.ROW_SLOPE], result[:, ix.ROW_SUMMED] = value.mean, 1.0
    kept = np.append(np.diff(begins) > 0.0, True)
    return result[kept]


def depth_rows(scene: Scene, law: DepthLaw) -> Array:
    """Return the rows of the depth of a prescribed insertion; of a push, of a needle that rests where it begins."""
    insertion = scene.insertion
    if insertion.kind == "profile":
        rows = value_rows(0.0 if insertion.depth is None else insertion.depth)
    elif insertion.kind == "speed":
        rows = summed_rows(insertion.first_depth, 0.0 if insertion.speed is None else insertion.speed)
    else:
        return value_rows(insertion.first_depth)
    if law.rests_from < inf and insertion.kind == "speed":
        rows = rows[rows[:, ix.ROW_START] < max(law.rests_from, np.finfo(float).tiny)]
        final = np.zeros((1, ix.ROW))
        final[0, ix.ROW_START], final[0, ix.ROW_VALUE] = law.rests_from, insertion.final_depth
        rows = np.concatenate([rows, final])
    return rows


def moving_rows(origin: Instant) -> Array:
    """Return the rows of a depth that goes on from an instant with a constant acceleration."""
    row = np.zeros((1, ix.ROW))
    row[0, ix.ROW_START], row[0, ix.ROW_VALUE] = origin.time, origin.depth
    row[0, ix.ROW_SLOPE], row[0, ix.ROW_CURVE] = origin.speed, 0.5 * origin.acceleration
    return row


def drive_of(scene: Scene) -> Drive:
    """Return the signals of a scene."""
    support, insertion = scene.support, scene.insertion
    turns = turns_with_needle(scene)
    signals: dict[int, Array] = {
        ix.DEPTH_SIGNAL: depth_rows(scene, depth_law(scene)),
        ix.FACTOR_SIGNAL: value_rows(scene.tissue.stiffness_factor),
        ix.HUB_SIGNAL: value_rows(support.hub_deflection),
        ix.ANGLE_SIGNAL: value_rows(0.0 if turns else support.hub_angle),
        ix.PUSH_SIGNAL: value_rows(insertion.push_force or 0.0),
    }
    if support.kind == "entry":
        signals[ix.HUB_SIGNAL], signals[ix.ANGLE_SIGNAL] = value_rows(0.0), value_rows(0.0)
    loads = load_rows(scene)
    return joined([*(signals[number] for number in range(ix.LOAD_SIGNAL)), *loads])


def load_rows(scene: Scene) -> list[Array]:
    """Return the rows of lateral forces, of the torque on a free hub, and of each tip load its force and its direction."""
    found = [value_rows(load.force) for load in scene.lateral_loads]
    if turns_with_needle(scene):
        found.append(value_rows(scene.support.hub_torque))
    for load in scene.loads:
        if isinstance(load, TipLoad):
            bevel = load.bevel_coefficient is not None
            found.append(value_rows(scene.tissue.stiffness_factor if bevel else (load.force or 0.0)))
            found.append(value_rows(load.direction))
    return found


def bevel_of(scene: Scene) -> Array:
    """Return the bevel coefficient of each tip load [m^2], NaN where its force is given (tips,)."""
    found = [
        np.nan if load.bevel_coefficient is None else load.bevel_coefficient for load in scene.loads if isinstance(load, TipLoad)
    ]
    return np.array(found, dtype=float)
