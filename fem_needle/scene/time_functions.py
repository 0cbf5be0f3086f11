"""Values that vary in time: constant, table, sinusoid.

All have ``value``, ``derivative`` (from the right), ``integral`` (exact, from
0 to t) and ``breakpoints`` (times of kinks). Each method takes a time in
seconds, a float or an array of any shape, and returns the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import asin, pi
from typing import Annotated, Any, Protocol, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from fem_needle.scene.part import Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity

Vector = NDArray[np.float64]
FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])


class TimeFunction(Protocol):
    """What the numeric core knows of a value that varies in time."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times of kinks [s]."""

    def value(self, time: FloatOrArray) -> FloatOrArray:
        """Return the value at ``time``."""

    def derivative(self, time: FloatOrArray) -> FloatOrArray:
        """Return the rate from the right at ``time``."""

    def integral(self, time: FloatOrArray) -> FloatOrArray:
        """Return the integral from 0 to ``time``."""


def _like(time: FloatOrArray, result: Any) -> FloatOrArray:
    """Return ``result`` as a float where ``time`` is a number, else as an array."""
    if np.ndim(time) == 0:
        return cast(FloatOrArray, float(result))  # type: ignore[redundant-cast]
    return cast(FloatOrArray, np.asarray(result, dtype=float))


@dataclass(frozen=True)
class Constant:
    """A value that does not vary, for the numeric core.

    Parameters
    ----------
    constant
        The value, in SI.
    """

    constant: float

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """No kinks."""
        return ()

    def value(self, time: FloatOrArray) -> FloatOrArray:
        """Return the constant in the shape of ``time`` [s]."""
        return _like(time, np.full(np.shape(time), self.constant))

    def derivative(self, time: FloatOrArray) -> FloatOrArray:
        """Return zero in the shape of ``time`` [s]."""
        return _like(time, np.zeros(np.shape(time)))

    def integral(self, time: FloatOrArray) -> FloatOrArray:
        """Return the constant times ``time`` [s]."""
        return _like(time, self.constant * np.asarray(time, dtype=float))


@dataclass(frozen=True, eq=False)
class _Pieces:
    """A table as arrays; not compared, the table's own fields are.

    ``slopes`` are those before the first point, of each piece, after the last
    point; ``areas`` the integrals from the first point to each point.
    """

    times: Vector
    values: Vector
    slopes: Vector
    areas: Vector

    @classmethod
    def of(cls, times: Vector, values: Vector) -> _Pieces:
        # A speed of 1e308 overflows here; the check of the depth then refuses it.
        with np.errstate(over="ignore", invalid="ignore"):
            slopes = np.diff(values) / np.diff(times)
            areas = np.cumsum(np.diff(times) * (values[1:] / 2.0 + values[:-1] / 2.0))
        return cls(times, values, np.concatenate(([0.0], slopes, [0.0])), np.concatenate(([0.0], areas)))

    def area_to(self, time: Vector) -> Vector:
        """Return the integral from the first point to ``time``, negative before it."""
        nearest = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.times) - 1)
        mean = (self.values[nearest] + np.interp(time, self.times, self.values)) / 2.0
        return self.areas[nearest] + (time - self.times[nearest]) * mean


