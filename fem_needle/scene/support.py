"""What holds the needle outside the tissue: the hub or the surface, and guides."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fem_needle.scene.part import MOST_ENTRIES, Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.time_quantity import TimeQuantity, TimeValue


class Guide(Part):
    """A template guide at a fixed place outside the tissue.

    Parameters
    ----------
    position
        y [m], negative before the surface.
    stiffness
        Lateral spring [N/m], or ``"rigid"`` for a pin.
    """

    position: Annotated[float, Quantity("m")]
    stiffness: Annotated[float | Literal["rigid"], Quantity("N/m", above=0.0, words=("rigid",))] = "rigid"


class Support(Part):
    """Where the needle is clamped.

    Parameters
    ----------
    kind
        ``"hub"``: clamped at the hub, the whole needle bends; ``"entry"``:
        clamped at the tissue surface, only the inserted part bends.
    hub_deflection
        Lateral position of the hub [m], may vary in time; hub only.
    hub_angle
        Angle of the hub [rad], may vary in time; hub only.
    hub_rotation
        ``"fixed"``: the hub has the angle given; ``"free"``: it turns under its torque
        and the needle's moment (under ``entry``, decoupled, under its torque alone).
    hub_torque
        On a free hub [N m], may vary in time; positive turns the needle to positive deflections.
    hub_rotational_inertia
        Of a free hub [kg m^2].
    guides
        Hub only.
    """

    kind: Literal["hub", "entry"]
    hub_deflection: Annotated[TimeValue, TimeQuantity("m")] = 0.0
    hub_angle: Annotated[TimeValue, TimeQuantity("rad")] = 0.0
    hub_rotation: Literal["fixed", "free"] = "fixed"
    hub_torque: Annotated[TimeValue, TimeQuantity("N m")] = 0.0
    hub_rotational_inertia: Annotated[float | None, Quantity("kg m^2", above=0.0, optional=True)] = None
    guides: Annotated[tuple[Guide, ...], Field(max_length=MOST_ENTRIES)] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Support", self._mistakes())
        return self

    def _mistakes(self) -> Iterator[Mistake]:
        positions = [guide.position for guide in self.guides]
        for index, position in enumerate(positions):
            if position in positions[:index]:
                message = f"two guides at one place (got {position:g}; allowed different places)"
                yield Mistake(f"guides.{index}.position", message, position)
        yield from self._rotation_mistakes()
        if self.kind == "entry":
            for name, moved in (("hub_deflection", self.hub_deflection), ("hub_angle", self.hub_angle)):
                if moved != 0.0:
                    yield Mistake(name, "has no meaning under 'entry' (allowed 0, or kind = 'hub')")
            if self.guides:
                message = "has no meaning under 'entry', where nothing outside bends (allowed none)"
                yield Mistake("guides", message)

    def _rotation_mistakes(self) -> Iterator[Mistake]:
        if self.hub_rotation == "free":
            if self.hub_rotational_inertia is None:
                yield Mistake("hub_rotational_inertia", "is required by a free hub (allowed above 0 kg m^2)")
            if self.hub_angle != 0.0:
                yield Mistake("hub_angle", "a free hub has no prescribed angle (allowed 0, or hub_rotation = 'fixed')")
            return
        if self.hub_torque != 0.0:
            yield Mistake("hub_torque", "has no meaning on a fixed hub (allowed 0, or hub_rotation = 'free')")
        if self.hub_rotational_inertia is not None:
            message = "has no meaning on a fixed hub (allowed none, or hub_rotation = 'free')"
            yield Mistake("hub_rotational_inertia", message)
