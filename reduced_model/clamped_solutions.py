"""All static shapes of an ``entry`` needle under a tip force, at any depth: a family of two functions.

In front of its tip the needle obeys EI w'''' + k(y) w = 0 and is clamped at the surface; w''(0) and w'''(0) are left to choose.
The two solutions are carried from the surface through the layers by Krylov's functions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_needle.exact.krylov import LONGEST_STEP, characteristic_number, transition_matrices
from fem_needle.scene import Scene
from fem_needle.segments import interfaces, tip_layer

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ClampedSolutions:
    """The two solutions over the full length (`reduced_model.shapes.FunctionSet`).

    Attributes
    ----------
    scene
        Needle and layers.
    factor
        Stiffness factor of the tissue.
    """

    scene: Scene
    factor: float
    breaks: Array = field(init=False)
    _moduli: Array = field(init=False)
    _states: Array = field(init=False)
    count: ClassVar[int] = 2

    def __post_init__(self) -> None:
        breaks, moduli = self._steps()
        states = [np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0 / self.scene.needle.length]])]
        for modulus, size in zip(moduli, np.diff(breaks), strict=True):
            states.append(states[-1] @ transition_matrices(modulus, size).T)
        object.__setattr__(self, "breaks", breaks)
        object.__setattr__(self, "_moduli", moduli)
        object.__setattr__(self, "_states", np.array(states[:-1]))

    def values(self, positions: Array, derivative: int = 0) -> Array:
        """Return both solutions, or a derivative up to the third, at y (n,) [m]; shape (2, n)."""
        places = np.asarray(positions, dtype=float)
        steps = np.clip(np.searchsorted(self.breaks, places, side="right") - 1, 0, len(self._moduli) - 1)
        carried = transition_matrices(self._moduli[steps], places - self.breaks[steps])
        return np.asarray(np.einsum("nj,nij->in", carried[:, derivative], self._states[steps]), dtype=float)

    def _steps(self) -> tuple[Array, Array]:
        """Return the ends of steps that the series carry a state over, and k / EI on each."""
        needle, layers = self.scene.needle, self.scene.tissue.layers
        edges = sorted({0.0, needle.length, *(y for y in interfaces(layers) if 0.0 < y < needle.length)})
        breaks, moduli = [0.0], []
        for start, end in pairwise(edges):
            layer = tip_layer(layers, start)
            modulus = 0.0 if layer is None else self.factor * layers[layer].foundation_modulus / needle.bending_stiffness
            parts = max(1, ceil(float(characteristic_number(modulus)) * (end - start) / (0.5 * LONGEST_STEP)))
            breaks += np.linspace(start, end, parts + 1)[1:].tolist()
            moduli += [modulus] * parts
        return np.array(breaks), np.array(moduli)