class Table(Part):
    """Linear between points, constant outside.

    Parameters
    ----------
    time
        Strictly rising times [s], at least two.
    value
        As many values, in SI (read them back as ``values``; `value` is the function).
    """

    time: tuple[Annotated[float, Quantity("s")], ...]
    values: tuple[Annotated[float, Quantity()], ...] = Field(alias="value")

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Table", self._mistakes())
        return self

    def _mistakes(self) -> Iterator[Mistake]:
        if len(self.time) != len(self.values):
            lengths = f"{len(self.values)} values for {len(self.time)} times"
            yield Mistake("value", f"the lengths differ (got {lengths}; allowed as many values as times)")
        if len(self.time) < 2:
            yield Mistake("time", f"too short (got {len(self.time)} points; allowed at least 2)")
        for index, (earlier, later) in enumerate(pairwise(self.time), start=1):
            if later <= earlier:
                limits = f"got {later:.12g}; allowed above {earlier:.12g} s, the time before"
                yield Mistake(f"time.{index}", f"times must rise ({limits})", later)
                return

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The times of the table [s], where its slope jumps."""
        return self.time

    @cached_property
    def _pieces(self) -> _Pieces:
        return _Pieces.of(np.array(self.time), np.array(self.values))

    def value(self, time: FloatOrArray) -> FloatOrArray:
        """Return the value at ``time`` [s]."""
        return _like(time, np.interp(time, self._pieces.times, self._pieces.values))

    def derivative(self, time: FloatOrArray) -> FloatOrArray:
        """Return the slope of the piece that begins at or holds ``time`` [s]."""
        return _like(time, self._pieces.slopes[np.searchsorted(self._pieces.times, time, side="right")])

    def integral(self, time: FloatOrArray) -> FloatOrArray:
        """Return the exact integral from 0 to ``time`` [s]: quadratic between points."""
        return _like(time, self._pieces.area_to(np.asarray(time, dtype=float)) - self._pieces.area_to(np.asarray(0.0)))

    def zeros(self, end: float) -> Vector:
        """Return the times in (0, ``end``) [s] among which the value crosses zero: kinks included."""
        times, values = self._pieces.times, self._pieces.values
        left, right = values[:-1], values[1:]
        crossing = np.sign(left) * np.sign(right) < 0
        share = left[crossing] / (left[crossing] - right[crossing])
        return _inside(np.concatenate((times, times[:-1][crossing] + share * np.diff(times)[crossing])), end)

    def turning_points(self, end: float) -> Vector:
        """Return the times in (0, ``end``) [s] among which lie all interior extremes of the value."""
        return _inside(self._pieces.times, end)


class Sinusoid(Part):
    """``mean + amplitude sin(2 pi frequency t + phase)``.

    Parameters
    ----------
    mean, amplitude
        In SI.
    frequency
        In Hz, above 0.
    phase
        In rad.
    """

    mean: Annotated[float, Quantity()] = 0.0
    amplitude: Annotated[float, Quantity()]
    frequency: Annotated[float, Quantity("Hz", above=0.0)]
    phase: Annotated[float, Quantity("rad")] = 0.0

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """No kinks."""
        return ()

    def _angle(self, time: FloatOrArray) -> Vector:
        return 2.0 * pi * self.frequency * np.asarray(time, dtype=float) + self.phase

    def value(self, time: FloatOrArray) -> FloatOrArray:
        """Return the value at ``time`` [s]."""
        return _like(time, self.mean + self.amplitude * np.sin(self._angle(time)))

    def derivative(self, time: FloatOrArray) -> FloatOrArray:
        """Return the rate at ``time`` [s]."""
        return _like(time, 2.0 * pi * self.frequency * self.amplitude * np.cos(self._angle(time)))

    def integral(self, time: FloatOrArray) -> FloatOrArray:
        """Return the exact integral from 0 to ``time`` [s].

        ``mean t + amplitude t sinc(f t) sin(pi f t + phase)``, which is the
        difference of two cosines without its cancellation at small ``f t``.
        """
        half = self.frequency * np.asarray(time, dtype=float)
        wave = self.amplitude * np.sinc(half) * np.sin(pi * half + self.phase)
        return _like(time, (self.mean + wave) * np.asarray(time, dtype=float))

    def zeros(self, end: float) -> Vector:
        """Return the first and last times in (0, ``end``) [s] of each kind of zero crossing."""
        if abs(self.mean) >= abs(self.amplitude):
            return np.empty(0)
        first = asin(-self.mean / self.amplitude)
        return self._first_and_last((first, pi - first), end)

    def turning_points(self, end: float) -> Vector:
        """Return the first and last maxima and minima in (0, ``end``) [s]."""
        return self._first_and_last((pi / 2.0, -pi / 2.0), end)

    def _first_and_last(self, angles: tuple[float, float], end: float) -> Vector:
        cycles = np.array([(angle - self.phase) / (2.0 * pi) for angle in angles])
        first = cycles - np.floor(cycles)
        last = cycles + np.floor(self.frequency * end - cycles)
        return _inside(np.concatenate((first, last)) / self.frequency, end)


def _inside(times: Vector, end: float) -> Vector:
    return times[(times > 0.0) & (times < end)]


def as_function(value: float | Table | Sinusoid) -> TimeFunction:
    """Return the object with ``value``, ``derivative``, ``integral`` of a scene's value."""
    return value if isinstance(value, Table | Sinusoid) else Constant(float(value))
