"""The tissue: layers of springs and dampers along the needle's axis."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import inf
from typing import Annotated, Literal, Self

from pydantic import Field, StrictStr, model_validator

from fem_needle.scene.part import MOST_ENTRIES, Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.time_quantity import TimeQuantity, TimeValue


class Layer(Part):
    """Tissue between two depths.

    Parameters
    ----------
    name
        For messages and for setting values by name.
    start
        y where the layer begins [m].
    end
        y where it ends [m], itself outside; None: no far side.
    foundation_modulus
        k [N/m^2], lateral force per length and deflection; not the Young's
        modulus of the tissue.
    damping
        c [N s/m^2], lateral force per length and speed.
    cutting_force
        Axial force [N] while the tip advances in the layer.
    puncture_force
        Axial force [N] that the tip must exceed once to enter the layer (force-driven).
    """

    name: StrictStr = ""
    start: Annotated[float, Quantity("m", at_least=0.0)] = 0.0
    end: Annotated[float | None, Quantity("m", above=0.0, optional=True)] = None
    foundation_modulus: Annotated[float, Quantity("N/m^2", at_least=0.0, at_most=1e12)]
    damping: Annotated[float, Quantity("N s/m^2", at_least=0.0)] = 0.0
    cutting_force: Annotated[float, Quantity("N", at_least=0.0)] = 0.0
    puncture_force: Annotated[float, Quantity("N", at_least=0.0)] = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.far_side <= self.start:
            limits = f"got {self.far_side:g}; allowed above start = {self.start:g} m"
            raise_mistakes("Layer", [Mistake("end", f"the layer has no thickness ({limits})", self.end)])
        return self

    @property
    def far_side(self) -> float:
        """The y where the layer ends [m]; infinity where it has no far side."""
        return inf if self.end is None else self.end

    def holds(self, y: float) -> bool:
        """Return whether ``y`` [m] lies in [start, end)."""
        return self.start <= y < self.far_side


class Tissue(Part):
    """Layers in any order; what no layer covers is empty space.

    Parameters
    ----------
    kind
        ``"foundation"``: springs and dampers along the needle; ``"tip-spring"``: one
        spring that travels with the tip.
    tip_stiffness
        Of the tip spring [N/m].
    rest_line
        ``"straight"``: the springs are at rest on the undeflected axis;
        ``"cut-path"``: on the path that the tip has cut.
    stiffness_factor
        m(t), multiplies every foundation modulus (swelling).
    layers
        Not overlapping; names, where given, differ.
    """

    kind: Literal["foundation", "tip-spring"] = "foundation"
    tip_stiffness: Annotated[float | None, Quantity("N/m", at_least=0.0, optional=True)] = None
    rest_line: Literal["straight", "cut-path"] = "straight"
    stiffness_factor: Annotated[TimeValue, TimeQuantity(at_least=0.0)] = 1.0
    layers: Annotated[tuple[Layer, ...], Field(max_length=MOST_ENTRIES)] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Tissue", self._mistakes())
        return self

    def _mistakes(self) -> Iterator[Mistake]:
        yield from self._kind_mistakes()
        for (first, one), (second, other) in combinations(enumerate(self.layers), 2):
            if one.name and one.name == other.name:
                message = f"names must differ (got {other.name!r} twice; allowed once)"
                yield Mistake(f"layers.{second}.name", message, other.name)
            if one.start < other.far_side and other.start < one.far_side:
                lower, upper = sorted((one, other), key=lambda layer: layer.start)
                index = second if upper is other else first
                message = f"layers overlap (got {upper.start:g}; allowed at least {lower.far_side:g} m)"
                yield Mistake(f"layers.{index}.start", message, upper.start)

    def _kind_mistakes(self) -> Iterator[Mistake]:
        if self.kind == "foundation":
            if self.tip_stiffness is not None:
                message = f"has no meaning with kind 'foundation' (got {self.tip_stiffness:g}; allowed with 'tip-spring')"
                yield Mistake("tip_stiffness", message, self.tip_stiffness)
            return
        if self.tip_stiffness is None:
            yield Mistake("tip_stiffness", "is required by kind 'tip-spring' (allowed at least 0 N/m)")
        if self.layers:
            yield Mistake("layers", "have no meaning with kind 'tip-spring', whose one spring is at the tip (allowed none)")
        if self.rest_line != "straight":
            message = "a tip spring leaves no path behind (got 'cut-path'; allowed 'straight')"
            yield Mistake("rest_line", message, self.rest_line)
