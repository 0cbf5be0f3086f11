"""The base of all parts of a scene, and the way in which they report mistakes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from fem_needle.errors import SceneError

MISTAKE = "mistake"
MOST_ENTRIES = 1000  # of a list of parts: they are compared with each other


class Part(BaseModel):
    """A frozen piece of a scene; unknown keys are errors.

    Raises
    ------
    SceneError
        Built with keywords that are impossible: every mistake, as of a scene file.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")
    # Set by `fem_needle.scene.mistakes`, which knows all parts.
    mistake_lines: ClassVar[Callable[[ValidationError, type[Part]], tuple[str, ...]]]

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise SceneError(Part.mistake_lines(error, type(self))) from None

    # Parts inside a whole are validated with it, and not through this.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def own_units(self) -> dict[str, str | None]:
        """Return dotted keys whose unit depends on another key, with that unit; None: the key has no meaning here."""
        return {}


class Mistake(NamedTuple):
    """One mistake found between fields.

    Attributes
    ----------
    path
        Key, dotted, relative to the part that was checked.
    message
        What is wrong and what would be allowed.
    value
        The value found.
    """

    path: str
    message: str
    value: Any = None


def shown(value: Any) -> str:
    """Return a short text of a value for a message."""
    try:
        text = f"{value:.12g}" if isinstance(value, float) else repr(value)
    except RecursionError:
        text = "tables in tables without end"
    return text if len(text) <= 60 else text[:57] + "..."


def custom_error(message: str) -> PydanticCustomError:
    """Return the error that carries ``message`` word for word."""
    return PydanticCustomError(MISTAKE, "{message}", {"message": message})


def raise_mistakes(title: str, mistakes: Iterable[Mistake]) -> None:
    """Raise one `pydantic.ValidationError` that lists all mistakes, if there are any."""
    details = [
        InitErrorDetails(type=custom_error(item.message), loc=_location(item.path), input=item.value)
        for item in mistakes
    ]
    if details:
        raise ValidationError.from_exception_data(title, details)


def _location(path: str) -> tuple[int | str, ...]:
    return tuple(int(key) if key.isdecimal() else key for key in path.split(".")) if path else ()
