"""A quantity that may vary in time: a number, a table, a sinusoid or a CSV column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError

from fem_needle.scene import units
from fem_needle.scene.part import Mistake, raise_mistakes, shown
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.table_file import FILE_KEYS, read_table
from fem_needle.scene.time_functions import Sinusoid, Table

TABLE_KEYS = ("time", "value", "unit")
SINUSOID_KEYS = tuple(Sinusoid.model_fields)

TimeValue = float | Table | Sinusoid


@dataclass(frozen=True)
class TimeQuantity(Quantity):
    """Metadata and check of a field marked (t) in the scene file."""

    def validate(self, value: Any, info: ValidationInfo) -> Any:
        """Return a float, `Table` or `Sinusoid` in SI; see `Quantity.validate`."""
        if value is None and self.optional:
            return None
        if isinstance(value, Mapping):
            value = self._from_mapping(value, info.context)
        if not isinstance(value, Table | Sinusoid):
            return self.number(value)
        lowest, highest = extremes(value)
        if not (self.contains(lowest) and self.contains(highest)):
            raise self.error("out of range", lowest if not self.contains(lowest) else highest)
        return value

    def json_choices(self) -> list[JsonSchemaValue]:
        """Return the JSON schemas of the allowed forms."""
        number_or_text = {"type": ["number", "string"]}
        numbers = {"type": "array", "items": number_or_text, "minItems": 2}
        forms = (
            ({"time": numbers, "value": numbers, "unit": {"type": "string"}}, ["time", "value"]),
            (dict.fromkeys(SINUSOID_KEYS, number_or_text), ["amplitude", "frequency"]),
            ({key: {"type": "string"} for key in FILE_KEYS}, list(FILE_KEYS)),
        )
        return super().json_choices() + [
            {"type": "object", "properties": keys, "required": required, "additionalProperties": False}
            for keys, required in forms
        ]

    def _from_mapping(self, data: Mapping[Any, Any], context: Any) -> Table | Sinusoid:
        if any(key in SINUSOID_KEYS for key in data):
            keys = {"mean", "amplitude"}
            mistakes: list[Mistake] = []
            converted = {
                key: self._element(value, key, None, mistakes) if key in keys else value
                for key, value in data.items()
            }
            raise_mistakes("Sinusoid", mistakes)
            return Sinusoid.model_validate(converted)
        if any(key in FILE_KEYS for key in data):
            folder = context.get("folder") if isinstance(context, Mapping) else None
            return self._table(_from_file(data, folder))
        return self._table(data)

    def _table(self, data: Mapping[Any, Any]) -> Table:
        """Return the table of a mapping with ``time``, ``value`` and, if wished, ``unit``."""
        converted = {key: value for key, value in data.items() if key != "unit"}
        values = converted.get("value")
        mistakes: list[Mistake] = []
        unit = self._value_unit(data.get("unit"), mistakes)
        if isinstance(values, Sequence) and not isinstance(values, str | bytes):
            converted["value"] = [
                self._element(value, f"value.{index}", unit, mistakes) for index, value in enumerate(values)
            ]
        raise_mistakes("Table", mistakes)
        return Table.model_validate(converted)

    def _value_unit(self, unit: Any, mistakes: list[Mistake]) -> units.Unit | None:
        if unit is None:
            return None
        expected = units.parse_unit(self.unit)
        try:
            found = units.parse_unit(unit) if isinstance(unit, str) else None
        except ValueError:
            found = None
        if found is None or found.dimension != expected.dimension:
            allowed = f"{units.dimension_name(expected.dimension)}, as {self.unit}"
            mistakes.append(Mistake("unit", f"wrong unit (got {shown(unit)}; allowed {allowed})", unit))
        return found

    def _element(self, value: Any, path: str, unit: units.Unit | None, mistakes: list[Mistake]) -> Any:
        """Return one number of a table in SI; the range is checked on the whole."""
        try:
            number = self.converted(value)
        except PydanticCustomError as error:
            mistakes.append(Mistake(path, error.message(), value))
            return 0.0
        return number if unit is None or isinstance(value, str) else unit.to_si(number)


def extremes(value: TimeValue) -> tuple[float, float]:
    """Return the smallest and the largest value over all times."""
    if isinstance(value, Table):
        return min(value.values), max(value.values)
    if isinstance(value, Sinusoid):
        return value.mean - abs(value.amplitude), value.mean + abs(value.amplitude)
    return value, value


def _from_file(data: Mapping[Any, Any], folder: Path | None) -> dict[str, Any]:
    mistakes = [
        Mistake(str(key), f"unknown key (allowed {' and '.join(FILE_KEYS)})", data[key])
        for key in data
        if key not in FILE_KEYS
    ]
    for key in FILE_KEYS:
        if not isinstance(data.get(key), str):
            mistakes.append(Mistake(key, f"must be a text (got {shown(data.get(key))})", data.get(key)))
    raise_mistakes("Table", mistakes)
    try:
        return read_table(data["file"], data["column"], folder)
    except (ValueError, OSError) as error:
        raise_mistakes("Table", [Mistake("file", str(error), data["file"])])
        raise
