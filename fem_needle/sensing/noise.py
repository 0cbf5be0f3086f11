"""Random numbers of a sensor, drawn in blocks: one at a time would cost more than the reading itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLOCK = 256


class Place(NamedTuple):
    """Where a stream of random numbers is.

    Attributes
    ----------
    generator
        State of the generator after the block was drawn.
    block
        Numbers that were drawn together; nobody changes them.
    taken
        How many of them were taken.
    """

    generator: Mapping[str, Any]
    block: tuple[float, ...]
    taken: int


class Stream:
    """Random numbers one by one, without end; it can say where it is, and go back there.

    Parameters
    ----------
    generator
        Where they come from; nobody else takes from it.
    draw
        Returns so many new ones of a generator.
    """

    def __init__(self, generator: np.random.Generator, draw: Callable[[np.random.Generator, int], Array]) -> None:
        self._generator, self._draw = generator, draw
        self._after: Mapping[str, Any] | None = None
        self._block: tuple[float, ...] = ()
        self._taken = 0

    def next(self) -> float:
        """Return the next number."""
        if self._taken == len(self._block):
            self._block, self._taken, self._after = tuple(self._draw(self._generator, BLOCK).tolist()), 0, None
        self._taken += 1
        return self._block[self._taken - 1]

    def array(self, shape: tuple[int, ...]) -> Array:
        """Return new numbers of a shape, past the block."""
        self._after = None
        return self._draw(self._generator, int(np.prod(shape))).reshape(shape)

    def place(self) -> Place:
        """Return where it is."""
        if self._after is None:
            self._after = self._generator.bit_generator.state
        return Place(self._after, self._block, self._taken)

    def go_to(self, place: Place) -> None:
        """Go on from a place."""
        if place.generator is not self._after:
            self._generator.bit_generator.state = place.generator
        self._after, self._block, self._taken = place


@dataclass(frozen=True)
class Noise:
    """Normally distributed numbers of mean 0.

    Attributes
    ----------
    deviation
        Their standard deviation.
    stream
        Where they come from; of a deviation of 0 nothing is drawn.
    """

    deviation: float
    stream: Stream

    @classmethod
    def of(cls, deviation: float, source: np.random.SeedSequence) -> Noise:
        """Return the noise of a standard deviation."""
        return cls(deviation, Stream(np.random.default_rng(source), lambda one, count: deviation * one.standard_normal(count)))

    def number(self) -> float:
        """Return the next number."""
        return self.stream.next() if self.deviation else 0.0

    def field(self, shape: tuple[int, ...]) -> Array | float:
        """Return an array of numbers, or 0.0 where there is no noise."""
        return self.stream.array(shape) if self.deviation else 0.0


def uniform(source: np.random.SeedSequence) -> Stream:
    """Return numbers between 0 and 1, the latter excluded."""
    return Stream(np.random.default_rng(source), lambda one, count: one.random(count))
