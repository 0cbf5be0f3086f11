"""The needles, tissues and models of the page, and the exact tip at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.exact import exact_static
from fem_needle.scene import Insertion, LateralLoad, Layer, Needle, Scene, Support, TipLoad, Tissue
from reduced_model.needle import AssumedModeNeedle

Array = NDArray[np.float64]

LENGTH = 0.2  # m
THESIS = Needle(length=LENGTH, bending_stiffness=0.0256, mass_per_length=0.01016)  # thesis, Table III: EI and rho A
OUTER, INNER, STEEL = 1.27e-3, 1.0e-3, 7850.0  # m, m, kg/m^3: 18 gauge tube
TUBE = Needle(length=LENGTH, bending_stiffness=0.01572, mass_per_length=STEEL * pi / 4 * (OUTER**2 - INNER**2))
THESIS_MODULUS, THESIS_SPRING = 520.0, 520.0  # N/m^2, N/m: the thesis' 0.52, read in both ways
MODULI = (500.0, 2e3, 5e3, 1e4, 2e4, 5e4)  # N/m^2
SHALLOW = 0.002  # m
HUB_REACH = 0.196  # m: a little before the hub meets the skin
TIP = TipLoad(force=0.1)
SKIN = LateralLoad(position=0.0, force=0.1)


@dataclass(frozen=True)
class Choice:
    """An assumed-mode model."""

    label: str
    modes: int
    basis: str = "full-length"
    static_corrections: bool = False

    def plant(self, scene: Scene) -> AssumedModeNeedle:
        """Return the needle of a scene."""
        return AssumedModeNeedle(
            scene, modes=self.modes, basis=self.basis, static_corrections=self.static_corrections
        )


TWO, THREE, FIVE = (Choice(f"{count} modes", count) for count in (2, 3, 5))
TWO_INSERTED, THREE_INSERTED, FIVE_INSERTED = (
    Choice(f"{count} of the inserted length", count, "inserted-length") for count in (2, 3, 5)
)
CORRECTED = Choice("2 and corrections", 2, static_corrections=True)
CORRECTED_INSERTED = Choice("2 of the inserted length and corrections", 2, "inserted-length", True)


def foundation(modulus: float, damping: float = 0.0) -> Tissue:
    """Return one tissue with a foundation modulus [N/m^2] and a damping [N s/m^2]."""
    return Tissue(layers=(Layer(foundation_modulus=modulus, damping=damping),))


def tip_spring(stiffness: float) -> Tissue:
    """Return a spring [N/m] that travels with the tip."""
    return Tissue(kind="tip-spring", tip_stiffness=stiffness)


def inserted(speed: float, start: float, end: float) -> Insertion:
    """Return an insertion at a speed [m/s] from a depth to a depth [m]."""
    return Insertion(kind="speed", initial_depth=start, speed=speed, final_depth=end)


def scene_of(
    needle: Needle, support: str, tissue: Tissue, insertion: Insertion, loads: Sequence[Any] = (TIP,), **parts: Any
) -> Scene:
    """Return a scene, undecorated."""
    return Scene(
        needle=needle, support=Support(kind=support), tissue=tissue, insertion=insertion, loads=tuple(loads), **parts
    )


def resting(needle: Needle, support: str, tissue: Tissue, loads: Sequence[Any] = (TIP,)) -> Scene:
    """Return a scene over all depths, for equilibria: static corrections take their responses from these depths."""
    end = LENGTH if support == "entry" and SKIN not in loads else HUB_REACH
    return scene_of(needle, support, tissue, inserted(0.01, SHALLOW, end), loads)


def exact_tip(scene: Scene, depth: float) -> float:
    """Return the exact tip deflection at rest [m]."""
    return exact_static(scene, depth).tip_deflection
