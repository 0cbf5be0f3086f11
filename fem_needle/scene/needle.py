"""The needle: length, bending stiffness and mass per length."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt
from typing import Annotated, Self

from pydantic import Field, model_validator

from fem_needle.scene.gauges import OuterDiameter
from fem_needle.scene.part import Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity

_STIFFNESS = Quantity("N m^2", at_least=1e-10, at_most=1e6)
_MASS = Quantity("kg/m", above=0.0)


def _optional(unit: str) -> Quantity:
    return Quantity(unit, above=0.0, optional=True)


class Needle(Part):
    """A uniform round or otherwise shaped needle.

    Bending stiffness and mass per length are given directly, or follow from
    Young's modulus and density with the second moment of area and the area, or
    with the diameters of a tube: I = pi/64 (D^4 - d^4), A = pi/4 (D^2 - d^2).

    Parameters
    ----------
    length
        Hub to tip [m].
    youngs_modulus
        E [Pa].
    second_moment_of_area
        I [m^4].
    area
        A of the cross section [m^2].
    outer_diameter, inner_diameter
        D and d [m]; in place of I and A; D may be a gauge, "18 G"; d is 0 where it is not given.
    density
        rho [kg/m^3].
    bending_stiffness
        EI [N m^2]; always a number after construction.
    mass_per_length
        rho A [kg/m]; always a number after construction.
    """

    length: Annotated[float, Quantity("m", at_least=1e-4, at_most=1e2)]
    youngs_modulus: Annotated[float | None, _optional("Pa")] = None
    second_moment_of_area: Annotated[float | None, _optional("m^4")] = None
    area: Annotated[float | None, _optional("m^2")] = None
    outer_diameter: Annotated[float | None, OuterDiameter(above=0.0, optional=True)] = None
    inner_diameter: Annotated[float | None, Quantity("m", at_least=0.0, optional=True)] = None
    density: Annotated[float | None, _optional("kg/m^3")] = None
    # Replaced by E I and rho A in _derive where they are not given.
    bending_stiffness: Annotated[float, _STIFFNESS] = Field(default_factory=float)
    mass_per_length: Annotated[float, _MASS] = Field(default_factory=float)

    @model_validator(mode="after")
    def _derive(self) -> Self:
        raise_mistakes("Needle", self._mistakes())
        derived = {"bending_stiffness": self._stiffness(), "mass_per_length": self._mass()}
        raise_mistakes("Needle", self._out_of_range(derived))
        # A frozen part is completed before anybody has seen it.
        self.__dict__.update(derived)
        return self

    def given(self, name: str) -> bool:
        """Return whether the user gave a value for ``name``."""
        return name in self.model_fields_set and getattr(self, name) is not None

    def _mistakes(self) -> Iterator[Mistake]:
        yield from self._two_ways()
        yield from self._too_little()
        if self.inner_diameter is not None:
            if self.outer_diameter is None:
                yield Mistake("inner_diameter", "needs outer_diameter as well", self.inner_diameter)
            elif self.inner_diameter >= self.outer_diameter:
                limits = f"0 to below outer_diameter = {self.outer_diameter:g} m"
                message = f"the tube has no wall (got {self.inner_diameter:g}; allowed {limits})"
                yield Mistake("inner_diameter", message, self.inner_diameter)

    def _two_ways(self) -> Iterator[Mistake]:
        exclusive = (
            ("bending_stiffness", ("youngs_modulus", "second_moment_of_area")),
            ("mass_per_length", ("density", "area")),
            ("outer_diameter", ("second_moment_of_area", "area")),
        )
        for name, others in exclusive:
            for other in others:
                if self.given(name) and self.given(other):
                    value = getattr(self, other)
                    ways = f"with {name} and with {other}"
                    yield Mistake(other, f"given in two ways, {ways} (got {value:g}; allowed one)", value)

    def _too_little(self) -> Iterator[Mistake]:
        ways = (
            ("bending_stiffness", "youngs_modulus", "second_moment_of_area"),
            ("mass_per_length", "density", "area"),
        )
        for direct, material, section in ways:
            complete = self.given(material) and (self.given(section) or self.given("outer_diameter"))
            if not self.given(direct) and not complete:
                message = (
                    f"too little is given (allowed {direct}, or {material} with {section}, "
                    f"or {material} with outer_diameter)"
                )
                yield Mistake(direct, message)

    def _stiffness(self) -> float:
        if self.given("bending_stiffness"):
            return self.bending_stiffness
        inertia = self.second_moment_of_area
        if inertia is None:
            outer, inner = self._diameters()
            inertia = pi / 64.0 * (outer**2 - inner**2) * (outer**2 + inner**2)
        return (self.youngs_modulus or 0.0) * inertia

    def _mass(self) -> float:
        if self.given("mass_per_length"):
            return self.mass_per_length
        area = self.area
        if area is None:
            outer, inner = self._diameters()
            area = pi / 4.0 * (outer - inner) * (outer + inner)
        return (self.density or 0.0) * area

    def _out_of_range(self, derived: dict[str, float]) -> Iterator[Mistake]:
        for name, quantity in (("bending_stiffness", _STIFFNESS), ("mass_per_length", _MASS)):
            value = derived[name]
            if not (quantity.contains(value) and value < float("inf")):
                limits = f"got {value:g}, from material and section; allowed {quantity.range_text}"
                yield Mistake(name, f"out of range ({limits})", value)

    def _diameters(self) -> tuple[float, float]:
        return self.outer_diameter or 0.0, self.inner_diameter or 0.0

    @property
    def radius(self) -> float | None:
        """Outer radius [m], that of a solid round section of the same area, or None."""
        if self.outer_diameter is not None:
            return self.outer_diameter / 2.0
        return None if self.area is None else sqrt(self.area / pi)
