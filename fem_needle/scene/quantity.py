"""What a number of a scene means: unit, allowed range, words allowed in its place."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from numbers import Integral, Real
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from fem_needle.scene import units
from fem_needle.scene.part import custom_error, shown


@dataclass(frozen=True)
class Quantity:
    """Metadata of a number field, and the check of its values.

    Parameters
    ----------
    unit
        SI unit; ``"1"`` for a plain number.
    at_least, above, at_most, below
        Bounds in SI, the second and fourth excluded.
    words
        Texts allowed in place of a number, e.g. ``"auto"``.
    integer
        Whether only whole numbers are allowed.
    optional
        Whether the value may be missing (None).
    """

    unit: str = "1"
    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    below: float | None = None
    words: tuple[str, ...] = ()
    integer: bool = False
    optional: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic call `validate`."""
        return core_schema.with_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Return the JSON schema: a number in range, a text with a unit, or a word."""
        choices = self.json_choices()
        return choices[0] if len(choices) == 1 else {"anyOf": choices}

    def json_choices(self) -> list[JsonSchemaValue]:
        """Return the JSON schemas of the allowed forms."""
        number: JsonSchemaValue = {"type": "integer" if self.integer else "number"}
        keys = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")
        bounds = zip(keys, (self.at_least, self.above, self.at_most, self.below), strict=True)
        number |= {key: bound for key, bound in bounds if bound is not None}
        choices = [number]
        if self.unit != "1":
            number["description"] = f"in {self.unit}"
            choices.append({"type": "string", "description": f"number with a unit, such as '1 {self.unit}'"})
        if self.words:
            choices.append({"enum": list(self.words)})
        return choices

    def validate(self, value: Any, info: ValidationInfo) -> Any:
        """Return ``value`` in SI, or a word as it is.

        Raises
        ------
        PydanticCustomError
            With value, unit and allowed range.
        """
        if value is None and self.optional:
            return None
        if isinstance(value, str) and value in self.words:
            return str(value)
        return self.number(value)

    def number(self, value: Any) -> float:
        """Return a number or a text with a unit as a number in SI, checked."""
        number = self.converted(value)
        if not isfinite(number):
            raise self.error("is not finite", value)
        if not self.contains(number):
            raise self.error("out of range", value)
        if not self.integer:
            return number
        if not isinstance(value, Integral):
            raise self.error("is not a whole number", value)
        return int(value)

    def converted(self, value: Any) -> float:
        """Return a number or a text with a unit in SI, its range not checked."""
        if isinstance(value, str):
            if self.words and not value[:1].isdigit():
                raise self.error("is not an allowed word", value)
            try:
                return units.to_si(value, self.unit)
            except ValueError as error:
                raise self.error(str(error), value) from None
        if isinstance(value, bool) or not isinstance(value, Real):
            raise self.error("is not a number", value)
        try:
            return float(value)
        except OverflowError:
            raise self.error("is not finite", value) from None

    def contains(self, number: float) -> bool:
        """Return whether an SI number is inside the bounds."""
        return (
            (self.at_least is None or number >= self.at_least)
            and (self.above is None or number > self.above)
            and (self.at_most is None or number <= self.at_most)
            and (self.below is None or number < self.below)
        )

    @property
    def range_text(self) -> str:
        """The allowed values in words, with the unit."""
        return self.range_in(self.unit)

    def range_in(self, unit: str) -> str:
        """Return the allowed values in words, in a unit of the same dimension."""
        size = units.parse_unit(unit).size / units.parse_unit(self.unit).size
        at_least, above, at_most, below = (
            None if bound is None else bound / size for bound in (self.at_least, self.above, self.at_most, self.below)
        )
        if at_least is not None and at_most is not None:
            text = f"{at_least:g} to {at_most:g}"
        else:
            limits = {"at least": at_least, "above": above, "at most": at_most, "below": below}
            bounds = [f"{word} {bound:g}" for word, bound in limits.items() if bound is not None]
            text = " and ".join(bounds) or "any finite number"
        shown_unit = "" if unit == "1" else f" {unit}"
        return text + shown_unit + "".join(f" or '{word}'" for word in self.words)

    def typed_unit(self, value: Any) -> str:
        """Return the unit of a text where it has the right dimension, else the SI unit."""
        try:
            written = units.split_quantity(value)[1] if isinstance(value, str) else self.unit
            return written if units.parse_unit(written).dimension == units.parse_unit(self.unit).dimension else self.unit
        except ValueError:
            return self.unit

    def error(self, message: str, value: Any) -> Exception:
        """Return the error for a wrong value."""
        kind = "whole number, " if self.integer else ""
        return custom_error(f"{message} (got {shown(value)}; allowed {kind}{self.range_in(self.typed_unit(value))})")
