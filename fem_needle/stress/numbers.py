"""The numbers of a scene, bare, so that the same scene can be built mirrored or in other units of length, force and time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, Literal

import numpy as np

from fem_needle.scene import (
    Guide,
    Initial,
    Insertion,
    LateralLoad,
    Layer,
    Needle,
    Numerics,
    Run,
    Scene,
    Support,
    Table,
    TipLoad,
    Tissue,
)

Analysis = Literal["static", "quasi-static", "dynamic", "auto"]

NODES = 40  # elements of an ordinary mesh, beside whose nodes depths are drawn
SMALLEST_LENGTH = 1e-30  # m, below which a tip need not be right: none of these are
BESIDE = 1e-12  # m from a node, an interface or a guide
THINNEST = 1e-6  # m


@dataclass(frozen=True)
class Units:
    """Factors of length, force and time; powers of two change no digit of a result."""

    length: float = 1.0
    force: float = 1.0
    time: float = 1.0


SI = Units()
OTHER = Units(4.0, 0.125, 2.0)


@dataclass(frozen=True)
class LayerNumbers:
    """A layer: ends y [m], foundation modulus [N/m^2], damping [N s/m^2]."""

    start: float
    end: float | None
    modulus: float
    damping: float = 0.0


@dataclass(frozen=True)
class Numbers:
    """A scene in SI.

    Attributes
    ----------
    support
        "hub" or "entry".
    length, bending_stiffness, mass_per_length
        Of the needle [m], [N m^2], [kg/m].
    layers
        Tissue.
    times, depths
        Corners of the depth over time [s], [m]; one of each: held.
    guides
        Position [m] and stiffness [N/m], inf for a rigid one.
    tip_force, bevel_coefficient
        [N] and [m^2]; 0: none.
    lateral
        Positions [m] and forces [N].
    initial_shape, tip_deflection
        As in a scene; deflection [m].
    time_step, steps, outputs
        Step [s], their number, and how many samples they leave.
    analysis, elements
        As in a scene.
    """

    support: str = "hub"
    length: float = 0.2
    bending_stiffness: float = 0.0256
    mass_per_length: float = 0.01016
    layers: tuple[LayerNumbers, ...] = (LayerNumbers(0.0, None, 5e3),)
    times: tuple[float, ...] = (0.0,)
    depths: tuple[float, ...] = (0.1,)
    guides: tuple[tuple[float, float], ...] = ()
    tip_force: float = 0.1
    bevel_coefficient: float = 0.0
    lateral: tuple[tuple[float, float], ...] = ()
    initial_shape: str = "equilibrium"
    tip_deflection: float = 0.0
    time_step: float = 1e-3
    steps: int = 20
    outputs: int = 10
    analysis: Analysis = "dynamic"
    elements: int = 16

    @property
    def duration(self) -> float:
        """Of the run [s]."""
        return self.time_step * self.steps


def scene_of(numbers: Numbers, units: Units = SI, *, mirrored: bool = False) -> Scene:
    """Return the scene in other units, or with every force and deflection turned round.

    Raises
    ------
    SceneError
        As for any scene.
    """
    length, time = units.length, units.time
    sign = -1.0 if mirrored else 1.0
    return Scene(
        needle=Needle(
            length=numbers.length * length,
            bending_stiffness=numbers.bending_stiffness * units.force * length**2,
            mass_per_length=numbers.mass_per_length * units.force * time**2 / length**2,
        ),
        support=Support(kind=numbers.support, guides=tuple(_guide(*guide, units) for guide in numbers.guides)),
        tissue=Tissue(layers=tuple(_layer(layer, units) for layer in numbers.layers)),
        insertion=_insertion(numbers, units),
        loads=_loads(numbers, units, sign),
        initial=_initial(numbers, units, sign),
        run=Run(duration=numbers.duration * time),
        numerics=Numerics(
            analysis=numbers.analysis,
            elements=numbers.elements,
            time_step=numbers.time_step * time,
            output_step=numbers.duration * time / numbers.outputs,
            absolute_tolerance=SMALLEST_LENGTH * length,
        ),
    )


def _guide(place: float, stiffness: float, units: Units) -> Guide:
    value: Any = "rigid" if stiffness == inf else stiffness * units.force / units.length
    return Guide(position=place * units.length, stiffness=value)


def _layer(layer: LayerNumbers, units: Units) -> Layer:
    pressure = units.force / units.length**2
    return Layer(
        start=layer.start * units.length,
        end=None if layer.end is None else layer.end * units.length,
        foundation_modulus=layer.modulus * pressure,
        damping=layer.damping * pressure * units.time,
    )


def _insertion(numbers: Numbers, units: Units) -> Insertion:
    if len(numbers.times) == 1:
        return Insertion(kind="hold", initial_depth=numbers.depths[0] * units.length)
    times, depths = (np.array(values) for values in (numbers.times, numbers.depths))
    return Insertion(kind="profile", depth=Table(time=(times * units.time).tolist(), value=(depths * units.length).tolist()))


def _initial(numbers: Numbers, units: Units, sign: float) -> Initial:
    if numbers.initial_shape != "tip-displaced":
        return Initial(shape=numbers.initial_shape)
    return Initial(shape="tip-displaced", tip_deflection=sign * numbers.tip_deflection * units.length)


def _loads(numbers: Numbers, units: Units, sign: float) -> tuple[TipLoad | LateralLoad, ...]:
    loads: list[TipLoad | LateralLoad] = []
    if numbers.tip_force:
        loads.append(TipLoad(force=sign * numbers.tip_force * units.force))
    if numbers.bevel_coefficient:
        loads.append(TipLoad(bevel_coefficient=sign * numbers.bevel_coefficient * units.length**2))
    for place, force in numbers.lateral:
        loads.append(LateralLoad(position=place * units.length, force=sign * force * units.force))
    return tuple(loads)
