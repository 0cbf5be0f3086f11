"""Closed forms of Hetenyi for uniform beams on an elastic foundation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_needle.exact.krylov import characteristic_number
from fem_needle.scene import Insertion, Layer, Needle, Run, Scene, Support, TipLoad, Tissue

_LONG_ENOUGH = 40.0  # exp(-40) = 4e-18: a needle of this many 1 / lambda is infinite to round-off


def _scene(length: float, bending_stiffness: float, foundation_modulus: float, support: Support, **parts: object) -> Scene:
    """Scene of a needle held with its whole length in homogeneous tissue."""
    return Scene(
        needle=Needle(length=length, bending_stiffness=bending_stiffness, mass_per_length=0.01),
        support=support,
        tissue=Tissue(layers=[Layer(start=0.0, foundation_modulus=foundation_modulus)]),
        insertion=Insertion(kind="hold", initial_depth=length),
        run=Run(duration=1.0),
        **parts,
    )


@dataclass(frozen=True)
class ClampedTipForce:
    """Clamped beam on a foundation under a force at its free end.

    w(L) = (2 F lambda / k) (sinh x cosh x - sin x cos x) / (cosh^2 x + cos^2 x), x = lambda L,
    lambda = (k / 4EI)^(1/4); F L^3 / 3EI at k = 0.

    Parameters
    ----------
    bending_stiffness
        EI [N m^2].
    foundation_modulus
        k [N/m^2].
    length
        L [m].
    force
        F [N].

    Notes
    -----
    Hetenyi, Beams on Elastic Foundation (1946), chapter III, beam with one end clamped and the other free.
    """

    bending_stiffness: float
    foundation_modulus: float
    length: float
    force: float

    @property
    def scene(self) -> Scene:
        """A needle inserted with its whole length, clamped at the surface."""
        return _scene(
            self.length,
            self.bending_stiffness,
            self.foundation_modulus,
            Support(kind="entry"),
            loads=[TipLoad(force=self.force)],
        )

    @property
    def tip_deflection(self) -> float:
        """Deflection of the free end [m]."""
        x = self.length * float(characteristic_number(self.foundation_modulus / self.bending_stiffness))
        cantilever = self.force * self.length**3 / (3.0 * self.bending_stiffness)
        return cantilever * _clamped_tip_factor(x)


def _clamped_tip_factor(x: float) -> float:
    """Tip deflection over that without foundation: 3 (sinh 2x - sin 2x) / (2 x^3 (2 + cosh 2x + cos 2x))."""
    if x < 1.0:  # the difference cancels: its series, sum (2x)^(4n+3) / (4n+3)!, does not
        half_difference = sum((2 * x) ** (4 * n) / math.factorial(4 * n + 3) for n in range(8)) * 8.0
        return 3.0 * half_difference / (2.0 + math.cosh(2 * x) + math.cos(2 * x))
    decay = math.exp(-2.0 * x)
    upper = 1.0 - decay * decay - 2.0 * decay * math.sin(2 * x)
    lower = 1.0 + decay * decay + 2.0 * decay * (2.0 + math.cos(2 * x))
    return 3.0 * upper / (2.0 * x**3 * lower)


@dataclass(frozen=True)
class InfiniteBeam:
    """Infinite beam on a foundation under a point force at x = 0.

    w(x) = (P lambda / 2k) exp(-lambda abs(x)) (cos lambda x + sin lambda abs(x)).

    Parameters
    ----------
    bending_stiffness
        EI [N m^2].
    foundation_modulus
        k [N/m^2], above 0.
    force
        P [N].

    Notes
    -----
    Hetenyi, Beams on Elastic Foundation (1946), chapter II, infinite beam, concentrated loading.
    """

    bending_stiffness: float
    foundation_modulus: float
    force: float

    @property
    def characteristic_number(self) -> float:
        """Lambda = (k / 4EI)^(1/4) [1/m]."""
        return float(characteristic_number(self.foundation_modulus / self.bending_stiffness))

    def deflection(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Deflection w [m] at distances from the force [m], of either sign; shape of the input."""
        x = self.characteristic_number * np.abs(np.asarray(distance, dtype=float))
        peak = self.force * self.characteristic_number / (2.0 * self.foundation_modulus)
        return peak * np.exp(-x) * (np.cos(x) + np.sin(x))

    @property
    def scene(self) -> Scene:
        """Half the beam, by symmetry: a hub at the surface held at w(0) without slope; its force is P/2."""
        return _scene(
            _LONG_ENOUGH / self.characteristic_number,
            self.bending_stiffness,
            self.foundation_modulus,
            Support(kind="hub", hub_deflection=float(self.deflection(0.0))),
        )


@dataclass(frozen=True)
class SemiInfiniteBeam:
    """Semi-infinite beam on a foundation under a force at its free end x = 0.

    w(x) = (2 P lambda / k) exp(-lambda x) cos lambda x.

    Parameters
    ----------
    bending_stiffness
        EI [N m^2].
    foundation_modulus
        k [N/m^2], above 0.
    force
        P [N].

    Notes
    -----
    Hetenyi, Beams on Elastic Foundation (1946), chapter II, semi-infinite beam, free end.
    """

    bending_stiffness: float
    foundation_modulus: float
    force: float

    @property
    def characteristic_number(self) -> float:
        """Lambda = (k / 4EI)^(1/4) [1/m]."""
        return float(characteristic_number(self.foundation_modulus / self.bending_stiffness))

    @property
    def tip_deflection(self) -> float:
        """Deflection of the free end [m]."""
        return float(self.deflection(0.0))

    def deflection(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Deflection w [m] at distances x >= 0 from the free end [m]; shape of the input."""
        x = self.characteristic_number * np.asarray(distance, dtype=float)
        peak = 2.0 * self.force * self.characteristic_number / self.foundation_modulus
        return peak * np.exp(-x) * np.cos(x)

    @property
    def scene(self) -> Scene:
        """A needle so long that its clamp at the surface does not feel the force at its tip."""
        return _scene(
            _LONG_ENOUGH / self.characteristic_number,
            self.bending_stiffness,
            self.foundation_modulus,
            Support(kind="entry"),
            loads=[TipLoad(force=self.force)],
        )
