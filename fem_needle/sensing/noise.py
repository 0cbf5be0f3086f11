"""Random numbers of a sensor, drawn in blocks: one at a time would cost more than the reading itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLOCK = 256


@dataclass(frozen=True)
class Noise:
    """Normally distributed numbers of mean 0.

    Attributes
    ----------
    deviation
        Their standard deviation.
    generator
        Where they come from.
    numbers
        The numbers one by one, without end.
    """

    deviation: float
    generator: np.random.Generator
    numbers: Iterator[float]

    @classmethod
    def of(cls, deviation: float, source: np.random.SeedSequence) -> Noise:
        """Return the noise of a standard deviation; of 0 it draws nothing."""
        generator = np.random.default_rng(source)
        return cls(deviation, generator, _normal(generator, deviation) if deviation else repeat(0.0))

    def field(self, shape: tuple[int, ...]) -> Array | float:
        """Return an array of numbers, or 0.0 where there is no noise."""
        return self.deviation * self.generator.standard_normal(shape) if self.deviation else 0.0


def uniform(source: np.random.SeedSequence) -> Iterator[float]:
    """Yield numbers between 0 and 1, the latter excluded, without end."""
    generator = np.random.default_rng(source)
    while True:
        yield from generator.random(BLOCK).tolist()


def _normal(generator: np.random.Generator, deviation: float) -> Iterator[float]:
    while True:
        yield from (deviation * generator.standard_normal(BLOCK)).tolist()
