"""Forces on the needle; they keep their direction."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fem_needle.scene.part import Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.time_quantity import TimeQuantity, TimeValue


class TipLoad(Part):
    """A lateral force at the tip; several add up.

    Parameters
    ----------
    force
        [N], may vary in time.
    bevel_coefficient
        a [m^2]: the force is a times the foundation modulus at the tip (the
        deeper layer at an interface, 0 outside the tissue).
    direction
        -1 to 1, times the force, may vary in time: the cosine of the angle by which a bevel is turned out of the plane.
    """

    kind: Literal["tip"] = "tip"
    force: Annotated[TimeValue | None, TimeQuantity("N", optional=True)] = None
    bevel_coefficient: Annotated[float | None, Quantity("m^2", optional=True)] = None
    direction: Annotated[TimeValue, TimeQuantity(at_least=-1.0, at_most=1.0)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        given = [name for name in ("force", "bevel_coefficient") if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "neither"
            message = f"one of force and bevel_coefficient is needed (got {found}; allowed exactly one)"
            raise_mistakes("TipLoad", [Mistake("force", message)])
        return self


class LateralLoad(Part):
    """A lateral force at a fixed place outside the tissue; hub only.

    Parameters
    ----------
    position
        y [m].
    force
        [N], may vary in time.
    """

    kind: Literal["lateral"] = "lateral"
    position: Annotated[float, Quantity("m")]
    force: Annotated[TimeValue, TimeQuantity("N")]


Load = Annotated[TipLoad | LateralLoad, Field(discriminator="kind")]
